//! The `f32` data of the screen at a node: rows over all atoms, each with an error bound. The head
//! of [`batched`](super::batched) defines the symbols and derives the bounds.

use super::errors::{Errors, Margins, SECOND_ORDER};
use super::node::{Node, Path};
use super::product::correlate;
use super::vectors::{
    TILE, Tile, U, add, add_squares, mul_add, panel, subtract_scaled, tile_index, tiles, tiles_mut,
    widen,
};
use crate::numeric::aligned::AlignedVec;
use crate::patch_model::sparse::codes::{CodeParams, MAX_ATOMS};
use crate::patch_model::sparse::dictionary::{Dictionary, LANES};
use crate::patch_model::sparse::gram;
use pulp::Simd;

/// Stored instead of `||d_res||^2` for an atom that cannot be chosen: every score divided by it is
/// negligible. Finite, so that no product is undefined.
pub const EXCLUDED: f32 = 1e36;

/// 1 minus more than the rounding error of adding it.
const NEARLY_ONE: f32 = 1.0 - 4.0 * U as f32;

/// The rows of a node, padded to the dictionary's stride.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// The inner products of the node's atom with all atoms, where they are not kept, and its
    /// samples in `f64`.
    gram: AlignedVec,
    atom: Vec<f64>,
    /// At the root, samples of the shared columns.
    samples: Vec<[f64; gram::SIGNALS]>,
    /// `w_t = D^T q_t`, minus 1 at a first node; empty at the root.
    weights: AlignedVec,
    /// The correlations of the shared columns' residuals with all atoms, one row per column, in
    /// panels; minus 1 at the root. Without shared columns there is one row, for a column of zeros.
    columns: AlignedVec,
    /// For each atom, a lower bound of the divisor of its score, or [`EXCLUDED`]. At the root it is
    /// the divisor minus 1, rounded rather than bounded.
    divisors: AlignedVec,
    /// `p` of each column along the node's direction; zeros without shared columns.
    projections: Vec<f32>,
    /// `1 - p` of each column, which a first node adds.
    offsets: Vec<f32>,
    /// Error bounds of the rows.
    pub errors: Errors,
}

/// A dictionary with the products of its atoms.
#[derive(Debug, Clone, Copy)]
pub struct Atoms<'a> {
    /// The atoms.
    pub dictionary: &'a Dictionary,
    /// Their panels.
    pub panels: &'a [f32],
    /// Their inner products.
    pub gram: Gram<'a>,
}

/// The inner products of all atoms.
#[derive(Debug, Clone, Copy)]
pub enum Gram<'a> {
    /// All rows, one after the other.
    Kept(&'a [f32]),
    /// The panels in `f64`, from which a row is made when a node needs it.
    DictionaryPanels(&'a [f64]),
}

/// A tile of the data that all candidates at a node share. Aligned, because loading a vector that
/// straddles two cache lines costs twice as much.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct SharedTile<S: Simd> {
    /// `w_t`; zeros at the root.
    pub weights: Tile<S>,
    /// For each atom, the sum of the squared correlations of all shared columns.
    pub squares: Tile<S>,
    /// Lower bounds of the divisors of the scores.
    pub divisors: Tile<S>,
}

/// Makes the tiles of the root one by one, and correlates the candidates.
#[derive(Debug, Clone, Copy)]
pub struct RootTiles<'a, S: Simd> {
    panels: (&'a [f32], usize),
    /// The candidates minus the newest column.
    differences: &'a [f32],
    rows: &'a Rows,
    columns: &'a [Tile<S>],
    divisors: &'a [Tile<S>],
}

/// Makes the tiles of a child, of the root or of a deeper node, one by one. Its rows are split into
/// tiles once, because splitting them costs more than computing a tile.
#[derive(Debug)]
pub struct ChildTiles<'a, S: Simd, const FIRST: bool> {
    recurrence: Recurrence<'a>,
    gram: &'a [Tile<S>],
    /// The weights of the nodes above.
    above: [&'a [Tile<S>]; MAX_ATOMS],
    /// The parent's rows.
    columns: &'a [Tile<S>],
    divisors: &'a [Tile<S>],
    /// The child's own rows, if it can have children.
    stored: Option<StoredRows<'a, S>>,
}

/// The recurrence that computes a child's entries from those of the nodes above.
#[derive(Debug)]
struct Recurrence<'a> {
    /// Number of nodes above, without the root.
    depth: usize,
    /// `q_s^T d` of the new atom for each node above, the inverse of the norm of its residual, and
    /// `p` of each column.
    triangle: [f32; MAX_ATOMS],
    inverse: f32,
    projections: &'a [f32],
    /// Corrections for entries stored minus 1. `weight_offset` is added to the weights, at a first
    /// node after scaling them; `offsets` are added to the columns.
    weight_offset: f32,
    offsets: &'a [f32],
    atom: usize,
    loss: (f32, f32),
}

/// The rows that a child stores for its own children.
#[derive(Debug)]
struct StoredRows<'a, S: Simd> {
    weights: &'a mut [Tile<S>],
    columns: &'a mut [Tile<S>],
    divisors: &'a mut [Tile<S>],
}

/// A source of tiles.
pub trait Tiles<S: Simd> {
    /// Whether the newest atom must be projected out of the candidates' correlations.
    const BELOW_ROOT: bool;

    /// Whether the correlations are stored minus 1.
    const HAS_OFFSET: bool;

    /// Whether the updated correlations are stored for child nodes.
    fn stores_rows(&self) -> bool;

    /// Correlates the candidates with the atoms of tile `t`, unless their correlations are stored
    /// already.
    fn correlate(&self, simd: S, t: usize, correlations: &mut [Tile<S>]);

    /// Makes tile `t`.
    fn tile(&mut self, simd: S, t: usize) -> SharedTile<S>;
}

impl Rows {
    /// Fills in the rows of the root. `panels`: those of the dictionary, in `f64`.
    #[inline(always)]
    pub fn fill_root<S: Simd>(
        &mut self,
        simd: S,
        (dictionary, panels): (&Dictionary, &[f64]),
        root: &Node,
        params: &CodeParams,
    ) {
        let (dim, stride, count) = (dictionary.dim(), dictionary.stride(), dictionary.len());
        let columns = (root.residuals.len() / dim).max(1);
        self.columns.resize(columns * stride);
        let spread = if root.residuals.is_empty() {
            self.columns.fill(-1.0);
            SECOND_ORDER
        } else {
            let Self { samples, columns, .. } = self;
            gram::fill_columns(simd, &root.residuals, (panels, dim), samples, columns);
            SECOND_ORDER * f64::from(largest(dictionary, &self.columns))
        };
        self.errors.columns.clear();
        self.errors.columns.resize(columns, U * spread);
        (self.errors.spread, self.errors.divisors) = (spread, 8.0 * U);
        self.errors.max_residual = 1.0 + 8.0 * U;
        self.divisors.resize(stride);
        self.divisors.fill(EXCLUDED);
        for (k, divisor) in self.divisors.iter_mut().take(count).enumerate() {
            let norm = dictionary.squared_norm(k);
            // An atom that repeats an earlier one has the same score and loses the tie. Once the
            // earlier one has been chosen, it has no residual.
            if norm >= params.min_residual && !dictionary.repeats(k) {
                *divisor = (norm - 1.0) as f32;
            }
        }
    }

    /// Tightens [`Errors::max_residual`] once all tiles have been made: the smaller the residuals
    /// of the atoms, the smaller the errors of deeper nodes.
    #[inline(always)]
    pub fn tighten_max_residual<S: Simd>(&mut self, simd: S) {
        let (excluded, zero) = (simd.splat_f32s(EXCLUDED), simd.splat_f32s(0.0));
        let mut largest = [zero; TILE];
        for tile in tiles::<S>(&self.divisors) {
            for (largest, &divisor) in largest.iter_mut().zip(tile) {
                let possible = simd.less_than_f32s(divisor, excluded);
                *largest = simd.max_f32s(*largest, simd.select_f32s(possible, divisor, zero));
            }
        }
        let largest = largest.into_iter().map(|v| simd.reduce_max_f32s(v)).fold(0.0, f32::max);
        self.errors.max_residual =
            self.errors.max_residual.min(f64::from(largest) + self.errors.divisors);
    }

    /// Number of columns.
    fn count(&self) -> usize {
        self.columns.len() / self.divisors.len().max(1)
    }

    /// The margins of a step at the root.
    #[inline(always)]
    pub fn root_margins(&self) -> Margins {
        self.errors.at_root()
    }

    /// At the root, for a candidate at this distance from the newest column: the error bound of its
    /// correlations, and an upper bound of their `|y'|`.
    #[inline(always)]
    pub fn candidate_bounds(&self, dim: usize, distance: f64) -> (f64, f64) {
        let spread = self.errors.spread + distance;
        (SECOND_ORDER * U * ((dim + 2) as f64 * distance + 2.0 * spread), spread)
    }

    /// Tile `t` of the newest column.
    #[inline(always)]
    pub fn newest_column<S: Simd>(&self, t: usize) -> &Tile<S> {
        &tiles::<S>(&self.columns)[tile_index::<S>(t, self.count() - 1, self.count())]
    }

    /// The tiles of the root.
    #[inline(always)]
    pub fn root_tiles<'a, S: Simd>(
        &'a self,
        atoms: Atoms<'a>,
        differences: &'a [f32],
    ) -> RootTiles<'a, S> {
        let (columns, divisors) = (tiles::<S>(&self.columns), tiles::<S>(&self.divisors));
        let panels = (atoms.panels, atoms.dictionary.dim());
        RootTiles { panels, differences, rows: self, columns, divisors }
    }

    /// The tiles and margins of the node at the end of the path; `FIRST` if its parent is the root.
    /// `root` and `above` are the rows of the nodes above it. Its own rows are complete once all
    /// tiles have been made.
    #[inline(always)]
    pub fn child_tiles<'a, S: Simd, const FIRST: bool>(
        &'a mut self,
        simd: S,
        atoms: Atoms<'a>,
        path: Path<'a>,
        (root, above): (&'a Self, &'a [Self]),
        params: &CodeParams,
    ) -> (ChildTiles<'a, S, FIRST>, Margins) {
        let (node, parent) = (path.end(), above.last().unwrap_or(root));
        let dictionary = atoms.dictionary;
        let margins = self.errors.set_child::<FIRST>(
            path,
            above.iter().map(|rows| &rows.errors),
            &parent.errors,
            dictionary.spread(),
        );
        self.projections.clear();
        self.projections.extend(node.projections.iter().map(|&p| p as f32));
        self.projections.resize(parent.count(), 0.0);
        self.offsets.clear();
        self.offsets.extend(node.projections.iter().map(|&p| (1.0 - p) as f32));
        self.offsets.resize(parent.count(), 1.0);
        let Self { gram, atom, weights, columns, divisors, projections, offsets, errors, .. } =
            self;
        let stride = dictionary.stride();
        let gram: &[f32] = match atoms.gram {
            Gram::Kept(rows) => &rows[node.atom * stride..][..stride],
            Gram::DictionaryPanels(panels) => {
                gram.resize(stride);
                widen(atom, dictionary.atom(node.atom));
                gram::fill_row(simd, atom, panels, gram);
                gram
            }
        };
        let own = [weights, columns, divisors];
        let inverse = 1.0 / node.triangle[above.len()];
        let weight_offset = if FIRST { inverse - 1.0 } else { 1.0 - node.triangle[0] };
        let recurrence = Recurrence {
            depth: above.len(),
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
            // Leaving early keeps the compiler from turning these few iterations into gathers.
            let Some(rows) = above.get(k) else { break };
            *tiles_above = tiles::<S>(&rows.weights);
        }
        let (columns, divisors) = (tiles::<S>(&parent.columns), tiles::<S>(&parent.divisors));
        // The deepest nodes have no children that would read their rows.
        let store = path.nodes.len() + 1 < params.atoms;
        let stored = store.then(|| StoredRows::new(own, parent));
        let gram = tiles::<S>(gram);
        (ChildTiles { recurrence, gram, above: earlier, columns, divisors, stored }, margins)
    }
}

impl<'a, S: Simd> StoredRows<'a, S> {
    /// Resizes the rows to the size of the parent's.
    #[inline(always)]
    fn new([weights, columns, divisors]: [&'a mut AlignedVec; 3], parent: &Rows) -> Self {
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
        correlate(simd, self.differences, self.panels, (t, newest), correlations);
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
        let above = &above[..recurrence.depth];
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
}

/// Updates the parent's columns, which are every `step`th tile, to the child, adds up their
/// squares, and stores them if the child stores its rows.
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

    /// Lower bounds of the divisors: `||d_res||^2` decreases by `w^2` and by its error bound. The
    /// node's own atom is excluded.
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

/// The largest magnitude in the columns (in panels) of any atom that is not zero.
#[inline(always)]
fn largest(dictionary: &Dictionary, columns: &[f32]) -> f32 {
    let panels = columns.chunks_exact(columns.len() / dictionary.stride() * LANES);
    let mut largest = [0.0f32; LANES];
    for (panel, norms) in panels.zip(dictionary.squared_norms().chunks(LANES)) {
        let mut nonzero = [0.0; LANES];
        nonzero.iter_mut().zip(norms).for_each(|(nonzero, &norm)| {
            *nonzero = if norm > 0.0 { 1.0 } else { 0.0 };
        });
        for row in panel.chunks_exact(LANES) {
            // This form compiles to vector instructions.
            for ((largest, entry), nonzero) in largest.iter_mut().zip(row).zip(&nonzero) {
                let far = entry.abs() * nonzero;
                *largest = if far > *largest { far } else { *largest };
            }
        }
    }
    largest.into_iter().fold(0.0, f32::max)
}

/// Marks the atom as excluded. It compares lanes, because writing one lane would move the whole
/// tile through memory.
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
mod tests;
