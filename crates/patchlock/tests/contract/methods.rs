//! The methods under test.

use patchlock::{Method, TrackerConfig};

/// Every method, with settings that take milliseconds per frame and still exercise everything.
pub fn all() -> Vec<TrackerConfig> {
    vec![patchwise(), robust()]
}

/// The preset `paper` with few particles and small patches.
pub fn patchwise() -> TrackerConfig {
    let mut config = TrackerConfig::preset("paper").unwrap();
    (config.patchwise.particles, config.patchwise.small_step) = (30, 8);
    config
}

/// The preset `robust`, which is fast enough as it is.
pub fn robust() -> TrackerConfig {
    TrackerConfig::preset("robust").unwrap()
}

/// Whether the boxes depend on random numbers.
pub fn draws_boxes(method: Method) -> bool {
    match method {
        Method::Patchwise => true,
        // Only the templates that are replaced are drawn, which affects the visibility.
        Method::Robust => false,
    }
}

/// The same settings with every learning step within a few frames.
pub fn learning_early(mut config: TrackerConfig) -> TrackerConfig {
    match config.method {
        Method::Patchwise | Method::Robust => {
            let patchwise = &mut config.patchwise;
            (patchwise.update_interval, patchwise.small_update_interval) = (2, 5);
        }
    }
    config
}

/// Settings that are good enough to follow a target; a test takes seconds.
pub fn following(mut config: TrackerConfig) -> TrackerConfig {
    match config.method {
        Method::Patchwise => {
            (config.patchwise.particles, config.patchwise.small_step) = (150, 4);
        }
        Method::Robust => {}
    }
    config
}

/// The default settings, and the number of frames after which all buffers have grown and every learning step
/// has occurred.
pub fn default_settings(method: Method) -> (TrackerConfig, usize) {
    match method {
        Method::Patchwise => (TrackerConfig::preset("paper").unwrap(), 60),
        Method::Robust => (robust(), 60),
    }
}

#[test]
fn every_method_is_listed() {
    let listed: Vec<Method> = all().iter().map(|config| config.method).collect();
    assert_eq!(listed.len(), Method::WORDS.len());
    let words = listed.iter().map(|method| serde_json::to_value(method).unwrap());
    assert!(words.eq(Method::WORDS.iter().map(|&word| serde_json::json!(word))));
}
