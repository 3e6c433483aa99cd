//! The times of frames: read from files, and kept in the videos that are written.

mod support;

use std::fs;
use std::io::Cursor;

use patchlock_media::{FrameRate, Mp4Writer, open};
use support::frame;

/// A video whose frames are at these times, read back.
fn times(rate: FrameRate, times: &[Option<f64>]) -> (Option<FrameRate>, Vec<f64>) {
    let mut writer = Mp4Writer::new(Cursor::new(Vec::new()), 48, 32, rate, None).unwrap();
    for (k, &time) in times.iter().enumerate() {
        writer.push_at(&frame(48, 32, k), time).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.mp4");
    fs::write(&file, writer.finish().unwrap().into_inner()).unwrap();
    let mut video = open(file.to_str().unwrap(), false).unwrap();
    assert_eq!(video.length(), Some(times.len()));
    let read = (0..times.len()).map(|k| video.frame(k).unwrap().unwrap().time.unwrap());
    let read = read.collect();
    (video.rate(), read)
}

fn assert_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() < 1e-5, "{found:?} for {expected:?}");
    }
}

#[test]
fn uneven_times_are_kept() {
    let uneven = [0.0, 0.04, 0.05, 0.35, 0.351, 2.0];
    let (_, found) = times(FrameRate::DEFAULT, &uneven.map(Some));
    assert_near(&found, &uneven);
    let later: Vec<_> = uneven.iter().map(|time| Some(time + 7.25)).collect();
    assert_near(&times(FrameRate::DEFAULT, &later).1, &uneven);
    let falling: Vec<_> = uneven.iter().rev().map(|&time| Some(time)).collect();
    let (_, found) = times(FrameRate::DEFAULT, &falling);
    assert_near(&found, &[0.0, 1.649, 1.65, 1.95, 1.96, 2.0]);
}

#[test]
fn even_times_give_the_exact_rate() {
    for rate in [(30_000, 1001), (24_000, 1001), (25, 1), (30, 2), (10_000_019, 333_333)] {
        let rate = FrameRate::new(rate.0, rate.1).unwrap();
        let distance = f64::from(rate.seconds) / f64::from(rate.frames);
        let expected: Vec<f64> = (0..20).map(|k| k as f64 * distance).collect();
        let lowest = if rate.seconds == 2 { FrameRate::new(15, 1) } else { Some(rate) };
        for given in [vec![None; 20], expected.iter().copied().map(Some).collect()] {
            let (found, read) = times(rate, &given);
            assert_eq!(found, lowest);
            assert_near(&read, &expected);
        }
    }
}

/// B-frames are stored out of order, and the edit list makes the first frame begin at 0.
#[test]
fn reordered_frames_have_rising_times() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bframes.mp4");
    let mut video = open(file, false).unwrap();
    let rate = video.rate().unwrap();
    for k in 0..18 {
        let expected = k as f64 * f64::from(rate.seconds) / f64::from(rate.frames);
        let time = video.frame(k).unwrap().unwrap().time.unwrap();
        assert!((time - expected).abs() < 1e-9, "frame {k} at {time}");
    }
}
