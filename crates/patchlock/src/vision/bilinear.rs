//! Square windows of the frame, sampled bilinearly at any scale, without averaging where they
//! shrink, as trackers with a network cut them.
//!
//! The cost follows the number of samples, not the size of the window. A row of the frame that two
//! rows of samples need is sampled once.

use super::crop::Planes;
use super::frame::Frame;
use super::geometry::Point;

/// A window of the frame.
#[derive(Debug, Clone, Copy)]
pub struct Bilinear {
    /// Where the middle of the samples is, in columns and rows of the frame.
    pub centre: Point,
    /// Frame pixels from one sample to the next.
    pub scale: f64,
    /// Samples on a side.
    pub size: usize,
}

/// Buffers of [`Bilinear::sample`].
#[derive(Debug, Default)]
pub struct BilinearScratch {
    taps: Vec<Tap>,
    /// The latest two rows of the frame, sampled along x.
    upper: SampledRow,
    lower: SampledRow,
}

/// A sample along one axis: between the pixel before and the one after it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tap {
    /// The pixel before it; may lie outside the frame.
    pub before: i64,
    /// The distance from it, below 1.
    pub fraction: f32,
}

#[derive(Debug, Default)]
struct SampledRow {
    number: Option<i64>,
    pixels: Vec<[f32; 3]>,
}

impl SampledRow {
    /// Samples a row of the frame, unless it holds this one.
    fn fill(&mut self, frame: &Frame<'_>, number: i64, border: [f32; 3], taps: &[Tap]) {
        if self.number == Some(number) {
            return;
        }
        self.number = Some(number);
        self.pixels.resize(taps.len(), [0.0; 3]);
        match usize::try_from(number) {
            Ok(y) if y < frame.height() => frame.sample_row(y, taps, border, &mut self.pixels),
            _ => self.pixels.fill(border),
        }
    }
}

impl Bilinear {
    /// Where sample `k` lies along an axis.
    fn tap(&self, axis: usize, k: usize) -> Tap {
        // Beyond this, nothing but the border is seen, and numbers of pixels stay exact.
        const FAR: f64 = 1e9;
        let middle = (self.size as f64 - 1.0) / 2.0;
        let position = (self.centre[axis] + (k as f64 - middle) * self.scale).clamp(-FAR, FAR);
        let before = position.floor();
        Tap { before: before as i64, fraction: (position - before) as f32 }
    }

    /// Samples the window into planes of red, green and blue, white at 255. What lies outside the
    /// frame has the colour `border`.
    pub fn sample(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        scratch: &mut BilinearScratch,
        out: &mut Planes,
    ) {
        let BilinearScratch { taps, upper, lower } = scratch;
        out.reshape([self.size; 2], 3);
        taps.clear();
        taps.extend((0..self.size).map(|k| self.tap(0, k)));
        // The channels of the frame may stand in another order.
        let places = [0, 1, 2].map(|colour| frame.place_of(colour));
        let border = places.map(|place| border[place]);
        (upper.number, lower.number) = (None, None);
        let plane = self.size * self.size;
        for y in 0..self.size {
            let Tap { before, fraction } = self.tap(1, y);
            if lower.number == Some(before) {
                std::mem::swap(upper, lower);
            }
            upper.fill(frame, before, border, taps);
            lower.fill(frame, before + 1, border, taps);
            for (colour, place) in places.into_iter().enumerate() {
                let row = &mut out.samples[colour * plane + y * self.size..][..self.size];
                let pixels = upper.pixels.iter().zip(&lower.pixels);
                for (out, (above, below)) in row.iter_mut().zip(pixels) {
                    *out = above[place] + (below[place] - above[place]) * fraction;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same by the definition, from pixels in red, green and blue.
    fn plain(pixels: &[u8], [w, h]: [usize; 2], border: [f32; 3], window: Bilinear) -> Vec<f32> {
        let pixel = |x: i64, y: i64, colour: usize| {
            let inside = (0..w as i64).contains(&x) && (0..h as i64).contains(&y);
            let index = || (y as usize * w + x as usize) * 3 + colour;
            if inside { f32::from(pixels[index()]) } else { border[colour] }
        };
        let mut out = Vec::new();
        for colour in 0..3 {
            for (r, c) in (0..window.size).flat_map(|r| (0..window.size).map(move |c| (r, c))) {
                let (x, y) = (window.tap(0, c), window.tap(1, r));
                let row = |y: i64| {
                    let left = pixel(x.before, y, colour);
                    left + (pixel(x.before + 1, y, colour) - left) * x.fraction
                };
                let (above, below) = (row(y.before), row(y.before + 1));
                out.push(above + (below - above) * y.fraction);
            }
        }
        out
    }

    proptest! {
        #[test]
        fn windows_equal_the_definition(
            (w, h) in (1_usize..30, 1_usize..30),
            centre in [-40.0_f64..70.0, -40.0..70.0],
            scale in 0.05_f64..6.0,
            size in 1_usize..40,
            seed in any::<u8>(),
        ) {
            let pixels: Vec<u8> = (0..w * h * 3).map(|k| ((k * 37 + k * k) % 256) as u8 ^ seed).collect();
            let (window, border) = (Bilinear { centre, scale, size }, [11.5, 200.25, 77.0]);
            let (mut scratch, mut out) = (BilinearScratch::default(), Planes::default());
            let rgb = Frame::rgb8(&pixels, w, h).unwrap();
            window.sample(&rgb, border, &mut scratch, &mut out);
            let expected = plain(&pixels, [w, h], border, window);
            prop_assert_eq!(&out.samples, &expected);
            // The same colours in another order and depth.
            let swapped: Vec<u16> = pixels
                .as_chunks::<3>().0.iter()
                .flat_map(|&[r, g, b]| [b, g, r].map(|value| u16::from(value) * 257))
                .collect();
            let bgr = Frame::rgb16(&swapped, w, h).unwrap().bgr();
            window.sample(&bgr, border, &mut scratch, &mut out);
            for (value, expected) in out.samples.iter().zip(&expected) {
                prop_assert!((value - expected).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn grey_is_three_equal_colours_and_far_windows_are_border() {
        let frame = Frame::grey8(&[7, 9], 2, 1).unwrap();
        let (mut scratch, mut out) = (BilinearScratch::default(), Planes::default());
        let window = Bilinear { centre: [0.5, 0.0], scale: 1.0, size: 2 };
        window.sample(&frame, [1.0; 3], &mut scratch, &mut out);
        // The rows of samples lie half a pixel above and below the row of the frame.
        assert_eq!(out.samples, [4.0, 5.0, 4.0, 5.0].repeat(3));
        let far = Bilinear { centre: [1e300, -1e300], scale: 1e200, size: 2 };
        far.sample(&frame, [1.0; 3], &mut scratch, &mut out);
        assert_eq!(out.samples, [1.0; 12]);
    }
}
