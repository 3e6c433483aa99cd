//! The methods under test.

use patchlock::{Method, MultiSnapshot, Network, Preset, Snapshot, TrackerConfig};

/// Every method, with settings that take milliseconds per frame and still exercise everything.
pub fn all() -> Vec<TrackerConfig> {
    vec![robust(), paper(), network()]
}

/// Every method that follows a target as it comes: a network with made-up weights does not.
pub fn all_that_follow() -> Vec<TrackerConfig> {
    vec![robust(), paper()]
}

/// Every method that computes on the threads of its caller: the runtime of a network does not.
pub fn all_that_compute_here() -> Vec<TrackerConfig> {
    vec![robust(), paper()]
}

/// The preset `robust`, which is fast enough as it is.
pub fn robust() -> TrackerConfig {
    TrackerConfig::from(Preset::Robust)
}

/// The preset `paper` with few particles and small patches.
pub fn paper() -> TrackerConfig {
    with(Preset::Paper, &[("particles", 30), ("small_step", 8)])
}

/// The preset `network` with a small network of made-up weights.
pub fn network() -> TrackerConfig {
    let files: [&[u8]; 2] = [
        include_bytes!("../golden/network/nanotrack_backbone.onnx"),
        include_bytes!("../golden/network/nanotrack_head.onnx"),
    ];
    let mut config = TrackerConfig::from(Preset::Network);
    config.network = Some(Network::from_bytes(&files).unwrap());
    config
}

/// The preset `network` with a VitTrack of made-up weights, which takes longer.
pub fn vittrack() -> TrackerConfig {
    let file = include_bytes!("../golden/network/vittrack.onnx");
    let mut config = TrackerConfig::from(Preset::Network);
    config.network = Some(Network::from_bytes(&[file]).unwrap());
    config
}

/// The preset `robust` and the same network, as a committee.
pub fn robust_with_network() -> TrackerConfig {
    let mut config = robust();
    config.network = network().network;
    config
}

/// A snapshot that was taken with this configuration, with its network, which no snapshot holds.
pub fn complete(snapshot: Snapshot, config: &TrackerConfig) -> Snapshot {
    match &config.network {
        Some(network) => snapshot.with_network(network.clone()),
        None => snapshot,
    }
}

/// As [`complete`], of many targets.
pub fn complete_many(snapshot: MultiSnapshot, config: &TrackerConfig) -> MultiSnapshot {
    match &config.network {
        Some(network) => snapshot.with_network(network.clone()),
        None => snapshot,
    }
}

/// A preset with these whole numbers.
pub fn with(preset: Preset, numbers: &[(&str, usize)]) -> TrackerConfig {
    let mut config = TrackerConfig::from(preset);
    for &(name, number) in numbers {
        config.set(name, number).unwrap();
    }
    config
}

/// Whether the boxes depend on random numbers.
pub fn draws_boxes(method: &Method) -> bool {
    match method {
        Method::Paper(_) => true,
        // Only the templates that are replaced are drawn, which affects the visibility.
        Method::Robust(_) => false,
        Method::Network(_) => false,
    }
}

/// The same settings with every learning step within a few frames.
pub fn learning_early(mut config: TrackerConfig) -> TrackerConfig {
    if config.method.patches().is_some() {
        config.set("update_interval", 2).unwrap();
        config.set("small_update_interval", 5).unwrap();
    }
    config
}

/// Settings that are good enough to follow a target; a test takes seconds.
pub fn following(mut config: TrackerConfig) -> TrackerConfig {
    match &mut config.method {
        Method::Paper(paper) => (paper.particles, paper.patches.small_step) = (150, 4),
        Method::Robust(_) | Method::Network(_) => {}
    }
    config
}

/// The default settings, and the number of frames after which all buffers have grown and every
/// learning step has occurred.
pub fn default_settings(method: &Method) -> (TrackerConfig, usize) {
    match method {
        Method::Paper(_) => (TrackerConfig::from(Preset::Paper), 60),
        Method::Robust(_) => (robust(), 60),
        Method::Network(_) => (network(), 60),
    }
}

#[test]
fn every_method_is_listed() {
    let listed: Vec<&str> = all().iter().map(|config| config.method.name()).collect();
    assert_eq!(listed, Method::NAMES);
}
