//! The methods under test.

use patchlock::{Method, TrackerConfig};

/// Every method, in a setting in which a frame takes milliseconds and everything happens that ever does.
pub fn all() -> Vec<TrackerConfig> {
    vec![patchwise()]
}

/// The preset `paper` with few particles and small patches.
pub fn patchwise() -> TrackerConfig {
    let mut config = TrackerConfig::preset("paper").unwrap();
    (config.patchwise.particles, config.patchwise.small_step) = (30, 8);
    config
}

/// The same settings with every learning step within a few frames.
pub fn learning_early(mut config: TrackerConfig) -> TrackerConfig {
    match config.method {
        Method::Patchwise => {
            let patchwise = &mut config.patchwise;
            (patchwise.update_interval, patchwise.small_update_interval) = (2, 5);
        }
    }
    config
}

/// A setting good enough to follow a target, in which a test takes seconds.
pub fn following(mut config: TrackerConfig) -> TrackerConfig {
    match config.method {
        Method::Patchwise => {
            (config.patchwise.particles, config.patchwise.small_step) = (150, 4);
        }
    }
    config
}

/// The setting that users run, and the number of frames after which each of its buffers has grown and each learning
/// step has happened.
pub fn as_used(method: Method) -> (TrackerConfig, usize) {
    match method {
        Method::Patchwise => (TrackerConfig::preset("paper").unwrap(), 60),
    }
}

#[test]
fn every_method_is_listed() {
    let listed: Vec<Method> = all().iter().map(|config| config.method).collect();
    assert_eq!(listed.len(), Method::WORDS.len());
    let words = listed.iter().map(|method| serde_json::to_value(method).unwrap());
    assert!(words.eq(Method::WORDS.iter().map(|&word| serde_json::json!(word))));
}
