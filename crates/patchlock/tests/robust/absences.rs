//! The target disappears completely and returns.

use crate::{config, mean, track, truth};
use patchlock::{Estimate, Status};
use patchlock_scene::{Absences, Scene, SceneConfig, Truth};
use std::ops::Range;

/// The first two. Behind the post, not every other seed keeps the bounds: some trunks pass for the
/// target.
const SEEDS: [u64; 2] = [1, 2];

/// The target turns by up to this many degrees on its way.
const TURN: f64 = 20.0;

/// Tracking begins this many frames before the absence.
const BEFORE: usize = 60;

/// No first absence begins later than this.
const LONGEST: usize = 1000;

/// A loss is said within this many frames of the first without the target: half a second of video.
const SAID_WITHIN: usize = 15;

/// The target is followed again within this many frames of its return: while it is lost, a frame is
/// searched in parts, and what is found is believed after a trial.
const FOUND_WITHIN: usize = 10;

/// From this visible share on, the target counts as back.
const BACK: f64 = 0.9;

/// A scene up to the first return, and what the tracker says of it.
struct AbsenceRun {
    name: String,
    scene: Scene,
    /// The first frames in which nothing of the target is visible.
    absence: Range<usize>,
    /// The first frame after them in which the target is back.
    back: usize,
    /// The estimates of the frames from [`BEFORE`] the absence on.
    estimates: Vec<(usize, Estimate)>,
}

impl AbsenceRun {
    fn new(absences: Absences, seed: u64) -> Self {
        let scene = Scene::new(SceneConfig::long(LONGEST, absences, TURN, seed));
        let first = |from: usize, is: &dyn Fn(Truth) -> bool| {
            (from..LONGEST).find(|&k| is(scene.truth(k))).unwrap()
        };
        let gone = first(0, &|truth| truth.is_absent());
        let end = first(gone, &|truth| !truth.is_absent());
        let back = first(end, &|truth| truth.visible >= BACK);
        let begin = gone.saturating_sub(BEFORE);
        let estimates = track(&scene, begin..back + FOUND_WITHIN + 1, config());
        let name = format!("{absences:?}, seed {seed}");
        Self { name, scene, absence: gone..end, back, estimates }
    }

    fn estimate(&self, k: usize) -> &Estimate {
        &self.estimates.iter().find(|(frame, _)| *frame == k).unwrap().1
    }

    fn is_lost(&self, k: usize) -> bool {
        self.estimate(k).status == Status::Lost
    }

    fn is_found(&self, k: usize) -> bool {
        !self.is_lost(k) && self.estimate(k).bbox.overlap(&truth(&self.scene, k)) >= 0.5
    }

    fn check(&self) {
        let Self { name, absence, back, .. } = self;
        let said = absence.clone().find(|&k| self.is_lost(k));
        let said = said.unwrap_or_else(|| panic!("{name}: the loss is not said"));
        let late = said - absence.start;
        assert!(late <= SAID_WITHIN, "{name}: said after {late} frames");
        let last = self.estimate(said);
        for k in said..absence.end {
            let estimate = self.estimate(k);
            assert_ne!(estimate.status, Status::Tracked, "{name}, frame {k}");
            if estimate.status == Status::Lost {
                assert_eq!(estimate.visibility, None, "{name}, frame {k}");
            }
        }
        // What is followed for a while is given up, and the box is back where the target was last seen.
        let end = self.estimate(absence.end - 1);
        if end.status == Status::Lost {
            let overlap = end.bbox.overlap(&last.bbox);
            assert!(overlap >= 0.3, "{name}: the last box of the absence overlaps by {overlap}");
        }
        let scores: Vec<f64> = absence.clone().map(|k| self.estimate(k).score).collect();
        assert!(
            mean(&scores) < 0.5,
            "{name}: the score while nothing is visible is {}",
            mean(&scores)
        );
        let found = (*back..=back + FOUND_WITHIN).any(|k| self.is_found(k));
        assert!(found, "{name}: not found within {FOUND_WITHIN} frames");
    }
}

#[test]
fn a_target_behind_a_post_is_lost_and_found() {
    for seed in SEEDS {
        AbsenceRun::new(Absences::BehindPost, seed).check();
    }
}

#[test]
fn a_target_outside_the_frame_is_lost_and_found() {
    for seed in SEEDS {
        AbsenceRun::new(Absences::OutsideFrame, seed).check();
    }
}
