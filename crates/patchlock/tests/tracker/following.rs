//! It follows its target.

use crate::film::{Film, OCCLUDED, SIMPLE};
use patchlock::{Estimate, TrackerConfig};
use patchlock_scene::{Post, Scene, SceneConfig};
use std::ops::Range;

/// The preset `paper` with fewer particles and small patches, so that a test takes seconds.
fn few() -> TrackerConfig {
    TrackerConfig { particles: 150, small_step: 4, ..TrackerConfig::preset("paper").unwrap() }
}

/// Mean and smallest overlap with the truth.
fn overlaps(film: &Film, config: &TrackerConfig, frames: Range<usize>) -> (f64, f64) {
    let estimates = film.track(config, frames.clone());
    let overlaps: Vec<f64> =
        (frames.start + 1..).zip(&estimates).map(|(k, e)| e.bbox.overlap(&film.truth(k))).collect();
    let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    (mean, overlaps.into_iter().fold(1.0, f64::min))
}

#[test]
fn it_follows_a_simple_target() {
    let (mean, worst) = overlaps(&SIMPLE, &few(), 0..SIMPLE.len());
    assert!(mean > 0.75 && worst > 0.6, "mean overlap {mean}, worst {worst}");
}

#[test]
fn it_follows_with_all_patches_of_the_paper() {
    let config = TrackerConfig { particles: 60, ..TrackerConfig::preset("paper").unwrap() };
    let (mean, worst) = overlaps(&SIMPLE, &config, 0..16);
    assert!(mean > 0.75 && worst > 0.6, "mean overlap {mean}, worst {worst}");
}

#[test]
fn it_follows_a_target_behind_a_thin_tree() {
    let post = Some(Post { centre_x: 120.0, width: 12.0 });
    let film = Film::new(Scene::new(SceneConfig { post, ..SceneConfig::occluded() }));
    for seed in [1, 2, 3] {
        let config = TrackerConfig { seed, ..few() };
        let (mean, worst) = overlaps(&film, &config, 14..46);
        assert!(mean > 0.85 && worst > 0.7, "seed {seed}: mean overlap {mean}, worst {worst}");
    }
}

#[test]
fn visibility_falls_while_the_target_is_hidden() {
    let estimates = OCCLUDED.track(&few(), 0..36);
    let mean =
        |frames: &[Estimate]| frames.iter().map(|e| e.score).sum::<f64>() / frames.len() as f64;
    let (free, hidden) = (mean(&estimates[..8]), mean(&estimates[26..34]));
    assert!(hidden < 0.7 * free, "visibility {free} while free, {hidden} while half hidden");
}
