//! Image files of several frames: the pages of a TIFF, and animations.

mod support;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use patchlock_media::{Error, FrameSource, Pixels, open};
use support::ffmpeg::{ffmpeg, ffmpeg_is_there};
use support::images::{chunk, webp_canvas, webp_picture_of};
use tiff::encoder::colortype::{ColorType, Gray8, Gray16, RGB8};
use tiff::encoder::{TiffEncoder, TiffKind, TiffValue};
use tiff::tags::Tag;

const PAGES: usize = 60;
const SIZE: (u32, u32) = (20, 12);

/// A stack of pages with these kinds (bit 0 for a small copy, bit 2 for a mask); all samples of a
/// page have the same value.
fn write<C: ColorType, K: TiffKind>(
    mut encoder: TiffEncoder<Cursor<&mut Vec<u8>>, K>,
    pages: impl Iterator<Item = (u32, C::Inner)>,
) where
    C::Inner: Copy,
    [C::Inner]: TiffValue,
{
    for (kind, value) in pages {
        let samples = SIZE.0 as usize * SIZE.1 as usize * C::BITS_PER_SAMPLE.len();
        let mut image = encoder.new_image::<C>(SIZE.0, SIZE.1).unwrap();
        if kind > 0 {
            image.encoder().write_tag(Tag::NewSubfileType, kind).unwrap();
        }
        image.write_data(&vec![value; samples]).unwrap();
    }
}

fn classic<C: ColorType>(pages: impl Iterator<Item = (u32, C::Inner)>) -> Vec<u8>
where
    C::Inner: Copy,
    [C::Inner]: TiffValue,
{
    let mut bytes = Vec::new();
    write::<C, _>(TiffEncoder::new(Cursor::new(&mut bytes)).unwrap(), pages);
    bytes
}

/// The first sample of a frame.
fn value(source: &mut dyn FrameSource, index: usize) -> usize {
    let picture = source.frame(index).unwrap().unwrap();
    assert_eq!((picture.width, picture.height), (20, 12));
    match picture.pixels {
        Pixels::Grey8(samples) | Pixels::Rgb8(samples) => samples[0].into(),
        Pixels::Grey16(samples) => samples[0].into(),
    }
}

fn opened(folder: &Path, bytes: &[u8]) -> Result<Box<dyn FrameSource>, Error> {
    let file = folder.join("stack.tif");
    fs::write(&file, bytes).unwrap();
    open(&file, false)
}

#[test]
fn each_page_of_a_stack_is_a_frame() {
    let folder = tempfile::tempdir().unwrap();
    let mut big = Vec::new();
    let pages = (0..PAGES).map(|k| (0, 1000 * k as u16));
    write::<Gray16, _>(TiffEncoder::new_big(Cursor::new(&mut big)).unwrap(), pages.clone());
    let kinds = [
        (classic::<Gray8>((0..PAGES).map(|k| (0, 4 * k as u8))), 4),
        (classic::<Gray16>(pages), 1000),
        (classic::<RGB8>((0..PAGES).map(|k| (2, 4 * k as u8))), 4),
        (big, 1000),
    ];
    for (bytes, factor) in kinds {
        let mut stack = opened(folder.path(), &bytes).unwrap();
        assert_eq!((stack.length(), stack.count().unwrap()), (Some(PAGES), PAGES));
        for k in (0..PAGES).chain([41, 3, 59, 0]) {
            assert_eq!(value(&mut *stack, k), factor * k);
        }
        assert_eq!(stack.frame(PAGES).unwrap(), None);
    }
}

#[test]
fn small_copies_and_masks_are_no_frames() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = classic::<Gray8>([(1, 9), (0, 10), (4, 11), (2, 12)].into_iter());
    let mut stack = opened(folder.path(), &bytes).unwrap();
    assert_eq!(stack.length(), Some(2));
    assert_eq!([0, 1].map(|k| value(&mut *stack, k)), [10, 12]);
    let mut single =
        opened(folder.path(), &classic::<Gray8>([(0, 7), (1, 8)].into_iter())).unwrap();
    assert_eq!((single.length(), value(&mut *single, 0)), (Some(1), 7));
    let folder = folder.path().to_str().unwrap();
    assert_eq!(value(&mut *open(folder, false).unwrap(), 0), 7, "in a folder too");
}

#[test]
fn a_stack_in_a_folder_of_images_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = classic::<Gray8>((0..3).map(|k| (0, k)));
    fs::write(folder.path().join("a.tif"), bytes).unwrap();
    let error = open(folder.path(), false).unwrap().frame(0).unwrap_err().to_string();
    assert!(error.contains("it holds 3 pictures; name the file itself"), "{error}");
}

#[test]
fn a_damaged_list_of_pages_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = classic::<Gray8>((0..4).map(|k| (0, k)));
    // The last offset of a page is at the end of the file; it leads back to the first page here.
    let first: [u8; 4] = bytes[4..8].try_into().unwrap();
    let end = bytes.len() - 4;
    assert_eq!(bytes[end..], [0; 4]);
    bytes[end..].copy_from_slice(&first);
    let error = opened(folder.path(), &bytes).err().unwrap().to_string();
    assert!(error.contains("the list of its pages is damaged after page"), "{error}");
    bytes[end..].fill(0xff);
    assert!(opened(folder.path(), &bytes).is_err());
    // What follows the only page of an image is not read by others either.
    let mut single = classic::<Gray8>([(0, 5)].into_iter());
    let end = single.len() - 4;
    single[end..].fill(0xff);
    let mut image = opened(folder.path(), &single).unwrap();
    assert_eq!((image.length(), value(&mut *image, 0)), (Some(1), 5));
}

#[test]
fn each_frame_of_an_animated_webp_is_a_frame() {
    let folder = tempfile::tempdir().unwrap();
    let frame = |k: u8| {
        let place = [&[0; 6][..], &[19, 0, 0, 11, 0, 0], &[40 + k, 0, 0, 2]].concat();
        chunk(b"ANMF", &[place, webp_picture_of(20, 12, 4 * k)].concat())
    };
    let frames: Vec<u8> = (0..PAGES as u8).flat_map(frame).collect();
    let bytes = webp_canvas(20, 12, 2, &[chunk(b"ANIM", &[0; 6]), frames].concat());
    let file = folder.path().join("a.webp");
    fs::write(&file, bytes).unwrap();
    let mut video = open(&file, true).unwrap();
    assert_eq!((video.length(), video.rate().is_some()), (Some(PAGES), true));
    for k in (0..PAGES).chain([41, 3, 59, 0]) {
        assert_eq!(value(&mut *video, k), 4 * k);
    }
    let time = video.frame(2).unwrap().unwrap().time.unwrap();
    assert!((time - 0.081).abs() < 1e-9, "{time}");
    assert_eq!(video.frame(PAGES).unwrap(), None);
    let error = open(folder.path(), false).unwrap().frame(0).unwrap_err().to_string();
    assert!(error.contains("it holds 60 pictures"), "{error}");
}

#[test]
fn each_frame_of_an_animated_png_is_a_frame() {
    if !ffmpeg_is_there("animated PNG") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    let source = "color=s=20x12:r=25:d=1,format=gray,geq=lum='4*N'";
    ffmpeg(&["-f", "lavfi", "-i", source, "-f", "apng", file.to_str().unwrap()]);
    let mut video = open(&file, false).unwrap();
    assert_eq!(video.count().unwrap(), 25);
    for k in [0, 7, 24] {
        assert!(value(&mut *video, k).abs_diff(4 * k) < 3);
    }
    let error = open(folder.path(), false).unwrap().frame(0).unwrap_err().to_string();
    assert!(error.contains("it holds 25 pictures"), "{error}");
}
