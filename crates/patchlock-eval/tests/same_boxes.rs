//! On real sequences the fast way gives the boxes of the plain one, in which every candidate is coded at every location, bit for bit.
//! `PATCHLOCK_DATA` names the folder that holds `otb-dev/`; without it `../shared/data`, seen from the root of the workspace, is tried. Where there
//! is none, the test says so and passes. `PATCHLOCK_FULL=1` takes whole sequences, which is most of an hour on two cores, and `PATCHLOCK_SIMD=plain` the plain code.

use std::env;
use std::io::Write;
use std::path::{Path, PathBuf};

use patchlock::{FrameView, Tracker, TrackerConfig};
use patchlock_eval::dataset::{Dataset, Sequence};
use patchlock_media::image_file;
use rayon::prelude::*;

fn sequences(test: &str) -> Option<PathBuf> {
    let near = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = env::var_os("PATCHLOCK_DATA").map_or_else(near, PathBuf::from).join("otb-dev");
    if folder.is_dir() {
        return Some(folder);
    }
    let skipped = format!("{test}: SKIPPED, there is no {}", folder.display());
    let _ = writeln!(std::io::stderr(), "{skipped} (PATCHLOCK_DATA names the folder around it)");
    None
}

/// Frames of a target that are tracked both ways; says and returns how many boxes there were.
fn hold_together(sequence: &Sequence, count: usize) -> usize {
    let config = TrackerConfig::preset("paper").unwrap();
    let (mut fast, mut plain) =
        (Tracker::new(config.clone()).unwrap(), Tracker::new(config).unwrap());
    for (k, path) in sequence.frames.iter().take(count).enumerate() {
        let picture = image_file::load(path).unwrap();
        let frame = picture.frame().unwrap();
        let (a, b) = if k == 0 {
            let first = sequence.truth[0].unwrap();
            (fast.init(&frame, first), plain.init(&frame, first))
        } else {
            // An observer gets all likelihoods, so nothing is left out.
            let mut all = true;
            let mut observer = |view: &FrameView<'_>| {
                let FrameView::Patchwise(view) = view else { panic!("another method's view") };
                all = view.likelihoods.iter().all(|likelihood| likelihood.is_finite());
            };
            let plain = plain.update_observed(&frame, &mut observer);
            assert!(all, "{}: a candidate was left out", sequence.name);
            (fast.update(&frame), plain)
        };
        assert_eq!(a.unwrap(), b.unwrap(), "{}, frame {k}", sequence.name);
    }
    let boxes = sequence.frames.len().min(count);
    let _ = writeln!(std::io::stderr(), "{}: {boxes} boxes are the same", sequence.name);
    boxes
}

#[test]
fn candidates_that_drop_out_change_no_box() {
    let Some(folder) = sequences("candidates_that_drop_out_change_no_box") else { return };
    let whole = env::var_os("PATCHLOCK_FULL").is_some_and(|value| value == "1");
    let count = |sequence: &Sequence| match sequence.name.as_str() {
        _ if whole => usize::MAX,
        // Until all has learned, the small dictionary and its buffer included.
        "Crossing" | "CarScale" => 22,
        _ => 3,
    };
    let dataset = Dataset::open(&folder).unwrap();
    let sequences = dataset.sequences.par_iter();
    let all: usize = sequences.map(|sequence| hold_together(sequence, count(sequence))).sum();
    assert!(all > 0, "{} holds no sequences", folder.display());
    let _ = writeln!(std::io::stderr(), "{all} boxes of {} targets", dataset.sequences.len());
}
