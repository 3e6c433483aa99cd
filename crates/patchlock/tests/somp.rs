//! Compares the fast solver with the definition, on random and degenerate problems.

mod solvers;

use patchlock::numeric::instructions::Instructions;
use patchlock::patch_model::sparse::codes::{Code, CodeParams};
use patchlock::patch_model::sparse::dictionary::Dictionary;
use patchlock::patch_model::sparse::somp::batched;
use patchlock::patch_model::templates::shifts;
use patchlock::vision::{frame::GreyImage, patches::PatchGrid, warp::warp};
use patchlock::{BoundingBox, Frame, State};
use patchlock_scene::Scene;
use proptest::prelude::*;
use solvers::{PARAMS, Solver, Span, TIE, indices, residual, solve_all};
use std::sync::LazyLock;

/// This many random cases; failures are not written to a file.
fn cases(count: u32) -> ProptestConfig {
    ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(count) }
}

fn unit(mut v: Vec<f32>) -> Vec<f32> {
    patchlock::vision::patches::normalise(&mut v);
    v
}

/// Vectors like patches: positive and similar; some of them equal, nearly equal, or zero.
fn vectors(dim: usize, count: usize) -> impl Strategy<Value = Vec<f32>> {
    let vector = prop::collection::vec(0.0..1.0f32, dim);
    let kinds = prop::collection::vec((vector, 0..12u8, 0..64usize), count);
    kinds.prop_map(move |kinds| {
        let mut all: Vec<Vec<f32>> = Vec::new();
        for (vector, kind, other) in kinds {
            let earlier = all.get(other % all.len().max(1)).cloned();
            let blend = |earlier: Vec<f32>, amount: f32| {
                earlier.iter().zip(&vector).map(|(e, v)| e + amount * v).collect::<Vec<_>>()
            };
            all.push(match (kind, earlier) {
                (0, _) => vec![0.0; dim],
                (1, Some(earlier)) => earlier,
                (2, Some(earlier)) => unit(blend(earlier, 1e-5)),
                (3, Some(earlier)) => unit(blend(earlier, 1e-3)),
                (4..7, Some(earlier)) => unit(blend(earlier, 0.05)),
                _ => unit(vector.iter().map(|v| v + 0.5).collect()),
            });
        }
        all.concat()
    })
}

/// The atoms must be those of the definition, unless a step was a tie; then both alternatives must
/// have equal scores.
fn check(
    dictionary: &Dictionary,
    shared: &[f32],
    candidate: &[f32],
    params: &CodeParams,
    fast: &Code,
) {
    let slow = Solver::Definition.solve(dictionary, shared, candidate, params);
    let (fast_support, slow_support) = (indices(fast), indices(&slow));
    if fast_support == slow_support {
        for (a, b) in fast.coefficients().iter().zip(slow.coefficients()) {
            assert!((a - b).abs() <= 1e-6 * (1.0 + b.abs()), "{a} {b}");
        }
    } else {
        let signals: Vec<&[f32]> =
            shared.chunks_exact(dictionary.dim()).chain([candidate]).collect();
        let step = (0..).find(|&k| fast_support.get(k) != slow_support.get(k)).unwrap();
        let common = Span::new(dictionary, &fast_support[..step]);
        let score = |support: &[usize]| {
            support.get(step).map_or(0.0, |&atom| common.score(dictionary, &signals, atom))
        };
        let (a, b) = (score(&fast_support), score(&slow_support));
        assert!(
            (a - b).abs() <= TIE * b,
            "step {step}: {fast_support:?} scores {a}, {slow_support:?} scores {b}"
        );
    }
    let left = residual(dictionary, candidate, fast);
    for &k in &fast_support {
        let product: f64 =
            left.iter().zip(dictionary.atom(k)).map(|(l, &d)| l * f64::from(d)).sum();
        assert!(product.abs() < 1e-6, "the residual is not orthogonal to the support: {product}");
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn fast_equals_definition(
        atoms in vectors(16, 50),
        signals in vectors(16, 10),
        columns in 0..5usize,
        count in 1..7usize,
    ) {
        let dictionary = Dictionary::new(16, 5, atoms);
        let params = CodeParams { atoms: count, ..PARAMS };
        let (shared, candidates) = signals.split_at(columns * 16);
        let codes = solve_all(&dictionary, shared, candidates, &params);
        for (candidate, code) in candidates.chunks_exact(16).zip(&codes) {
            check(&dictionary, shared, candidate, &params, code);
        }
    }

    /// More atoms never increase the energy of the residual.
    #[test]
    fn the_residual_never_grows(atoms in vectors(16, 40), signals in vectors(16, 5)) {
        let dictionary = Dictionary::new(16, 5, atoms);
        let (shared, candidate) = signals.split_at(4 * 16);
        for solver in Solver::ALL {
            let mut before = f64::INFINITY;
            for count in 1..=8 {
                let params = CodeParams { atoms: count, ..PARAMS };
                let code = solver.solve(&dictionary, shared, candidate, &params);
                let left = solvers::energy(&residual(&dictionary, candidate, &code));
                prop_assert!(left <= before * (1.0 + 1e-9) + 1e-12);
                before = left;
            }
        }
    }
}

#[test]
fn more_candidates_than_a_block_get_their_own_codes() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let tree = (vectors(64, 170), vectors(64, 204)).new_tree(&mut runner).unwrap();
    let (atoms, signals) = proptest::strategy::ValueTree::current(&tree);
    let dictionary = Dictionary::new(64, 17, atoms);
    let (shared, candidates) = signals.split_at(4 * 64);
    let codes = solve_all(&dictionary, shared, candidates, &PARAMS);
    for (candidate, code) in candidates.chunks_exact(64).zip(&codes) {
        check(&dictionary, shared, candidate, &PARAMS, code);
    }
}

#[test]
fn nothing_to_explain_gives_an_empty_code() {
    let dictionary = Dictionary::new(4, 1, unit(vec![1.0, 2.0, 3.0, 4.0]));
    let zero = Dictionary::new(4, 1, vec![0.0; 4]);
    let none = Dictionary::new(4, 1, Vec::new());
    for solver in Solver::ALL {
        assert!(solver.solve(&dictionary, &[], &[0.0; 4], &PARAMS).support().is_empty());
        assert!(solver.solve(&zero, &[], dictionary.atom(0), &PARAMS).support().is_empty());
        assert!(solver.solve(&none, &[], dictionary.atom(0), &PARAMS).support().is_empty());
    }
}

/// The dictionary and buffer of a tracker on a rendered scene.
struct Setting {
    scene: Scene,
    grid: PatchGrid,
    dictionary: Dictionary,
    buffer: Vec<Vec<f32>>,
}

impl Setting {
    /// Templates of the first frame, and a buffer of the true boxes of four later frames.
    fn new(grid: PatchGrid) -> Self {
        let scene = Scene::occluded();
        let first = image(&scene, 0);
        let atoms = shifts(10)
            .into_iter()
            .flat_map(|[x, y]| grid.cut_all(&cut(&first, &scene, 0, [x, y, 0.0, 0.0])))
            .collect();
        let dictionary = Dictionary::new(grid.dim(), grid.locations(), atoms);
        let buffer = [2, 4, 6, 8].map(|k| cut(&image(&scene, k), &scene, k, [0.0; 4])).to_vec();
        Self { scene, grid, dictionary, buffer }
    }

    /// Compares the fast solver with the definition at one location of a candidate near the target
    /// of frame `k`.
    fn check(&self, k: usize, offset: [f64; 4], location: usize) {
        let candidate = cut(&image(&self.scene, k), &self.scene, k, offset);
        let patch = |template: &Vec<f32>| {
            let mut patch = vec![0.0; self.grid.dim()];
            self.grid.cut(template, location % self.grid.locations(), &mut patch);
            patch
        };
        let (shared, candidate) =
            (self.buffer.iter().flat_map(patch).collect::<Vec<_>>(), patch(&candidate));
        let code = solve_all(&self.dictionary, &shared, &candidate, &PARAMS)[0];
        check(&self.dictionary, &shared, &candidate, &PARAMS, &code);
    }
}

fn image(scene: &Scene, k: usize) -> GreyImage {
    let frame = scene.frame(k);
    let mut image = GreyImage::default();
    image.fill(&Frame::rgb8(&frame.rgb, frame.width, frame.height).unwrap()).unwrap();
    image
}

/// The normalised candidate at the true box of frame `k`, offset by this in x, y, scale and
/// rotation.
fn cut(image: &GreyImage, scene: &Scene, k: usize, [x, y, scale, rotation]: [f64; 4]) -> Vec<f32> {
    let [left, top, w, h] = scene.truth(k).bbox;
    let centre = BoundingBox { x: left + x, y: top + y, w, h }.centre();
    let mut state = State::from_box(centre, w, h, 32);
    state.scale += scale;
    state.rotation += rotation;
    let mut candidate = vec![0.0; 32 * 32];
    warp(image, &state.matrix(), 32, &mut candidate);
    unit(candidate)
}

/// Candidates as the motion model draws them, but spread wider, over frames in which the target is
/// visible, half hidden, and visible again.
fn candidates() -> impl Strategy<Value = (usize, [f64; 4], usize)> {
    let offset = (-12.0..12.0f64, -12.0..12.0f64, -0.1..0.1f64, -0.1..0.1f64);
    (1..60usize, offset.prop_map(|(x, y, s, r)| [x, y, s, r]), 0..169usize)
}

/// Candidates share nodes of the tree, and locations share working memory, as in the tracker.
#[test]
fn fast_equals_definition_where_candidates_share_nodes() {
    let Setting { scene, grid, dictionary, buffer } = &*SMALL;
    let image = image(scene, 12);
    let offset =
        |k: usize| [(k % 11) as f64 - 5.0, (k / 11) as f64 - 2.5, 0.01 * (k % 3) as f64, 0.0];
    let candidates: Vec<_> = (0..66).map(|k| cut(&image, scene, 12, offset(k))).collect();
    let mut scratches: Vec<_> = Instructions::available()
        .into_iter()
        .map(|(_, instructions)| batched::SolverScratch::with(instructions))
        .collect();
    for number in [83, 84, 97, 0] {
        let patches = |templates: &[Vec<f32>]| {
            let mut patches = vec![0.0; templates.len() * grid.dim()];
            grid.cut_each(templates.iter().map(Vec::as_slice), number, &mut patches);
            patches
        };
        let (shared, signals) = (patches(buffer), patches(&candidates));
        let location = batched::Location::new(dictionary, (number, &shared), &PARAMS);
        let mut found: Vec<Vec<Code>> = Vec::new();
        for scratch in &mut scratches {
            let mut codes = vec![Code::default(); candidates.len()];
            batched::solve(dictionary, &location, &signals, &PARAMS, scratch, &mut codes);
            found.push(codes);
        }
        assert!(found.iter().all(|codes| *codes == found[0]));
        for (signal, code) in signals.chunks_exact(grid.dim()).zip(&found[0]) {
            check(dictionary, &shared, signal, &PARAMS, code);
        }
    }
}

static SMALL: LazyLock<Setting> = LazyLock::new(|| Setting::new(PatchGrid::new(32, 8, 2, false)));
static LARGE: LazyLock<Setting> = LazyLock::new(|| Setting::new(PatchGrid::new(32, 16, 8, false)));

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn fast_equals_definition_on_small_patches((k, offset, location) in candidates()) {
        SMALL.check(k, offset, location);
    }

    #[test]
    fn fast_equals_definition_on_large_patches((k, offset, location) in candidates()) {
        LARGE.check(k, offset, location);
    }
}
