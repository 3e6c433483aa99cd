//! Plans of Fourier transforms in single precision: `rustfft` and `realfft` for `f32`.
//!
//! This is a crate of its own because `rustfft` is compiled where its planner is called, and takes
//! as long as the rest of the tracker. Here that happens once, not again for each build of
//! `patchlock` and of its tests.

use std::sync::Arc;

pub use realfft::{ComplexToReal, RealToComplex};
pub use rustfft::Fft;
pub use rustfft::num_complex::Complex32;

/// The transforms of lines of one length. None of them is scaled.
#[derive(Clone)]
pub struct Plans {
    /// From real numbers to the half spectrum with non-negative frequency.
    pub real: Arc<dyn RealToComplex<f32>>,
    /// From that half spectrum to real numbers.
    pub real_back: Arc<dyn ComplexToReal<f32>>,
    /// From complex numbers to their spectrum.
    pub complex: Arc<dyn Fft<f32>>,
    /// From a spectrum to complex numbers.
    pub complex_back: Arc<dyn Fft<f32>>,
}

impl Plans {
    /// Plans the transforms of lines of this length.
    pub fn new(length: usize) -> Self {
        let mut real = realfft::RealFftPlanner::new();
        let mut complex = rustfft::FftPlanner::new();
        Self {
            real: real.plan_fft_forward(length),
            real_back: real.plan_fft_inverse(length),
            complex: complex.plan_fft_forward(length),
            complex_back: complex.plan_fft_inverse(length),
        }
    }
}

/// Plans only [`Plans::complex`].
pub fn complex(length: usize) -> Arc<dyn Fft<f32>> {
    rustfft::FftPlanner::new().plan_fft_forward(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_its_spectrum_and_comes_back() {
        let plans = Plans::new(6);
        let line = [1.0, 2.0, 0.0, -1.0, 3.0, 0.5];
        let mut half = plans.real.make_output_vec();
        plans.real.process(&mut line.to_vec(), &mut half).expect("the lengths are planned");
        let mut whole = line.map(|re| Complex32::new(re, 0.0));
        plans.complex.process(&mut whole);
        assert!((whole[0].re - 5.5).abs() < 1e-5, "the sum");
        assert!(half.iter().zip(&whole).all(|(a, b)| (a - b).norm() < 1e-5));
        assert_eq!(complex(6).len(), 6);
        let mut back = plans.real_back.make_output_vec();
        plans.real_back.process(&mut half, &mut back).expect("the lengths are planned");
        plans.complex_back.process(&mut whole);
        for ((value, real), complex) in line.iter().zip(&back).zip(&whole) {
            assert!((6.0 * value - real).abs() < 1e-4 && (6.0 * value - complex.re).abs() < 1e-4);
        }
    }
}
