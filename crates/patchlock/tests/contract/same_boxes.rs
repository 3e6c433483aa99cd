//! The same seed gives the same boxes, bit for bit, whatever else changes.

use crate::fields::others;
use crate::methods::{all, draws_boxes, learning_early, paper};
use crate::sequence::{OCCLUDED, SIMPLE, bits};
use patchlock::{
    Estimate, Frame, FrameView, PARAMETERS, Parameter, Range, Tracker, TrackerConfig, Value,
};
use std::process::Command;

const FRAMES: std::ops::Range<usize> = 0..24;

fn on_threads(count: usize, config: &TrackerConfig) -> Vec<Estimate> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
    pool.install(|| SIMPLE.track(config, FRAMES))
}

#[test]
fn on_any_number_of_threads() {
    for config in all() {
        let one = on_threads(1, &config);
        for count in [2, 3, 5] {
            let more = on_threads(count, &config);
            assert_eq!(bits(&one), bits(&more), "{count} threads");
            assert_eq!(one, more);
        }
        // In the global thread pool.
        assert_eq!(one, SIMPLE.track(&config, FRAMES));
    }
}

#[test]
fn in_any_layout_of_the_same_pixels() {
    let swapped = |rgb: &[u8]| -> Vec<u8> {
        rgb.as_chunks().0.iter().flat_map(|&[r, g, b]: &[u8; 3]| [b, g, r]).collect()
    };
    let padded = |rgb: &[u8], width: usize| -> Vec<u8> {
        let row = |row: &[u8]| [row, &[7; 5]].concat();
        rgb.chunks(3 * width).flat_map(row).collect()
    };
    for config in all() {
        let expected = SIMPLE.track(&config, 0..12);
        for (is_bgr, is_padded) in [(true, false), (false, true), (true, true)] {
            let (width, height) = (SIMPLE.width(), SIMPLE.height());
            let pixels = |k: usize| {
                let rgb = SIMPLE.rgb(k);
                let own = if is_bgr { swapped(rgb) } else { rgb.to_vec() };
                if is_padded { padded(&own, width) } else { own }
            };
            let all: Vec<Vec<u8>> = (0..12).map(pixels).collect();
            let frame = |k: usize| {
                let frame = Frame::rgb8(&all[k], width, height).unwrap();
                let frame = if is_bgr { frame.bgr() } else { frame };
                frame.with_stride(3 * width + if is_padded { 5 } else { 0 }).unwrap()
            };
            let mut tracker = Tracker::start(config.clone(), &frame(0), SIMPLE.truth(0)).unwrap();
            for (k, expected) in (1..12).zip(&expected) {
                assert_eq!(tracker.update(&frame(k)).unwrap(), expected, "{is_bgr} {is_padded}");
            }
        }
    }
}

/// For [`with_any_instructions`]: the environment is read once in a process.
#[test]
#[ignore = "another test runs it"]
fn print_boxes() {
    for config in all() {
        println!("\nboxes {:?}", bits(&SIMPLE.track(&config, 0..8)));
    }
}

#[test]
fn with_any_instructions() {
    let boxes = |instructions: Option<&str>| {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "same_boxes::print_boxes", "--ignored", "--nocapture"]);
        match instructions {
            Some(name) => command.env("PATCHLOCK_SIMD", name),
            None => command.env_remove("PATCHLOCK_SIMD"),
        };
        let text = String::from_utf8(command.output().unwrap().stdout).unwrap();
        let lines = text.lines().filter(|line| line.starts_with("boxes "));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    let widest = boxes(None);
    assert_eq!(widest.len(), all().len());
    assert_eq!(boxes(Some("plain")), widest);
}

#[test]
fn with_an_observer() {
    for config in all() {
        let mut tracker = SIMPLE.begin(&config, 0);
        let mut seen = 0;
        let mut observer = |_: &FrameView<'_>| seen += 1;
        let observed: Vec<_> = (1..FRAMES.end)
            .map(|k| tracker.update_observed(&SIMPLE.frame(k), &mut observer).unwrap().clone())
            .collect();
        assert_eq!(seen, FRAMES.end - 1);
        let alone = SIMPLE.track(&config, FRAMES);
        assert_eq!(bits(&observed), bits(&alone));
        assert_eq!(observed, alone);
    }
}

/// With all combinations of words and flags, and numbers far away, more candidates than a block holds,
/// and frequent learning.
#[test]
fn with_an_observer_whatever_is_pruned() {
    let mut base = learning_early(paper());
    base.set("particles", 130).unwrap();
    let (mut combinations, mut numbers) = (vec![base.clone()], Vec::new());
    let affects = |row: &&Parameter| row.group == base.method.name() && row.name != "particles";
    for row in PARAMETERS.iter().filter(affects) {
        let others = others(&base, row);
        let with = |config: &TrackerConfig, value: &Value| {
            let mut config = config.clone();
            config.set(row.name, value.clone()).unwrap();
            config
        };
        if matches!(row.range, Range::Number { .. }) {
            numbers.extend(others.iter().take(2).map(|value| with(&base, value)));
            continue;
        }
        for config in combinations.clone() {
            combinations.extend(others.iter().map(|value| with(&config, value)));
        }
    }
    combinations.iter().chain(&numbers).for_each(observe_same_boxes);
}

fn observe_same_boxes(config: &TrackerConfig) {
    let alone = OCCLUDED.track(config, 0..12);
    let mut tracker = OCCLUDED.begin(config, 0);
    for (k, alone) in (1..12).zip(alone) {
        let frame = OCCLUDED.frame(k);
        let observed = tracker.update_observed(&frame, &mut |_: &FrameView<'_>| ()).unwrap();
        assert_eq!(*observed, alone, "frame {k} of {config:?}");
    }
}

#[test]
fn on_a_second_run_but_not_with_another_seed() {
    for config in all() {
        let first = SIMPLE.track(&config, FRAMES);
        assert_eq!(bits(&first), bits(&SIMPLE.track(&config, FRAMES)));
        if !draws_boxes(&config.method) {
            continue;
        }
        let mut other = config;
        other.seed = 1;
        let other = SIMPLE.track(&other, FRAMES);
        assert!(bits(&first).iter().zip(bits(&other)).all(|(a, b)| *a != b));
    }
}

#[test]
fn after_a_restart_at_any_time() {
    for config in all() {
        let begun = SIMPLE.begin(&config, 5);
        let fresh = SIMPLE.track(&config, 5..20);
        for tracked in [0, 1, 4, 13] {
            let mut tracker = SIMPLE.begin(&config, 0);
            SIMPLE.resume(&mut tracker, 1..1 + tracked);
            let first = tracker.restart(&SIMPLE.frame(5), SIMPLE.truth(5)).unwrap();
            assert_eq!(first, begun.estimate());
            let again = SIMPLE.resume(&mut tracker, 6..20);
            assert_eq!(bits(&again), bits(&fresh), "after {tracked}");
            assert_eq!(again, fresh);
        }
    }
}

#[test]
fn the_first_estimate_is_the_box_itself() {
    for config in all() {
        let tracker = SIMPLE.begin(&config, 0);
        let estimate = tracker.estimate();
        assert!(estimate.bbox.overlap(&SIMPLE.truth(0)) > 1.0 - 1e-9);
        assert!(estimate.score > 0.8, "{}", estimate.score);
    }
}
