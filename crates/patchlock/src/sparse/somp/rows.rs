//! What the screen knows in `f32` at a node: rows over all atoms, each with a bound of its error. The symbols and the bounds are derived at
//! the head of [`batched`](super::batched).

use super::node::{Node, Path};
use super::product::correlate;
use super::vectors::{
    TILE, Tile, U, add, add_squares, dots_each, mul_add, panel, panel_index, subtract_scaled,
    tile_index, tiles, tiles_mut, widen,
};
use crate::numeric::aligned::Aligned;
use crate::sparse::codes::{CodeRules, MAX_ATOMS};
use crate::sparse::dictionary::{Dictionary, LANES};
use pulp::Simd;

/// Stands for `||d_res||^2` of an atom that can't be chosen: no score is left over it. Finite, so that no product is undefined.
pub const EXCLUDED: f32 = 1e36;

/// Covers the products of two errors in the bounds.
const SECOND_ORDER: f64 = 1.01;

/// Less than 1 by more than adding it to a number can be off.
const NEARLY_ONE: f32 = 1.0 - 4.0 * U as f32;

/// The rows of a node, padded to the dictionary's stride.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// `w_t = D^T q_t`, of the first node less 1; nothing at the root.
    weights: Aligned,
    /// The correlations of the shared columns' residuals, a row each (as of a column of zeros where nothing is shared), in panels; at the root less 1.
    columns: Aligned,
    /// For each atom a lower bound of what its score is divided by, or [`DEAD`]; at the root less 1, and no bound but the number.
    divisors: Aligned,
    /// `p` of each column along the node's direction; zeros where nothing is shared.
    projections: Vec<f32>,
    /// What is left of 1 of each column, at a first node.
    offsets: Vec<f32>,
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
    divisors: f64,
    /// No weight is more than this.
    max_weight: f64,
    /// No `||d_res||^2` is more than this.
    max_left: f64,
    /// At the root: no entry of the columns is more than this.
    spread: f64,
    /// `||d_res||^2` loses `w^2`: as the screen has `w`, at most `|w| (|w| + first) + second`, and at the first node `w (2 + w) + second`.
    loss: (f64, f64),
}

/// What a step has to know of [`Errors`].
#[derive(Debug, Clone, Copy)]
pub struct Margins {
    /// How far a weight may be off, and how large it may be.
    weights: (f64, f64),
    /// Whether the node is the first one.
    first: bool,
    /// The sum of the squares of how far the columns may be off.
    pub squared: f64,
    /// How much less than the truth a divisor may be, rounded up.
    pub gap: f32,
}

impl Margins {
    /// How much further a correlation is off once `along` is taken off. At the root it was no more than `spread`, less 1.
    #[inline(always)]
    pub fn projection_error(&self, projection: f64, spread: f64) -> f64 {
        let (p, (off, max_weight)) = (projection.abs(), self.weights);
        let sums = if self.first {
            2.0 * (spread + p * max_weight + (1.0 - projection).abs())
        } else {
            max_weight
        };
        SECOND_ORDER * (p * (off + 2.0 * U * max_weight) + U * sums)
    }
}

impl Errors {
    /// What a step at the root has to know: there, 1 is added to all.
    #[inline(always)]
    fn at_root(&self) -> Margins {
        let squared = self.columns.iter().map(|e| (e + ADD_ONE_ERROR).powi(2)).sum();
        Margins { squared, ..self.margins(false) }
    }

    /// What a step has to know.
    #[inline(always)]
    fn margins(&self, first: bool) -> Margins {
        Margins {
            weights: (self.weights, self.max_weight),
            first,
            squared: self.columns.iter().map(|e| e * e).sum(),
            gap: (self.divisors * (1.0 + 4.0 * U)) as f32,
        }
    }

    /// As the child's of `parent` with the node at the path's end; gives what a step has to know.
    #[inline(always)]
    fn set_child<const FIRST: bool>(
        &mut self,
        path: Path<'_>,
        above: &[Rows],
        parent: &Self,
        spread: f64,
    ) -> Margins {
        if FIRST {
            self.set_first(path.end().triangle[0], spread);
        } else {
            self.set_deeper(&path.end().triangle, above, spread);
            self.divisors += parent.divisors;
        }
        // What is left of an atom only becomes less.
        self.max_left = parent.max_left;
        let margins = self.margins(FIRST);
        self.columns.clone_from(&parent.columns);
        for (error, &p) in self.columns.iter_mut().zip(&path.end().projections) {
            *error += margins.projection_error(p, parent.spread);
        }
        self.margins(FIRST)
    }

    /// Of a first node, whose atom has this norm.
    #[inline(always)]
    fn set_first(&mut self, norm: f64, spread: f64) {
        let max_weight = spread / norm + (1.0 / norm - 1.0).abs();
        self.max_weight = SECOND_ORDER * max_weight;
        self.weights = SECOND_ORDER * 5.0 * U * max_weight;
        let square = max_weight * (2.0 + max_weight);
        let second = self.weights * (2.0 + 2.0 * max_weight) + U * (4.0 * square + 2.0 * spread);
        self.loss = (2.0, SECOND_ORDER * second);
        self.divisors = 2.0 * self.loss.1;
    }

    /// Of a node further below; what `over` may lack more than the parent's.
    #[inline(always)]
    fn set_deeper(&mut self, triangle: &[f64; MAX_ATOMS], above: &[Rows], spread: f64) {
        let earlier = above.len();
        let mut numerator = U * spread;
        let mut sums = spread + (1.0 - triangle[0]).abs();
        for (rows, projection) in above.iter().zip(triangle) {
            let Errors { weights, max_weight, .. } = rows.errors;
            numerator += projection.abs() * (weights + 2.0 * U * max_weight);
            sums += projection.abs() * max_weight;
        }
        numerator += U * ((earlier + 1) as f64 * sums + (1.0 - triangle[0]).abs());
        let max_norm = above[0].errors.max_left.sqrt();
        self.weights = SECOND_ORDER * (numerator / triangle[earlier] + 3.0 * U * max_norm);
        self.max_weight = max_norm + self.weights;
        let rounding = 5.0 * U * self.max_weight.powi(2);
        self.loss =
            (2.0 * SECOND_ORDER * self.weights, SECOND_ORDER * (self.weights.powi(2) + rounding));
        // `2 o |w|` is taken off twice too much at most, and so is what is for rounding.
        self.divisors = SECOND_ORDER * (4.0 * self.weights * self.max_weight + 2.0 * rounding);
    }
}

/// How far adding 1 to a correlation takes it off.
pub const ADD_ONE_ERROR: f64 = 2.0 * U;

/// A tile of what all candidates at a node share. Aligned, as a vector across two cache lines costs twice.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct SharedTile<S: Simd> {
    /// `w_t`; nothing at the root.
    pub weights: Tile<S>,
    /// For each atom the sum of the squared correlations of all columns.
    pub squares: Tile<S>,
    /// What scores are divided by, at least.
    pub divisors: Tile<S>,
}

/// Gives the tiles of the root, one after the other, and correlates the candidates.
#[derive(Debug, Clone, Copy)]
pub struct RootTiles<'a, S: Simd> {
    dictionary: &'a Dictionary,
    /// What the candidates differ by from the newest column.
    differences: &'a [f32],
    rows: &'a Rows,
    columns: &'a [Tile<S>],
    divisors: &'a [Tile<S>],
}

/// Makes the tiles of a child, of the root or of a node further below, one after the other. Its rows are cut into tiles once, as cutting costs more than a tile.
#[derive(Debug)]
pub struct ChildTiles<'a, S: Simd, const FIRST: bool> {
    recurrence: Recurrence<'a>,
    gram: &'a [Tile<S>],
    /// The weights of the nodes above.
    above: [&'a [Tile<S>]; MAX_ATOMS],
    /// The parent's rows.
    columns: &'a [Tile<S>],
    divisors: &'a [Tile<S>],
    /// The child's own, where they are kept for nodes further below.
    stored: Option<StoredRows<'a, S>>,
}

/// How a child's entries follow from those of the nodes above.
#[derive(Debug)]
struct Recurrence<'a> {
    gram: &'a [f32],
    above: &'a [Rows],
    parent: &'a Rows,
    /// `q_s^T d` of the new atom for each node above, one over what is left of its norm, and `p` of each column.
    triangle: [f32; MAX_ATOMS],
    inverse: f32,
    projections: &'a [f32],
    /// What makes good that the numbers above are less 1: added to weights (of the first node after they are scaled), and to columns.
    weight_offset: f32,
    offsets: &'a [f32],
    atom: usize,
    loss: (f32, f32),
}

/// Rows that are written.
#[derive(Debug)]
struct StoredRows<'a, S: Simd> {
    weights: &'a mut [Tile<S>],
    columns: &'a mut [Tile<S>],
    divisors: &'a mut [Tile<S>],
}

/// A source of tiles.
pub trait Tiles<S: Simd> {
    /// Whether candidates still have to take off what the newest atom explains.
    const BELOW_ROOT: bool;

    /// Whether the correlations are less 1.
    const HAS_OFFSET: bool;

    /// Whether what a step makes of the correlations is written, for nodes further below.
    fn stores_rows(&self) -> bool;

    /// Makes the candidates' correlations with tile `t`, where they are not there yet.
    fn correlate(&self, simd: S, t: usize, correlations: &mut [Tile<S>]);

    /// Tile `t`.
    fn tile(&mut self, simd: S, t: usize) -> SharedTile<S>;

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
        self.columns.resize(columns * stride);
        self.columns.fill(-1.0);
        let signals = root.residuals.chunks_exact(dim);
        let mut spread = if root.residuals.is_empty() { 1.0f32 } else { 0.0 };
        for k in 0..count {
            widen(wide, dictionary.atom(k));
            let column = &mut self.columns;
            let nonzero = dictionary.squared_norm(k) > 0.0;
            dots_each(simd, wide, signals.clone(), |c, dot| {
                let less = (dot - 1.0) as f32;
                column[panel_index(k, c, columns)] = less;
                spread = if nonzero { spread.max(less.abs()) } else { spread };
            });
        }
        let spread = f64::from(spread) * SECOND_ORDER;
        self.errors.columns.clear();
        self.errors.columns.resize(columns, U * spread);
        (self.errors.spread, self.errors.divisors) = (spread, 8.0 * U);
        self.errors.max_left = 1.0 + 8.0 * U;
        self.divisors.resize(stride);
        self.divisors.fill(EXCLUDED);
        for (k, divisor) in self.divisors.iter_mut().take(count).enumerate() {
            let norm = dictionary.squared_norm(k);
            // An atom that repeats an earlier one has its score, and gives way to it; with that one chosen, nothing is left of it.
            if norm >= rules.min_residual && !dictionary.repeats(k) {
                *divisor = (norm - 1.0) as f32;
            }
        }
    }

    /// Looks how much is left of the atoms, once all tiles were made: the less, the less the rows of nodes further below can be off.
    #[inline(always)]
    pub fn measure_residuals<S: Simd>(&mut self, simd: S) {
        let (excluded, zero) = (simd.splat_f32s(EXCLUDED), simd.splat_f32s(0.0));
        let mut largest = [zero; TILE];
        for tile in tiles::<S>(&self.divisors) {
            for (largest, &divisor) in largest.iter_mut().zip(tile) {
                let possible = simd.less_than_f32s(divisor, excluded);
                *largest = simd.max_f32s(*largest, simd.select_f32s(possible, divisor, zero));
            }
        }
        let largest = largest.into_iter().map(|v| simd.reduce_max_f32s(v)).fold(0.0, f32::max);
        self.errors.max_left = self.errors.max_left.min(f64::from(largest) + self.errors.divisors);
    }

    /// How many columns there are.
    fn count(&self) -> usize {
        self.columns.len() / self.divisors.len().max(1)
    }

    #[inline(always)]
    fn column_at(&self, k: usize, c: usize) -> f32 {
        self.columns[panel_index(k, c, self.count())]
    }

    /// What a step at the root has to know.
    #[inline(always)]
    pub fn root_margins(&self) -> Margins {
        self.errors.at_root()
    }

    /// At the root: how far a candidate's correlations are off that is this far from the newest column, and the most that they are, less 1.
    #[inline(always)]
    pub fn candidate_bounds(&self, dim: usize, distance: f64) -> (f64, f64) {
        let spread = self.errors.spread + distance;
        (SECOND_ORDER * U * ((dim + 2) as f64 * distance + 2.0 * spread), spread)
    }

    /// The root's tiles.
    #[inline(always)]
    pub fn root_tiles<'a, S: Simd>(
        &'a self,
        dictionary: &'a Dictionary,
        differences: &'a [f32],
    ) -> RootTiles<'a, S> {
        let (columns, divisors) = (tiles::<S>(&self.columns), tiles::<S>(&self.divisors));
        RootTiles { dictionary, differences, rows: self, columns, divisors }
    }

    /// The tiles of the node at the path's end, `FIRST` if the root is its parent, whose parents' rows are `root` and `above`, and their margins. The rows are there once all tiles were
    /// made.
    #[inline(always)]
    pub fn child_tiles<'a, S: Simd, const FIRST: bool>(
        &'a mut self,
        dictionary: &'a Dictionary,
        path: Path<'a>,
        (root, above): (&'a Self, &'a [Self]),
        rules: &CodeRules,
    ) -> (ChildTiles<'a, S, FIRST>, Margins) {
        let (node, parent) = (path.end(), above.last().unwrap_or(root));
        let margins =
            self.errors.set_child::<FIRST>(path, above, &parent.errors, dictionary.spread());
        let gram = dictionary.gram_row(node.atom);
        self.projections.clear();
        self.projections.extend(node.projections.iter().map(|&p| p as f32));
        self.projections.resize(parent.count(), 0.0);
        self.offsets.clear();
        self.offsets.extend(node.projections.iter().map(|&p| (1.0 - p) as f32));
        self.offsets.resize(parent.count(), 1.0);
        let Self { weights, columns, divisors, projections, offsets, errors } = self;
        let own = [weights, columns, divisors];
        let inverse = 1.0 / node.triangle[above.len()];
        let weight_offset = if FIRST { inverse - 1.0 } else { 1.0 - node.triangle[0] };
        let recurrence = Recurrence {
            gram,
            above,
            parent,
            triangle: node.triangle.map(|w| w as f32),
            inverse: inverse as f32,
            projections,
            weight_offset: weight_offset as f32,
            offsets,
            atom: node.atom,
            loss: (errors.loss.0 as f32, errors.loss.1 as f32),
        };
        let mut earlier: [&[Tile<S>]; MAX_ATOMS] = [&[]; MAX_ATOMS];
        for (k, tiles_above) in earlier.iter_mut().enumerate() {
            // Left early, so that the compiler makes no gathers of these few turns.
            let Some(rows) = above.get(k) else { break };
            *tiles_above = tiles::<S>(&rows.weights);
        }
        let (columns, divisors) = (tiles::<S>(&parent.columns), tiles::<S>(&parent.divisors));
        // Below the deepest node there is none that would ask for its rows.
        let store = path.nodes.len() + 1 < rules.atoms;
        let stored = store.then(|| StoredRows::new(own, parent));
        let gram = tiles::<S>(gram);
        (ChildTiles { recurrence, gram, above: earlier, columns, divisors, stored }, margins)
    }
}

impl<'a, S: Simd> StoredRows<'a, S> {
    /// Room in these for as many as the parent has.
    #[inline(always)]
    fn new([weights, columns, divisors]: [&'a mut Aligned; 3], parent: &Rows) -> Self {
        columns.resize(parent.columns.len());
        for row in [&mut *weights, &mut *divisors] {
            row.resize(parent.divisors.len());
        }
        Self {
            weights: tiles_mut::<S>(weights),
            columns: tiles_mut::<S>(columns),
            divisors: tiles_mut::<S>(divisors),
        }
    }
}

impl<S: Simd> RootTiles<'_, S> {
    /// Tile `t` of a column.
    #[inline(always)]
    fn column(&self, t: usize, c: usize) -> &Tile<S> {
        &self.columns[tile_index::<S>(t, c, self.rows.count())]
    }
}

impl<S: Simd> Tiles<S> for RootTiles<'_, S> {
    const BELOW_ROOT: bool = false;
    const HAS_OFFSET: bool = true;

    #[inline(always)]
    fn stores_rows(&self) -> bool {
        false
    }

    #[inline(always)]
    fn correlate(&self, simd: S, t: usize, correlations: &mut [Tile<S>]) {
        let newest = self.column(t, self.rows.count() - 1);
        correlate(simd, self.differences, self.dictionary, (t, newest), correlations);
    }

    #[inline(always)]
    fn tile(&mut self, simd: S, t: usize) -> SharedTile<S> {
        let zero = [simd.splat_f32s(0.0); TILE];
        let mut shared = SharedTile { weights: zero, squares: zero, divisors: self.divisors[t] };
        add(simd, &mut shared.divisors, NEARLY_ONE);
        for c in 0..self.rows.count() {
            let mut y = *self.column(t, c);
            add(simd, &mut y, 1.0);
            add_squares(simd, &mut shared.squares, &y);
        }
        shared
    }

    #[inline(always)]
    fn at(&self, k: usize) -> [f32; 3] {
        let mut squares = 0.0;
        for c in 0..self.rows.count() {
            squares += (self.rows.column_at(k, c) + 1.0).powi(2);
        }
        [0.0, squares, self.rows.divisors[k] + NEARLY_ONE]
    }
}

impl<S: Simd, const FIRST: bool> Tiles<S> for ChildTiles<'_, S, FIRST> {
    const BELOW_ROOT: bool = true;
    const HAS_OFFSET: bool = FIRST;

    #[inline(always)]
    fn stores_rows(&self) -> bool {
        self.stored.is_some()
    }

    #[inline(always)]
    fn correlate(&self, _: S, _: usize, _: &mut [Tile<S>]) {}

    #[inline(always)]
    fn tile(&mut self, simd: S, t: usize) -> SharedTile<S> {
        let Self { recurrence, gram, above, columns, divisors, stored } = self;
        let above = &above[..recurrence.above.len()];
        let w = recurrence.weights::<S, FIRST>(simd, gram[t], above, t);
        let divisors = recurrence.update_divisors::<S, FIRST>(simd, &w, divisors[t], t);
        let mut shared = SharedTile { weights: w, squares: [simd.splat_f32s(0.0); TILE], divisors };
        let (first, step) = panel::<S>(t, recurrence.projections.len());
        let own = stored.as_mut().map(|stored| {
            (stored.weights[t], stored.divisors[t]) = (w, divisors);
            &mut stored.columns[first..]
        });
        let columns = (&columns[first..], own);
        update_columns::<S, FIRST>(simd, columns, step, recurrence, &mut shared);
        shared
    }

    #[inline(always)]
    fn at(&self, k: usize) -> [f32; 3] {
        self.recurrence.at::<FIRST>(k)
    }
}

/// Adds up the squares of what the node leaves of its parent's columns, every `step`th of these tiles,
/// and writes it where it has its own.
#[inline(always)]
fn update_columns<S: Simd, const FIRST: bool>(
    simd: S,
    (columns, mut own): (&[Tile<S>], Option<&mut [Tile<S>]>),
    step: usize,
    recurrence: &Recurrence<'_>,
    shared: &mut SharedTile<S>,
) {
    for (c, (&projection, &offset)) in
        recurrence.projections.iter().zip(recurrence.offsets).enumerate()
    {
        let mut y = columns[c * step];
        subtract_scaled(simd, &mut y, &shared.weights, projection);
        if FIRST {
            add(simd, &mut y, offset);
        }
        add_squares(simd, &mut shared.squares, &y);
        if let Some(own) = &mut own {
            own[c * step] = y;
        }
    }
}

impl Recurrence<'_> {
    /// The weights of a tile.
    #[inline(always)]
    fn weights<S: Simd, const FIRST: bool>(
        &self,
        simd: S,
        gram: Tile<S>,
        above: &[&[Tile<S>]],
        t: usize,
    ) -> Tile<S> {
        let (mut w, inverse) = (gram, simd.splat_f32s(self.inverse));
        if FIRST {
            let weight_offset = simd.splat_f32s(self.weight_offset);
            return w.map(|w| mul_add(simd, w, inverse, weight_offset));
        }
        add(simd, &mut w, self.weight_offset);
        for (rows, &projection) in above.iter().zip(&self.triangle) {
            subtract_scaled(simd, &mut w, &rows[t], projection);
        }
        w.map(|w| simd.mul_f32s(w, inverse))
    }

    #[inline(always)]
    fn at<const FIRST: bool>(&self, k: usize) -> [f32; 3] {
        let w = if FIRST {
            self.gram[k] * self.inverse + self.weight_offset
        } else {
            let subtract_scaled =
                |w, (rows, projection): (&Rows, &f32)| w - rows.weights[k] * projection;
            let above = self.above.iter().zip(&self.triangle);
            above.fold(self.gram[k] + self.weight_offset, subtract_scaled) * self.inverse
        };
        let mut squares = 0.0;
        for (c, (projection, offset)) in self.projections.iter().zip(self.offsets).enumerate() {
            let y = self.parent.column_at(k, c) - w * projection;
            squares += if FIRST { y + offset } else { y }.powi(2);
        }
        let above = self.parent.divisors[k];
        if k == self.atom {
            return [w, squares, EXCLUDED];
        }
        let size = if FIRST { w } else { w.abs() };
        [w, squares, above - (size + self.loss.0) * size - self.loss.1]
    }

    /// What scores are divided by, at least: `||d_res||^2` loses `w^2`, and what that may be off. The node's own atom is dead.
    #[inline(always)]
    fn update_divisors<S: Simd, const FIRST: bool>(
        &self,
        simd: S,
        w: &Tile<S>,
        above: Tile<S>,
        t: usize,
    ) -> Tile<S> {
        let mut divisors = above;
        let (more, constant) = (simd.splat_f32s(self.loss.0), simd.splat_f32s(self.loss.1));
        for i in 0..TILE {
            let size = if FIRST { w[i] } else { simd.abs_f32s(w[i]) };
            let slope = simd.neg_f32s(simd.add_f32s(size, more));
            let left = mul_add(simd, slope, size, divisors[i]);
            divisors[i] = simd.sub_f32s(left, constant);
        }
        if self.atom / (TILE * S::F32_LANES) == t {
            exclude(simd, &mut divisors, self.atom);
        }
        divisors
    }
}

/// Marks the atom as one that can't be chosen. By comparing: a number written into a vector would take the whole tile through memory.
#[inline(always)]
fn exclude<S: Simd>(simd: S, divisors: &mut Tile<S>, atom: usize) {
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
        divisors[i] = simd.select_f32s(chosen, simd.splat_f32s(EXCLUDED), divisors[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::instructions::Instructions;
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;
    use pulp::WithSimd;

    const DIM: usize = 16;
    const RULES: CodeRules = CodeRules { atoms: MAX_ATOMS, min_residual: 1e-6 };

    /// Vectors that are positive and alike, as patches are, with this much texture; every third is nearly that before it.
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

    /// What a few atoms leave of vectors, by Gram and Schmidt in `f64`.
    #[derive(Default)]
    struct Truth(Vec<Vec<f64>>);

    impl Truth {
        fn rest(&self, vector: &[f32]) -> Vec<f64> {
            let mut left: Vec<f64> = vector.iter().map(|&v| f64::from(v)).collect();
            for q in self.0.iter().chain(&self.0) {
                let projection = dot(q, &left);
                left.iter_mut().zip(q).for_each(|(l, q)| *l -= projection * q);
            }
            left
        }

        fn add(&mut self, atom: &[f32]) {
            let mut direction = self.rest(atom);
            let norm = dot(&direction, &direction).sqrt();
            direction.iter_mut().for_each(|v| *v /= norm);
            self.0.push(direction);
        }
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Takes these atoms one after the other, as far as they are eligible, and holds each node's rows to the truth. Gives what they say of their errors.
    struct Descend<'a> {
        dictionary: &'a Dictionary,
        shared: &'a [f32],
        atoms: &'a [usize],
    }

    impl WithSimd for Descend<'_> {
        type Output = Vec<Errors>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<Errors> {
            let Self { dictionary, shared, atoms } = self;
            let (mut root, mut nodes) = (Node::default(), Vec::new());
            root.fill_root(simd, shared);
            let mut rows = vec![Rows::default()];
            rows[0].fill_root(simd, &mut Vec::new(), dictionary, &root, &RULES);
            let mut truth = Truth::default();
            self.check(&rows[0], &truth);
            for &atom in atoms {
                let left = truth.rest(dictionary.atom(atom));
                if dot(&left, &left) < RULES.min_residual {
                    continue;
                }
                let mut node = Node::default();
                node.fill(simd, dictionary, Path { root: &root, nodes: &nodes }, atom);
                nodes.push(node);
                truth.add(dictionary.atom(atom));
                let (path, mut new) = (Path { root: &root, nodes: &nodes }, Rows::default());
                let above = (&rows[0], &rows[1..]);
                let single = if nodes.len() == 1 {
                    let tiles = new.child_tiles::<S, true>(dictionary, path, above, &RULES).0;
                    let single = make_tiles(simd, dictionary, tiles);
                    new.measure_residuals(simd);
                    single
                } else {
                    let tiles = new.child_tiles::<S, false>(dictionary, path, above, &RULES).0;
                    make_tiles(simd, dictionary, tiles)
                };
                self.check(&new, &truth);
                for (k, [weight, _, divisor]) in single.into_iter().enumerate() {
                    self.check_atom(&new, &truth, k, (weight, divisor));
                }
                rows.push(new);
            }
            rows.into_iter().map(|rows| rows.errors).collect()
        }
    }

    /// Makes all tiles, and says what the same are of each atom alone.
    #[inline(always)]
    fn make_tiles<S: Simd, const FIRST: bool>(
        simd: S,
        dictionary: &Dictionary,
        mut tiles: ChildTiles<'_, S, FIRST>,
    ) -> Vec<[f32; 3]> {
        let single = (0..dictionary.len()).map(|k| tiles.at(k)).collect();
        for t in 0..dictionary.stride() / (TILE * S::F32_LANES) {
            tiles.tile(simd, t);
        }
        single
    }

    impl Descend<'_> {
        fn check(&self, rows: &Rows, truth: &Truth) {
            for k in 0..self.dictionary.len() {
                let weight = rows.weights.get(k).copied().unwrap_or_default();
                let less = if truth.0.is_empty() { 1.0 } else { 0.0 };
                self.check_atom(rows, truth, k, (weight, rows.divisors[k]));
                let atom: Vec<f64> =
                    self.dictionary.atom(k).iter().map(|&v| f64::from(v)).collect();
                for (c, column) in self.shared.chunks_exact(DIM).enumerate() {
                    let off =
                        dot(&truth.rest(column), &atom) - less - f64::from(rows.column_at(k, c));
                    assert!(off.abs() <= rows.errors.columns[c], "column {c}: {off}");
                }
            }
        }

        /// A weight, and a divisor.
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
                let (rest, divisor) = (truth.rest(atom), f64::from(divisor + at_root));
                let left = dot(&rest, &rest);
                assert!(
                    divisor <= left && left <= divisor + rows.errors.divisors,
                    "{divisor} {left}"
                );
            }
        }
    }

    /// Where patches have little texture, little is left of the atoms, and the bounds are as much closer.
    #[test]
    fn bounds_are_tight_where_little_is_left() {
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let signals =
            |count, runner: &mut _| vectors(count, 0.01).new_tree(runner).unwrap().current();
        let dictionary = Dictionary::new(DIM, 9, signals(90, &mut runner));
        let shared = signals(4, &mut runner);
        for (_, instructions) in Instructions::available() {
            let descend = Descend { dictionary: &dictionary, shared: &shared, atoms: &[3, 16, 31] };
            for (depth, errors) in instructions.dispatch(descend).iter().enumerate().skip(1) {
                println!("{depth} {} {} {:?}", errors.max_left, errors.divisors, errors.columns);
                assert!(errors.max_left < 1e-3, "node {depth}: {errors:?}");
                assert!(errors.divisors < 1e-2 * errors.max_left, "node {depth}: {errors:?}");
                assert!(errors.columns.iter().all(|e| *e < 1e-7), "node {depth}: {errors:?}");
            }
        }
    }

    proptest! {
        /// The bounds that the proof begins with.
        #[test]
        fn errors_stay_within_their_bounds(
            (atoms, shared) in prop_oneof![Just(0.8), Just(0.01), Just(1e-4)]
                .prop_flat_map(|texture| (vectors(90, texture), vectors(4, texture))),
            path in prop::collection::vec(0..90usize, 5),
        ) {
            let dictionary = Dictionary::new(DIM, 9, atoms);
            for (_, instructions) in Instructions::available() {
                instructions.dispatch(Descend { dictionary: &dictionary, shared: &shared, atoms: &path });
            }
        }
    }
}
