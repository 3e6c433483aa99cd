//! The CPU instructions that the tracker uses: the widest that the processor supports, unless the
//! environment variable `PATCHLOCK_SIMD` selects others.
//!
//! Its values are `avx512`, `avx2`, `neon` and `plain`, as far as the processor supports them. The
//! boxes are the same with all of them: candidates and patches have the same bits, everything that
//! decides about codes is computed in `f64` in a fixed order, and sums over channels are taken in
//! blocks of a fixed length. `plain` is the same source compiled for every processor of the
//! architecture. Browsers have `simd128`, which rounds sums over channels otherwise. The variable
//! says nothing to the runtime of a network, which always uses the widest instructions that it
//! knows; so with the method `network` boxes can differ between processors.
//!
//! Code becomes vector instructions in two ways. Most of it is plain loops over arrays of a fixed
//! length, which `dispatch!` compiles for each set. Where a sum must have one order, or vectors must
//! stay in registers, it uses pulp's vectors: the sums over channels, `dot_wide`, the Gram matrix
//! and the solver. The head of each module says what that saves, measured in
//! `benchmarks/record/speed.md`.

use crate::error::Error;
#[cfg(target_arch = "aarch64")]
use pulp::aarch64::Neon;
#[cfg(target_arch = "wasm32")]
use pulp::wasm::Simd128;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};
use pulp::{Scalar256b, Simd};
use std::any::TypeId;
use std::env::VarError;
use std::sync::OnceLock;

/// The environment variable that selects the instructions.
pub const VARIABLE: &str = "PATCHLOCK_SIMD";

/// The CPU instructions that the tracker uses.
#[derive(Debug, Clone, Copy)]
pub enum Instructions {
    /// Instructions that every processor of the architecture supports.
    Plain,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    /// AVX-512.
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
    /// NEON.
    #[cfg(target_arch = "aarch64")]
    Neon(Neon),
    /// The 128-bit vectors of WebAssembly. They multiply and add in two steps, so the last digits of
    /// sums are others than elsewhere.
    #[cfg(target_arch = "wasm32")]
    Simd128(Simd128),
}

impl Instructions {
    /// The instructions that [`VARIABLE`] names, or the widest that the processor supports. The
    /// variable is read once.
    ///
    /// # Errors
    /// [`Error::Instructions`] if the variable holds an unknown name or one that this processor
    /// does not support.
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
        Self::available().last().map_or(Self::Plain, |&(_, widest)| widest)
    }

    /// All instructions that this processor supports, with their names; the widest are the last.
    pub fn available() -> Vec<(&'static str, Self)> {
        let plain = ("plain", Self::Plain);
        #[cfg(target_arch = "x86_64")]
        let vectors = [
            V3::try_new().map(|v| ("avx2", Self::Avx2(v))),
            V4::try_new().map(|v| ("avx512", Self::Avx512(v))),
        ];
        #[cfg(target_arch = "aarch64")]
        let vectors = [Neon::try_new().map(|v| ("neon", Self::Neon(v)))];
        #[cfg(target_arch = "wasm32")]
        let vectors = [Simd128::try_new().map(|v| ("simd128", Self::Simd128(v)))];
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")))]
        let vectors: [Option<(&str, Self)>; 0] = [];
        std::iter::once(plain).chain(vectors.into_iter().flatten()).collect()
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
}

/// Evaluates an expression compiled for these instructions, with their vectors as `simd`. It takes
/// what it uses by value: behind references, numbers would not stay in registers.
macro_rules! dispatch {
    ($instructions:expr, |$simd:pat_param| $body:expr) => {
        $crate::numeric::instructions::vectorised!($instructions, |$simd| $body, [])
    };
}

/// The same, but for AVX2 instead of AVX-512: for what gains nothing by wider vectors, so that it
/// is not compiled for them.
macro_rules! dispatch_eight {
    ($instructions:expr, |$simd:pat_param| $body:expr) => {
        $crate::numeric::instructions::vectorised!($instructions, |$simd| $body, [*])
    };
}

/// Both of them: with `*`, AVX-512 becomes the AVX2 that it includes.
macro_rules! vectorised {
    ($instructions:expr, |$simd:pat_param| $body:expr, [$($narrower:tt)?]) => {{
        use $crate::numeric::instructions::{Instructions as Set, vectorise, vectorised};
        match $instructions {
            Set::Plain => vectorised!(pulp::Scalar256b, $simd, $body),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(simd) => vectorised!(simd, $simd, $body),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(simd) => vectorised!($($narrower)? simd, $simd, $body),
            #[cfg(target_arch = "aarch64")]
            Set::Neon(simd) => vectorised!(simd, $simd, $body),
            #[cfg(target_arch = "wasm32")]
            Set::Simd128(simd) => vectorised!(simd, $simd, $body),
        }
    }};
    ($vectors:expr, $simd:pat_param, $body:expr) => {
        vectorise($vectors, #[inline(always)] move || {
            let $simd = $vectors;
            $body
        })
    };
}

pub(crate) use {dispatch, dispatch_eight, vectorised};

/// Runs a closure compiled for these instructions. Only code that is always inlined is, so the
/// closure must be `#[inline(always)]`; and that it is taken as one that runs once spares a call in
/// between, which would not be inlined.
#[inline(always)]
pub fn vectorise<S: Simd, R>(simd: S, run: impl FnOnce() -> R) -> R {
    simd.vectorize(run)
}

/// Whether these are the plain instructions, which have no fused multiplication and addition: each
/// would call a function.
#[inline(always)]
pub fn is_plain<S: Simd>() -> bool {
    TypeId::of::<S>() == TypeId::of::<Scalar256b>()
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
