//! Frames of every kind give correct results or are refused, and no frame corrupts the tracker.

use crate::methods::{all, learning_early};
use crate::sequence::{SIMPLE, bits, numbers};
use patchlock::{BoundingBox, Error, Estimate, Frame, Tracker, TrackerConfig};

/// A frame of the scene in grey.
fn grey(k: usize) -> Vec<u8> {
    let grey = |rgb: &[u8]| {
        let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(f64::from);
        (0.2989 * r + 0.5870 * g + 0.1140 * b).round() as u8
    };
    SIMPLE.rgb(k).chunks_exact(3).map(grey).collect()
}

const COUNT: usize = 16;

/// Tracks frames made from the grey ones, with every method.
fn track<T>(make: impl Fn(&[u8]) -> Vec<T>, view: impl Fn(&[T]) -> Frame<'_>) -> Vec<Estimate> {
    all().iter().flat_map(|config| track_with(config, &make, &view)).collect()
}

fn track_with<T>(
    config: &TrackerConfig,
    make: impl Fn(&[u8]) -> Vec<T>,
    view: impl Fn(&[T]) -> Frame<'_>,
) -> Vec<Estimate> {
    let frames: Vec<Vec<T>> = (0..COUNT).map(|k| make(&grey(k))).collect();
    let mut tracker = Tracker::start(config.clone(), &view(&frames[0]), SIMPLE.truth(0)).unwrap();
    frames[1..].iter().map(|frame| tracker.update(&view(frame)).unwrap().clone()).collect()
}

#[test]
fn every_kind_of_sample_gives_the_same_boxes() {
    let (w, h) = (SIMPLE.width(), SIMPLE.height());
    let grey8 = track(<[u8]>::to_vec, |s| Frame::grey8(s, w, h).unwrap());
    let grey16 = track(
        |g| g.iter().map(|&v| u16::from(v) * 257).collect::<Vec<u16>>(),
        |s| Frame::grey16(s, w, h).unwrap(),
    );
    let grey32f = track(
        |g| g.iter().map(|&v| f32::from(v) / 255.0).collect::<Vec<f32>>(),
        |s| Frame::grey32f(s, w, h).unwrap(),
    );
    assert_eq!(bits(&grey8), bits(&grey16));
    assert_eq!(bits(&grey8), bits(&grey32f));
    // The weights of the channels sum to 0.9999.
    let rgb8 = track(
        |g| g.iter().flat_map(|&v| [v; 3]).collect::<Vec<u8>>(),
        |s| Frame::rgb8(s, w, h).unwrap(),
    );
    for (a, b) in grey8.iter().zip(&rgb8) {
        assert!(a.bbox.overlap(&b.bbox) > 0.99, "{:?} {:?}", a.bbox, b.bbox);
    }
}

/// Appends `gap` samples of noise to every row.
fn with_gaps<T: Copy>(samples: &[T], row: usize, gap: usize, noise: T) -> Vec<T> {
    samples.chunks_exact(row).flat_map(|row| row.iter().copied().chain(vec![noise; gap])).collect()
}

#[test]
fn gaps_between_rows_change_nothing() {
    let (w, h) = (SIMPLE.width(), SIMPLE.height());
    let dense = track(<[u8]>::to_vec, |s| Frame::grey8(s, w, h).unwrap());
    let strided = track(
        |g| with_gaps(g, w, 13, 199),
        |s| Frame::grey8(s, w, h).and_then(|f| f.with_stride(w + 13)).unwrap(),
    );
    assert_eq!(bits(&dense), bits(&strided));
    let floats = track(
        |g| with_gaps(&g.iter().map(|&v| f32::from(v) / 255.0).collect::<Vec<_>>(), w, 5, f32::NAN),
        |s| Frame::grey32f(s, w, h).and_then(|f| f.with_stride(w + 5)).unwrap(),
    );
    assert_eq!(bits(&dense), bits(&floats));
    let colours = track(
        |g| g.iter().flat_map(|&v| [v; 3]).collect::<Vec<u8>>(),
        |s| Frame::rgb8(s, w, h).unwrap(),
    );
    let strided = track(
        |g| with_gaps(&g.iter().flat_map(|&v| [v; 3]).collect::<Vec<u8>>(), 3 * w, 7, 31),
        |s| Frame::rgb8(s, w, h).and_then(|f| f.with_stride(3 * w + 7)).unwrap(),
    );
    assert_eq!(bits(&colours), bits(&strided));
}

#[test]
fn a_refused_frame_leaves_the_tracker_as_it_was() {
    let (w, h) = (SIMPLE.width(), SIMPLE.height());
    for config in all() {
        let undisturbed = SIMPLE.track(&config, 0..12);
        let mut tracker = SIMPLE.begin(&config, 0);
        for (k, want) in (1..).zip(&undisturbed) {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, 200.0] {
                let mut samples = vec![0.5; w * h];
                samples[w * h / 2] = bad;
                let frame = Frame::grey32f(&samples, w, h).unwrap();
                let before = tracker.snapshot();
                assert!(matches!(tracker.update(&frame), Err(Error::Frame(_))), "{bad}");
                let again = tracker.restart(&frame, SIMPLE.truth(0));
                assert!(matches!(again, Err(Error::Frame(_))), "{bad}");
                let begun = Tracker::start(config.clone(), &frame, SIMPLE.truth(0));
                assert!(matches!(begun, Err(Error::Frame(_))), "{bad}");
                assert_eq!(tracker.snapshot(), before);
            }
            let samples = vec![90; w * h];
            for (w, h) in [(h, w), (w - 1, h), (w, h - 1), (1, 1)] {
                let error = tracker.update(&Frame::grey8(&samples, w, h).unwrap()).unwrap_err();
                assert!(matches!(error, Error::FrameSize { .. }), "{error}");
            }
            assert_eq!(tracker.update(&SIMPLE.frame(k)).unwrap(), want);
        }
    }
}

/// Tracks the same frame repeatedly and checks that all numbers are finite.
fn track_one_frame(samples: &[u8], w: usize, h: usize, bbox: BoundingBox, config: &TrackerConfig) {
    let frame = Frame::grey8(samples, w, h).unwrap();
    let mut tracker = Tracker::start(config.clone(), &frame, bbox).unwrap();
    let first = tracker.estimate().clone();
    let rest = (0..30).map(|_| tracker.update(&frame).unwrap().clone());
    for estimate in std::iter::once(first).chain(rest) {
        let all = numbers(&estimate);
        assert!(all.iter().all(|v| v.is_finite()), "{w}x{h} of {}: {all:?}", samples[0]);
        assert!((0.0..=1.0).contains(&estimate.score));
    }
}

#[test]
fn uniform_frames_give_finite_numbers() {
    let bbox = BoundingBox { x: 20.0, y: 10.0, w: 24.0, h: 20.0 };
    for config in all().into_iter().map(learning_early) {
        for subtract_mean in [false, true] {
            let mut config = config.clone();
            if config.method.patches().is_some() {
                config.set("subtract_mean", subtract_mean).unwrap();
            }
            for grey in [0, 128, 255] {
                track_one_frame(&[grey; 80 * 60], 80, 60, bbox, &config);
            }
        }
    }
}

#[test]
fn the_smallest_frames_give_finite_numbers() {
    for config in all() {
        // The method `paper` refuses a box of few pixels, but not one that covers few.
        let side = if config.method.name() == "paper" { 4.0 } else { 1.0 };
        let one = BoundingBox { x: 0.0, y: 0.0, w: side, h: side };
        track_one_frame(&[77], 1, 1, one, &config);
        track_one_frame(&[0], 1, 1, one, &config);
        track_one_frame(&[77, 200], 2, 1, one, &config);
        track_one_frame(&[77, 200], 2, 1, BoundingBox { w: 2.0 * side, ..one }, &config);
        track_one_frame(&[200, 3], 1, 2, BoundingBox { h: 2.0 * side, ..one }, &config);
        track_one_frame(&[0, 255], 2, 1, BoundingBox { x: -3.0, y: -3.0, w: 9.0, h: 9.0 }, &config);
    }
}
