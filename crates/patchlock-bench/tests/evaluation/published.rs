//! Scores the boxes that the authors of OTB published for several trackers, and compares the scores
//! with the published ones. `patchlock_testdata` finds the boxes.

use std::path::{Path, PathBuf};

use patchlock_bench::dataset::{Dataset, Layout};
use patchlock_bench::{results, score};
use patchlock_testdata::real;

/// DP at 20 pixels and AUC over all 51 targets in OPE: Wu, Lim, Yang, CVPR 2013.
const PUBLISHED: [(&str, f64, f64); 5] = [
    ("SCM", 0.650, 0.499),
    ("Struck", 0.656, 0.473),
    ("TLD", 0.608, 0.438),
    ("ASLA", 0.531, 0.435),
    ("IVT", 0.500, 0.357),
];

fn published(test: &str) -> Option<PathBuf> {
    let truth = real(test, "otb2013-published/annotations")?;
    truth.parent().map(Path::to_owned)
}

#[test]
fn five_trackers_match_their_published_scores() {
    let Some(folder) = published("five_trackers_match_their_published_scores") else { return };
    let truth = Dataset::open(&folder.join("annotations")).unwrap();
    assert_eq!((truth.layout, truth.sequences.len()), (Layout::TruthOnly, 51));
    for (name, dp20, auc) in PUBLISHED {
        let results = results::read(&folder.join(name), &truth).unwrap();
        let board = score::scoreboard(&results, &truth);
        assert!(board.refused.is_empty(), "{:?}", board.refused);
        let [tracker] = &board.trackers[..] else {
            panic!("one tracker, but {}", board.trackers.len())
        };
        assert_eq!((tracker.name.as_str(), tracker.targets.len()), (name, 51));
        let (got_dp, got_auc) = (tracker.overall.dp20.mean, tracker.overall.auc.mean);
        assert!((got_dp - dp20).abs() <= 0.002, "{name}: DP {got_dp:.4}, published {dp20}");
        assert!((got_auc - auc).abs() <= 0.002, "{name}: AUC {got_auc:.4}, published {auc}");
    }
}

#[test]
fn a_trajectory_of_the_wrong_length_is_rejected() {
    let Some(folder) = published("a_trajectory_of_the_wrong_length_is_rejected") else { return };
    let truth = Dataset::open(&folder.join("annotations")).unwrap();
    // The files of two targets have more frames than count.
    let results = results::read(&folder.join("LSK"), &truth).unwrap();
    let reasons = score::tracker(&results[0], &truth).unwrap_err();
    assert!(
        reasons
            .iter()
            .any(|reason| reason.contains("770 boxes, but the truth of david has 471 frames")),
        "{reasons:?}"
    );
}
