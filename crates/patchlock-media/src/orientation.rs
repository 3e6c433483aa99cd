//! How stored pictures are turned and mirrored before they are shown.

use image::metadata::Orientation;
use image::{DynamicImage, RgbImage};

use crate::Picture;

/// The orientation that a transformation matrix of MP4 stands for. Only turns by 90 degrees and
/// mirrors do; no camera writes others, which are not applied. The matrix maps stored to shown
/// positions: x' = a x + c y and y' = b x + d y.
fn of_matrix([a, b, c, d]: [i32; 4]) -> Orientation {
    match (b == 0 && c == 0, a == 0 && d == 0) {
        (true, false) => match (a < 0, d < 0) {
            (false, false) => Orientation::NoTransforms,
            (true, false) => Orientation::FlipHorizontal,
            (false, true) => Orientation::FlipVertical,
            (true, true) => Orientation::Rotate180,
        },
        (false, true) => match (c < 0, b < 0) {
            (true, false) => Orientation::Rotate90,
            (false, true) => Orientation::Rotate270,
            (false, false) => Orientation::Rotate90FlipH,
            (true, true) => Orientation::Rotate270FlipH,
        },
        _ => Orientation::NoTransforms,
    }
}

/// The orientation of a track whose own matrix is followed by that of the movie. Of these, a, b, c
/// and d are the numbers 0, 1, 3 and 4.
pub fn of_matrices(track: &[i32; 9], movie: &[i32; 9]) -> Orientation {
    // Only signs and zeros matter.
    let [t, m] = [track, movie].map(|matrix| matrix.map(i32::signum));
    let product = |row: usize, column: usize| t[row] * m[column] + t[row + 1] * m[column + 3];
    of_matrix([product(0, 0), product(0, 1), product(3, 0), product(3, 1)])
}

/// Whether width and height change places.
pub fn swaps_sides(orientation: Orientation) -> bool {
    matches!(
        orientation,
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    )
}

/// RGB bytes as a picture in this orientation.
pub fn oriented(width: usize, height: usize, rgb: Vec<u8>, orientation: Orientation) -> Picture {
    let sides = (u32::try_from(width), u32::try_from(height));
    let (true, (Ok(wide), Ok(high))) = (orientation != Orientation::NoTransforms, sides) else {
        return Picture::rgb(width, height, rgb);
    };
    let mut image = DynamicImage::from(RgbImage::from_raw(wide, high, rgb).unwrap_or_default());
    image.apply_orientation(orientation);
    let (width, height) = (image.width() as usize, image.height() as usize);
    Picture::rgb(width, height, image.into_rgb8().into_raw())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pixels;

    /// Each pixel of a picture of 2 x 1 goes where the matrix says.
    #[test]
    fn matrices_move_pixels_as_they_say() {
        const ONE: i32 = 1 << 16;
        for (a, b, c, d) in [
            (ONE, 0, 0, ONE),
            (-ONE, 0, 0, ONE),
            (ONE, 0, 0, -ONE),
            (-ONE, 0, 0, -ONE),
            (0, ONE, -ONE, 0),
            (0, -ONE, ONE, 0),
            (0, ONE, ONE, 0),
            (0, -ONE, -ONE, 0),
        ] {
            let orientation = of_matrix([a, b, c, d]);
            let (width, height) = (3, 2);
            let stored: Vec<u8> = (0..6).flat_map(|v| [v; 3]).collect();
            let shown = oriented(width, height, stored, orientation);
            assert_eq!(swaps_sides(orientation), shown.width == 2);
            let Pixels::Rgb8(pixels) = &shown.pixels else { panic!("it has colours") };
            for y in 0..height as i32 {
                for x in 0..width as i32 {
                    // A negative direction counts from the other end.
                    let at = |p: i32, q: i32, side: usize| {
                        let place = (p.signum() * x) + (q.signum() * y);
                        if p + q < 0 { place + side as i32 - 1 } else { place }
                    };
                    let (u, v) = (at(a, c, shown.width), at(b, d, shown.height));
                    let found = pixels[(v as usize * shown.width + u as usize) * 3];
                    assert_eq!(found as i32, y * 3 + x, "{orientation:?}");
                }
            }
        }
        let [none, quarter] = [[ONE, 0, 0, 0, ONE, 0, 0, 0, 0], [0, ONE, 0, -ONE, 0, 0, 0, 0, 0]];
        assert_eq!(of_matrices(&quarter, &none), Orientation::Rotate90);
        assert_eq!(of_matrices(&none, &quarter), Orientation::Rotate90);
        assert_eq!(of_matrices(&quarter, &quarter), Orientation::Rotate180);
        let skewed = [ONE, 9, 0, -9, ONE, 0, 0, 0, 0];
        assert_eq!(of_matrices(&skewed, &none), Orientation::NoTransforms);
    }
}
