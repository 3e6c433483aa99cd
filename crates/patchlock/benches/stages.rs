//! The time of each stage of a frame, on the rendered scene: `cargo bench -p patchlock --bench
//! stages`.

#[path = "../tests/solvers/definition.rs"]
mod definition;
#[allow(dead_code)] // each benchmark uses a part of it
mod setup;

use divan::{Bencher, black_box};
use patchlock::patch_model::model::{PatchErrorScratch, PatchModel};
use patchlock::patch_model::sparse::codes::Code;
use patchlock::patch_model::sparse::somp::batched;
use patchlock::vision::frame::GreyImage;
use patchlock::vision::warp;
use patchlock::{PaperConfig, Preset, State, Tracker, Visibility};
use patchlock_scene::{Scene, SceneFrame};
use setup::{Bench, LOCATION, PARAMS, PARTICLES, SIDE, small, truth, view};

fn main() {
    divan::main();
}

/// Conversion from colour to grey.
#[divan::bench]
fn grey(bencher: Bencher<'_, '_>) {
    let (frame, mut image) = (Scene::demo().frame(0), GreyImage::default());
    bencher.bench_local(|| image.fill(&view(black_box(&frame))));
}

/// Warps of all candidates of a frame, on one thread.
#[divan::bench]
fn warp_candidates(bencher: Bencher<'_, '_>) {
    let bench = Bench::new();
    let mut out = vec![0.0; SIDE * SIDE];
    bencher.bench_local(|| {
        for state in &bench.particles {
            warp::warp(&bench.image, &state.matrix(), SIDE, black_box(&mut out));
        }
    });
}

/// The small dictionary: patches, transposed atoms and Gram matrix.
#[divan::bench]
fn small_dictionary(bencher: Bencher<'_, '_>) {
    let bench = Bench::new();
    bencher.bench_local(|| bench.dictionary(&small()));
}

/// Codes of all candidates at one of the 169 small locations.
#[divan::bench]
fn codes_of_a_location(bencher: Bencher<'_, '_>) {
    let (dictionary, shared, patches) = Bench::new().problems();
    let mut codes = vec![Code::default(); PARTICLES];
    let mut scratch = batched::SolverScratch::default();
    let location = batched::Location::new(&dictionary, (LOCATION, &shared), &PARAMS);
    bencher.bench_local(|| {
        batched::solve(&dictionary, &location, &patches, &PARAMS, &mut scratch, &mut codes);
        codes[0]
    });
}

/// The code of one candidate at this location, by the definition.
#[divan::bench(sample_count = 10)]
fn definition_of_one_code(bencher: Bencher<'_, '_>) {
    let (dictionary, shared, patches) = Bench::new().problems();
    let candidate = &patches[..dictionary.dim()];
    bencher.bench_local(|| definition::solve(&dictionary, &shared, candidate, &PARAMS));
}

/// The visibility of one candidate, with small patches this many samples apart (2 in the paper), on
/// one thread.
#[divan::bench(args = [2, 4])]
fn look(bencher: Bencher<'_, '_>, small_step: usize) {
    let mut config = PaperConfig::default();
    config.patches.small_step = small_step;
    let (bench, params) = (Bench::new(), config.patch_params());
    let state = bench.first();
    let model = PatchModel::begin(&bench.image, &state.matrix(), params);
    let near = State { x: state.x + 0.4, y: state.y - 0.3, ..state };
    let candidate = setup::candidate(&bench.image, &near);
    let (mut scratch, mut visibility) = (PatchErrorScratch::default(), Visibility::default());
    bencher.bench_local(|| {
        let errors = model.look(black_box(&candidate), &mut scratch);
        errors.visibility(params.likelihood.epsilon, &mut visibility);
    });
}

/// Updates on successive frames of the scene, with the paper's settings, on all threads.
#[divan::bench(sample_count = 20)]
fn update(bencher: Bencher<'_, '_>) {
    let scene = Scene::demo();
    let frames: Vec<SceneFrame> = (0..30).map(|k| scene.frame(k)).collect();
    let mut tracker = Tracker::start(Preset::Paper, &view(&frames[0]), truth(&scene)).unwrap();
    let mut next = 1;
    bencher.bench_local(|| {
        // Forwards and backwards, so that the target never jumps.
        let round = next % (2 * (frames.len() - 1));
        let k = round.min(2 * (frames.len() - 1) - round);
        next += 1;
        tracker.update(&view(&frames[k])).unwrap().score
    });
}
