//! What the screen knows in `f32` at a node: rows over all atoms, each with a bound of its error. The symbols and the bounds are derived at
//! the head of [`batched`](super::batched).

use super::node::{Node, Path};
use super::product::correlate;
use super::vectors::{
    TILE, Tile, U, add_squares, dots_each, mul_add, panel, place, take_off, tile_place, tiles,
    tiles_mut, widen,
};
use crate::config::{MAX_ATOMS, Selection};
use crate::sparse::aligned::Aligned;
use crate::sparse::codes::CodeRules;
use crate::sparse::dictionary::{Dictionary, LANES};
use pulp::Simd;

/// Stands for `||d_res||^2` of an atom that can't be chosen: no score is left over it. Finite, so that no product is undefined.
pub const DEAD: f32 = 1e36;

/// Covers the products of two errors in the bounds.
const SECOND_ORDER: f64 = 1.01;

/// The rows of a node, padded to the dictionary's stride.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// `w_t = D^T q_t`; nothing at the root.
    weights: Aligned,
    /// The correlations of the shared columns' residuals, a row each (a row of zeros where nothing is shared), in panels.
    columns: Aligned,
    /// For each atom a lower bound of what its score is divided by, or [`DEAD`].
    over: Aligned,
    /// `p` of each column along the node's direction; zeros where nothing is shared.
    along: Vec<f32>,
    /// How far the rows may be off.
    pub errors: Errors,
}

/// How far rows may be off.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// An entry of the weights.
    weights: f64,
    /// An entry of each column.
    columns: Vec<f64>,
    /// How much an entry of `over` may lack.
    over: f64,
    /// No `||d_res||^2` is more than this, the roots of its rounding aside.
    most_left: f64,
    /// What an entry of `over` may have lost to rounding when it was made from the parent's.
    rounding: f64,
}

/// What a step has to know of [`Errors`].
#[derive(Debug, Clone, Copy)]
pub struct Margins {
    /// How far a weight may be off.
    pub weights: f64,
    /// The sum of the squares of how far the columns may be off.
    pub squared: f64,
    /// How much less than the truth a divisor may be, rounded up.
    pub gap: f32,
}

impl Errors {
    /// What a step has to know.
    #[inline(always)]
    pub fn margins(&self) -> Margins {
        Margins {
            weights: self.weights,
            squared: self.columns.iter().map(|e| e * e).sum(),
            gap: (self.over * (1.0 + 4.0 * U)) as f32,
        }
    }

    /// As the child's of `parent` with the node at the path's end.
    #[inline(always)]
    fn follow(&mut self, path: Path<'_>, above: &[Rows], parent: &Self) {
        let (node, earlier) = (path.end(), path.nodes.len() - 1);
        let mut numerator = U * (3 * earlier + 1) as f64;
        for (rows, along) in above.iter().zip(&node.triangle).take(earlier) {
            numerator += along.abs() * rows.errors.weights;
        }
        self.weights = SECOND_ORDER * (numerator / node.triangle[earlier] + 3.0 * U);
        // What is left of an atom only becomes less.
        self.most_left = parent.most_left;
        let most = self.most_left.sqrt();
        self.rounding = 5.0 * U * (most + self.weights).powi(2);
        // `2 o |w|` is taken off twice too much at most, and so is what is for rounding.
        let taken = 4.0 * self.weights * (most + self.weights) + 2.0 * self.rounding;
        self.over = parent.over + SECOND_ORDER * taken;
        self.columns.clone_from(&parent.columns);
        for (error, &p) in self.columns.iter_mut().zip(&node.along) {
            *error += SECOND_ORDER * (p.abs() * (self.weights + 2.0 * U) + U);
        }
    }
}

/// A tile of what all candidates at a node share. Aligned, as a vector across two cache lines costs twice.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Shared<S: Simd> {
    /// `w_t`; nothing at the root.
    pub weights: Tile<S>,
    /// For each atom the sum of the squared correlations of all columns.
    pub squares: Tile<S>,
    /// What scores are divided by, at least.
    pub over: Tile<S>,
}

/// Gives the tiles of the root, one after the other, and correlates the candidates.
#[derive(Debug, Clone, Copy)]
pub struct RootTiles<'a, S: Simd> {
    dictionary: &'a Dictionary,
    /// What the candidates differ by from the newest column.
    differences: &'a [f32],
    rows: &'a Rows,
    columns: &'a [Tile<S>],
    over: &'a [Tile<S>],
}

/// Makes the tiles of a child, one after the other. Its rows are cut into tiles once, as cutting costs more than a tile.
#[derive(Debug)]
pub struct ChildTiles<'a, S: Simd> {
    recipe: Recipe<'a>,
    gram: &'a [Tile<S>],
    /// The weights of the nodes above.
    above: [&'a [Tile<S>]; MAX_ATOMS],
    /// The parent's rows.
    columns: &'a [Tile<S>],
    over: &'a [Tile<S>],
    /// The child's own, where they are kept for nodes further below.
    kept: Option<Kept<'a, S>>,
}

/// How a child's entries follow from those of the nodes above.
#[derive(Debug)]
struct Recipe<'a> {
    gram: &'a [f32],
    above: &'a [Rows],
    parent: &'a Rows,
    /// `q_s^T d` of the new atom for each node above, one over what is left of its norm, and `p` of each column.
    triangle: [f32; MAX_ATOMS],
    inverse: f32,
    along: &'a [f32],
    atom: usize,
    selection: Selection,
    loss: (f32, f32),
}

/// Rows that are written.
#[derive(Debug)]
struct Kept<'a, S: Simd> {
    weights: &'a mut [Tile<S>],
    columns: &'a mut [Tile<S>],
    over: &'a mut [Tile<S>],
}

/// A source of tiles.
pub trait Tiles<S: Simd> {
    /// Whether candidates still have to take off what the newest atom explains.
    const DEEP: bool;

    /// Whether what a step makes of the correlations is written, for nodes further below.
    fn kept(&self) -> bool;

    /// Makes the candidates' correlations with tile `t`, where they are not there yet.
    fn correlate(&self, simd: S, t: usize, correlations: &mut [Tile<S>]);

    /// Tile `t`.
    fn tile(&mut self, simd: S, t: usize) -> Shared<S>;

    /// The same of a single atom: weight, squares and divisor.
    fn at(&self, k: usize) -> [f32; 3];
}

impl Rows {
    /// Becomes the rows of the root.
    #[inline(always)]
    pub fn fill_root<S: Simd>(
        &mut self,
        simd: S,
        wide: &mut Vec<f64>,
        dictionary: &Dictionary,
        root: &Node,
        rules: &CodeRules,
    ) {
        let (dim, stride, count) = (dictionary.dim(), dictionary.stride(), dictionary.len());
        let columns = (root.residuals.len() / dim).max(1);
        self.errors.columns.clear();
        self.errors.columns.resize(columns, U * SECOND_ORDER);
        self.errors.over = 8.0 * U;
        self.errors.most_left = 1.0 + 8.0 * U;
        self.columns.reset(columns * stride);
        let signals = root.residuals.chunks_exact(dim);
        for k in 0..count {
            widen(wide, dictionary.atom(k));
            let column = &mut self.columns;
            dots_each(simd, wide, signals.clone(), |c, dot| {
                column[place(k, c, columns)] = dot as f32;
            });
        }
        self.over.reset(stride);
        self.over.fill(DEAD);
        for (k, over) in self.over.iter_mut().take(count).enumerate() {
            let norm = dictionary.squared_norm(k);
            // An atom that repeats an earlier one has its score, and gives way to it; with that one chosen, nothing is left of it.
            if norm >= rules.min_residual && !dictionary.repeats(k) {
                *over = match rules.selection {
                    Selection::OrderRecursive => (norm * (1.0 - 4.0 * U)) as f32,
                    Selection::Textbook => 1.0,
                };
            }
        }
    }

    /// Looks how much is left of the atoms, once all tiles were made: the less, the less the rows of nodes further below can be off.
    #[inline(always)]
    pub fn measure<S: Simd>(&mut self, simd: S) {
        let (dead, none) = (simd.splat_f32s(DEAD), simd.splat_f32s(0.0));
        let mut most = [none; TILE];
        for tile in tiles::<S>(&self.over) {
            for (most, &over) in most.iter_mut().zip(tile) {
                let alive = simd.less_than_f32s(over, dead);
                *most = simd.max_f32s(*most, simd.select_f32s(alive, over, none));
            }
        }
        let most = most.into_iter().map(|most| simd.reduce_max_f32s(most)).fold(0.0, f32::max);
        self.errors.most_left = self.errors.most_left.min(f64::from(most) + self.errors.over);
    }

    /// How many columns there are.
    fn count(&self) -> usize {
        self.columns.len() / self.over.len().max(1)
    }

    #[inline(always)]
    fn column_at(&self, k: usize, c: usize) -> f32 {
        self.columns[place(k, c, self.count())]
    }

    /// The root's tiles.
    #[inline(always)]
    pub fn tiles<'a, S: Simd>(
        &'a self,
        dictionary: &'a Dictionary,
        differences: &'a [f32],
    ) -> RootTiles<'a, S> {
        let (columns, over) = (tiles::<S>(&self.columns), tiles::<S>(&self.over));
        RootTiles { dictionary, differences, rows: self, columns, over }
    }

    /// The tiles of the node at the path's end, whose parents' rows are `root` and `above`, and their margins. The rows are there once all tiles were
    /// made.
    #[inline(always)]
    pub fn grow<'a, S: Simd>(
        &'a mut self,
        dictionary: &'a Dictionary,
        path: Path<'a>,
        (root, above): (&'a Self, &'a [Self]),
        rules: &CodeRules,
    ) -> (ChildTiles<'a, S>, Margins) {
        let (node, parent) = (path.end(), above.last().unwrap_or(root));
        self.errors.follow(path, above, &parent.errors);
        let margins = self.errors.margins();
        let gram = dictionary.gram_row(node.atom);
        self.along.clear();
        self.along.extend(node.along.iter().map(|&p| p as f32));
        self.along.resize(parent.count(), 0.0);
        let Self { weights, columns, over, along, errors } = self;
        let own = [weights, columns, over];
        let recipe = Recipe {
            gram,
            above,
            parent,
            triangle: node.triangle.map(|w| w as f32),
            inverse: (1.0 / node.triangle[above.len()]) as f32,
            along,
            atom: node.atom,
            selection: rules.selection,
            loss: errors.over_loss(),
        };
        let mut earlier: [&[Tile<S>]; MAX_ATOMS] = [&[]; MAX_ATOMS];
        for (k, tiles_above) in earlier.iter_mut().enumerate() {
            // Left early, so that the compiler makes no gathers of these few turns.
            let Some(rows) = above.get(k) else { break };
            *tiles_above = tiles::<S>(&rows.weights);
        }
        let (columns, over) = (tiles::<S>(&parent.columns), tiles::<S>(&parent.over));
        // Below the deepest node there is none that would ask for its rows.
        let keep = path.nodes.len() + 1 < rules.atoms;
        let kept = keep.then(|| Kept::new(own, parent));
        let gram = tiles::<S>(gram);
        (ChildTiles { recipe, gram, above: earlier, columns, over, kept }, margins)
    }
}

impl<'a, S: Simd> Kept<'a, S> {
    /// Room in these for as many as the parent has.
    #[inline(always)]
    fn new([weights, columns, over]: [&'a mut Aligned; 3], parent: &Rows) -> Self {
        columns.resize(parent.columns.len());
        for row in [&mut *weights, &mut *over] {
            row.resize(parent.over.len());
        }
        Self {
            weights: tiles_mut::<S>(weights),
            columns: tiles_mut::<S>(columns),
            over: tiles_mut::<S>(over),
        }
    }
}

impl<S: Simd> RootTiles<'_, S> {
    /// Tile `t` of a column.
    #[inline(always)]
    fn column(&self, t: usize, c: usize) -> &Tile<S> {
        &self.columns[tile_place::<S>(t, c, self.rows.count())]
    }
}

impl<S: Simd> Tiles<S> for RootTiles<'_, S> {
    const DEEP: bool = false;

    #[inline(always)]
    fn kept(&self) -> bool {
        false
    }

    #[inline(always)]
    fn correlate(&self, simd: S, t: usize, correlations: &mut [Tile<S>]) {
        let newest = self.column(t, self.rows.count() - 1);
        correlate(simd, self.differences, self.dictionary, (t, newest), correlations);
    }

    #[inline(always)]
    fn tile(&mut self, simd: S, t: usize) -> Shared<S> {
        let zero = [simd.splat_f32s(0.0); TILE];
        let mut shared = Shared { weights: zero, squares: zero, over: self.over[t] };
        for c in 0..self.rows.count() {
            add_squares(simd, &mut shared.squares, self.column(t, c));
        }
        shared
    }

    #[inline(always)]
    fn at(&self, k: usize) -> [f32; 3] {
        let mut squares = 0.0;
        for c in 0..self.rows.count() {
            squares += self.rows.column_at(k, c).powi(2);
        }
        [0.0, squares, self.rows.over[k]]
    }
}

impl<S: Simd> Tiles<S> for ChildTiles<'_, S> {
    const DEEP: bool = true;

    #[inline(always)]
    fn kept(&self) -> bool {
        self.kept.is_some()
    }

    #[inline(always)]
    fn correlate(&self, _: S, _: usize, _: &mut [Tile<S>]) {}

    #[inline(always)]
    fn tile(&mut self, simd: S, t: usize) -> Shared<S> {
        let Self { recipe, gram, above, columns, over, kept } = self;
        let mut w = gram[t];
        for (rows, &along) in above[..recipe.above.len()].iter().zip(&recipe.triangle) {
            take_off(simd, &mut w, &rows[t], along);
        }
        let inverse = simd.splat_f32s(recipe.inverse);
        for w in &mut w {
            *w = simd.mul_f32s(*w, inverse);
        }
        let over = recipe.shorten(simd, &w, over[t], t);
        let mut shared = Shared { weights: w, squares: [simd.splat_f32s(0.0); TILE], over };
        let (first, step) = panel::<S>(t, recipe.along.len());
        let own = kept.as_mut().map(|kept| {
            (kept.weights[t], kept.over[t]) = (w, over);
            &mut kept.columns[first..]
        });
        let (columns, along) = ((&columns[first..], own), recipe.along);
        // The paper's four columns in a loop of a known length.
        match (step, along.len()) {
            (1, 4) => leave::<S, 4>(simd, columns, 1, along, &mut shared),
            _ => leave::<S, 0>(simd, columns, step, along, &mut shared),
        }
        shared
    }

    #[inline(always)]
    fn at(&self, k: usize) -> [f32; 3] {
        self.recipe.at(k)
    }
}

/// Adds up the squares of what the node leaves of its parent's columns, every `step`th of these tiles, and writes it where it has its own. `N` is how many
/// columns there are, or 0 if that is not known beforehand.
#[inline(always)]
fn leave<S: Simd, const N: usize>(
    simd: S,
    (columns, mut own): (&[Tile<S>], Option<&mut [Tile<S>]>),
    step: usize,
    along: &[f32],
    shared: &mut Shared<S>,
) {
    let count = if N == 0 { along.len() } else { N };
    for (c, &along) in along[..count].iter().enumerate() {
        let mut y = columns[c * step];
        take_off(simd, &mut y, &shared.weights, along);
        add_squares(simd, &mut shared.squares, &y);
        if let Some(own) = &mut own {
            own[c * step] = y;
        }
    }
}

impl Recipe<'_> {
    #[inline(always)]
    fn at(&self, k: usize) -> [f32; 3] {
        let mut w = self.gram[k];
        for (rows, along) in self.above.iter().zip(&self.triangle) {
            w -= rows.weights[k] * along;
        }
        w *= self.inverse;
        let mut squares = 0.0;
        for (c, along) in self.along.iter().enumerate() {
            squares += (self.parent.column_at(k, c) - w * along).powi(2);
        }
        let over = match self.selection {
            _ if k == self.atom => DEAD,
            Selection::Textbook => self.parent.over[k],
            Selection::OrderRecursive => {
                self.parent.over[k] - (w.abs() + self.loss.0) * w.abs() - self.loss.1
            }
        };
        [w, squares, over]
    }

    /// What scores are divided by, at least: `||d_res||^2` loses `w^2`, and what that may be off. The node's own atom is dead.
    #[inline(always)]
    fn shorten<S: Simd>(&self, simd: S, w: &Tile<S>, above: Tile<S>, t: usize) -> Tile<S> {
        let mut over = above;
        if self.selection == Selection::OrderRecursive {
            let (twice, constant) = (simd.splat_f32s(self.loss.0), simd.splat_f32s(self.loss.1));
            for i in 0..TILE {
                let size = simd.abs_f32s(w[i]);
                let most = simd.neg_f32s(simd.add_f32s(size, twice));
                let left = mul_add(simd, most, size, over[i]);
                over[i] = simd.sub_f32s(left, constant);
            }
        }
        if self.atom / (TILE * S::F32_LANES) == t {
            kill(simd, &mut over, self.atom);
        }
        over
    }
}

impl Errors {
    /// With `w` as the screen has it, `||d_res||^2` loses at most `|w| (|w| + first) + second`.
    #[inline(always)]
    fn over_loss(&self) -> (f32, f32) {
        let second = (self.weights.powi(2) + self.rounding) * SECOND_ORDER;
        ((2.0 * self.weights * SECOND_ORDER) as f32, second as f32)
    }
}

/// Marks the atom as one that can't be chosen. By comparing: a number written into a vector would take the whole tile through memory.
#[inline(always)]
fn kill<S: Simd>(simd: S, over: &mut Tile<S>, atom: usize) {
    static NUMBERS: [f32; LANES] = {
        let mut numbers = [0.0; LANES];
        let mut k = 0;
        while k < LANES {
            numbers[k] = k as f32;
            k += 1;
        }
        numbers
    };
    let numbers = S::as_simd_f32s(&NUMBERS).0;
    let atom = simd.splat_f32s((atom % (TILE * S::F32_LANES)) as f32);
    for i in 0..TILE {
        let chosen = simd.equal_f32s(numbers[i], atom);
        over[i] = simd.select_f32s(chosen, simd.splat_f32s(DEAD), over[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use proptest::prelude::*;
    use pulp::WithSimd;

    const DIM: usize = 16;
    const RULES: CodeRules = CodeRules {
        atoms: MAX_ATOMS,
        selection: Selection::OrderRecursive,
        min_residual: 1e-6,
        stop_energy: 0.0,
    };

    /// Vectors that are positive and alike, as patches are; every third is nearly that before it.
    fn vectors(count: usize) -> impl Strategy<Value = Vec<f32>> {
        prop::collection::vec(prop::collection::vec(0.2..1.0f32, DIM), count).prop_map(|rows| {
            let mut all: Vec<Vec<f32>> = Vec::new();
            for (k, mut row) in rows.into_iter().enumerate() {
                if k % 3 == 2 {
                    row.iter_mut().zip(&all[k - 1]).for_each(|(v, near)| *v = near + 0.004 * *v);
                }
                let norm = row.iter().map(|v| v * v).sum::<f32>().sqrt();
                all.push(row.into_iter().map(|v| v / norm).collect());
            }
            all.concat()
        })
    }

    /// What a few atoms leave of vectors, by Gram and Schmidt in `f64`.
    #[derive(Default)]
    struct Truth(Vec<Vec<f64>>);

    impl Truth {
        fn rest(&self, vector: &[f32]) -> Vec<f64> {
            let mut left: Vec<f64> = vector.iter().map(|&v| f64::from(v)).collect();
            for q in self.0.iter().chain(&self.0) {
                let along = dot(q, &left);
                left.iter_mut().zip(q).for_each(|(l, q)| *l -= along * q);
            }
            left
        }

        fn take(&mut self, atom: &[f32]) {
            let mut direction = self.rest(atom);
            let norm = dot(&direction, &direction).sqrt();
            direction.iter_mut().for_each(|v| *v /= norm);
            self.0.push(direction);
        }
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Takes these atoms one after the other, as far as they are eligible, and holds each node's rows to the truth.
    struct Descend<'a> {
        dictionary: &'a Dictionary,
        shared: &'a [f32],
        atoms: &'a [usize],
    }

    impl WithSimd for Descend<'_> {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            let Self { dictionary, shared, atoms } = self;
            let (mut root, mut nodes) = (Node::default(), Vec::new());
            root.fill_root(simd, shared);
            let mut rows = vec![Rows::default()];
            rows[0].fill_root(simd, &mut Vec::new(), dictionary, &root, &RULES);
            let mut truth = Truth::default();
            self.hold(&rows[0], &truth);
            for &atom in atoms {
                let left = truth.rest(dictionary.atom(atom));
                if dot(&left, &left) < RULES.min_residual {
                    continue;
                }
                let mut node = Node::default();
                node.fill(simd, dictionary, Path { root: &root, nodes: &nodes }, atom);
                nodes.push(node);
                truth.take(dictionary.atom(atom));
                let (path, mut new) = (Path { root: &root, nodes: &nodes }, Rows::default());
                let above = (&rows[0], &rows[1..]);
                let (mut tiles, _) = new.grow::<S>(dictionary, path, above, &RULES);
                let single: Vec<[f32; 3]> = (0..dictionary.len()).map(|k| tiles.at(k)).collect();
                for t in 0..dictionary.stride() / (TILE * S::F32_LANES) {
                    tiles.tile(simd, t);
                }
                self.hold(&new, &truth);
                for (k, [weight, _, over]) in single.into_iter().enumerate() {
                    self.hold_atom(&new, &truth, k, (weight, over));
                }
                rows.push(new);
            }
        }
    }

    impl Descend<'_> {
        fn hold(&self, rows: &Rows, truth: &Truth) {
            for k in 0..self.dictionary.len() {
                let weight = rows.weights.get(k).copied().unwrap_or_default();
                self.hold_atom(rows, truth, k, (weight, rows.over[k]));
                let atom: Vec<f64> =
                    self.dictionary.atom(k).iter().map(|&v| f64::from(v)).collect();
                for (c, column) in self.shared.chunks_exact(DIM).enumerate() {
                    let off = dot(&truth.rest(column), &atom) - f64::from(rows.column_at(k, c));
                    assert!(off.abs() <= rows.errors.columns[c], "column {c}: {off}");
                }
            }
        }

        /// A weight, and a divisor.
        fn hold_atom(&self, rows: &Rows, truth: &Truth, k: usize, (weight, over): (f32, f32)) {
            let atom = self.dictionary.atom(k);
            if let Some(direction) = truth.0.last() {
                let wide: Vec<f64> = atom.iter().map(|&v| f64::from(v)).collect();
                let off = dot(direction, &wide) - f64::from(weight);
                assert!(off.abs() <= rows.errors.weights, "weight: {off}");
            }
            if over != DEAD {
                let (rest, over) = (truth.rest(atom), f64::from(over));
                let left = dot(&rest, &rest);
                assert!(over <= left && left <= over + rows.errors.over, "{over} {left}");
            }
        }
    }

    proptest! {
        /// The bounds that the proof begins with.
        #[test]
        fn rows_are_no_further_off_than_they_say(
            atoms in vectors(90),
            shared in vectors(4),
            path in prop::collection::vec(0..90usize, 5),
        ) {
            let dictionary = Dictionary::new(DIM, 9, atoms);
            for (_, instructions) in Instructions::available() {
                instructions.dispatch(Descend { dictionary: &dictionary, shared: &shared, atoms: &path });
            }
        }
    }
}
