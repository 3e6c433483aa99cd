use super::super::vectors::panel_index;
use super::*;
use crate::numeric::instructions::{Instructions, dispatch};
use proptest::prelude::*;
use proptest::strategy::ValueTree;

const DIM: usize = 16;
const PARAMS: CodeParams = CodeParams { atoms: MAX_ATOMS, min_residual: 1e-6 };

/// Positive, similar vectors with this much texture, like patches; every third one nearly
/// equals the one before it.
fn vectors(count: usize, texture: f32) -> impl Strategy<Value = Vec<f32>> {
    let rows = prop::collection::vec(prop::collection::vec(-0.5..0.5f32, DIM), count);
    rows.prop_map(move |rows| {
        let mut all: Vec<Vec<f32>> = Vec::new();
        for (k, mut row) in rows.into_iter().enumerate() {
            row.iter_mut().for_each(|v| *v = 0.6 + texture * *v);
            if k % 3 == 2 {
                row.iter_mut()
                    .zip(&all[k - 1])
                    .for_each(|(v, near)| *v = near + 0.004 * texture * *v);
            }
            let norm = row.iter().map(|v| v * v).sum::<f32>().sqrt();
            all.push(row.into_iter().map(|v| v / norm).collect());
        }
        all.concat()
    })
}

/// Projects chosen atoms out of vectors by the Gram-Schmidt process in `f64`.
#[derive(Default)]
struct Truth(Vec<Vec<f64>>);

impl Truth {
    fn residual(&self, vector: &[f32]) -> Vec<f64> {
        let mut left: Vec<f64> = vector.iter().map(|&v| f64::from(v)).collect();
        for q in self.0.iter().chain(&self.0) {
            let projection = dot(q, &left);
            left.iter_mut().zip(q).for_each(|(l, q)| *l -= projection * q);
        }
        left
    }

    fn add(&mut self, atom: &[f32]) {
        let mut direction = self.residual(atom);
        let norm = dot(&direction, &direction).sqrt();
        direction.iter_mut().for_each(|v| *v /= norm);
        self.0.push(direction);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Chooses these atoms in order, as far as they are eligible, and compares each node's rows
/// with the truth. Returns the error bounds of the nodes.
struct RowDescent<'a> {
    dictionary: &'a Dictionary,
    shared: &'a [f32],
    path: &'a [usize],
}

impl RowDescent<'_> {
    fn descend<S: Simd>(&self, simd: S) -> Vec<Errors> {
        let Self { dictionary, shared, path } = *self;
        let products = dictionary.products().unwrap();
        let gram = Gram::Kept(&products.gram);
        let atoms = Atoms { dictionary, panels: &products.panels, gram };
        let (mut root, mut nodes) = (Node::default(), Vec::new());
        root.fill_root(simd, shared);
        let mut rows = vec![Rows::default()];
        let mut wide = Vec::new();
        widen(&mut wide, &products.panels);
        rows[0].fill_root(simd, (dictionary, &wide), &root, &PARAMS);
        let mut truth = Truth::default();
        self.check(&rows[0], &truth);
        for &atom in path {
            let left = truth.residual(dictionary.atom(atom));
            if dot(&left, &left) < PARAMS.min_residual {
                continue;
            }
            let mut node = Node::default();
            node.fill(simd, dictionary, Path { root: &root, nodes: &nodes }, atom);
            nodes.push(node);
            truth.add(dictionary.atom(atom));
            let (path, mut new) = (Path { root: &root, nodes: &nodes }, Rows::default());
            let above = (&rows[0], &rows[1..]);
            if nodes.len() == 1 {
                let tiles = new.child_tiles::<S, true>(simd, atoms, path, above, &PARAMS).0;
                make_tiles(simd, dictionary, tiles);
                new.tighten_max_residual(simd);
            } else {
                let tiles = new.child_tiles::<S, false>(simd, atoms, path, above, &PARAMS).0;
                make_tiles(simd, dictionary, tiles);
            }
            self.check(&new, &truth);
            rows.push(new);
        }
        rows.into_iter().map(|rows| rows.errors).collect()
    }

    fn check(&self, rows: &Rows, truth: &Truth) {
        for k in 0..self.dictionary.len() {
            let weight = rows.weights.get(k).copied().unwrap_or_default();
            let less = if truth.0.is_empty() { 1.0 } else { 0.0 };
            self.check_atom(rows, truth, k, (weight, rows.divisors[k]));
            let atom: Vec<f64> = self.dictionary.atom(k).iter().map(|&v| f64::from(v)).collect();
            for (c, column) in self.shared.chunks_exact(DIM).enumerate() {
                let entry = rows.columns[panel_index(k, c, rows.count())];
                let off = dot(&truth.residual(column), &atom) - less - f64::from(entry);
                assert!(off.abs() <= rows.errors.columns[c], "column {c}: {off}");
            }
        }
    }

    /// Checks a weight and a divisor.
    fn check_atom(&self, rows: &Rows, truth: &Truth, k: usize, (weight, divisor): (f32, f32)) {
        let atom = self.dictionary.atom(k);
        if let Some(direction) = truth.0.last() {
            let wide: Vec<f64> = atom.iter().map(|&v| f64::from(v)).collect();
            let less = if truth.0.len() == 1 { 1.0 } else { 0.0 };
            let off = dot(direction, &wide) - less - f64::from(weight);
            assert!(off.abs() <= rows.errors.weights, "weight: {off}");
        }
        if divisor < EXCLUDED {
            let at_root = if truth.0.is_empty() { NEARLY_ONE } else { 0.0 };
            let (residual, divisor) = (truth.residual(atom), f64::from(divisor + at_root));
            let left = dot(&residual, &residual);
            assert!(divisor <= left && left <= divisor + rows.errors.divisors, "{divisor} {left}");
        }
    }
}

/// Makes all tiles.
#[inline(always)]
fn make_tiles<S: Simd, const FIRST: bool>(
    simd: S,
    dictionary: &Dictionary,
    mut tiles: ChildTiles<'_, S, FIRST>,
) {
    for t in 0..dictionary.stride() / (TILE * S::F32_LANES) {
        tiles.tile(simd, t);
    }
}

/// With little texture the residuals of the atoms are small, and the bounds are correspondingly
/// tight.
#[test]
fn bounds_are_tight_where_little_is_left() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let signals = |count, runner: &mut _| vectors(count, 0.01).new_tree(runner).unwrap().current();
    let dictionary = Dictionary::new(DIM, 9, signals(90, &mut runner));
    let shared = signals(4, &mut runner);
    for (_, instructions) in Instructions::available() {
        let descent = RowDescent { dictionary: &dictionary, shared: &shared, path: &[3, 16, 31] };
        let errors = dispatch!(instructions, |simd| descent.descend(simd));
        for (depth, errors) in errors.iter().enumerate().skip(1) {
            assert!(errors.max_residual < 1e-3, "node {depth}: {errors:?}");
            assert!(errors.divisors < 1e-2 * errors.max_residual, "node {depth}: {errors:?}");
            assert!(errors.columns.iter().all(|e| *e < 1e-7), "node {depth}: {errors:?}");
        }
    }
}

proptest! {
    /// The bounds on which the proof is built.
    #[test]
    fn errors_stay_within_their_bounds(
        (atoms, shared) in prop_oneof![Just(0.8), Just(0.01), Just(1e-4)]
            .prop_flat_map(|texture| (vectors(90, texture), vectors(4, texture))),
        path in prop::collection::vec(0..90usize, 5),
    ) {
        let dictionary = Dictionary::new(DIM, 9, atoms);
        for (_, instructions) in Instructions::available() {
            let descent = RowDescent { dictionary: &dictionary, shared: &shared, path: &path };
            dispatch!(instructions, |simd| descent.descend(simd));
        }
    }
}
