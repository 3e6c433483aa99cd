//! Conversion between RGB and the YCbCr planes of video.

use pulp::{Arch, NullaryFnOnce};
use rusty_h264::YuvFrame;

/// The standard that defines the weights of red and blue in luma.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Matrix {
    /// ITU-R BT.601, used for standard definition.
    #[default]
    Bt601,
    /// ITU-R BT.709, used for high definition.
    Bt709,
    /// ITU-R BT.2020 with constant weights, used for high dynamic range.
    Bt2020,
}

impl Matrix {
    /// The matrix of a source that does not specify one: BT.709 for high definition (at least 1280
    /// pixels wide or more than 576 high, also if it was turned), else BT.601. Players do the same.
    pub fn usual(width: usize, height: usize) -> Self {
        let high_definition = width.max(height) >= 1280 || width.min(height) > 576;
        if high_definition { Self::Bt709 } else { Self::Bt601 }
    }

    /// The matrix with this number in H.264 and MP4 (`matrix_coefficients`, Rec. H.273); `None` if
    /// it is unspecified or no known one.
    pub fn of_code(code: u32) -> Option<Self> {
        match code {
            1 => Some(Self::Bt709),
            4..=6 => Some(Self::Bt601),
            9 | 10 => Some(Self::Bt2020),
            _ => None,
        }
    }
}

/// How sample values map to colours.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Colour {
    /// The luma weights.
    pub matrix: Matrix,
    /// Whether luma covers 0..=255 (full range) instead of 16..=235 (limited range).
    pub full_range: bool,
}

/// The planes of one picture, row by row without padding. The chroma planes are empty for grey
/// pictures.
#[derive(Debug, Clone)]
pub struct Planes<'a> {
    /// Width of the luma plane, in pixels.
    pub width: usize,
    /// Height of the luma plane, in pixels.
    pub height: usize,
    /// Luma samples.
    pub y: &'a [u8],
    /// Blue-difference chroma (Cb).
    pub u: &'a [u8],
    /// Red-difference chroma (Cr).
    pub v: &'a [u8],
    /// Luma pixels per chroma sample: horizontally, vertically.
    pub subsampling: (usize, usize),
}

/// Conversion coefficients in fixed point with 16 fractional bits.
struct Coefficients {
    luma_offset: i32,
    luma: i32,
    red_v: i32,
    green_u: i32,
    green_v: i32,
    blue_u: i32,
}

impl Colour {
    fn weights(self) -> (f64, f64) {
        match self.matrix {
            Matrix::Bt601 => (0.299, 0.114),
            Matrix::Bt709 => (0.2126, 0.0722),
            Matrix::Bt2020 => (0.2627, 0.0593),
        }
    }

    fn to_rgb_coefficients(self) -> Coefficients {
        let (red, blue) = self.weights();
        let green = 1.0 - red - blue;
        let (luma, chroma) =
            if self.full_range { (1.0, 1.0) } else { (255.0 / 219.0, 255.0 / 224.0) };
        let fixed = |value: f64| (value * 65536.0).round() as i32;
        Coefficients {
            luma_offset: if self.full_range { 0 } else { 16 },
            luma: fixed(luma),
            red_v: fixed(chroma * 2.0 * (1.0 - red)),
            green_u: fixed(-chroma * 2.0 * (1.0 - blue) * blue / green),
            green_v: fixed(-chroma * 2.0 * (1.0 - red) * red / green),
            blue_u: fixed(chroma * 2.0 * (1.0 - blue)),
        }
    }
}

/// Converts planes to RGB bytes (`width * height * 3`). Chroma is not interpolated: each sample is
/// used for all luma pixels that it covers.
///
/// The loops go over one colour of a row at a time, so that the compiler makes vectors of them, the
/// widest that the processor has: ten times as fast as pixel by pixel.
pub fn to_rgb(planes: &Planes<'_>, colour: Colour) -> Vec<u8> {
    Arch::new().dispatch(RgbConversion { planes, colour })
}

struct RgbConversion<'a> {
    planes: &'a Planes<'a>,
    colour: Colour,
}

impl NullaryFnOnce for RgbConversion<'_> {
    type Output = Vec<u8>;

    #[inline(always)]
    fn call(self) -> Vec<u8> {
        let Self { planes, colour } = self;
        let c = colour.to_rgb_coefficients();
        let (across, down) = planes.subsampling;
        let chroma_width = planes.width.div_ceil(across);
        let mut rgb = vec![0; planes.width * planes.height * 3];
        // What chroma adds to the luma of each pixel of a row, with the rounding; then that row.
        let mut added: [Vec<i32>; 3] = std::array::from_fn(|_| vec![0; planes.width]);
        let mut row: [Vec<u8>; 3] = std::array::from_fn(|_| vec![0; planes.width]);
        let lines = rgb.chunks_exact_mut((planes.width * 3).max(1));
        for (k, (out, luma)) in lines.zip(planes.y.chunks_exact(planes.width.max(1))).enumerate() {
            if k % down == 0 {
                let at = k / down * chroma_width;
                let chroma = [planes.u, planes.v].map(|plane| &plane[at..][..chroma_width]);
                add_chroma(&c, chroma, across, &mut added);
            }
            for (row, added) in row.iter_mut().zip(&added) {
                for ((sample, &y), &add) in row.iter_mut().zip(luma).zip(added) {
                    *sample = clamp(i32::from(y) * c.luma + add);
                }
            }
            let [red, green, blue] = &row;
            let samples = red.iter().zip(green).zip(blue);
            for (pixel, ((&red, &green), &blue)) in out.chunks_exact_mut(3).zip(samples) {
                pixel.copy_from_slice(&[red, green, blue]);
            }
        }
        rgb
    }
}

/// What a row of chroma samples adds to red, green and blue of the pixels that it covers.
#[inline(always)]
fn add_chroma(c: &Coefficients, [u, v]: [&[u8]; 2], across: usize, added: &mut [Vec<i32>; 3]) {
    match across {
        1 => add_chroma_of::<1>(c, [u, v], added),
        2 => add_chroma_of::<2>(c, [u, v], added),
        _ => add_chroma_of::<4>(c, [u, v], added),
    }
}

#[inline(always)]
fn add_chroma_of<const ACROSS: usize>(
    c: &Coefficients,
    [u, v]: [&[u8]; 2],
    [red, green, blue]: &mut [Vec<i32>; 3],
) {
    let rounding = 32768 - c.luma_offset * c.luma;
    let add = |u: u8, v: u8| {
        let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
        let green = rounding + c.green_u * u + c.green_v * v;
        [rounding + c.red_v * v, green, rounding + c.blue_u * u]
    };
    let whole = red.len() / ACROSS;
    let reds = red.as_chunks_mut::<ACROSS>().0.iter_mut();
    let greens = green.as_chunks_mut::<ACROSS>().0.iter_mut();
    let blues = blue.as_chunks_mut::<ACROSS>().0.iter_mut();
    for ((((red, green), blue), &u), &v) in reds.zip(greens).zip(blues).zip(u).zip(v) {
        let [r, g, b] = add(u, v);
        (*red, *green, *blue) = ([r; ACROSS], [g; ACROSS], [b; ACROSS]);
    }
    // Fewer pixels are left than a sample covers.
    if let (Some(&u), Some(&v)) = (u.get(whole), v.get(whole)) {
        for (row, value) in [red, green, blue].into_iter().zip(add(u, v)) {
            row[whole * ACROSS..].fill(value);
        }
    }
}

#[inline(always)]
fn clamp(fixed: i32) -> u8 {
    (fixed >> 16).clamp(0, 255) as u8
}

/// Converts luma to grey values of 0..=255, for sources without colour. Limited-range luma is
/// stretched.
pub fn luma_to_grey(luma: &[u8], full_range: bool) -> Vec<u8> {
    if full_range {
        return luma.to_vec();
    }
    luma.iter()
        .map(|&y| ((f32::from(y) - 16.0) * (255.0 / 219.0)).round().clamp(0.0, 255.0) as u8)
        .collect()
}

/// Converts pixels of `N` bytes, of which the first are red, green and blue, to 4:2:0 planes in
/// BT.601, limited range. Odd sizes are padded to even ones by repeating the last row or column,
/// since 4:2:0 H.264 allows only even sizes.
fn to_yuv420<const N: usize>(pixels: &[u8], width: usize, height: usize) -> YuvFrame {
    let pixels = &pixels.as_chunks().0[..width * height];
    Arch::new().dispatch(YuvConversion::<N> { pixels, width, height })
}

/// [`to_yuv420`] of three bytes per pixel. It has no parameters of types, so that it is compiled in
/// this crate, with its optimisation.
pub(crate) fn rgb_to_yuv420(rgb: &[u8], width: usize, height: usize) -> YuvFrame {
    to_yuv420::<3>(rgb, width, height)
}

/// The same of four bytes per pixel.
pub(crate) fn rgba_to_yuv420(rgba: &[u8], width: usize, height: usize) -> YuvFrame {
    to_yuv420::<4>(rgba, width, height)
}

struct YuvConversion<'a, const N: usize> {
    pixels: &'a [[u8; N]],
    width: usize,
    height: usize,
}

impl<const N: usize> NullaryFnOnce for YuvConversion<'_, N> {
    type Output = YuvFrame;

    #[inline(always)]
    fn call(self) -> YuvFrame {
        let Self { pixels, width, height } = self;
        let (wide, high) = (width.next_multiple_of(2), height.next_multiple_of(2));
        let row = |y: usize| &pixels[y.min(height - 1) * width..][..width];
        let mut frame = YuvFrame::black(wide, high);
        for (y, luma) in frame.y.chunks_exact_mut(wide).enumerate() {
            for (out, pixel) in luma.iter_mut().zip(row(y)) {
                // 0.299, 0.587 and 0.114 times 219 / 255, with 16 fractional bits.
                let [r, g, b] = [pixel[0], pixel[1], pixel[2]].map(i32::from);
                *out = clamp(16_829 * r + 33_039 * g + 6_416 * b + (16 << 16) + 32_768);
            }
            if wide > width {
                luma[width] = luma[width - 1];
            }
        }
        let chroma = frame.u.chunks_exact_mut(wide / 2).zip(frame.v.chunks_exact_mut(wide / 2));
        for (y, (blue, red)) in chroma.enumerate() {
            let rows = [row(2 * y), row(2 * y + 1)];
            let [(upper, up), (lower, low)] = rows.map(|row| row.as_chunks::<2>());
            let samples = blue.iter_mut().zip(red.iter_mut());
            for ((blue, red), (upper, lower)) in samples.zip(upper.iter().zip(lower)) {
                [*blue, *red] = chroma_of([upper[0], upper[1], lower[0], lower[1]]);
            }
            if let (&[up], &[low]) = (up, low) {
                [blue[width / 2], red[width / 2]] = chroma_of([up, up, low, low]);
            }
        }
        frame
    }
}

/// The chroma of four pixels.
#[inline(always)]
fn chroma_of<const N: usize>(four: [[u8; N]; 4]) -> [u8; 2] {
    let sum = |k: usize| four.iter().map(|pixel| i32::from(pixel[k])).sum::<i32>();
    let [r, g, b] = [sum(0), sum(1), sum(2)];
    // The chroma weights times 224 / 255, for a sum of four pixels: 18 fractional bits.
    let sample = |fixed: i32| ((fixed + (128 << 18) + (1 << 17)) >> 18).clamp(0, 255) as u8;
    [sample(-9_714 * r - 19_071 * g + 28_785 * b), sample(28_785 * r - 24_104 * g - 4_681 * b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primary_colours_survive_a_round_trip() {
        for colour in
            [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255], [0, 0, 0], [90, 140, 30]]
        {
            let rgb: Vec<u8> = colour.iter().copied().cycle().take(4 * 4 * 3).collect();
            let yuv = to_yuv420::<3>(&rgb, 4, 4);
            let planes = Planes {
                width: 4,
                height: 4,
                y: &yuv.y,
                u: &yuv.u,
                v: &yuv.v,
                subsampling: (2, 2),
            };
            for (back, was) in to_rgb(&planes, Colour::default()).iter().zip(&rgb) {
                assert!(back.abs_diff(*was) <= 2, "{colour:?} came back with {back} for {was}");
            }
        }
    }

    /// The definition, pixel by pixel.
    fn slowly(planes: &Planes<'_>, colour: Colour) -> Vec<u8> {
        let c = colour.to_rgb_coefficients();
        let (across, down) = planes.subsampling;
        let mut rgb = Vec::new();
        for row in 0..planes.height {
            for column in 0..planes.width {
                let at = row / down * planes.width.div_ceil(across) + column / across;
                let [u, v] = [planes.u[at], planes.v[at]].map(|sample| i32::from(sample) - 128);
                let y = i32::from(planes.y[row * planes.width + column]);
                let y = (y - c.luma_offset) * c.luma + 32768;
                rgb.extend(
                    [c.red_v * v, c.green_u * u + c.green_v * v, c.blue_u * u]
                        .map(|add| clamp(y + add)),
                );
            }
        }
        rgb
    }

    #[test]
    fn rows_have_the_colours_of_their_pixels() {
        let mut random = fastrand::Rng::with_seed(7);
        for (width, height) in [(1usize, 1usize), (2, 2), (7, 5), (33, 9), (64, 4)] {
            for subsampling in [(1usize, 1usize), (2, 1), (2, 2), (4, 1)] {
                let (across, down) = subsampling;
                let chroma = width.div_ceil(across) * height.div_ceil(down);
                let mut plane = |length| (0..length).map(|_| random.u8(..)).collect::<Vec<u8>>();
                let [y, u, v] = [width * height, chroma, chroma].map(&mut plane);
                let planes = Planes { width, height, y: &y, u: &u, v: &v, subsampling };
                for full_range in [false, true] {
                    for matrix in [Matrix::Bt601, Matrix::Bt709, Matrix::Bt2020] {
                        let colour = Colour { matrix, full_range };
                        assert_eq!(to_rgb(&planes, colour), slowly(&planes, colour));
                    }
                }
            }
        }
    }

    #[test]
    fn range_and_matrix_change_the_colours() {
        let planes =
            Planes { width: 1, height: 1, y: &[120], u: &[90], v: &[200], subsampling: (1, 1) };
        let limited = to_rgb(&planes, Colour::default());
        let full = to_rgb(&planes, Colour { full_range: true, ..Colour::default() });
        let hd = to_rgb(&planes, Colour { matrix: Matrix::Bt709, full_range: false });
        assert_eq!(full, [221, 82, 53]); // R = 120 + 1.402 * 72; B = 120 - 1.772 * 38
        assert_ne!(limited, full);
        assert_ne!(limited, hd);
    }

    #[test]
    fn an_unspecified_matrix_follows_from_the_size() {
        for (width, height) in [(1920, 1080), (1080, 1920), (1280, 536), (960, 720)] {
            assert_eq!(Matrix::usual(width, height), Matrix::Bt709, "{width} x {height}");
        }
        for (width, height) in [(720, 576), (576, 720), (854, 480), (64, 48)] {
            assert_eq!(Matrix::usual(width, height), Matrix::Bt601, "{width} x {height}");
        }
        assert_eq!(
            [1, 6, 9].map(Matrix::of_code).map(Option::unwrap),
            [Matrix::Bt709, Matrix::Bt601, Matrix::Bt2020]
        );
        assert_eq!([0, 2, 8, 255].map(Matrix::of_code), [None; 4]);
    }

    #[test]
    fn odd_sizes_are_padded() {
        let yuv = to_yuv420::<3>(&[200; 3 * 5 * 3], 3, 5);
        assert_eq!((yuv.width, yuv.height, yuv.y.len(), yuv.u.len()), (4, 6, 24, 6));
        assert!(yuv.y.iter().all(|&y| y == yuv.y[0]));
        assert!(yuv.u.iter().all(|&u| u == yuv.u[0]));
    }

    /// The definition, pixel by pixel.
    fn planes_slowly(rgb: &[u8], width: usize, height: usize) -> [Vec<u8>; 3] {
        let (wide, high) = (width.next_multiple_of(2), height.next_multiple_of(2));
        let at = |x: usize, y: usize| {
            let pixel = &rgb[(y.min(height - 1) * width + x.min(width - 1)) * 3..][..3];
            [0, 1, 2].map(|k| f64::from(pixel[k]))
        };
        let [mut luma, mut blue, mut red] = [(); 3].map(|()| Vec::new());
        let weighted = |[r, g, b]: [f64; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
        let sample = |value: f64| value.round().clamp(0.0, 255.0) as u8;
        for y in 0..high {
            luma.extend((0..wide).map(|x| sample(16.0 + weighted(at(x, y)) * 219.0 / 255.0)));
        }
        for (y, x) in (0..high / 2).flat_map(|y| (0..wide / 2).map(move |x| (2 * y, 2 * x))) {
            let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            let mean = [0, 1, 2].map(|k| four.iter().map(|pixel| pixel[k]).sum::<f64>() / 4.0);
            let from_luma =
                |k: usize, weight: f64| (mean[k] - weighted(mean)) / (2.0 - 2.0 * weight);
            blue.push(sample(128.0 + from_luma(2, 0.114) * 224.0 / 255.0));
            red.push(sample(128.0 + from_luma(0, 0.299) * 224.0 / 255.0));
        }
        [luma, blue, red]
    }

    #[test]
    fn planes_follow_their_definition_with_three_and_four_bytes_per_pixel() {
        let mut random = fastrand::Rng::with_seed(8);
        for (width, height) in [(1usize, 1usize), (2, 2), (7, 5), (33, 9), (64, 4), (70, 3)] {
            let rgb: Vec<u8> = (0..width * height * 3).map(|_| random.u8(..)).collect();
            let rgba: Vec<u8> = rgb.chunks(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
            let fast = to_yuv420::<3>(&rgb, width, height);
            let planes = [&fast.y, &fast.u, &fast.v];
            for (plane, slow) in planes.into_iter().zip(planes_slowly(&rgb, width, height)) {
                assert_eq!(plane.len(), slow.len());
                assert!(plane.iter().zip(&slow).all(|(a, b)| a.abs_diff(*b) <= 1), "{width}");
            }
            let four = to_yuv420::<4>(&rgba, width, height);
            assert_eq!(planes, [&four.y, &four.u, &four.v]);
        }
    }
}
