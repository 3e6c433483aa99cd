//! Runs each stage once, for instruction counters: `instructions STAGE` runs the stage inside
//! [`counted`], the only function whose instructions should be counted. Without arguments it runs
//! all stages, to check that they work. `benchmarks/instructions.py` does the counting.

#[allow(dead_code)] // each benchmark uses a part of it
mod setup;

use patchlock::patch_model::buffer;
use patchlock::patch_model::scale::{CodingScratch, Scale, ScaleParams};
use patchlock::patch_model::sparse::dictionary::DictionaryScratch;
use patchlock::patch_model::sparse::somp::batched::BLOCK;
use patchlock::vision::patches::{PatchGrid, normalise};
use patchlock::vision::warp::warp;
use patchlock::{PaperConfig, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneFrame};
use setup::{Bench, PARAMS, PARTICLES, SIDE, truth, view};
use std::hint::black_box;

/// The centre of the small scale's 7 x 7 locations. They are twice as far apart as in the paper,
/// because programs run about fifty times slower while instructions are counted.
const LOCATION: usize = 24;

fn small() -> PatchGrid {
    PatchGrid::new(SIDE, 8, 4, false)
}

/// The stages by name.
const STAGES: [(&str, fn()); 7] = [
    ("warp", warp_candidates),
    ("cut", cut_a_location),
    ("codes", codes_of_a_location),
    ("dictionary", small_dictionary),
    ("update", update),
    ("learn", learn),
    ("robust", robust),
];

fn main() {
    let asked: Vec<String> =
        std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    // A single thread, so that no work is done outside [`counted`]'s thread.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for (name, stage) in STAGES {
        if asked.is_empty() || asked.iter().any(|word| word == name) {
            pool.install(stage);
            println!("{name}");
        }
    }
    let unknown: Vec<_> =
        asked.iter().filter(|word| STAGES.iter().all(|(name, _)| name != word)).collect();
    assert!(unknown.is_empty(), "unknown stages: {unknown:?}");
}

/// The instructions of this function are counted.
#[inline(never)]
fn counted(stage: &mut dyn FnMut()) {
    stage();
    black_box(());
}

/// All candidates of a frame, warped and normalised.
fn warp_candidates() {
    let (bench, mut out) = (Bench::new(), vec![0.0; SIDE * SIDE]);
    counted(&mut || {
        for state in &bench.particles {
            warp(&bench.image, &state.matrix(), SIDE, &mut out);
            normalise(black_box(&mut out));
        }
    });
}

/// The patches of all candidates at one small location.
fn cut_a_location() {
    let (grid, candidates) = (small(), Bench::new().candidates());
    let mut out = vec![0.0; PARTICLES * grid.dim()];
    counted(&mut || {
        grid.cut_each(candidates.chunks_exact(SIDE * SIDE), LOCATION, black_box(&mut out));
    });
}

fn scale(bench: &Bench) -> Scale {
    let params =
        ScaleParams { codes: PARAMS, beta: 0.8, position_weights: true, keeps_products: true };
    Scale::new(small(), params, &bench.templates, &buffer::begin(&bench.templates, 4))
}

/// Codes and features of all candidates at one small location.
fn codes_of_a_location() {
    let bench = Bench::new();
    let (scale, candidates) = (scale(&bench), bench.candidates());
    let (mut scratch, mut found) = (CodingScratch::default(), vec![Default::default(); BLOCK]);
    let mut code_all = || {
        for block in candidates.chunks(BLOCK * SIDE * SIDE) {
            let block = block.chunks_exact(SIDE * SIDE);
            let found = &mut found[..block.len()];
            scale.code_block(LOCATION, block, &mut scratch, found);
        }
    };
    code_all();
    counted(&mut code_all);
}

/// The small dictionary, the buffer's patches, and the data that follow from both for each
/// location.
fn small_dictionary() {
    let bench = Bench::new();
    let (mut scale, buffer) = (scale(&bench), buffer::begin(&bench.templates, 4));
    let mut scratch = DictionaryScratch::default();
    counted(&mut || scale.learn(Some(&bench.templates), Some(&buffer), &mut scratch));
}

/// An update without learning: frame 2.
fn update() {
    frame(paper(), &Scene::simple(), 2);
}

/// An update with a new template, large dictionary and buffer: frame 5.
fn learn() {
    frame(paper(), &Scene::simple(), 5);
}

/// A frame of the method `robust`, in colour, with the largest patch. No template is replaced.
fn robust() {
    frame(TrackerConfig::default(), &Scene::demo(), 3);
}

fn paper() -> TrackerConfig {
    let mut paper = PaperConfig::default();
    (paper.particles, paper.patches.small_step) = (200, 4);
    paper.into()
}

fn frame(config: TrackerConfig, scene: &Scene, number: usize) {
    let frames: Vec<SceneFrame> = (0..=number).map(|k| scene.frame(k)).collect();
    let mut tracker = Tracker::start(config, &view(&frames[0]), truth(scene)).unwrap();
    for frame in &frames[1..number] {
        tracker.update(&view(frame)).unwrap();
    }
    counted(&mut || {
        tracker.update(&view(&frames[number])).unwrap();
    });
}
