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
    gram: Vec<f32>,
}

/// Rows of `f32` that run over all atoms are padded to a multiple of this.
pub const LANES: usize = 16;

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

    /// The inner products of atom `k` with all atoms, then zeros; each is rounded once from `f64`.
    pub fn gram_row(&self, k: usize) -> &[f32] {
        &self.gram[k * self.stride..][..self.stride]
    }
}

/// The Gram matrix, `count` rows of `stride`, computed in `f64` block by block and rounded once.
fn gram(dim: usize, count: usize, stride: usize, atoms: &[f32]) -> Vec<f32> {
    const BLOCK: usize = 64;
    let wide: Vec<f64> = atoms.iter().map(|&v| f64::from(v)).collect();
    let mut gram = vec![0.0; count * stride];
    let mut products = vec![0.0; BLOCK * count];
    for first in (0..count).step_by(BLOCK) {
        let rows = BLOCK.min(count - first);
        multiply_transposed(&wide[first * dim..][..rows * dim], &wide, dim, &mut products);
        for (row, product) in products.chunks_exact(count).take(rows).enumerate() {
            let out = &mut gram[(first + row) * stride..][..count];
            out.iter_mut().zip(product).for_each(|(o, &p)| *o = p as f32);
        }
    }
    gram
}

/// `out = a b^T` for row-major `a` and `b` with rows of `dim`.
#[allow(unsafe_code)]
fn multiply_transposed(a: &[f64], b: &[f64], dim: usize, out: &mut [f64]) {
    let (rows, columns) = (a.len() / dim, b.len() / dim);
    assert!(out.len() >= rows * columns);
    let step = dim as isize;
    // SAFETY: `a` holds rows x dim, `b` columns x dim and `out` (checked above) rows x columns values, all contiguous, which is
    // what the strides say; `out` is borrowed mutably, so it overlaps neither. Benefit: the library's only entry is a raw
    // one, and its product is some 30 times faster than plain loops.
    unsafe {
        matrixmultiply::dgemm(
            rows,
            dim,
            columns,
            1.0,
            a.as_ptr(),
            step,
            1,
            b.as_ptr(),
            1,
            step,
            0.0,
            out.as_mut_ptr(),
            columns as isize,
            1,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gram_and_transpose_are_the_atoms() {
        let (dim, count) = (5, 70);
        let atoms: Vec<f32> = (0..dim * count).map(|k| ((k * 31 % 17) as f32) / 10.0).collect();
        let d = Dictionary::new(dim, 7, atoms);
        assert_eq!((d.len(), d.stride(), d.location(15)), (70, 80, 1));
        for i in 0..count {
            for j in 0..count {
                let dot: f64 = d
                    .atom(i)
                    .iter()
                    .zip(d.atom(j))
                    .map(|(&a, &b)| f64::from(a) * f64::from(b))
                    .sum();
                assert!((f64::from(d.gram_row(i)[j]) - dot).abs() <= 1e-7 * dot.abs());
            }
            assert!(d.gram_row(i)[count..].iter().all(|&g| g == 0.0));
            assert_eq!(d.transposed()[3 * d.stride() + i], d.atom(i)[3]);
        }
    }
}
