//! Discrete Fourier transforms of real square planes. Spectra hold the half with non-negative
//! horizontal frequency, column by column: bin `kx * n + ky`, unscaled; the inverse divides by `n *
//! n`.

use super::batch::Batch;
use patchlock_fft::Plans;
use std::fmt;

pub use patchlock_fft::Complex32;

/// Transforms of planes with side `n`, which must be even and have no prime factor above 7.
#[derive(Clone)]
pub struct Fourier {
    n: usize,
    lines: Plans,
    batch: Batch,
}

impl fmt::Debug for Fourier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Fourier({})", self.n)
    }
}

/// Buffers of the transforms.
#[derive(Debug, Default)]
pub struct FourierScratch {
    row: Vec<f32>,
    half_row: Vec<Complex32>,
    spectrum: Vec<Complex32>,
    work: Vec<Complex32>,
}

impl Fourier {
    /// Plans the transforms.
    pub fn new(n: usize) -> Self {
        Self { n, lines: Plans::new(n), batch: Batch::new(n) }
    }

    /// Side of the planes.
    pub fn side(&self) -> usize {
        self.n
    }

    /// Length of a spectrum.
    pub fn bins(&self) -> usize {
        (self.n / 2 + 1) * self.n
    }

    /// The same transforms of many planes at once.
    pub fn batch(&self) -> &Batch {
        &self.batch
    }

    /// The spectrum of a plane.
    pub fn forward(&self, plane: &[f32], out: &mut [Complex32], scratch: &mut FourierScratch) {
        let n = self.n;
        scratch.fit(self);
        let FourierScratch { row, half_row, work, .. } = scratch;
        for (y, source) in plane.chunks_exact(n).enumerate() {
            row.copy_from_slice(source);
            self.lines.real.process_with_scratch(row, half_row, work).expect("lengths are planned");
            half_row.iter().enumerate().for_each(|(kx, &value)| out[kx * n + y] = value);
        }
        self.lines.complex.process_with_scratch(out, work);
    }

    /// The plane of a spectrum.
    pub fn inverse(&self, spectrum: &[Complex32], out: &mut [f32], scratch: &mut FourierScratch) {
        let n = self.n;
        scratch.fit(self);
        let FourierScratch { half_row, spectrum: columns, work, .. } = scratch;
        columns.copy_from_slice(spectrum);
        self.lines.complex_back.process_with_scratch(columns, work);
        let scale = 1.0 / (n * n) as f32;
        for (y, out) in out.chunks_exact_mut(n).enumerate() {
            half_row.iter_mut().enumerate().for_each(|(kx, v)| *v = columns[kx * n + y] * scale);
            // Rounding leaves imaginary parts where the transform of a real row has none.
            half_row[0].im = 0.0;
            half_row[n / 2].im = 0.0;
            let back = &self.lines.real_back;
            back.process_with_scratch(half_row, out, work).expect("lengths are planned");
        }
    }
}

impl FourierScratch {
    fn fit(&mut self, fourier: &Fourier) {
        let work = [
            fourier.lines.real.get_scratch_len(),
            fourier.lines.real_back.get_scratch_len(),
            fourier.lines.complex.get_inplace_scratch_len(),
            fourier.lines.complex_back.get_inplace_scratch_len(),
        ];
        self.row.resize(fourier.n, 0.0);
        self.half_row.resize(fourier.n / 2 + 1, Complex32::ZERO);
        self.spectrum.resize(fourier.bins(), Complex32::ZERO);
        self.work.resize(work.into_iter().max().unwrap_or(0), Complex32::ZERO);
    }
}

/// The even sides whose only prime factors are 2, 3, 5 and 7, nearest to `n` and at least 4.
pub fn smooth_side(n: f64) -> usize {
    let smooth = |n: usize| {
        let rest = [2, 3, 5, 7].into_iter().fold(n, |mut n, p| {
            while n.is_multiple_of(p) {
                n /= p;
            }
            n
        });
        n.is_multiple_of(2) && rest == 1
    };
    let distance = |side: &usize| (*side as f64 - n).abs();
    let sides = (4..=512).filter(|&side| smooth(side));
    sides.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn noise(n: usize) -> Vec<f32> {
        (0..n * n).map(|k| ((k * 7919 + k * k * 31) % 1009) as f32 / 1009.0 - 0.5).collect()
    }

    #[test]
    fn the_spectrum_is_the_sum_of_the_definition() {
        for n in [4, 10, 14] {
            let (plane, fourier) = (noise(n), Fourier::new(n));
            let mut spectrum = vec![Complex32::ZERO; fourier.bins()];
            fourier.forward(&plane, &mut spectrum, &mut FourierScratch::default());
            for (bin, value) in spectrum.iter().enumerate() {
                let (mut re, mut im) = (0.0, 0.0);
                for (k, &v) in plane.iter().enumerate() {
                    let turns = (bin / n * (k % n) + bin % n * (k / n)) as f64 / n as f64;
                    re += f64::from(v) * (TAU * turns).cos();
                    im -= f64::from(v) * (TAU * turns).sin();
                }
                assert!((f64::from(value.re) - re).abs() < 1e-4, "{n} {bin}");
                assert!((f64::from(value.im) - im).abs() < 1e-4, "{n} {bin}");
            }
        }
    }

    #[test]
    fn the_inverse_gives_the_plane_back() {
        for n in [4, 38, 40, 42, 48, 50] {
            let (plane, fourier) = (noise(n), Fourier::new(n));
            let (mut spectrum, mut back) =
                (vec![Complex32::ZERO; fourier.bins()], vec![0.0; n * n]);
            let scratch = &mut FourierScratch::default();
            fourier.forward(&plane, &mut spectrum, scratch);
            fourier.inverse(&spectrum, &mut back, scratch);
            assert!(plane.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-6), "{n}");
        }
    }

    #[test]
    fn smooth_sides() {
        assert_eq!([37.5, 41.4, 44.0, 50.0, 51.0].map(smooth_side), [36, 42, 42, 50, 50]);
    }
}
