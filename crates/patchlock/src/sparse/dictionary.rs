//! The dictionary (Eq. 1-2): the normalised patches of all templates at all locations.
//!
//! `K = templates * locations` atoms of `dim` samples; atom `j * locations + i` is location `i` of template `j`. An atom has
//! norm 1, or 0 where the patch was all zero.

use super::aligned::Aligned;
use rayon::prelude::*;

/// Atoms and what all signals share of them: their squared norms, their samples as the matrix product reads them, and their
/// inner products.
#[derive(Debug, Clone, Default)]
pub struct Dictionary {
    dim: usize,
    locations: usize,
    count: usize,
    stride: usize,
    atoms: Vec<f32>,
    squared_norms: Vec<f64>,
    panels: Aligned,
    gram: Aligned,
}

/// Rows that run over all atoms are padded to a multiple of this: four of the widest vectors.
pub const LANES: usize = 64;

impl Dictionary {
    /// A dictionary of the atoms in `atoms`, one after the other.
    pub fn new(dim: usize, locations: usize, atoms: Vec<f32>) -> Self {
        let mut dictionary = Self::default();
        dictionary.fill(dim, locations, |out| *out = atoms);
        dictionary
    }

    /// Becomes the dictionary of the atoms that `atoms` writes, one after the other, in place of the old ones.
    pub fn fill(&mut self, dim: usize, locations: usize, atoms: impl FnOnce(&mut Vec<f32>)) {
        self.atoms.clear();
        atoms(&mut self.atoms);
        (self.dim, self.locations) = (dim, locations);
        self.count = self.atoms.len() / dim;
        self.stride = self.count.next_multiple_of(LANES);
        let square = |atom: &[f32]| atom.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>();
        self.squared_norms.clear();
        self.squared_norms.extend(self.atoms.chunks_exact(dim).map(square));
        self.fill_panels();
        self.fill_gram();
    }

    fn fill_panels(&mut self) {
        self.panels.reset(self.dim * self.stride);
        for (k, atom) in self.atoms.chunks_exact(self.dim).enumerate() {
            let panel = &mut self.panels[k / LANES * LANES * self.dim..][..LANES * self.dim];
            for (row, &sample) in panel.chunks_exact_mut(LANES).zip(atom) {
                row[k % LANES] = sample;
            }
        }
    }

    /// Samples of an atom.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of locations.
    pub fn locations(&self) -> usize {
        self.locations
    }

    /// Number of atoms.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no atom.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Length of the padded rows that run over all atoms.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// One atom.
    pub fn atom(&self, k: usize) -> &[f32] {
        &self.atoms[k * self.dim..][..self.dim]
    }

    /// The squared norm of an atom, 1 up to rounding, or 0.
    pub fn squared_norm(&self, k: usize) -> f64 {
        self.squared_norms[k]
    }

    /// The location of an atom.
    pub fn location(&self, k: usize) -> usize {
        k % self.locations
    }

    /// The samples in panels of [`LANES`] atoms: a panel has `dim` rows, of which row `s` holds sample `s` of each of its atoms. The
    /// last panel is filled up with zeros.
    pub fn panels(&self) -> &[f32] {
        &self.panels
    }

    /// The inner products of atom `k` with all atoms, computed in `f64` and rounded once, then zeros.
    pub fn gram_row(&self, k: usize) -> &[f32] {
        &self.gram[k * self.stride..][..self.stride]
    }

    /// The Gram matrix, `count` rows of `stride`, some rows at a time so that the wide ones need little room.
    fn fill_gram(&mut self) {
        let Self { dim, count, stride, atoms, gram, .. } = self;
        let (dim, count, stride) = (*dim, *count, *stride);
        let wide: Vec<f64> = atoms[..count * dim].iter().map(|&v| f64::from(v)).collect();
        gram.reset(count * stride);
        gram.par_chunks_mut(GRAM_ROWS * stride).enumerate().for_each(|(block, out)| {
            let rows = &wide[block * GRAM_ROWS * dim..];
            let rows = &rows[..rows.len().min(GRAM_ROWS * dim)];
            let products = inner_products(dim, rows, &wide);
            for (out, products) in out.chunks_exact_mut(stride).zip(products.chunks_exact(count)) {
                out.iter_mut().zip(products).for_each(|(out, &product)| *out = product as f32);
            }
        });
    }
}

/// Rows of the Gram matrix that are computed together.
const GRAM_ROWS: usize = 128;

/// The inner products of each row of `left` with each row of `right`; rows have `dim` samples.
#[allow(unsafe_code)]
fn inner_products(dim: usize, left: &[f64], right: &[f64]) -> Vec<f64> {
    let (rows, columns) = (left.len() / dim, right.len() / dim);
    let mut products = vec![0.0; rows * columns];
    let step = dim as isize;
    // SAFETY: `left` holds rows x dim, `right` columns x dim and `products` rows x columns values, contiguous and row-major; the
    // strides say just that, `right` transposed. `products` is borrowed mutably, so it overlaps neither.
    // Benefit: the library's only entry is a raw one, and its product is some 30 times faster than plain loops.
    unsafe {
        matrixmultiply::dgemm(
            rows,
            dim,
            columns,
            1.0,
            left.as_ptr(),
            step,
            1,
            right.as_ptr(),
            1,
            step,
            0.0,
            products.as_mut_ptr(),
            columns as isize,
            1,
        );
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gram_and_panels_are_the_atoms() {
        let (dim, count) = (5, 70);
        let atoms: Vec<f32> = (0..dim * count).map(|k| ((k * 31 % 17) as f32) / 10.0).collect();
        let d = Dictionary::new(dim, 7, atoms);
        assert_eq!((d.len(), d.stride(), d.location(15)), (70, 128, 1));
        for i in 0..count {
            for j in 0..count {
                let dot: f64 = d
                    .atom(i)
                    .iter()
                    .zip(d.atom(j))
                    .map(|(&a, &b)| f64::from(a) * f64::from(b))
                    .sum();
                assert!((f64::from(d.gram_row(i)[j]) - dot).abs() <= 6e-8 * dot);
            }
            assert!(d.gram_row(i)[count..].iter().all(|&g| g == 0.0));
            assert_eq!(d.panels()[i / LANES * LANES * dim + 3 * LANES + i % LANES], d.atom(i)[3]);
        }
    }
}
