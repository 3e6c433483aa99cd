//! The dictionary (Eq. 1-2): the normalised patches of all templates at all locations.
//!
//! `K = templates * locations` atoms of `dim` samples; atom `j * locations + i` is location `i` of template `j`. An atom has
//! norm 1, or 0 where the patch was all zero.

/// Atoms and what all signals share of them: transposed atoms for the matrix product, squared norms and the Gram matrix.
#[derive(Debug, Clone)]
pub struct Dictionary {
    dim: usize,
    locations: usize,
    count: usize,
    stride: usize,
    atoms: Vec<f32>,
    transposed: Vec<f32>,
    squared_norms: Vec<f64>,
    gram: Vec<f64>,
}

/// Rows that run over all atoms are padded to a multiple of this: four of the widest vectors.
pub const LANES: usize = 64;

impl Dictionary {
    /// A dictionary of the atoms in `atoms`, one after the other.
    pub fn new(dim: usize, locations: usize, atoms: Vec<f32>) -> Self {
        let count = atoms.len() / dim;
        let stride = count.next_multiple_of(LANES);
        let mut transposed = vec![0.0; dim * stride];
        for (k, atom) in atoms.chunks_exact(dim).enumerate() {
            for (row, &sample) in atom.iter().enumerate() {
                transposed[row * stride + k] = sample;
            }
        }
        let square = |atom: &[f32]| atom.iter().map(|&v| f64::from(v).powi(2)).sum();
        let squared_norms = atoms.chunks_exact(dim).map(square).collect();
        let gram = gram(dim, count, stride, &atoms);
        Self { dim, locations, count, stride, atoms, transposed, squared_norms, gram }
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

    /// `dim` rows of `stride` samples: row `s` holds sample `s` of every atom, then zeros.
    pub fn transposed(&self) -> &[f32] {
        &self.transposed
    }

    /// The inner products of atom `k` with all atoms, then zeros.
    pub fn gram_row(&self, k: usize) -> &[f64] {
        &self.gram[k * self.stride..][..self.stride]
    }
}

/// The Gram matrix, `count` rows of `stride`.
#[allow(unsafe_code)]
fn gram(dim: usize, count: usize, stride: usize, atoms: &[f32]) -> Vec<f64> {
    let wide: Vec<f64> = atoms[..count * dim].iter().map(|&v| f64::from(v)).collect();
    let mut gram = vec![0.0; count * stride];
    let step = dim as isize;
    // SAFETY: `wide` holds count x dim and `gram` count x stride values, contiguous and row-major, and count <= stride; the
    // strides say just that, once as it is and once transposed. `gram` is borrowed mutably, so it does not overlap `wide`.
    // Benefit: the library's only entry is a raw one, and its product is some 30 times faster than plain loops.
    unsafe {
        matrixmultiply::dgemm(
            count,
            dim,
            count,
            1.0,
            wide.as_ptr(),
            step,
            1,
            wide.as_ptr(),
            1,
            step,
            0.0,
            gram.as_mut_ptr(),
            stride as isize,
            1,
        );
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gram_and_transpose_are_the_atoms() {
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
                assert!((d.gram_row(i)[j] - dot).abs() <= 1e-12);
            }
            assert!(d.gram_row(i)[count..].iter().all(|&g| g == 0.0));
            assert_eq!(d.transposed()[3 * d.stride() + i], d.atom(i)[3]);
        }
    }
}
