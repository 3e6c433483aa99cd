//! The methods under test.

use patchlock::{Method, MultiSnapshot, Network, NetworkUse, Preset, Snapshot, TrackerConfig};

/// Settings in which a preset is tested: its name, that of the setting, and the value.
type Exceptions = &'static [(&'static str, &'static str, usize)];

/// A frame takes milliseconds, and everything is still exercised.
const QUICK: Exceptions = &[("paper", "particles", 30), ("paper", "small_step", 8)];

/// Good enough to follow a target; a test takes seconds.
const FOLLOWING: Exceptions = &[("paper", "particles", 150), ("paper", "small_step", 4)];

/// Every method, with settings that take milliseconds per frame and still exercise everything.
pub fn all() -> Vec<TrackerConfig> {
    Preset::ALL.map(quick).into()
}

/// Every method that follows a target as it comes, and computes on the threads of its caller: a
/// network with made-up weights does neither.
pub fn all_without_network() -> Vec<TrackerConfig> {
    all().into_iter().filter(|config| config.network.is_none()).collect()
}

/// The preset of this method, with settings that take milliseconds per frame.
pub fn quick_of(method: &Method) -> TrackerConfig {
    all().into_iter().find(|config| config.method.name() == method.name()).unwrap()
}

fn quick(preset: Preset) -> TrackerConfig {
    changed(begun(preset), QUICK)
}

/// The default settings of a preset, with a small network of made-up weights if it needs one.
pub fn begun(preset: Preset) -> TrackerConfig {
    let mut config = TrackerConfig::from(preset);
    if preset.info().network == NetworkUse::Required {
        let files: [&[u8]; 2] = [
            include_bytes!("../golden/network/nanotrack_backbone.onnx"),
            include_bytes!("../golden/network/nanotrack_head.onnx"),
        ];
        config.network = Some(Network::from_bytes(&files).unwrap());
    }
    config
}

/// The same settings, with those for its method.
fn changed(mut config: TrackerConfig, exceptions: Exceptions) -> TrackerConfig {
    let method = config.method.name();
    for &(_, name, number) in exceptions.iter().filter(|(of, ..)| *of == method) {
        config.set(name, number).unwrap();
    }
    config
}

/// The preset `robust`, which is fast enough as it is.
pub fn robust() -> TrackerConfig {
    quick(Preset::Robust)
}

/// The preset `paper` with few particles and small patches.
pub fn paper() -> TrackerConfig {
    quick(Preset::Paper)
}

/// The preset `network` with a small network of made-up weights.
pub fn network() -> TrackerConfig {
    quick(Preset::Network)
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
    // With `robust`, only the templates that are replaced are drawn, which affects the visibility.
    method.name() == "paper"
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
pub fn following(config: TrackerConfig) -> TrackerConfig {
    changed(config, FOLLOWING)
}

#[test]
fn every_method_is_listed() {
    let listed: Vec<&str> = all().iter().map(|config| config.method.name()).collect();
    assert_eq!(listed, Method::NAMES);
}
