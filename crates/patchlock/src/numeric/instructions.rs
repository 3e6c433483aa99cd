//! The CPU instructions that the tracker uses: the widest that the processor supports, unless the environment
//! variable `PATCHLOCK_SIMD` selects others.
//!
//! Its values are `avx512`, `avx2`, `neon` and `plain`, as far as the processor supports them. The boxes are
//! the same with all of them: candidates and patches have the same bits, and everything that decides about
//! codes is computed in `f64` in a fixed order. `plain` is the same source compiled for every processor of
//! the architecture.

use crate::error::Error;
use pulp::{Arch, Scalar256b, Simd, WithSimd};
use std::env::VarError;
use std::sync::OnceLock;

/// The environment variable that selects the instructions.
pub const VARIABLE: &str = "PATCHLOCK_SIMD";

/// The CPU instructions that the tracker uses.
#[derive(Debug, Clone, Copy)]
pub enum Instructions {
    /// Vector instructions that not every processor of the architecture supports.
    Vectors(Arch),
    /// Instructions that every processor of the architecture supports.
    Plain,
}

impl Instructions {
    /// The instructions that [`VARIABLE`] names, or the widest that the processor supports. The variable is
    /// read once.
    ///
    /// # Errors
    /// [`Error::Instructions`] if the variable holds an unknown name or one that this processor does not
    /// support.
    pub fn chosen() -> Result<Self, Error> {
        static CHOSEN: OnceLock<Result<Instructions, Error>> = OnceLock::new();
        let read = || match std::env::var(VARIABLE) {
            Ok(name) => Self::named(&name),
            Err(VarError::NotUnicode(name)) => Self::named(&name.to_string_lossy()),
            Err(VarError::NotPresent) => Ok(Self::widest()),
        };
        CHOSEN.get_or_init(read).clone()
    }

    fn widest() -> Self {
        match Arch::new() {
            Arch::Scalar => Self::Plain,
            arch => Self::Vectors(arch),
        }
    }

    /// All instructions that this processor supports, with their names.
    pub fn available() -> Vec<(&'static str, Self)> {
        let mut all = vec![("plain", Self::Plain)];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(pulp::x86::V3::try_new().map(|v| ("avx2", Self::Vectors(Arch::V3(v)))));
            all.extend(pulp::x86::V4::try_new().map(|v| ("avx512", Self::Vectors(Arch::V4(v)))));
        }
        #[cfg(target_arch = "aarch64")]
        if let arch @ Self::Vectors(_) = Self::widest() {
            all.push(("neon", arch));
        }
        all
    }

    /// The instructions of this name.
    ///
    /// # Errors
    /// [`Error::Instructions`] if the name is unknown or this processor does not support them.
    pub fn named(name: &str) -> Result<Self, Error> {
        let available = Self::available();
        let found = available.iter().find(|(known, _)| *known == name);
        found.map(|&(_, instructions)| instructions).ok_or_else(|| Error::Instructions {
            variable: VARIABLE,
            value: name.to_owned(),
            allowed: available.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Runs `op` compiled for these instructions.
    #[inline]
    pub fn dispatch<Op: WithSimd>(self, op: Op) -> Op::Output {
        match self {
            Self::Vectors(arch) => arch.dispatch(op),
            Self::Plain => Scalar256b.vectorize(op),
        }
    }
}

impl Default for Instructions {
    /// The chosen instructions, or the plain ones if the choice is an error.
    fn default() -> Self {
        Self::chosen().unwrap_or(Self::Plain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_checked() {
        for (name, _) in Instructions::available() {
            assert!(Instructions::named(name).is_ok());
        }
        let error = Instructions::named("mmx").unwrap_err().to_string();
        assert!(error.contains("PATCHLOCK_SIMD") && error.contains("mmx"), "{error}");
        assert!(error.contains("plain"), "{error}");
    }
}
