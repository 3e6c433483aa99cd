//! All channels of a window transformed at once, against one plane after the other with `rustfft`:
//! `cargo bench -p patchlock --bench transforms`. `separate` has each channel in its own plane, the
//! layout that suits `rustfft` best.

use divan::{Bencher, black_box};
use patchlock::correlation::batch::{BatchScratch, Mask};
use patchlock::correlation::features::Features;
use patchlock::correlation::fourier::{Complex32, Fourier, FourierScratch};

/// Cells on a side of the window: with a `patch` of 150 pixels, the default, and of 200.
const SIDES: [usize; 2] = [36, 50];

fn main() {
    divan::main();
}

/// Planes of all channels, their spectra, and a mask of the size of a target.
struct Planes {
    fourier: Fourier,
    planes: Vec<f32>,
    window: Vec<f32>,
    spectra: Vec<Complex32>,
    mask: Mask,
}

impl Planes {
    fn new(n: usize) -> Self {
        let channels = Features::new(n).channels();
        let noise = |k: usize| ((k * 7919 + k * k * 31) % 1009) as f32 / 1009.0 - 0.5;
        let fourier = Fourier::new(n);
        let (middle, spectra) = (2 * n / 5..3 * n / 5, fourier.bins() * channels);
        Self {
            planes: (0..n * n * channels).map(noise).collect(),
            window: (0..n * n).map(noise).collect(),
            spectra: (0..spectra).map(|k| Complex32::new(noise(k), noise(k + 1))).collect(),
            mask: Mask { x: middle.clone(), y: middle },
            fourier,
        }
    }
}

#[divan::bench(args = SIDES)]
fn forward_batch(bencher: Bencher<'_, '_>, n: usize) {
    let (mut all, mut scratch) = (Planes::new(n), BatchScratch::default());
    bencher.bench_local(|| {
        let Planes { fourier, planes, window, spectra, .. } = &mut all;
        fourier.batch().forward(black_box(planes), window, spectra, &mut scratch);
    });
}

#[divan::bench(args = SIDES)]
fn forward_separate(bencher: Bencher<'_, '_>, n: usize) {
    let (mut all, mut scratch) = (Planes::new(n), FourierScratch::default());
    let mut windowed = vec![0.0; n * n];
    bencher.bench_local(|| {
        let Planes { fourier, planes, window, spectra, .. } = &mut all;
        let spectra = spectra.chunks_exact_mut(fourier.bins());
        for (plane, spectrum) in black_box(planes).chunks_exact(n * n).zip(spectra) {
            let cells = windowed.iter_mut().zip(plane.iter().zip(window.iter()));
            cells.for_each(|(out, (value, weight))| *out = value * weight);
            fourier.forward(&windowed, spectrum, &mut scratch);
        }
    });
}

#[divan::bench(args = SIDES)]
fn mask_batch(bencher: Bencher<'_, '_>, n: usize) {
    let (all, mut scratch) = (Planes::new(n), BatchScratch::default());
    let mut out = all.spectra.clone();
    let channels = all.spectra.len() / all.fourier.bins();
    let mut cells = vec![0.0; all.mask.len() * channels];
    bencher.bench_local(|| {
        let (transforms, mask) = (all.fourier.batch(), &all.mask);
        transforms.cells(black_box(&all.spectra), mask, &mut cells, &mut scratch);
        transforms.spectra(&cells, mask, &mut out, &mut scratch);
    });
}

#[divan::bench(args = SIDES)]
fn mask_separate(bencher: Bencher<'_, '_>, n: usize) {
    let (all, mut scratch) = (Planes::new(n), FourierScratch::default());
    let (mut out, mut plane) = (all.spectra.clone(), vec![0.0; n * n]);
    let Planes { fourier, spectra, mask, .. } = &all;
    bencher.bench_local(|| {
        let pairs = black_box(spectra).chunks_exact(fourier.bins());
        for (spectrum, out) in pairs.zip(out.chunks_exact_mut(fourier.bins())) {
            fourier.inverse(spectrum, &mut plane, &mut scratch);
            for (y, row) in plane.chunks_exact_mut(n).enumerate() {
                let inside = if mask.y.contains(&y) { mask.x.clone() } else { 0..0 };
                row[..inside.start].fill(0.0);
                row[inside.end..].fill(0.0);
            }
            fourier.forward(&plane, out, &mut scratch);
        }
    });
}
