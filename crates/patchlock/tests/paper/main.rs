//! The paper's tracker: requirements for this method only.

#[allow(dead_code)]
#[path = "../contract/methods.rs"]
mod methods;
mod model;
mod observer;
#[allow(dead_code)]
#[path = "../contract/sequence.rs"]
mod sequence;
mod snapshot;

use patchlock::{Preset, TrackerConfig};
use sequence::SIMPLE;

#[test]
fn it_follows_with_all_patches_of_the_paper() {
    let mut config = TrackerConfig::from(Preset::Paper);
    config.set("particles", 60).unwrap();
    let estimates = SIMPLE.track(&config, 0..16);
    let overlaps = (1..).zip(&estimates).map(|(k, e)| e.bbox.overlap(&SIMPLE.truth(k)));
    let (sum, worst) = overlaps.fold((0.0, 1.0f64), |(sum, worst), o| (sum + o, worst.min(o)));
    let mean = sum / estimates.len() as f64;
    assert!(mean > 0.75 && worst > 0.6, "mean overlap {mean}, worst {worst}");
}
