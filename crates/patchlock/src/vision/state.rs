//! The affine state of the target (Sec. 2) and its matrix.

use serde::{Deserialize, Serialize};

/// Centre, scale, rotation, aspect and skew of the target. Tracking stores only these six numbers;
/// they are never recovered from the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Column of the centre, in pixels.
    pub x: f64,
    /// Row of the centre, in pixels.
    pub y: f64,
    /// Width divided by the template's side.
    pub scale: f64,
    /// Rotation in radians, from x towards y.
    pub rotation: f64,
    /// Height divided by width.
    pub aspect: f64,
    /// Skew in radians: the direction in which the aspect stretches.
    pub skew: f64,
}

impl State {
    /// The upright state of a box with this centre and size.
    pub fn from_box(centre: [f64; 2], width: f64, height: f64, template_side: usize) -> Self {
        Self {
            x: centre[0],
            y: centre[1],
            scale: width / template_side as f64,
            rotation: 0.0,
            aspect: height / width,
            skew: 0.0,
        }
    }

    /// Width and height in pixels; `template_side` is in samples.
    pub fn size(&self, template_side: usize) -> (f64, f64) {
        let width = template_side as f64 * self.scale;
        (width, width * self.aspect)
    }

    /// The affine map from template coordinates to pixels: `R(rotation) R(-skew) S R(skew)` with
    /// `S = diag(s, s r)`, followed by a translation to the centre.
    pub fn matrix(&self) -> [[f64; 3]; 2] {
        let (s, t) = (self.scale, self.scale * self.aspect);
        let (sin_out, cos_out) = (self.rotation - self.skew).sin_cos();
        let (sin_in, cos_in) = self.skew.sin_cos();
        [
            [
                s * cos_out * cos_in - t * sin_out * sin_in,
                -s * cos_out * sin_in - t * sin_out * cos_in,
                self.x,
            ],
            [
                s * sin_out * cos_in + t * cos_out * sin_in,
                -s * sin_out * sin_in + t * cos_out * cos_in,
                self.y,
            ],
        ]
    }

    /// Whether all numbers are finite, and scale and aspect positive.
    pub fn is_valid(&self) -> bool {
        let all = [self.x, self.y, self.scale, self.rotation, self.aspect, self.skew];
        all.iter().all(|v| v.is_finite()) && self.scale > 0.0 && self.aspect > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type M = [[f64; 2]; 2];

    fn product(a: M, b: M) -> M {
        let entry = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
        [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
    }

    fn rotation_matrix(angle: f64) -> M {
        [[angle.cos(), -angle.sin()], [angle.sin(), angle.cos()]]
    }

    proptest! {
        #[test]
        fn matrix_is_the_product_of_its_factors(
            scale in 0.1..4.0f64, rotation in -3.0..3.0f64, aspect in 0.2..5.0f64, skew in -2.0..2.0f64,
        ) {
            let state = State { x: 7.0, y: -2.0, scale, rotation, aspect, skew };
            let stretch = [[scale, 0.0], [0.0, scale * aspect]];
            let rotations = product(rotation_matrix(rotation), rotation_matrix(-skew));
            let want = product(rotations, product(stretch, rotation_matrix(skew)));
            let got = state.matrix();
            for i in 0..2 {
                for j in 0..2 {
                    prop_assert!((got[i][j] - want[i][j]).abs() < 1e-12);
                }
            }
            prop_assert_eq!([got[0][2], got[1][2]], [7.0, -2.0]);
        }

        #[test]
        fn without_skew_the_matrix_has_a_closed_form(
            scale in 0.1..4.0f64,
            rotation in -3.0..3.0f64,
            aspect in 0.2..5.0f64,
            a in -15.5..15.5f64,
            b in -15.5..15.5f64,
        ) {
            let m = State { x: 1.0, y: 2.0, scale, rotation, aspect, skew: 0.0 }.matrix();
            let x = 1.0 + scale * rotation.cos() * a - scale * aspect * rotation.sin() * b;
            let y = 2.0 + scale * rotation.sin() * a + scale * aspect * rotation.cos() * b;
            prop_assert!((m[0][0] * a + m[0][1] * b + m[0][2] - x).abs() < 1e-10);
            prop_assert!((m[1][0] * a + m[1][1] * b + m[1][2] - y).abs() < 1e-10);
        }
    }

    #[test]
    fn a_box_becomes_a_state_of_its_size() {
        let state = State::from_box([10.0, 20.0], 48.0, 24.0, 32);
        assert_eq!((state.scale, state.aspect), (1.5, 0.5));
        assert_eq!(state.size(32), (48.0, 24.0));
    }
}
