//! The dictionary (Eq. 1-2): the normalised patches of all templates at all locations.
//!
//! It has `K = templates * locations` atoms of `dim` samples. Atom `j * locations + i` is location
//! `i` of template `j`. An atom has norm 1, or 0 if its patch was all zero.

use super::gram;
use crate::numeric::aligned::Aligned;

/// Atoms and what is derived from them: squared norms, the samples in the layout of the matrix
/// product, and inner products.
#[derive(Debug, Clone, Default)]
pub struct Dictionary {
    dim: usize,
    locations: usize,
    count: usize,
    stride: usize,
    atoms: Vec<f32>,
    squared_norms: Vec<f64>,
    /// The atoms, sorted so that identical ones are neighbours, and a flag for each that repeats an
    /// earlier one.
    sorted: Vec<u32>,
    repeats: Vec<bool>,
    panels: Aligned,
    gram: Aligned,
    /// 1 for a nonzero atom, else 0.
    nonzero: Vec<f32>,
    spread: f64,
}

/// Buffers of [`Dictionary::fill`].
#[derive(Debug, Default)]
pub struct DictionaryScratch {
    /// The panels in `f64`, for the inner products.
    wide: Vec<f64>,
}

/// The largest dictionary, in atoms; its Gram matrix then takes 512 MiB.
pub const MAX_DICTIONARY: usize = 8192;

/// Rows over all atoms are padded to a multiple of this: four of the widest vectors.
pub const LANES: usize = 64;

impl Dictionary {
    /// A dictionary of the atoms in `atoms`, stored one after the other, `dim` samples each.
    pub fn new(dim: usize, locations: usize, atoms: Vec<f32>) -> Self {
        let mut dictionary = Self::default();
        dictionary.fill(dim, locations, |out| *out = atoms, &mut DictionaryScratch::default());
        dictionary
    }

    /// Replaces the atoms by those that the function `atoms` writes, one after the other.
    pub fn fill(
        &mut self,
        dim: usize,
        locations: usize,
        atoms: impl FnOnce(&mut Vec<f32>),
        scratch: &mut DictionaryScratch,
    ) {
        self.atoms.clear();
        atoms(&mut self.atoms);
        (self.dim, self.locations) = (dim, locations);
        self.count = self.atoms.len() / dim;
        self.stride = self.count.next_multiple_of(LANES);
        let square = |atom: &[f32]| atom.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>();
        self.squared_norms.clear();
        self.squared_norms.extend(self.atoms.chunks_exact(dim).map(square));
        self.find_repeats();
        self.fill_panels();
        self.fill_gram(scratch);
    }

    fn find_repeats(&mut self) {
        let Self { sorted, repeats, atoms, dim, count, .. } = self;
        let bits = |k: u32| atoms[k as usize * *dim..][..*dim].iter().map(|v| v.to_bits());
        sorted.clear();
        sorted.extend(0..*count as u32);
        sorted.sort_unstable_by(|&a, &b| bits(a).cmp(bits(b)).then(a.cmp(&b)));
        repeats.clear();
        repeats.resize(*count, false);
        for pair in sorted.windows(2) {
            repeats[pair[1] as usize] = bits(pair[0]).eq(bits(pair[1]));
        }
    }

    /// Whether an earlier atom has the same samples, bit for bit.
    pub fn repeats(&self, k: usize) -> bool {
        self.repeats[k]
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

    /// Number of samples of an atom.
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

    /// Length of the padded rows over all atoms.
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

    /// The samples in panels of [`LANES`] atoms. A panel has `dim` rows; row `s` holds sample `s`
    /// of each of its atoms. The last panel is padded with zero atoms.
    pub fn panels(&self) -> &[f32] {
        &self.panels
    }

    /// The inner products of atom `k` with all atoms, minus 1, computed in `f64` and rounded once.
    /// The padding holds -1, as for zero atoms.
    pub fn gram_row(&self, k: usize) -> &[f32] {
        &self.gram[k * self.stride..][..self.stride]
    }

    /// Upper bound of the difference from 1 of any inner product of two nonzero atoms, and of any
    /// squared norm.
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Fills the Gram matrix: `count` rows of `stride` entries.
    fn fill_gram(&mut self, DictionaryScratch { wide }: &mut DictionaryScratch) {
        let Self { dim, count, stride, panels, gram, .. } = self;
        wide.clear();
        wide.extend(panels.iter().map(|&v| f64::from(v)));
        gram.reset(*count * *stride);
        gram::fill(wide, *dim, gram);
        self.find_spread();
    }

    /// Finds the spread from half of the Gram matrix; the other half is the same.
    fn find_spread(&mut self) {
        let Self { stride, squared_norms, gram, nonzero, .. } = self;
        nonzero.clear();
        nonzero.extend(squared_norms.iter().map(|&norm| if norm > 0.0 { 1.0 } else { 0.0 }));
        nonzero.resize(*stride, 0.0);
        let mut farthest = [0.0f32; LANES];
        for (k, row) in gram.chunks_exact((*stride).max(1)).enumerate() {
            let parts = row[..(k / LANES + 1) * LANES].chunks_exact(LANES);
            for (row, own) in parts.zip(nonzero.chunks_exact(LANES)) {
                // This form compiles to vector instructions.
                for ((farthest, product), own) in farthest.iter_mut().zip(row).zip(own) {
                    let far = product.abs() * own * nonzero[k];
                    *farthest = if far > *farthest { far } else { *farthest };
                }
            }
        }
        let most = farthest.into_iter().fold(0.0, f32::max);
        self.spread = f64::from(most) * (1.0 + f64::from(f32::EPSILON));
    }
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
                let less = dot - 1.0;
                assert!((f64::from(d.gram_row(i)[j]) - less).abs() <= 6e-8 * less.abs());
                assert!(less.abs() <= d.spread());
            }
            assert!(d.gram_row(i)[count..].iter().all(|&g| g == -1.0));
            assert_eq!(d.panels()[i / LANES * LANES * dim + 3 * LANES + i % LANES], d.atom(i)[3]);
        }
    }

    #[test]
    fn atoms_that_repeat_an_earlier_one_are_found() {
        let atoms = [[1.0, 0.0], [0.6, 0.8], [1.0, 0.0], [0.0, 0.0], [0.6, 0.8], [1.0, 0.0]];
        let d = Dictionary::new(2, 3, atoms.concat());
        let repeats: Vec<bool> = (0..6).map(|k| d.repeats(k)).collect();
        assert_eq!(repeats, [false, false, true, false, true, true]);
        // Between the first two atoms; the zero atom does not count.
        assert!((d.spread() - 0.4).abs() < 1e-6);
    }
}
