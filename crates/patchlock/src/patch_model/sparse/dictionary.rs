//! The dictionary (Eq. 1-2): the normalised patches of all templates at all locations.
//!
//! It has `K = templates * locations` atoms of `dim` samples. Atom `j * locations + i` is location
//! `i` of template `j`. An atom has norm 1, or 0 if its patch was all zero.

use super::gram;
use super::somp::vectors::widen;
use crate::numeric::aligned::AlignedVec;

/// Atoms and what is derived from them: squared norms, and for many candidates the products.
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
    spread: f64,
    products: Option<Products>,
}

/// The atoms in the layout of the matrix product, and their inner products: six times the memory
/// of the atoms, and worth it for many candidates. For one, a solver makes what it needs.
#[derive(Debug, Clone, Default)]
pub struct Products {
    /// See [`Dictionary::fill_panels`].
    pub panels: AlignedVec,
    /// The inner products of each atom with all atoms, minus 1, computed in `f64` and rounded once:
    /// one row per atom, as long as the padded rows over all atoms. The padding holds -1.
    pub gram: AlignedVec,
}

/// Buffers of [`Dictionary::fill`].
#[derive(Debug, Default)]
pub struct DictionaryScratch {
    /// The panels in `f64`.
    wide: Vec<f64>,
    /// The mean of all atoms.
    mean: Vec<f64>,
}

impl DictionaryScratch {
    /// The panels in `f64`.
    pub fn wide_panels(&mut self, products: &Products) -> &[f64] {
        widen(&mut self.wide, &products.panels);
        &self.wide
    }
}

/// The largest dictionary, in atoms; its Gram matrix then takes 512 MiB.
pub const MAX_DICTIONARY: usize = 8192;

/// Rows over all atoms are padded to a multiple of this: four of the widest vectors.
pub const LANES: usize = 64;

impl Dictionary {
    /// A dictionary without atoms, which keeps its products from when it is filled, or does not.
    pub fn empty(keeps_products: bool) -> Self {
        Self { products: keeps_products.then(Products::default), ..Self::default() }
    }

    /// A dictionary of the atoms in `atoms`, stored one after the other, `dim` samples each. It
    /// keeps its products.
    #[cfg(feature = "internals")]
    pub fn new(dim: usize, locations: usize, atoms: Vec<f32>) -> Self {
        let mut dictionary = Self::empty(true);
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
        self.find_spread(&mut scratch.mean);
        if let Some(mut products) = self.products.take() {
            self.fill_panels(&mut products.panels);
            products.gram.reset(self.count * self.stride);
            gram::fill(scratch.wide_panels(&products), self.dim, &mut products.gram);
            self.products = Some(products);
        }
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

    /// Fills in the samples in panels of [`LANES`] atoms. A panel has `dim` rows; row `s` holds
    /// sample `s` of each of its atoms. The last panel is padded with zero atoms.
    pub fn fill_panels(&self, panels: &mut AlignedVec) {
        panels.reset(self.dim * self.stride);
        for (k, atom) in self.atoms.chunks_exact(self.dim.max(1)).enumerate() {
            let panel = &mut panels[k / LANES * LANES * self.dim..][..LANES * self.dim];
            for (row, &sample) in panel.chunks_exact_mut(LANES).zip(atom) {
                row[k % LANES] = sample;
            }
        }
    }

    /// The products, if they are kept.
    pub fn products(&self) -> Option<&Products> {
        self.products.as_ref()
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

    /// The squared norms of all atoms.
    pub fn squared_norms(&self) -> &[f64] {
        &self.squared_norms
    }

    /// The location of an atom.
    pub fn location(&self, k: usize) -> usize {
        k % self.locations
    }

    /// Upper bound of the difference from 1 of any inner product of two nonzero atoms, and of any
    /// squared norm.
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Finds the spread. The inner product of two atoms is half the sum of their squared norms minus
    /// half their squared distance, which is at most the sum of their distances from the mean.
    fn find_spread(&mut self, mean: &mut Vec<f64>) {
        let Self { dim, count, atoms, squared_norms, .. } = self;
        let nonzero = |&(_, norm): &(&[f32], &f64)| *norm > 0.0;
        let each = || atoms.chunks_exact((*dim).max(1)).zip(&*squared_norms).filter(nonzero);
        mean.clear();
        mean.resize(*dim, 0.0);
        for (atom, _) in each() {
            mean.iter_mut().zip(atom).for_each(|(mean, &v)| *mean += f64::from(v) / *count as f64);
        }
        let distance = |atom: &[f32]| {
            let squares = atom.iter().zip(&*mean).map(|(&v, mean)| (f64::from(v) - mean).powi(2));
            squares.sum::<f64>()
        };
        let farthest = each().map(|(atom, _)| distance(atom)).fold(0.0, f64::max);
        let norms = each().map(|(_, norm)| (norm - 1.0).abs()).fold(0.0, f64::max);
        self.spread = (2.0 * farthest + norms) * (1.0 + f64::from(f32::EPSILON));
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
        let Products { panels, gram } = d.products().unwrap();
        for i in 0..count {
            let row = &gram[i * d.stride()..][..d.stride()];
            for (j, &entry) in row[..count].iter().enumerate() {
                let dot: f64 = d
                    .atom(i)
                    .iter()
                    .zip(d.atom(j))
                    .map(|(&a, &b)| f64::from(a) * f64::from(b))
                    .sum();
                let less = dot - 1.0;
                assert!((f64::from(entry) - less).abs() <= 6e-8 * less.abs());
                assert!(less.abs() <= d.spread());
            }
            assert!(row[count..].iter().all(|&g| g == -1.0));
            assert_eq!(panels[i / LANES * LANES * dim + 3 * LANES + i % LANES], d.atom(i)[3]);
        }
    }

    #[test]
    fn atoms_that_repeat_an_earlier_one_are_found() {
        let atoms = [[1.0, 0.0], [0.6, 0.8], [1.0, 0.0], [0.0, 0.0], [0.6, 0.8], [1.0, 0.0]];
        let d = Dictionary::new(2, 3, atoms.concat());
        let repeats: Vec<bool> = (0..6).map(|k| d.repeats(k)).collect();
        assert_eq!(repeats, [false, false, true, false, true, true]);
        // That of the first two atoms is 0.4; the zero atom does not count.
        assert!((0.4..0.8).contains(&d.spread()));
    }
}
