//! On real sequences, the pruned computation gives exactly the same boxes as the plain one, in
//! which every candidate is coded at every location. `patchlock_testdata` finds the sequences.
//! `PATCHLOCK_FULL=1` tests whole sequences, which takes most of an hour on two cores;
//! `PATCHLOCK_SIMD=plain` selects the code without SIMD.

use std::env;
use std::io::Write;

use patchlock::{FrameView, Preset, Tracker, TrackerConfig};
use patchlock_bench::dataset::{Dataset, Sequence};
use patchlock_media::image_file;
use patchlock_testdata::{real, slow};
use rayon::prelude::*;

/// Tracks the first `count` frames both ways and compares the boxes. Returns the number of boxes.
fn compare_boxes(sequence: &Sequence, count: usize) -> usize {
    let config = TrackerConfig::from(Preset::Paper);
    if count == 0 {
        return 0;
    }
    let mut both: Option<(Tracker, Tracker)> = None;
    for (k, path) in sequence.frames.iter().take(count).enumerate() {
        let picture = image_file::load(path).unwrap();
        let frame = picture.frame().unwrap();
        let Some((fast, plain)) = &mut both else {
            let first = sequence.truth[0].unwrap();
            let start = || Tracker::start(config.clone(), &frame, first).unwrap();
            both = Some((start(), start()));
            continue;
        };
        let (a, b) = {
            // An observer receives all likelihoods, so no candidate is pruned.
            let mut all = true;
            let mut observer = |view: &FrameView<'_>| {
                let FrameView::Paper(view) = view else { panic!("another method's view") };
                all = view.likelihoods.iter().all(|likelihood| likelihood.is_finite());
            };
            let plain = plain.update_observed(&frame, &mut observer);
            assert!(all, "{}: a candidate was pruned", sequence.name);
            (fast.update(&frame), plain)
        };
        assert_eq!(a.unwrap(), b.unwrap(), "{}, frame {k}", sequence.name);
    }
    let boxes = sequence.frames.len().min(count);
    let _ = writeln!(std::io::stderr(), "{}: {boxes} boxes are the same", sequence.name);
    boxes
}

#[test]
fn pruning_does_not_change_any_box() {
    let Some(folder) = real("pruning_does_not_change_any_box", "otb-dev") else { return };
    let whole = env::var_os("PATCHLOCK_FULL").is_some_and(|value| value == "1");
    let short = !whole && !slow("pruning_does_not_change_any_box", 45);
    let count = |sequence: &Sequence| match sequence.name.as_str() {
        _ if whole => usize::MAX,
        "Crossing" if short => 6,
        _ if short => 0,
        // Until everything has been updated, including the small dictionary and its buffer.
        "Crossing" | "CarScale" => 22,
        _ => 3,
    };
    let dataset = Dataset::open(&folder).unwrap();
    let sequences = dataset.sequences.par_iter();
    let all: usize = sequences.map(|sequence| compare_boxes(sequence, count(sequence))).sum();
    assert!(all > 0, "{} holds no sequences", folder.display());
    let _ = writeln!(std::io::stderr(), "{all} boxes of {} targets", dataset.sequences.len());
}
