//! What the built-in runtime computes, beside what onnxruntime computed: with the made-up networks
//! in `tests/golden/network`, and with real ones. Programs in `tools/oracles` wrote the files.

use super::graph::CheckedGraph;
use super::program::{Program, ProgramScratch};
use super::{Network, Runtime};
use crate::{BoundingBox, Frame, FrameView, Preset, Tracker, TrackerConfig};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The largest difference of an output of the made-up networks, relative to it where it is above 1.
const MADE_UP: f32 = 1e-5;
/// The largest difference of an output of a real network.
const REAL: f32 = 1e-3;

fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> T {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A value of a network by its name, with its shape.
struct Value {
    name: String,
    shape: Vec<usize>,
    samples: Vec<f32>,
}

/// The outputs of a network for these inputs.
fn run(file: &Path, inputs: &[Value]) -> Vec<Value> {
    let graph = CheckedGraph::read(&bytes(file)).unwrap();
    let given = graph.inputs.iter().map(|input| {
        let given = inputs.iter().find(|given| given.name == input.name);
        given.unwrap_or_else(|| panic!("there is no input {}", input.name))
    });
    let given: Vec<&Value> = given.collect();
    let shapes: Vec<&[usize]> = given.iter().map(|value| &*value.shape).collect();
    let samples: Vec<&[f32]> = given.iter().map(|value| &*value.samples).collect();
    let program = Program::new(&graph, &shapes, &Runtime::built_in()).unwrap();
    let mut outputs = vec![Vec::new(); graph.outputs.len()];
    program.run(&samples, &mut ProgramScratch::default(), &mut outputs).unwrap();
    let named = graph.outputs.iter().zip(program.output_shapes()).zip(outputs);
    named
        .map(|((output, shape), samples)| Value {
            name: output.name.clone(),
            shape: shape.clone(),
            samples,
        })
        .collect()
}

/// The largest difference of two lists of equal length.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().chain(b).all(|number| number.is_finite()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[derive(Deserialize)]
struct SyntheticNetwork {
    calls: Vec<SyntheticCall>,
}

#[derive(Deserialize)]
struct SyntheticCall {
    network: String,
    inputs: BTreeMap<String, Vec<usize>>,
    scale: f64,
    offset: f64,
    outputs: Vec<SyntheticOutput>,
}

/// An output: its sum, and samples that are spread evenly over it.
#[derive(Deserialize)]
struct SyntheticOutput {
    name: String,
    shape: Vec<usize>,
    sum: f64,
    samples: Vec<f32>,
}

impl SyntheticCall {
    /// An input of this shape, `[1, C, H, W]`.
    fn input(&self, name: &str, shape: &[usize]) -> Value {
        let &[1, channels, height, width] = shape else { panic!("{shape:?}") };
        let mut samples = Vec::new();
        for (c, y, x) in (0..channels)
            .flat_map(|c| (0..height).flat_map(move |y| (0..width).map(move |x| (c, y, x))))
        {
            let whole = (31 * c + 7 * y + 13 * x) % 256;
            samples.push((whole as f64 * self.scale + self.offset) as f32);
        }
        Value { name: name.to_owned(), shape: shape.to_vec(), samples }
    }
}

#[test]
fn made_up_networks_compute_what_onnxruntime_does() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/network");
    let file: SyntheticNetwork = read(&folder.join("network.json"));
    assert_eq!(file.calls.len(), 4);
    for call in file.calls {
        let inputs: Vec<Value> =
            call.inputs.iter().map(|(name, shape)| call.input(name, shape)).collect();
        for (made, wanted) in run(&folder.join(&call.network), &inputs).iter().zip(&call.outputs) {
            assert_eq!((&made.name, &made.shape), (&wanted.name, &wanted.shape));
            let (length, count) = (made.samples.len(), wanted.samples.len());
            let chosen: Vec<f32> = (0..count).map(|k| made.samples[k * length / count]).collect();
            let sum: f64 = made.samples.iter().copied().map(f64::from).sum();
            let mean = (sum - wanted.sum).abs() / length as f64;
            let scale = wanted.samples.iter().fold(1.0, |scale: f32, value| scale.max(value.abs()));
            let difference = difference(&chosen, &wanted.samples) / scale;
            println!("{} {}: {difference:e}, mean {mean:e}", call.network, made.name);
            assert!(difference < MADE_UP && mean < f64::from(MADE_UP * scale));
        }
    }
}

/// What `tools/oracles/network_check.py` wrote.
#[derive(Deserialize)]
struct Index {
    targets: Vec<Target>,
    calls: Vec<Call>,
    tracks: Vec<Track>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
    width: usize,
    height: usize,
    frames: Vec<PathBuf>,
}

#[derive(Deserialize)]
struct Call {
    network: PathBuf,
    inputs: Vec<StoredTensor>,
    outputs: Vec<StoredTensor>,
}

/// A tensor in a file of floats.
#[derive(Deserialize)]
struct StoredTensor {
    name: String,
    shape: Vec<usize>,
    file: PathBuf,
}

#[derive(Deserialize)]
struct Track {
    networks: Vec<PathBuf>,
    target: usize,
    first: [f64; 4],
    boxes: Vec<[f64; 4]>,
    scores: Vec<f64>,
}

impl StoredTensor {
    fn load(&self, folder: &Path) -> Value {
        let bytes = bytes(&folder.join(&self.file));
        let samples = bytes.as_chunks().0.iter().map(|&sample| f32::from_le_bytes(sample));
        let (name, shape) = (self.name.clone(), self.shape.clone());
        Value { name, shape, samples: samples.collect() }
    }
}

/// The folder that `tools/python/check.sh` has `network_check.py` write.
fn checked() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/network-check")
}

/// `tools/python/network.sh` writes the files and runs this.
#[test]
#[ignore = "needs files that tools/python/network.sh writes"]
fn real_networks_compute_what_onnxruntime_does() {
    let folder = checked();
    let index: Index = read(&folder.join("index.json"));
    assert!(!index.calls.is_empty());
    let mut worst = 0.0_f32;
    for call in &index.calls {
        let inputs: Vec<Value> = call.inputs.iter().map(|input| input.load(&folder)).collect();
        let made = run(&call.network, &inputs);
        assert_eq!(made.len(), call.outputs.len());
        for (made, wanted) in made.iter().zip(&call.outputs) {
            let wanted = wanted.load(&folder);
            assert_eq!((&made.name, &made.shape), (&wanted.name, &wanted.shape));
            let difference = difference(&made.samples, &wanted.samples);
            worst = worst.max(difference);
            let place = format!("{} {}", call.network.display(), made.name);
            assert!(difference < REAL, "{place}: {difference:e}");
        }
    }
    println!("{} calls of networks: the largest difference is {worst:e}", index.calls.len());
}

/// A track may differ by rounding alone, as long as the same cells are chosen.
#[test]
#[ignore = "needs files that tools/python/network.sh writes"]
fn real_networks_follow_as_the_loop_with_onnxruntime_does() {
    let folder = checked();
    let index: Index = read(&folder.join("index.json"));
    let (mut worst_box, mut worst_score) = (0.0_f64, 0.0_f64);
    for track in &index.tracks {
        let Target { name, width, height, frames } = &index.targets[track.target];
        let files: Vec<Vec<u8>> = track.networks.iter().map(|path| bytes(path)).collect();
        let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
        let mut config = TrackerConfig::from(Preset::Network);
        config.network = Some(Network::from_bytes(&files).unwrap());
        let load = |k: usize| bytes(&folder.join(&frames[k]));
        let [x, y, w, h] = track.first;
        let first = load(0);
        let first = Frame::rgb8(&first, *width, *height).unwrap();
        let mut tracker = Tracker::start(config, &first, BoundingBox { x, y, w, h }).unwrap();
        for (k, (wanted, score)) in (1..).zip(track.boxes.iter().zip(&track.scores)) {
            let pixels = load(k);
            let frame = Frame::rgb8(&pixels, *width, *height).unwrap();
            let mut seen = 0.0;
            let mut observer = |view: &FrameView<'_>| {
                let FrameView::Network(view) = view else { panic!("another method's view") };
                seen = view.scores[view.chosen];
            };
            let estimate = tracker.update_observed(&frame, &mut observer).unwrap();
            let BoundingBox { x, y, w, h } = estimate.bbox;
            let apart = [x, y, w, h].into_iter().zip(wanted).map(|(a, b)| (a - b).abs());
            let apart = apart.fold(0.0, f64::max);
            let of_score = (seen - score).abs();
            assert!(apart < 0.05 && of_score < 1e-3, "{name} {k}: {apart} pixels, {of_score}");
            (worst_box, worst_score) = (worst_box.max(apart), worst_score.max(of_score));
        }
    }
    println!("{} tracks: {worst_box:e} pixels, score {worst_score:e}", index.tracks.len());
}
