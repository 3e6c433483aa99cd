//! Compares affine sampling with OpenCV (exact positions) and SciPy (any positions).

use crate::golden;
use patchlock::Frame;
use patchlock::State;
use patchlock::vision::{frame::GreyImage, warp::warp};
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    width: usize,
    height: usize,
    image: Vec<Vec<f32>>,
    exact: Vec<Case>,
    general: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    state: Option<[f64; 6]>,
    matrix: [[f64; 3]; 2],
    output: Vec<Vec<f64>>,
}

impl File {
    fn image(&self) -> GreyImage {
        let mut image = GreyImage::default();
        let samples = self.image.concat();
        image.fill(&Frame::grey32f(&samples, self.width, self.height).unwrap()).unwrap();
        image
    }
}

impl Case {
    /// Pairs of samples: ours, computed with this matrix, and the stored ones.
    fn samples(&self, image: &GreyImage, matrix: [[f64; 3]; 2]) -> Vec<(f64, f64)> {
        let mut ours = vec![0.0; 32 * 32];
        warp(image, &matrix, 32, &mut ours);
        let theirs = self.output.concat();
        assert_eq!(theirs.len(), ours.len());
        ours.into_iter().map(f64::from).zip(theirs).collect()
    }
}

fn state([x, y, scale, rotation, aspect, skew]: [f64; 6]) -> State {
    State { x, y, scale, rotation, aspect, skew }
}

#[test]
fn samples_at_exact_positions_match_opencv_bit_for_bit() {
    let file: File = golden("warp.json");
    assert_eq!(file.exact.len(), 7);
    for case in &file.exact {
        for (ours, theirs) in case.samples(&file.image(), case.matrix) {
            // The file holds the shortest decimals that represent OpenCV's `f32` values.
            assert_eq!(ours as f32, theirs as f32);
        }
    }
}

#[test]
fn samples_at_any_position_match_scipy() {
    let file: File = golden("warp.json");
    assert_eq!(file.general.len(), 8);
    for case in &file.general {
        for (ours, theirs) in case.samples(&file.image(), case.matrix) {
            assert!((ours - theirs).abs() < 1e-5, "{ours} {theirs}");
        }
    }
}

#[test]
fn the_matrix_of_a_state_matches_the_oracle() {
    let file: File = golden("warp.json");
    let mut compared = 0;
    for case in file.exact.iter().chain(&file.general) {
        let Some(numbers) = case.state else { continue };
        let ours = state(numbers).matrix();
        assert!(crate::difference(ours.as_flattened(), case.matrix.as_flattened()) < 1e-12);
        for (ours, theirs) in case.samples(&file.image(), ours) {
            assert!((ours - theirs).abs() < 1e-5, "{ours} {theirs}");
        }
        compared += 1;
    }
    assert_eq!(compared, 13);
}
