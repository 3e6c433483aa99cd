//! Vectors of eight values, and what is done to all channels of a bin.
//!
//! The transforms use arrays of eight, because pulp's vectors have 4, 8 or 16 values, depending on
//! the processor. The compiler makes one AVX2 instruction of eight operations: a transform takes 55
//! to 59 % of the plain instructions. The sums over channels use pulp's vectors, in blocks of a
//! fixed length; they take 7 % (`benchmarks/record/speed.md`).

use super::fourier::Complex32;
use crate::numeric::instructions::{Instructions, dispatch_eight};
use pulp::Simd;
use std::array::from_fn;
use std::ops::{Add, Mul, Sub};

/// Values in a vector.
pub const LANES: usize = 8;

/// The order of values in a vector: so, one instruction takes the real parts out of eight numbers.
const ORDER: [usize; LANES] = [0, 1, 4, 5, 2, 3, 6, 7];

/// Eight values, for each of which the same is computed.
#[derive(Debug, Clone, Copy)]
pub struct Vector([f32; LANES]);

/// Eight complex numbers.
#[derive(Debug, Clone, Copy)]
// So that no vector lies across two cache lines.
#[repr(align(64))]
pub struct Octet {
    /// Their real parts.
    pub re: Vector,
    /// Their imaginary parts.
    pub im: Vector,
}

impl Vector {
    /// Zero.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The first values.
    #[inline(always)]
    pub fn load(values: &[f32]) -> Self {
        let Some(values) = values.first_chunk::<LANES>() else { return Self::ZERO };
        Self(from_fn(|k| values[ORDER[k]]))
    }

    /// Writes them to the first places.
    #[inline(always)]
    pub fn store(self, out: &mut [f32]) {
        let Some(out) = out.first_chunk_mut::<LANES>() else { return };
        ORDER.into_iter().zip(self.0).for_each(|(place, value)| out[place] = value);
    }
}

impl Add for Vector {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Vector {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl Mul<f32> for Vector {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        Self(from_fn(|k| self.0[k] * factor))
    }
}

impl Octet {
    /// Zero.
    pub const ZERO: Self = Self { re: Vector::ZERO, im: Vector::ZERO };

    /// The first values.
    #[inline(always)]
    pub fn load(values: &[Complex32]) -> Self {
        let Some(values) = values.first_chunk::<LANES>() else { return Self::ZERO };
        Self {
            re: Vector(from_fn(|k| values[ORDER[k]].re)),
            im: Vector(from_fn(|k| values[ORDER[k]].im)),
        }
    }

    /// Writes them to the first places.
    #[inline(always)]
    pub fn store(self, out: &mut [Complex32]) {
        let Some(out) = out.first_chunk_mut::<LANES>() else { return };
        for (k, place) in ORDER.into_iter().enumerate() {
            out[place] = Complex32::new(self.re.0[k], self.im.0[k]);
        }
    }

    /// The conjugates.
    #[inline(always)]
    pub fn conj(self) -> Self {
        Self { re: self.re, im: Vector::ZERO - self.im }
    }

    /// Multiplied with `-i`.
    #[inline(always)]
    pub fn turned(self) -> Self {
        Self { re: self.im, im: Vector::ZERO - self.re }
    }

    /// Multiplied with the conjugate of a number.
    #[inline(always)]
    pub fn turned_by(self, [re, im]: [f32; 2]) -> Self {
        Self { re: self.re * re + self.im * im, im: self.im * re - self.re * im }
    }
}

impl Add for Octet {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl Sub for Octet {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl Mul<f32> for Octet {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }
}

/// Complex numbers that are summed side by side, whatever the width of the processor's vectors, so
/// that a sum has the same last digits on all of them.
const BLOCK: usize = 8;

/// The sum of the products of one sequence, conjugated, with another.
#[inline(always)]
pub fn inner<S: Simd>(simd: S, a: &[Complex32], b: &[Complex32]) -> Complex32 {
    match S::C32_LANES {
        1 => inner_of::<S, BLOCK>(simd, a, b),
        2 => inner_of::<S, { BLOCK / 2 }>(simd, a, b),
        4 => inner_of::<S, { BLOCK / 4 }>(simd, a, b),
        _ => inner_of::<S, 1>(simd, a, b),
    }
}

/// The same with blocks of so many vectors.
#[inline(always)]
fn inner_of<S: Simd, const VECTORS: usize>(simd: S, a: &[Complex32], b: &[Complex32]) -> Complex32 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<BLOCK>(), b.as_chunks::<BLOCK>());
    let mut sums = [simd.splat_c32s(Complex32::ZERO); VECTORS];
    for (a, b) in a.iter().zip(b) {
        for ((sum, &a), &b) in sums.iter_mut().zip(S::as_simd_c32s(a).0).zip(S::as_simd_c32s(b).0) {
            *sum = simd.conj_mul_add_e_c32s(a, b, *sum);
        }
    }
    // In halves, as a vector is summed.
    let mut half = VECTORS / 2;
    while half > 0 {
        for k in 0..half {
            sums[k] = simd.add_c32s(sums[k], sums[k + half]);
        }
        half /= 2;
    }
    let mut sum = simd.reduce_sum_c32s(sums[0]);
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += a.conj() * b;
    }
    sum
}

/// Adds to one sequence another, multiplied by a factor.
#[inline(always)]
pub fn add<S: Simd>(simd: S, out: &mut [Complex32], values: &[Complex32], factor: Complex32) {
    // What is left over is not multiplied and added in one, and must be the same with all vectors.
    let (out, out_rest) = out.as_chunks_mut::<BLOCK>();
    let (values, rest) = values.as_chunks::<BLOCK>();
    let factors = simd.splat_c32s(factor);
    let (out, values) = (out.as_flattened_mut(), values.as_flattened());
    for (out, &value) in S::as_mut_simd_c32s(out).0.iter_mut().zip(S::as_simd_c32s(values).0) {
        *out = simd.mul_add_e_c32s(value, factors, *out);
    }
    for (out, value) in out_rest.iter_mut().zip(rest) {
        *out += value * factor;
    }
}

/// Learns spectra, bin by bin with the channels side by side, at a rate: the running means of them
/// times the label, and of their energies. A filter is the quotient of both.
pub fn learn(
    label: &[Complex32],
    spectra: &[Complex32],
    rate: f32,
    (numerator, denominator): (&mut [Complex32], &mut [f32]),
) {
    dispatch_eight!(Instructions::default(), |simd| {
        let channels = spectra.len() / label.len();
        let bins = numerator.chunks_exact_mut(channels).zip(spectra.chunks_exact(channels));
        for ((a, x), (b, label)) in bins.zip(denominator.iter_mut().zip(label)) {
            for a in a.iter_mut() {
                *a *= 1.0 - rate;
            }
            add(simd, a, x, label * rate);
            *b = *b * (1.0 - rate) + rate * inner(simd, x, x).re;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Scalar256b, Scalar512b};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    #[inline(always)]
    fn inner_and_sum<S: Simd>(
        simd: S,
        a: &[Complex32],
        b: &[Complex32],
    ) -> (Complex32, Vec<Complex32>) {
        let mut sum = a.to_vec();
        add(simd, &mut sum, b, Complex32::new(0.3, -0.7));
        (inner(simd, a, b), sum)
    }

    #[test]
    fn sums_do_not_depend_on_the_width_of_vectors() {
        let mut rng = Pcg64::new(7, 1);
        let mut normal = || StandardNormal.sample(&mut rng);
        for count in 0..70 {
            let [a, b] = [(); 2].map(|()| {
                (0..count).map(|_| Complex32::new(normal(), normal())).collect::<Vec<_>>()
            });
            let (expected, out) = inner_and_sum(Scalar512b, &a, &b);
            let twin: Complex32 = a.iter().zip(&b).map(|(a, b)| a.conj() * b).sum();
            assert!((expected - twin).norm() < 1e-4, "{count}: {expected} and {twin}");
            for (k, out) in out.iter().enumerate() {
                let twin = a[k] + b[k] * Complex32::new(0.3, -0.7);
                assert!((out - twin).norm() < 1e-5, "{count}: {out} and {twin}");
            }
            let found = inner_and_sum(Scalar256b, &a, &b);
            assert_eq!(found, (expected, out.clone()), "{count}");
            let (a, b) = (&a, &b);
            for (name, instructions) in Instructions::available() {
                let found = dispatch_eight!(instructions, |simd| inner_and_sum(simd, a, b));
                assert_eq!(found, (expected, out.clone()), "{name}: {count}");
            }
        }
    }
}
