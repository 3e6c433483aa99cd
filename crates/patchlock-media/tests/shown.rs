//! Frames are what a player shows: turned as the file says, and only those that its edit list
//! shows.

mod support;

use std::fs;
use std::path::Path;

use image::{DynamicImage, RgbImage};
use patchlock_media::{Picture, Pixels, image_file, open};
use support::{boxed, change, put, small_mp4};

fn frames(file: &[u8], reverse: bool) -> Vec<Picture> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.mp4");
    fs::write(&path, file).unwrap();
    let mut video = open(path.to_str().unwrap(), reverse).unwrap();
    let count = video.length().unwrap();
    let mut order: Vec<usize> = (0..count).collect();
    if reverse {
        order.reverse();
    }
    let mut frames: Vec<Picture> =
        order.into_iter().map(|k| video.frame(k).unwrap().unwrap()).collect();
    if reverse {
        frames.reverse();
    }
    assert_eq!(video.frame(count).unwrap(), None);
    frames
}

fn image(picture: &Picture) -> DynamicImage {
    let Pixels::Rgb8(rgb) = &picture.pixels else { panic!("video has colours") };
    let (width, height) = (picture.width as u32, picture.height as u32);
    RgbImage::from_raw(width, height, rgb.clone()).unwrap().into()
}

/// The file with these four numbers in the matrix of its track or movie.
fn with_matrix(file: &[u8], path: &str, matrix: [i32; 4]) -> Vec<u8> {
    let start = if path.ends_with("tkhd") { 40 } else { 36 };
    change(file, path, &|content| {
        for (place, value) in [0, 1, 3, 4].into_iter().zip(matrix) {
            put(content, start + 4 * place, (value << 16) as u32);
        }
    })
}

#[test]
fn rotation_tags_of_mp4_are_applied() {
    let plain = small_mp4(64, 48, 3);
    let stored = image(&frames(&plain, false)[2]);
    let turned = |matrix| {
        let file = with_matrix(&plain, "moov/trak/tkhd", matrix);
        image(&frames(&file, false)[2])
    };
    assert_eq!(turned([1, 0, 0, 1]), stored);
    assert_eq!(turned([0, 1, -1, 0]), stored.rotate90(), "as a phone held upright writes it");
    assert_eq!(turned([-1, 0, 0, -1]), stored.rotate180());
    assert_eq!(turned([0, -1, 1, 0]), stored.rotate270());
    assert_eq!(turned([-1, 0, 0, 1]), stored.fliph(), "as a front camera may write it");
    assert_eq!(turned([1, 0, 0, -1]), stored.flipv());
    let both = with_matrix(&plain, "moov/trak/tkhd", [0, 1, -1, 0]);
    let both = with_matrix(&both, "moov/mvhd", [0, 1, -1, 0]);
    assert_eq!(image(&frames(&both, false)[2]), stored.rotate180(), "the movie has a matrix too");
}

#[test]
fn orientation_tags_of_images_are_applied() {
    let folder = tempfile::tempdir().unwrap();
    let plain = folder.path().join("plain.jpg");
    let stored = RgbImage::from_fn(24, 16, |x, y| image::Rgb([x as u8 * 9, y as u8 * 14, 60]));
    stored.save(&plain).unwrap();
    let jpeg = fs::read(&plain).unwrap();
    let stored = image(&image_file::load(&plain).unwrap());
    let turned = |tag: u8, path: &Path| {
        // EXIF with one entry: orientation (0x112), one short number.
        let entry = [&[0, 1, 1, 0x12, 0, 3, 0, 0, 0, 1, 0, tag][..], &[0; 6]].concat();
        let exif = [b"Exif\0\0MM\0\x2a\0\0\0\x08", &entry[..]].concat();
        let part = [&[0xff, 0xe1, 0, exif.len() as u8 + 2], &exif[..]].concat();
        fs::write(path, [&jpeg[..2], &part, &jpeg[2..]].concat()).unwrap();
        let loaded = image_file::load(path).unwrap();
        assert_eq!(image_file::size(path).unwrap(), (loaded.width, loaded.height));
        image(&loaded)
    };
    let file = folder.path().join("turned.jpg");
    let expected = [
        stored.clone(),
        stored.fliph(),
        stored.rotate180(),
        stored.flipv(),
        stored.rotate90().fliph(),
        stored.rotate90(),
        stored.rotate270().fliph(),
        stored.rotate270(),
    ];
    for (tag, expected) in (1..).zip(expected) {
        assert_eq!(turned(tag, &file), expected, "orientation {tag}");
    }
    assert_eq!(turned(77, &file), stored, "no such orientation");
}

/// Ticks of a frame of [`small_mp4`].
const FRAME: i32 = 2400;

/// The file with this edit list: duration in milliseconds and media time in frames.
fn with_edits(file: &[u8], edits: &[(u32, i32)]) -> Vec<u8> {
    let scaled = change(file, "moov/mvhd", &|content| put(content, 12, 1000));
    let mut list = [0_u32, edits.len() as u32].map(u32::to_be_bytes).concat();
    for &(duration, time) in edits {
        let time = if time < 0 { time } else { time * FRAME };
        list.extend([duration, time as u32, 1 << 16].map(u32::to_be_bytes).concat());
    }
    let edits = boxed("edts", &boxed("elst", &list));
    change(&scaled, "moov/trak", &|content| content.extend(&edits))
}

/// An edit list, and the stored frames that it shows.
type Case<'a> = (&'a [(u32, i32)], Vec<usize>);

#[test]
fn edit_lists_select_frames() {
    // 25 frames per second.
    let plain = small_mp4(64, 48, 70);
    let all = frames(&plain, false);
    let cases: [Case<'_>; 6] = [
        (&[(2800, 0)], (0..70).collect()),
        (&[(400, 7)], (7..17).collect()),
        (&[(0, 65)], (65..70).collect()),
        (&[(100, -1), (80, 3)], vec![3, 4]),
        (&[(80, 60), (120, 2)], vec![60, 61, 2, 3, 4]),
        (&[(80, 62), (80, 62)], vec![62, 63, 62, 63]),
    ];
    for (edits, expected) in cases {
        let file = with_edits(&plain, edits);
        for reverse in [false, true] {
            let shown = frames(&file, reverse);
            assert_eq!(shown.len(), expected.len(), "{edits:?}");
            for (picture, &k) in shown.iter().zip(&expected) {
                assert!(picture.pixels == all[k].pixels, "{edits:?}, frame {k}");
            }
        }
    }
}

#[test]
fn an_edit_list_that_shows_nothing_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.mp4");
    fs::write(&path, with_edits(&small_mp4(64, 48, 5), &[(80, 50)])).unwrap();
    let error = open(path.to_str().unwrap(), false).err().expect("no frame");
    assert!(error.to_string().contains("its edit list shows no frame"), "{error}");
}
