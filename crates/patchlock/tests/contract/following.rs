//! The tracker follows its target.

use crate::methods::{all_without_network, following};
use crate::sequence::{OCCLUDED, SIMPLE, Sequence};
use patchlock::{Estimate, TrackerConfig, Visibility};
use patchlock_scene::{Post, Scene, SceneConfig};
use std::ops::Range;

/// Mean and smallest overlap with the ground truth.
fn overlaps(sequence: &Sequence, config: &TrackerConfig, frames: Range<usize>) -> (f64, f64) {
    let estimates = sequence.track(config, frames.clone());
    let overlaps: Vec<f64> = (frames.start + 1..)
        .zip(&estimates)
        .map(|(k, e)| e.bbox.overlap(&sequence.truth(k)))
        .collect();
    let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    (mean, overlaps.into_iter().fold(1.0, f64::min))
}

#[test]
fn it_follows_a_simple_target() {
    for config in all_without_network().into_iter().map(following) {
        let (mean, worst) = overlaps(&SIMPLE, &config, 0..SIMPLE.len());
        assert!(mean > 0.75 && worst > 0.6, "mean overlap {mean}, worst {worst}");
    }
}

#[test]
fn it_follows_a_target_behind_a_thin_tree() {
    let post = Some(Post { centre_x: 120.0, width: 12.0 });
    let sequence = Sequence::new(Scene::new(SceneConfig { post, ..SceneConfig::occluded() }));
    for config in all_without_network().into_iter().map(following) {
        for seed in [1, 2, 3] {
            let mut config = config.clone();
            config.seed = seed;
            let (mean, worst) = overlaps(&sequence, &config, 14..46);
            assert!(mean > 0.85 && worst > 0.7, "seed {seed}: mean overlap {mean}, worst {worst}");
        }
    }
}

/// Half of the target is hidden, and the box stays on it: as a probability, and counting the visible
/// share as a mean over many frames, the score falls a little; the visible share falls as far as the
/// target is hidden.
#[test]
fn score_and_visible_share_fall_while_the_target_is_hidden() {
    for config in all_without_network().into_iter().map(following) {
        let estimates = OCCLUDED.track(&config, 0..36);
        let mean = |frames: &[Estimate], of: fn(&Estimate) -> f64| {
            frames.iter().map(of).sum::<f64>() / frames.len() as f64
        };
        let fall = |of| (mean(&estimates[..8], of), mean(&estimates[26..34], of));
        let (free, hidden) = fall(|estimate| estimate.score);
        assert!(hidden < free - 0.005, "score {free} while free, {hidden} while half hidden");
        let (free, hidden) =
            fall(|estimate| estimate.visibility.as_ref().map_or(0.0, Visibility::share));
        assert!(hidden < 0.7 * free, "share {free} while free, {hidden} while half hidden");
    }
}

/// What is reported as visible has a limit of its own, by which score and status count; the other
/// one decides what is learned, so boxes do not change.
#[test]
fn what_is_reported_as_visible_has_a_limit_of_its_own() {
    let track = |shown_epsilon: f64| -> Vec<Estimate> {
        let mut config = TrackerConfig::default();
        config.set("shown_epsilon", shown_epsilon).unwrap();
        OCCLUDED.track(&config, 0..36)
    };
    let share = |estimate: &Estimate| estimate.visibility.as_ref().map_or(0.0, Visibility::share);
    let (strict, mild) = (track(0.08), track(0.3));
    let mut more = 0;
    for (strict, mild) in strict.iter().zip(&mild) {
        assert_eq!(strict.bbox, mild.bbox);
        assert!(share(strict) <= share(mild) && strict.score <= mild.score, "{strict:?} {mild:?}");
        more += usize::from(share(strict) < share(mild) && strict.score < mild.score);
    }
    assert!(more > strict.len() / 2, "{more} of {} frames", strict.len());
}
