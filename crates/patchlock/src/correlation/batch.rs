//! Discrete Fourier transforms of many real planes at once. The channels of a cell, and those of a
//! bin, lie side by side, so each vector instruction works on eight channels, for every length of a
//! line.
//!
//! The gain over `rustfft`, one plane after the other, with 36 and 50 cells on a side (AMD EPYC with
//! AVX2, `cargo bench -p patchlock --bench transforms`, 2026-11-25, medians): all channels 65 and
//! 91 us against 115 and 272 us, and masking a filter 71 and 93 us against 210 and 515 us. With AVX2
//! they take 59 % and 55 % of the plain instructions (`benchmarks/record/speed.md`).
//!
//! Bins are those of [`Fourier`](super::fourier::Fourier), which transforms one plane at a time and
//! is what the tests hold this to. Two planes that are real are transformed as one that is complex.

use super::fourier::Complex32;
use super::lanes::{LANES, Octet, Vector};
use crate::numeric::instructions::{Instructions, dispatch_eight, vectorise};
use pulp::Simd;
use std::f64::consts::TAU;
use std::ops::Range;

/// The number of channels must be a multiple of this: those that are transformed together.
pub const GROUP: usize = 2 * LANES;

/// Transforms of square planes with side `n`, which must be even and have no prime factor above 7.
#[derive(Debug, Clone)]
pub struct Batch {
    n: usize,
    passes: Vec<Pass>,
}

/// Buffers of the transforms.
#[derive(Debug, Default)]
pub struct BatchScratch {
    line: Vec<Octet>,
    other: Vec<Octet>,
    /// Half spectra along x, column by column, of the first and of the second eight channels in
    /// turn.
    columns: Vec<Octet>,
}

/// Cells that may be other than zero: a rectangle. What is inside it is held row by row, the
/// channels of a cell side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// The columns.
    pub x: Range<usize>,
    /// The rows.
    pub y: Range<usize>,
}

impl Mask {
    /// The cells of a rectangle of this size in the middle of a plane with side `n`.
    pub fn middle(n: usize, size: [f64; 2]) -> Self {
        let [x, y] = size.map(|size| {
            let (middle, reach) = ((n as f64 - 1.0) / 2.0, (size / 2.0).max(1.0));
            let first = (middle - reach).ceil().max(0.0) as usize;
            first..n - first
        });
        Self { x, y }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    /// Whether there is no cell.
    #[cfg(feature = "internals")]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Batch {
    /// Plans the transforms.
    pub fn new(n: usize) -> Self {
        let mut passes = Vec::new();
        let mut length = n;
        for radix in [7, 5, 3, 4, 2] {
            while length.is_multiple_of(radix) {
                passes.push(Pass::new(radix, length, n / length));
                length /= radix;
            }
        }
        Self { n, passes }
    }

    /// The spectra of planes, each cell multiplied by its weight in the window.
    pub fn forward(
        &self,
        planes: &[f32],
        window: &[f32],
        out: &mut [Complex32],
        scratch: &mut BatchScratch,
    ) {
        scratch.fit(self.n);
        dispatch_eight!(Instructions::default(), |simd| {
            let n = self.n;
            let channels = planes.len() / (n * n);
            for group in (0..channels).step_by(GROUP) {
                for y in 0..n {
                    let cells = planes[y * n * channels..].chunks_exact(channels);
                    let cells = cells.zip(&window[y * n..]);
                    for (line, (cell, &weight)) in scratch.line.iter_mut().zip(cells) {
                        *line = halves(&cell[group..], weight);
                    }
                    self.transform(simd, scratch);
                    separate(y, scratch);
                }
                self.finish(simd, 0..n, (group, channels), scratch, out);
            }
        });
    }

    /// The cells inside the mask of the planes with these spectra.
    pub fn cells(
        &self,
        spectra: &[Complex32],
        mask: &Mask,
        out: &mut [f32],
        scratch: &mut BatchScratch,
    ) {
        scratch.fit(self.n);
        dispatch_eight!(Instructions::default(), |simd| {
            let n = self.n;
            let channels = spectra.len() / (n * (n / 2 + 1));
            let scale = 1.0 / (n * n) as f32;
            for group in (0..channels).step_by(GROUP) {
                // The inverse transform of v is the conjugate of the transform of its conjugate.
                let parts = (0..=n / 2).flat_map(|column| [(column, 0), (column, LANES)]);
                for (column, half) in parts {
                    let bins = spectra[column * n * channels..].chunks_exact(channels);
                    for (line, bin) in scratch.line.iter_mut().zip(bins) {
                        *line = Octet::load(&bin[group + half..]).conj();
                    }
                    self.transform(simd, scratch);
                    let start = (2 * column + half / LANES) * n;
                    scratch.columns[start..][mask.y.clone()]
                        .copy_from_slice(&scratch.line[mask.y.clone()]);
                }
                let rows = out.chunks_exact_mut((mask.x.len() * channels).max(1));
                for (y, row) in mask.y.clone().zip(rows) {
                    join(y, scratch);
                    self.transform(simd, scratch);
                    let line = &scratch.line[mask.x.clone()];
                    for (cell, line) in row.chunks_exact_mut(channels).zip(line) {
                        let values = line.conj() * scale;
                        values.re.store(&mut cell[group..]);
                        values.im.store(&mut cell[group + LANES..]);
                    }
                }
            }
        });
    }

    /// The spectra of planes that have these cells inside the mask, and zeros elsewhere.
    pub fn spectra(
        &self,
        cells: &[f32],
        mask: &Mask,
        out: &mut [Complex32],
        scratch: &mut BatchScratch,
    ) {
        scratch.fit(self.n);
        dispatch_eight!(Instructions::default(), |simd| {
            let n = self.n;
            let channels = out.len() / (n * (n / 2 + 1));
            for group in (0..channels).step_by(GROUP) {
                let rows = cells.chunks_exact((mask.x.len() * channels).max(1));
                for (y, row) in mask.y.clone().zip(rows) {
                    scratch.line.fill(Octet::ZERO);
                    let line = &mut scratch.line[mask.x.clone()];
                    for (line, cell) in line.iter_mut().zip(row.chunks_exact(channels)) {
                        *line = halves(&cell[group..], 1.0);
                    }
                    self.transform(simd, scratch);
                    separate(y, scratch);
                }
                self.finish(simd, mask.y.clone(), (group, channels), scratch, out);
            }
        });
    }
}

impl BatchScratch {
    fn fit(&mut self, n: usize) {
        self.line.resize(n, Octet::ZERO);
        self.other.resize(n, Octet::ZERO);
        self.columns.resize(2 * n * (n / 2 + 1), Octet::ZERO);
    }
}

/// The channels of a cell in pairs, with this weight, and half of it, as the parts of a spectrum
/// are sums of two.
#[inline(always)]
fn halves(cell: &[f32], weight: f32) -> Octet {
    let part = |start: usize| Vector::load(&cell[start..]) * (0.5 * weight);
    Octet { re: part(0), im: part(LANES) }
}

/// Separates the spectrum of a row of complex cells into twice those of their real and imaginary
/// parts.
#[inline(always)]
fn separate(y: usize, scratch: &mut BatchScratch) {
    let BatchScratch { line, columns, .. } = scratch;
    let n = line.len();
    for (k, pair) in columns.chunks_exact_mut(2 * n).enumerate() {
        let (v, mirror) = (line[k], line[(n - k) % n].conj());
        let (sum, difference) = (v + mirror, v - mirror);
        pair[y] = sum;
        pair[n + y] = difference.turned();
    }
}

/// The conjugate spectrum of a row of complex cells from those of their real and imaginary parts.
#[inline(always)]
fn join(y: usize, scratch: &mut BatchScratch) {
    let BatchScratch { line, columns, .. } = scratch;
    let n = line.len();
    for (k, pair) in columns.chunks_exact(2 * n).enumerate() {
        let (mut real, mut imaginary) = (pair[y], pair[n + y]);
        if k == 0 || k == n / 2 {
            // Rounding leaves imaginary parts where the transform of a real row has none.
            (real.im, imaginary.im) = (Vector::ZERO, Vector::ZERO);
        }
        line[k] = real + imaginary.turned();
        line[(n - k) % n] = real.conj() + imaginary.conj().turned();
    }
}

impl Batch {
    /// Transforms the columns, of which only these rows are other than zero, into a group of the
    /// result.
    #[inline(always)]
    fn finish<S: Simd>(
        &self,
        simd: S,
        rows: Range<usize>,
        (group, channels): (usize, usize),
        scratch: &mut BatchScratch,
        out: &mut [Complex32],
    ) {
        let n = self.n;
        for (column, half) in (0..=n / 2).flat_map(|column| [(column, 0), (column, LANES)]) {
            let start = (2 * column + half / LANES) * n;
            scratch.line[..rows.start].fill(Octet::ZERO);
            scratch.line[rows.clone()].copy_from_slice(&scratch.columns[start..][rows.clone()]);
            scratch.line[rows.end..].fill(Octet::ZERO);
            self.transform(simd, scratch);
            let bins = out[column * n * channels..].chunks_exact_mut(channels);
            for (bin, line) in bins.zip(&scratch.line) {
                line.store(&mut bin[group + half..]);
            }
        }
    }

    /// Transforms a line in place. It is not inlined: it is long and has many callers.
    #[inline(always)]
    fn transform<S: Simd>(&self, simd: S, scratch: &mut BatchScratch) {
        vectorise(
            simd,
            #[inline(always)]
            move || {
                let BatchScratch { line, other, .. } = scratch;
                for pass in &self.passes {
                    match pass.radix {
                        2 => pass.run::<2>(line, other),
                        3 => pass.run::<3>(line, other),
                        4 => pass.run::<4>(line, other),
                        5 => pass.run::<5>(line, other),
                        _ => pass.run::<7>(line, other),
                    }
                    std::mem::swap(line, other);
                }
            },
        );
    }
}

/// One pass of Stockham's algorithm: transforms of `radix` values, `stride * count` of them.
#[derive(Debug, Clone)]
struct Pass {
    radix: usize,
    stride: usize,
    count: usize,
    /// Cosine and sine of `k` turns by `radix`.
    roots: Vec<[f32; 2]>,
    /// Factors of the results, `radix` for each of `count`.
    twiddles: Vec<[f32; 2]>,
}

impl Pass {
    fn new(radix: usize, length: usize, stride: usize) -> Self {
        let turn = |k: usize, length: usize| {
            let (sin, cos) = ((k % length) as f64 * TAU / length as f64).sin_cos();
            [cos as f32, sin as f32]
        };
        let count = length / radix;
        let roots = (0..radix).map(|k| turn(k, radix)).collect();
        let twiddles = (0..count)
            .flat_map(|p| (0..radix).map(move |k| p * k))
            .map(|product| turn(product, length))
            .collect();
        Self { radix, stride, count, roots, twiddles }
    }

    #[inline(always)]
    fn run<const R: usize>(&self, from: &[Octet], to: &mut [Octet]) {
        let (stride, count) = (self.stride, self.count);
        let (twiddles, _) = self.twiddles.as_chunks::<R>();
        let Some(roots) = self.roots.first_chunk::<R>() else { return };
        for (p, (to, twiddles)) in to.chunks_exact_mut(R * stride).zip(twiddles).enumerate() {
            let mut parts = [from; R];
            for (j, part) in parts.iter_mut().enumerate() {
                *part = &from[stride * (p + j * count)..][..stride];
            }
            match p {
                // Here all are 1.
                0 => transforms::<R, false>(parts, to, roots, twiddles),
                _ => transforms::<R, true>(parts, to, roots, twiddles),
            }
        }
    }
}

/// Transforms of `R` values each, multiplied by the twiddles if `TURN`.
#[inline(always)]
fn transforms<const R: usize, const TURN: bool>(
    from: [&[Octet]; R],
    to: &mut [Octet],
    roots: &[[f32; 2]; R],
    twiddles: &[[f32; 2]; R],
) {
    let stride = from[0].len();
    let to = &mut to[..R * stride];
    for q in 0..stride {
        let mut values = [Octet::ZERO; R];
        for (value, from) in values.iter_mut().zip(from) {
            *value = from[q];
        }
        let sums = butterfly::<R>(values, roots);
        to[q] = sums[0];
        for k in 1..R {
            to[k * stride + q] = if TURN { sums[k].turned_by(twiddles[k]) } else { sums[k] };
        }
    }
}

/// The transform of `R` values, from its definition with values taken in pairs.
#[inline(always)]
fn butterfly<const R: usize>(v: [Octet; R], roots: &[[f32; 2]; R]) -> [Octet; R] {
    let mut out = v;
    if R == 2 {
        (out[0], out[1]) = (v[0] + v[1], v[0] - v[1]);
        return out;
    }
    if R == 4 {
        let (a, b) = (v[0] + v[2], v[0] - v[2]);
        let (c, d) = (v[1] + v[3], (v[1] - v[3]).turned());
        (out[0], out[1], out[2], out[3]) = (a + c, b + d, a - c, b - d);
        return out;
    }
    for j in 1..=R / 2 {
        out[0] = out[0] + (v[j] + v[R - j]);
    }
    for k in 1..=R / 2 {
        let (mut even, mut odd) = (v[0], Octet::ZERO);
        for j in 1..=R / 2 {
            let [cos, sin] = roots[j * k % R];
            even = even + (v[j] + v[R - j]) * cos;
            odd = odd + (v[j] - v[R - j]) * sin;
        }
        out[k] = even + odd.turned();
        out[R - k] = even - odd.turned();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::fourier::{Fourier, FourierScratch};

    const CHANNELS: usize = 2 * GROUP;

    fn noise(count: usize) -> Vec<f32> {
        (0..count).map(|k| ((k * 7919 + k * k * 31) % 1009) as f32 / 1009.0 - 0.5).collect()
    }

    /// One channel of all cells or bins.
    fn channel<T: Copy>(all: &[T], channel: usize) -> Vec<T> {
        all.chunks(CHANNELS).map(|values| values[channel]).collect()
    }

    #[test]
    fn spectra_are_those_of_each_plane() {
        for n in [4, 6, 10, 14, 16, 42, 50, 54] {
            let (fourier, scratch) = (Fourier::new(n), &mut BatchScratch::default());
            let (planes, window) = (noise(n * n * CHANNELS), noise(n * n));
            let mut spectra = vec![Complex32::ZERO; fourier.bins() * CHANNELS];
            Batch::new(n).forward(&planes, &window, &mut spectra, scratch);
            let mut single = vec![Complex32::ZERO; fourier.bins()];
            for k in 0..CHANNELS {
                let plane: Vec<f32> =
                    channel(&planes, k).iter().zip(&window).map(|(v, w)| v * w).collect();
                fourier.forward(&plane, &mut single, &mut FourierScratch::default());
                for (a, b) in channel(&spectra, k).iter().zip(&single) {
                    assert!((a - b).norm() < 1e-5 * n as f32, "{n} {k}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn cells_inside_a_mask_are_those_of_each_plane_and_give_its_spectrum() {
        for n in [4, 14, 50] {
            let (fourier, scratch) = (Fourier::new(n), &mut BatchScratch::default());
            let planes = noise(n * n * CHANNELS);
            let mut spectra = vec![Complex32::ZERO; fourier.bins() * CHANNELS];
            let batch = Batch::new(n);
            batch.forward(&planes, &vec![1.0; n * n], &mut spectra, scratch);
            let mask = Mask { x: 1..3, y: n / 4..n / 2 + 1 };
            let mut cells = vec![9.0; mask.len() * CHANNELS];
            batch.cells(&spectra, &mask, &mut cells, scratch);
            let mut masked = vec![Complex32::ZERO; spectra.len()];
            batch.spectra(&cells, &mask, &mut masked, scratch);
            let mut back = vec![0.0; n * n];
            for k in 0..CHANNELS {
                let spectrum = channel(&masked, k);
                fourier.inverse(&spectrum, &mut back, &mut FourierScratch::default());
                let mut inside = channel(&cells, k).into_iter();
                for (cell, (a, b)) in back.iter().zip(channel(&planes, k)).enumerate() {
                    let is_inside = mask.x.contains(&(cell % n)) && mask.y.contains(&(cell / n));
                    let expected = if is_inside { b } else { 0.0 };
                    assert!((a - expected).abs() < 1e-5, "{n} {k} {cell}: {a} {expected}");
                    if is_inside {
                        assert!((inside.next().unwrap() - b).abs() < 1e-5, "{n} {k} {cell}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_mask_lies_in_the_middle() {
        assert_eq!(Mask::middle(8, [6.0, 9.0]), Mask { x: 1..7, y: 0..8 });
        // However small the target is, there are two cells.
        assert_eq!(Mask::middle(8, [0.1; 2]), Mask { x: 3..5, y: 3..5 });
    }
}
