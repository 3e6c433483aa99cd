//! Round trips through video files: frames are read back in order and with little loss.

use std::fs;
use std::path::Path;

use patchlock_media::{FrameRate, FrameSource, Mp4Writer, Note, Pixels, open};
use patchlock_scene::Scene;

/// RGB bytes of a textured card that moves one pixel to the right per frame, on a smooth
/// background.
fn film(k: usize, width: usize, height: usize) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as i64 - 20 - k as i64, y as i64 - 18);
            if (0..32).contains(&u) && (0..28).contains(&v) {
                let tile = (u / 5 * 3 + v / 5 * 7) % 5;
                rgb.extend([60 + 40 * tile as u8, 220 - 30 * tile as u8, 40 + 6 * (u as u8)]);
            } else {
                rgb.extend([40 + (x as u8) / 2, 60 + (y as u8), 90]);
            }
        }
    }
    rgb
}

/// Writes the first `count` frames of the film.
fn write_film(file: &Path, (width, height): (usize, usize), count: usize) {
    let out = fs::File::create(file).unwrap();
    let mut writer = Mp4Writer::new(out, width, height, FrameRate::DEFAULT, None).unwrap();
    (0..count).for_each(|k| writer.push(&film(k, width, height)).unwrap());
    writer.finish().unwrap();
}

fn psnr(a: &[u8], b: &[u8]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(x, y)| (f64::from(*x) - f64::from(*y)).powi(2)).sum();
    10.0 * (255.0 * 255.0 * a.len() as f64 / squares.max(1e-9)).log10()
}

fn rgb(pixels: Pixels) -> Vec<u8> {
    match pixels {
        Pixels::Rgb8(rgb) => rgb,
        other => panic!("video has colours: {other:?}"),
    }
}

#[test]
fn rendered_frames_survive_a_round_trip_through_mp4() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.mp4");
    let scene = Scene::simple();
    let frames: Vec<_> = (0..scene.len()).map(|k| scene.frame(k)).collect();
    let rate = FrameRate { frames: 30_000, seconds: 1001 };
    let out = fs::File::create(&file).unwrap();
    let mut writer = Mp4Writer::new(out, frames[0].width, frames[0].height, rate, None).unwrap();
    frames.iter().for_each(|frame| writer.push(&frame.rgb).unwrap());
    writer.finish().unwrap();

    let mut video = open(file.to_str().unwrap(), false).unwrap();
    assert_eq!((video.length(), video.rate()), (Some(frames.len()), Some(rate)));
    let mut worst = f64::INFINITY;
    for (k, frame) in frames.iter().enumerate() {
        let back = rgb(video.frame(k).unwrap().unwrap().pixels);
        let here = psnr(&back, &frame.rgb);
        worst = worst.min(here);
        if let Some(later) = frames.get(k + 8) {
            assert!(here > psnr(&back, &later.rgb), "frame {k} is out of order");
        }
    }
    println!("worst PSNR {worst:.1} dB over {} frames", frames.len());
    assert!(worst > 30.0, "{worst}");
    assert!(video.frame(frames.len()).unwrap().is_none());
}

#[test]
fn frames_do_not_depend_on_the_order_of_reading() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.mp4");
    write_film(&file, (96, 72), 150); // longer than a group of pictures and than the backward window
    let open = || open(file.to_str().unwrap(), true).unwrap();
    let mut straight = open();
    let forwards: Vec<_> = (0..150).map(|k| straight.frame(k).unwrap().unwrap()).collect();
    let mut falling = open();
    for k in (0..150).rev() {
        assert_eq!(falling.frame(k).unwrap().unwrap(), forwards[k], "frame {k} backwards");
    }
    let mut jumping = open();
    for k in [140, 3, 60, 59, 61, 149, 0] {
        assert_eq!(jumping.frame(k).unwrap().unwrap(), forwards[k], "frame {k} by a jump");
    }
}

#[test]
fn odd_sizes_are_padded_to_even_ones() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("odd.mp4");
    write_film(&file, (95, 71), 3);
    let back = open(file.to_str().unwrap(), false).unwrap().frame(1).unwrap().unwrap();
    assert_eq!((back.width, back.height), (96, 72));
    let back = rgb(back.pixels);
    let cut: Vec<u8> =
        back.chunks_exact(96 * 3).take(71).flat_map(|row| &row[..95 * 3]).copied().collect();
    let quality = psnr(&cut, &film(1, 95, 71));
    assert!(quality > 24.0, "4:2:0 blurs coloured edges by one pixel, but not more: {quality}");
}

/// The file was made with x264: 18 frames with B-frames, so the storage order differs from the
/// presentation order, in two groups of pictures. Its height of 46 lines is cropped from 48. Red is
/// 30 in the first frame and grows by 10 per frame.
#[test]
fn reordered_frames_come_in_presentation_order() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bframes.mp4");
    let red = |video: &mut Box<dyn FrameSource>, k: usize| {
        let picture = video.frame(k).unwrap().unwrap();
        assert_eq!((picture.width, picture.height), (64, 46));
        let red: Vec<f64> = rgb(picture.pixels).iter().step_by(3).map(|&r| f64::from(r)).collect();
        red.iter().sum::<f64>() / red.len() as f64
    };
    for reverse in [false, true] {
        let mut video = open(file, reverse).unwrap();
        assert_eq!(video.length(), Some(18));
        let order: Vec<usize> = if reverse { (0..18).rev().collect() } else { (0..18).collect() };
        for k in order {
            let red = red(&mut video, k);
            assert!((red - (30.0 + 10.0 * k as f64)).abs() < 4.0, "frame {k} has red {red}");
        }
    }
}

/// A download that has stopped: the index is at the beginning, the end is missing.
#[test]
fn an_mp4_without_its_end_has_the_frames_before_and_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.mp4");
    let out = fs::File::create(&file).unwrap();
    let mut writer = Mp4Writer::new(out, 96, 72, FrameRate::DEFAULT, Some(30)).unwrap();
    (0..30).for_each(|k| writer.push(&film(k, 96, 72)).unwrap());
    writer.finish().unwrap();
    let mut whole = open(&file, false).unwrap();
    let frames: Vec<_> = (0..30).map(|k| whole.frame(k).unwrap().unwrap()).collect();
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() * 2 / 3]).unwrap();
    for reverse in [false, true] {
        let mut video = open(&file, reverse).unwrap();
        let length = video.length().unwrap();
        assert!((5..25).contains(&length), "{length}");
        let note = Note::NoEnd { name: file.display().to_string(), frames: 30 - length };
        assert_eq!(video.notes(), [note]);
        let mut order: Vec<usize> = (0..length).collect();
        if reverse {
            order.reverse();
        }
        for k in order {
            assert!(video.frame(k).unwrap().as_ref() == Some(&frames[k]), "frame {k}");
        }
        assert_eq!(video.frame(length).unwrap(), None);
    }
}
