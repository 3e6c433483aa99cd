//! The response of a filter to a sample, and the place of its peak between cells.

use super::fourier::{Complex32, Fourier, FourierScratch};
use std::f64::consts::TAU;

/// The longest side of a plane.
const MAX_SIDE: usize = 512;

/// The response of a filter, as its spectrum and cell by cell. Cell 0 stands for no displacement, and cells
/// beyond half the side for negative ones.
#[derive(Debug, Default)]
pub struct Response {
    spectrum: Vec<Complex32>,
    cells: Vec<f32>,
    scratch: FourierScratch,
}

/// A place in a response.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peak {
    /// Displacement along x and y, in cells.
    pub shift: [f64; 2],
    /// The response there.
    pub value: f64,
}

impl Response {
    /// Fills it with the response of a filter to a sample.
    pub fn fill(&mut self, fourier: &Fourier, filter: &[Complex32], sample: &[Complex32]) {
        let bins = fourier.bins();
        self.spectrum.clear();
        self.spectrum.resize(bins, Complex32::ZERO);
        for (f, z) in filter.chunks_exact(bins).zip(sample.chunks_exact(bins)) {
            let pairs = f.iter().zip(z);
            self.spectrum.iter_mut().zip(pairs).for_each(|(sum, (f, z))| *sum += f.conj() * z);
        }
        self.cells.resize(fourier.side() * fourier.side(), 0.0);
        fourier.inverse(&self.spectrum, &mut self.cells, &mut self.scratch);
    }

    /// The response at each displacement, row by row.
    pub fn cells(&self) -> &[f32] {
        &self.cells
    }

    /// The largest response, to a fraction of a cell: Newton steps on the series that the spectrum is, from
    /// the largest cell, unless they lead away from it.
    pub fn peak(&self, fourier: &Fourier) -> Peak {
        let n = fourier.side();
        let largest =
            |best: (usize, f32), (k, &v): (usize, &f32)| if v > best.1 { (k, v) } else { best };
        let (cell, value) = self.cells.iter().enumerate().fold((0, f32::MIN), largest);
        let start = Peak { shift: [wrap(cell % n, n), wrap(cell / n, n)], value: f64::from(value) };
        self.climb(fourier, start)
    }

    /// The response at a displacement between cells.
    pub fn at(&self, fourier: &Fourier, shift: [f64; 2]) -> f64 {
        self.expand(fourier.side(), shift).value
    }

    fn climb(&self, fourier: &Fourier, start: Peak) -> Peak {
        let n = fourier.side();
        let mut shift = start.shift;
        for _ in 0..5 {
            let series = self.expand(n, shift);
            let [xx, xy, yy] = series.curvature;
            let determinant = xx * yy - xy * xy;
            if xx >= 0.0 || determinant <= 0.0 {
                return start;
            }
            let [x, y] = series.slope;
            shift[0] -= (yy * x - xy * y) / determinant;
            shift[1] -= (xx * y - xy * x) / determinant;
            let moved = |axis: usize| (shift[axis] - start.shift[axis]).abs();
            if !(moved(0) <= 1.0 && moved(1) <= 1.0) {
                return start;
            }
        }
        let value = self.expand(n, shift).value;
        if value >= start.value { Peak { shift, value } } else { start }
    }

    /// The series at a displacement, with its derivatives per cell.
    fn expand(&self, n: usize, shift: [f64; 2]) -> Series {
        let mut series = Series::default();
        let step = TAU / n as f64;
        let mut rows = [(0.0, 0.0); MAX_SIDE];
        for (ky, row) in rows.iter_mut().enumerate().take(n) {
            *row = (wrap(ky, n) * step * shift[1]).sin_cos();
        }
        for (kx, column) in self.spectrum.chunks_exact(n).enumerate() {
            // Columns inside stand for themselves and their mirror image.
            let weight = if kx == 0 || kx == n / 2 { 1.0 } else { 2.0 };
            // The highest frequency has no sign, so it adds to the value alone.
            let wx = if kx == n / 2 { 0.0 } else { kx as f64 * step };
            let (sin_x, cos_x) = (kx as f64 * step * shift[0]).sin_cos();
            for (value, (&(sin_y, cos_y), ky)) in column.iter().zip(rows.iter().zip(0..n)) {
                let (re, im) = (f64::from(value.re), f64::from(value.im));
                let (sin, cos) = (sin_x * cos_y + cos_x * sin_y, cos_x * cos_y - sin_x * sin_y);
                let real = weight * (re * cos - im * sin);
                let imaginary = weight * (re * sin + im * cos);
                let wy = if ky == n / 2 { 0.0 } else { wrap(ky, n) * step };
                series.value += real;
                series.slope[0] -= wx * imaginary;
                series.slope[1] -= wy * imaginary;
                series.curvature[0] -= wx * wx * real;
                series.curvature[1] -= wx * wy * real;
                series.curvature[2] -= wy * wy * real;
            }
        }
        let cells = (n * n) as f64;
        series.value /= cells;
        series.slope = series.slope.map(|v| v / cells);
        series.curvature = series.curvature.map(|v| v / cells);
        series
    }
}

/// The value and derivatives of a response between cells.
#[derive(Debug, Default)]
struct Series {
    value: f64,
    slope: [f64; 2],
    /// Along xx, xy, yy.
    curvature: [f64; 3],
}

/// The displacement that a cell stands for, also the frequency of a bin.
fn wrap(cell: usize, n: usize) -> f64 {
    if cell < n.div_ceil(2) { cell as f64 } else { cell as f64 - n as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The response whose spectrum is that of this plane.
    fn of(fourier: &Fourier, plane: &[f32]) -> Response {
        let bins = fourier.bins();
        let (mut spectrum, mut one) = (vec![Complex32::ZERO; bins], vec![Complex32::ZERO; bins]);
        let scratch = &mut FourierScratch::default();
        fourier.forward(plane, &mut spectrum, scratch);
        let mut impulse = vec![0.0; plane.len()];
        impulse[0] = 1.0;
        fourier.forward(&impulse, &mut one, scratch);
        let mut response = Response::default();
        response.fill(fourier, &one, &spectrum);
        response
    }

    #[test]
    fn on_cells_the_series_is_the_response() {
        let n = 10;
        let fourier = Fourier::new(n);
        let plane: Vec<f32> = (0..n * n).map(|k| ((k * 37 + k * k) % 101) as f32).collect();
        let response = of(&fourier, &plane);
        for (k, &value) in plane.iter().enumerate() {
            let shift = [wrap(k % n, n), wrap(k / n, n)];
            assert!((response.at(&fourier, shift) - f64::from(value)).abs() < 1e-3, "{k}");
            assert!((response.cells()[k] - value).abs() < 1e-3);
        }
    }

    #[test]
    fn the_peak_lies_between_cells() {
        let n = 24;
        let fourier = Fourier::new(n);
        for (x, y) in [(0.0, 0.0), (3.3, -4.8), (-0.45, 2.6)] {
            let plane: Vec<f32> = (0..n * n)
                .map(|k| (wrap(k % n, n) - x).powi(2) + (wrap(k / n, n) - y).powi(2))
                .map(|squared| (-squared / 8.0).exp() as f32)
                .collect();
            let peak = of(&fourier, &plane).peak(&fourier);
            assert!((peak.shift[0] - x).abs() < 0.02, "{peak:?}");
            assert!((peak.shift[1] - y).abs() < 0.02, "{peak:?}");
            assert!((peak.value - 1.0).abs() < 0.01, "{peak:?}");
        }
    }
}
