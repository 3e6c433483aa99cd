//! A sparse code: a few atoms of the dictionary and their coefficients.

/// The maximum number of atoms in a code.
pub const MAX_ATOMS: usize = 8;

/// The code of one patch: up to `MAX_ATOMS` atoms, in the order in which they were chosen, with
/// signed coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Code {
    atoms: [u32; MAX_ATOMS],
    coefficients: [f64; MAX_ATOMS],
    length: usize,
}

impl Code {
    /// The chosen atoms (columns of the dictionary).
    pub fn support(&self) -> &[u32] {
        &self.atoms[..self.length]
    }

    /// The coefficients, one per atom.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients[..self.length]
    }

    /// The atoms with their coefficients.
    pub fn entries(&self) -> impl Iterator<Item = (usize, f64)> {
        self.support().iter().zip(self.coefficients()).map(|(&atom, &x)| (atom as usize, x))
    }

    /// A code of these atoms and coefficients; atoms beyond `MAX_ATOMS` are dropped.
    pub fn new(atoms: &[usize], coefficients: &[f64]) -> Self {
        let mut code = Self::default();
        for (&atom, &x) in atoms.iter().zip(coefficients).take(MAX_ATOMS) {
            code.atoms[code.length] = atom as u32;
            code.coefficients[code.length] = x;
            code.length += 1;
        }
        code
    }
}

/// How codes are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodeParams {
    /// Maximum number of atoms in a code; at most `MAX_ATOMS`.
    pub atoms: usize,
    /// An atom is eligible while `||d_res||^2` is at least this.
    pub min_residual: f64,
}

/// Share of the signals' energy that counts as rounding error. The signals are `f32`, whose
/// rounding errors have about 1e-14 of their energy.
const ROUNDING: f64 = 1e-12;

/// The residual energy at which a joint problem is complete; `energy` is the total energy of its
/// signals.
pub fn final_energy(energy: f64) -> f64 {
    ROUNDING * energy
}
