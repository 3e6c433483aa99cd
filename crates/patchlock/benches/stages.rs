//! What the stages of a frame cost, on the rendered scene: `cargo bench -p patchlock`.

use divan::{Bencher, black_box};
use patchlock::appearance::{buffer, templates};
use patchlock::config::Selection;
use patchlock::filter::{motion::Motion, particles, state::State};
use patchlock::sparse::codes::{Code, CodeRules};
use patchlock::sparse::dictionary::Dictionary;
use patchlock::sparse::somp::{batched, definition};
use patchlock::vision::frame::GreyImage;
use patchlock::vision::patches::{PatchGrid, normalise};
use patchlock::vision::warp;
use patchlock::{BoundingBox, Frame, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneFrame};
use rand_pcg::Pcg64;

const SIDE: usize = 32;
const PARTICLES: usize = 650;
/// The middle of the small scale's 13 x 13 locations.
const LOCATION: usize = 84;
const RULES: CodeRules = CodeRules {
    atoms: 4,
    selection: Selection::OrderRecursive,
    min_residual: 1e-6,
    stop_energy: 0.0,
};

fn main() {
    divan::main();
}

/// A frame of the rendered scene and everything that the paper's setting makes of it.
struct Bench {
    image: GreyImage,
    particles: Vec<State>,
    templates: Vec<Vec<f32>>,
}

impl Bench {
    fn new() -> Self {
        let scene = Scene::demo();
        let mut image = GreyImage::default();
        image.fill(&view(&scene.frame(0))).unwrap();
        let first = truth(&scene);
        let state = State::from_box(first.centre(), first.w, first.h, SIDE);
        let motion = Motion { sigma: [6.0, 6.0, 0.02, 0.002, 0.002, 0.0], relative_scale: false };
        let mut drawn = Vec::new();
        particles::draw(&mut drawn, PARTICLES, &state, &motion, &mut Pcg64::new(7, 1));
        let templates = templates::shifts(10)
            .into_iter()
            .map(|[dx, dy]| {
                let state = State { x: state.x + dx, y: state.y + dy, ..state };
                candidate(&image, &state)
            })
            .collect();
        Self { image, particles: drawn, templates }
    }

    fn candidates(&self) -> Vec<f32> {
        self.particles.iter().flat_map(|state| candidate(&self.image, state)).collect()
    }

    fn dictionary(&self, grid: &PatchGrid) -> Dictionary {
        let atoms = self.templates.iter().flat_map(|template| grid.cut_all(template)).collect();
        Dictionary::new(grid.dim(), grid.locations(), atoms)
    }

    /// The patches of these templates at [`LOCATION`].
    fn patches<'a>(&self, grid: &PatchGrid, of: impl Iterator<Item = &'a [f32]>) -> Vec<f32> {
        of.flat_map(|template| {
            let mut patch = vec![0.0; grid.dim()];
            grid.cut(template, LOCATION, &mut patch);
            patch
        })
        .collect()
    }

    /// Dictionary, the buffer's patches and the candidates' patches of one location of the small scale.
    fn problems(&self) -> (Dictionary, Vec<f32>, Vec<f32>) {
        let grid = small();
        let buffer = buffer::begin(&self.templates, 4);
        let shared = self.patches(&grid, buffer.iter().map(Vec::as_slice));
        let candidates = self.candidates();
        let patches = self.patches(&grid, candidates.chunks_exact(SIDE * SIDE));
        (self.dictionary(&grid), shared, patches)
    }
}

fn small() -> PatchGrid {
    PatchGrid::new(SIDE, 8, 2, false)
}

fn view(frame: &SceneFrame) -> Frame<'_> {
    Frame::rgb8(&frame.rgb, frame.width, frame.height).unwrap()
}

fn truth(scene: &Scene) -> BoundingBox {
    let [x, y, w, h] = scene.truth(0).bbox;
    BoundingBox { x, y, w, h }
}

fn candidate(image: &GreyImage, state: &State) -> Vec<f32> {
    let mut out = vec![0.0; SIDE * SIDE];
    warp::warp(image, &state.matrix(), SIDE, &mut out);
    normalise(&mut out);
    out
}

/// Colour to grey.
#[divan::bench]
fn grey(bencher: Bencher<'_, '_>) {
    let (frame, mut image) = (Scene::demo().frame(0), GreyImage::default());
    bencher.bench_local(|| image.fill(&view(black_box(&frame))));
}

/// All candidates of a frame, on one thread.
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

/// All candidates of one of the 169 small locations.
#[divan::bench]
fn codes_of_a_location(bencher: Bencher<'_, '_>) {
    let (dictionary, shared, patches) = Bench::new().problems();
    let mut codes = vec![Code::default(); PARTICLES];
    let mut scratch = batched::Scratch::default();
    let mut location = batched::Location::default();
    location.fill(&dictionary, (LOCATION, &shared), &RULES);
    bencher.bench_local(|| {
        batched::solve(&dictionary, &location, &patches, &RULES, &mut scratch, &mut codes);
        codes[0]
    });
}

/// One candidate of it by the definition.
#[divan::bench(sample_count = 10)]
fn definition_of_one_code(bencher: Bencher<'_, '_>) {
    let (dictionary, shared, patches) = Bench::new().problems();
    let candidate = &patches[..dictionary.dim()];
    bencher.bench_local(|| definition::solve(&dictionary, &shared, candidate, &RULES));
}

/// One frame after another of the scene, in the paper's setting, on all threads.
#[divan::bench(sample_count = 20)]
fn update(bencher: Bencher<'_, '_>) {
    let scene = Scene::demo();
    let frames: Vec<SceneFrame> = (0..30).map(|k| scene.frame(k)).collect();
    let mut tracker = Tracker::new(TrackerConfig::preset("paper").unwrap()).unwrap();
    tracker.init(&view(&frames[0]), truth(&scene)).unwrap();
    let mut next = 1;
    bencher.bench_local(|| {
        // Back and forth, so that the target never jumps.
        let round = next % (2 * (frames.len() - 1));
        let k = round.min(2 * (frames.len() - 1) - round);
        next += 1;
        tracker.update(&view(&frames[k])).unwrap()
    });
}
