//! An online classifier: ridge regression from a network's features to where the target is, learnt in
//! each frame in which it is found. The network knows what targets look like in general, the classifier
//! what lies around this one. The two are combined as in ATOM (Danelljan et al. 2019); this classifier is
//! linear and has a closed form.

use crate::network::FeatureMap;
use crate::numeric::dot_wide;
use crate::numeric::instructions::{Instructions, dispatch_eight};
use crate::numeric::numbers::Numbers;
use pulp::Simd;

/// The features of a cell are those of the network, divided by their length, their means over squares of
/// cells with these sides, and a constant.
const SQUARES: [usize; 2] = [3, 5];
const CONSTANT: f64 = 0.3;

/// Standard deviation of the label, in sides of the target, and at least in cells.
const LABEL_WIDTH: f64 = 0.25;
const LEAST_WIDTH: f64 = 0.5;
/// The weight of the target, where that of all cells together is 1.
const TARGET_WEIGHT: f64 = 0.15;

/// The rate of the running mean over frames.
const RATE: f64 = 0.01;
/// The ridge, in means of the squares of the features.
const RIDGE: f64 = 0.02;

/// The classifier of a target.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Classifier {
    /// Running means of the weighted sums of products of features with each other, and with the label:
    /// the lower triangle of a matrix, row by row, and a row for the label.
    moments: Numbers,
    weights: Vec<f64>,
}

/// Where the target is in a window, in cells from its middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Label {
    pub centre: [f64; 2],
    pub size: [f64; 2],
}

/// The window that was seen last, and buffers.
#[derive(Debug, Default)]
pub(super) struct ClassifierScratch {
    /// Cells on a side.
    side: usize,
    /// A row of the cells for each feature.
    features: Vec<f64>,
    label: Vec<f64>,
    /// The weight of each cell.
    weights: Vec<f64>,
    /// The moments of the window.
    moments: Vec<f64>,
    row: Vec<f64>,
    /// The matrix of the regression, then its triangular factor.
    factor: Vec<f64>,
}

impl Classifier {
    /// Begins with the window of the first frame.
    pub fn begin(map: &FeatureMap<'_>, label: Label, scratch: &mut ClassifierScratch) -> Self {
        scratch.see(map);
        scratch.measure(label);
        let moments = scratch.moments.iter().map(|&value| value as f32).collect();
        Self::of(moments, scratch)
    }

    fn of(moments: Numbers, scratch: &mut ClassifierScratch) -> Self {
        let mut classifier = Self { moments, weights: Vec::new() };
        classifier.solve(scratch);
        classifier
    }

    /// How much each cell of a window looks like the target's middle, from 0 to 1.
    pub fn classify(
        &self,
        map: &FeatureMap<'_>,
        scratch: &mut ClassifierScratch,
        out: &mut Vec<f64>,
    ) {
        scratch.see(map);
        let cells = map.side * map.side;
        out.clear();
        out.resize(cells, 0.0);
        for (row, weight) in scratch.features.chunks_exact(cells).zip(&self.weights) {
            out.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
        }
        for response in out {
            // Moments of a damaged snapshot may have no solution.
            *response = if response.is_nan() { 0.0 } else { response.clamp(0.0, 1.0) };
        }
    }

    /// Learns where the target is in the window that was classified last.
    pub fn learn(&mut self, label: Label, scratch: &mut ClassifierScratch) {
        scratch.measure(label);
        for (mean, &seen) in self.moments.iter_mut().zip(&scratch.moments) {
            *mean += (RATE * (seen - f64::from(*mean))) as f32;
        }
        self.solve(scratch);
    }

    /// The weights that fit the moments.
    fn solve(&mut self, scratch: &mut ClassifierScratch) {
        let (factor, weights) = (&mut scratch.factor, &mut self.weights);
        factor.clear();
        factor.extend(self.moments.iter().map(|&value| f64::from(value)));
        let count = features_of(factor.len());
        weights.clear();
        weights.extend(factor.drain(row(count).start..));
        let trace: f64 = (0..count).map(|k| factor[row(k).end - 1]).sum();
        let ridge = RIDGE * trace / count as f64;
        (0..count).for_each(|k| factor[row(k).end - 1] += ridge);
        dispatch_eight!(Instructions::default(), |simd| solve(simd, factor, weights));
    }

    /// The classifier as a snapshot holds it.
    pub fn saved(&self) -> Numbers {
        self.moments.clone()
    }

    /// A classifier that continues from a saved one, for a network with so many channels. `None` if its
    /// numbers do not fit.
    pub fn restore(moments: Numbers, channels: usize) -> Option<Self> {
        let features = channels * (1 + SQUARES.len()) + 1;
        let is_sound = moments.is_sound(row(features).start + features);
        is_sound.then(|| Self::of(moments, &mut ClassifierScratch::default()))
    }
}

impl Label {
    /// Fills the label of each cell, 1 in the middle of the target, and the weights of the cells.
    fn fill(&self, side: usize, label: &mut Vec<f64>, weights: &mut Vec<f64>) {
        let middle = (side as f64 - 1.0) / 2.0;
        let line = |axis: usize| {
            let width = (LABEL_WIDTH * self.size[axis]).max(LEAST_WIDTH);
            let at = move |k: usize| (k as f64 - middle - self.centre[axis]) / width;
            (0..side).map(move |k| (-0.5 * at(k) * at(k)).exp())
        };
        label.clear();
        label.extend(line(1).flat_map(|y| line(0).map(move |x| x * y)));
        let (count, sum) = (label.len() as f64, label.iter().sum::<f64>());
        let target = TARGET_WEIGHT / ((1.0 + TARGET_WEIGHT) * sum.max(f64::MIN_POSITIVE));
        let all = 1.0 / ((1.0 + TARGET_WEIGHT) * count);
        weights.clear();
        weights.extend(label.iter().map(|label| target * label + all));
    }
}

impl ClassifierScratch {
    /// Computes the features of a window.
    fn see(&mut self, map: &FeatureMap<'_>) {
        let (cells, Self { side, features, row, .. }) = (map.side * map.side, self);
        *side = map.side;
        features.clear();
        features.extend(map.planes.iter().map(|&value| f64::from(value)));
        row.clear();
        row.resize(cells, 1e-6);
        for plane in features.chunks_exact(cells) {
            row.iter_mut().zip(plane).for_each(|(sum, value)| *sum += value * value);
        }
        for plane in features.chunks_exact_mut(cells) {
            for (value, square) in plane.iter_mut().zip(&*row) {
                let unit = *value / square.sqrt();
                *value = if unit.is_finite() { unit } else { 0.0 };
            }
        }
        let own = features.len();
        for square in SQUARES {
            for begin in (0..own).step_by(cells) {
                let end = features.len();
                features.resize(end + cells, 0.0);
                let (from, to) = features.split_at_mut(end);
                average(&from[begin..begin + cells], map.side, square, row, to);
            }
        }
        features.resize(features.len() + cells, CONSTANT);
    }

    /// Computes the moments of the window that was seen last, with the target at the label.
    fn measure(&mut self, label: Label) {
        let Self { side, features, label: labels, weights, moments, row, .. } = self;
        label.fill(*side, labels, weights);
        moments.clear();
        dispatch_eight!(Instructions::default(), |simd| {
            let count = features.len() / weights.len();
            for k in 0..=count {
                let one = features.chunks_exact(weights.len()).nth(k).unwrap_or(labels);
                row.clear();
                row.extend(one.iter().zip(&*weights).map(|(value, weight)| value * weight));
                // Not by a closure, which would not be compiled for these instructions.
                for other in features.chunks_exact(weights.len()).take(k + 1) {
                    moments.push(dot_wide(simd, row, other));
                }
            }
        });
    }
}

/// The means over squares of cells. Beyond the border are the cells at it.
fn average(plane: &[f64], side: usize, square: usize, line: &mut Vec<f64>, out: &mut [f64]) {
    let near =
        |k: usize| (0..square).map(move |d| (k + d).saturating_sub(square / 2).min(side - 1));
    let share = 1.0 / (square * square) as f64;
    for (y, out) in out.chunks_exact_mut(side).enumerate() {
        line.clear();
        line.resize(side, 0.0);
        for other in near(y) {
            let other = &plane[other * side..(other + 1) * side];
            line.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
        }
        for (x, out) in out.iter_mut().enumerate() {
            *out = share * near(x).map(|x| line[x]).sum::<f64>();
        }
    }
}

/// Where a row of a triangle is, the first of which has one number.
fn row(number: usize) -> std::ops::Range<usize> {
    let begin = number * (number + 1) / 2;
    begin..begin + number + 1
}

/// The number of features that have so many moments.
fn features_of(moments: usize) -> usize {
    (0..).take_while(|&count| row(count).start + count <= moments).count() - 1
}

/// Solves a system of linear equations with a symmetric positive definite matrix, of which the lower
/// triangle is given: the method of Cholesky. The triangle becomes its factor, the vector the solution.
#[inline(always)]
fn solve<S: Simd>(simd: S, matrix: &mut [f64], vector: &mut [f64]) {
    for k in 0..vector.len() {
        let (above, below) = matrix.split_at_mut(row(k).start);
        let own = &mut below[..=k];
        for j in 0..k {
            let other = &above[row(j)];
            own[j] = (own[j] - dot_wide(simd, &own[..j], &other[..j])) / other[j];
        }
        own[k] = (own[k] - dot_wide(simd, &own[..k], &own[..k])).sqrt();
        vector[k] = (vector[k] - dot_wide(simd, &own[..k], &vector[..k])) / own[k];
    }
    for k in (0..vector.len()).rev() {
        let own = &matrix[row(k)];
        let (before, at) = vector.split_at_mut(k);
        at[0] /= own[k];
        before.iter_mut().zip(own).for_each(|(value, factor)| *value -= at[0] * factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const SIDE: usize = 8;
    const CHANNELS: usize = 3;
    const CELLS: usize = SIDE * SIDE;
    const LABEL: Label = Label { centre: [0.0; 2], size: [2.0, 3.0] };

    /// A window of noise with something of its own around each of these cells.
    fn window(seed: usize, things: &[(usize, [f32; CHANNELS])]) -> Vec<f32> {
        let noise = |k: usize| ((k * 37 + seed * 101) as f32 * 0.7).sin() * 0.05 + 0.3;
        let mut planes: Vec<f32> = (0..CHANNELS * CELLS).map(noise).collect();
        for (cell, channels) in things {
            for (channel, value) in channels.iter().enumerate() {
                planes[channel * CELLS + cell] += value;
            }
        }
        planes
    }

    fn map(planes: &[f32]) -> FeatureMap<'_> {
        FeatureMap { planes, side: SIDE, spacing: 1.0 }
    }

    /// The features of a cell, as the text says.
    fn plain_features(planes: &[f32], cell: usize) -> Vec<f64> {
        let unit = |cell: usize| -> Vec<f64> {
            let own = (0..CHANNELS).map(|c| f64::from(planes[c * CELLS + cell]));
            let length = (own.clone().map(|v| v * v).sum::<f64>() + 1e-6).sqrt();
            own.map(|v| v / length).collect()
        };
        let mut features = unit(cell);
        for square in SQUARES {
            let reach = (square / 2) as isize;
            let near = |at: usize, d: isize| (at as isize + d).clamp(0, SIDE as isize - 1) as usize;
            let mut mean = [0.0; CHANNELS];
            for (dy, dx) in (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (y, x))) {
                let other = unit(near(cell / SIDE, dy) * SIDE + near(cell % SIDE, dx));
                mean.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
            }
            features.extend(mean.iter().map(|sum| sum / (square * square) as f64));
        }
        features.push(CONSTANT);
        features
    }

    fn plain_label(label: Label, cell: usize) -> f64 {
        let at = [(cell % SIDE) as f64 - 3.5, (cell / SIDE) as f64 - 3.5];
        let square =
            |k: usize| ((at[k] - label.centre[k]) / (label.size[k] * 0.25).max(0.5)).powi(2);
        (-0.5 * (square(0) + square(1))).exp()
    }

    /// Matrix and vector of a window.
    fn plain_moments(planes: &[f32], label: Label) -> (DMatrix<f64>, DVector<f64>) {
        let labels: Vec<f64> = (0..CELLS).map(|cell| plain_label(label, cell)).collect();
        let sum: f64 = labels.iter().sum();
        let weights = labels.iter().map(|y| 1.0 / CELLS as f64 + TARGET_WEIGHT * y / sum);
        let all: f64 = weights.clone().sum();
        let count = CHANNELS * 3 + 1;
        let (mut matrix, mut vector) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for (cell, weight) in weights.enumerate() {
            let features = DVector::from_vec(plain_features(planes, cell));
            matrix += &features * features.transpose() * (weight / all);
            vector += features * (labels[cell] * weight / all);
        }
        (matrix, vector)
    }

    #[test]
    fn the_weights_are_those_of_a_plain_ridge_regression() {
        let mut scratch = ClassifierScratch::default();
        let first = window(0, &[(27, [2.0, -1.0, 0.0]), (9, [0.0, 2.0, 2.0])]);
        let mut classifier = Classifier::begin(&map(&first), LABEL, &mut scratch);
        let (mut mean, mut response) = (plain_moments(&first, LABEL), Vec::new());
        for k in 1..30 {
            let planes = window(k, &[(27 + k % 3, [2.0, -1.0, 0.0]), (k, [1.0, 1.0, 1.0])]);
            let label = Label { centre: [(k % 3) as f64 - 0.5, -0.5], size: [2.5, 1.0] };
            classifier.classify(&map(&planes), &mut scratch, &mut response);
            classifier.learn(label, &mut scratch);
            let seen = plain_moments(&planes, label);
            mean = (&mean.0 + RATE * (seen.0 - &mean.0), &mean.1 + RATE * (seen.1 - &mean.1));
        }
        let (mut matrix, vector) = mean;
        let ridge = RIDGE * matrix.trace() / vector.len() as f64;
        (0..vector.len()).for_each(|k| matrix[(k, k)] += ridge);
        let expected = matrix.cholesky().unwrap().solve(&vector);
        for (weight, expected) in classifier.weights.iter().zip(expected.iter()) {
            assert!((weight - expected).abs() < 1e-4, "{weight} {expected}");
        }
        let planes = window(99, &[(20, [2.0, -1.0, 0.0])]);
        classifier.classify(&map(&planes), &mut scratch, &mut response);
        for (cell, response) in response.iter().enumerate() {
            let plain = DVector::from_vec(plain_features(&planes, cell)).dot(&expected);
            assert!((response - plain.clamp(0.0, 1.0)).abs() < 1e-4, "{cell}: {response} {plain}");
        }
    }

    #[test]
    fn it_learns_that_something_alike_is_not_the_target() {
        let mut scratch = ClassifierScratch::default();
        let (target, other) = (27, 13);
        let (looks, alike) = ([1.0, 0.5, 0.0], [0.5, 1.0, 0.0]);
        let label = Label { centre: [-0.5, -0.5], size: [1.0; 2] };
        let alone = window(0, &[(target, looks)]);
        let mut classifier = Classifier::begin(&map(&alone), label, &mut scratch);
        let (mut response, mut sums) = (Vec::new(), [[0.0; 2]; 10]);
        for k in 0..200 {
            let both = window(k, &[(target, looks), (other, alike)]);
            classifier.classify(&map(&both), &mut scratch, &mut response);
            sums[k / 20][0] += response[target];
            sums[k / 20][1] += response[other];
            classifier.learn(label, &mut scratch);
        }
        let [of_target, of_other] = [0, 1].map(|k| sums[9][k] / sums[0][k]);
        assert!(of_target > 0.95 && of_other < 0.9, "{of_target} {of_other}");
    }

    #[test]
    fn it_goes_on_from_a_saved_one_of_the_same_length() {
        let mut scratch = ClassifierScratch::default();
        let planes = window(0, &[(27, [2.0, -1.0, 0.0])]);
        let mut classifier = Classifier::begin(&map(&planes), LABEL, &mut scratch);
        classifier.learn(LABEL, &mut scratch);
        assert_eq!(Classifier::restore(classifier.saved(), CHANNELS).as_ref(), Some(&classifier));
        assert_eq!(Classifier::restore(classifier.saved(), CHANNELS + 1), None);
        let mut unsound = classifier.clone();
        unsound.moments[3] = f32::NAN;
        assert_eq!(Classifier::restore(unsound.saved(), CHANNELS), None);
    }

    #[test]
    fn moments_without_a_solution_give_finite_responses() {
        let mut scratch = ClassifierScratch::default();
        let planes = window(0, &[(27, [2.0, -1.0, 0.0])]);
        let good = Classifier::begin(&map(&planes), LABEL, &mut scratch).moments;
        for value in [-1.0, 0.0, f32::MAX, -f32::MAX] {
            let moments = Numbers::from(vec![value; good.len()]);
            let classifier = Classifier::restore(moments, CHANNELS).unwrap();
            let mut response = Vec::new();
            classifier.classify(&map(&planes), &mut scratch, &mut response);
            assert!(response.iter().all(|v| (0.0..=1.0).contains(v)), "{value}: {response:?}");
        }
    }

    #[test]
    fn any_features_and_labels_give_finite_responses() {
        let mut scratch = ClassifierScratch::default();
        let planes = window(1, &[]);
        for value in [0.0, f32::NAN, f32::INFINITY, -f32::MAX, f32::MIN_POSITIVE] {
            let mut damaged = planes.clone();
            damaged[5..100].fill(value);
            for centre in [0.0, 1e9, -1e300] {
                let label = Label { centre: [centre; 2], size: [1e-300, 1e300] };
                let mut classifier = Classifier::begin(&map(&damaged), label, &mut scratch);
                classifier.learn(label, &mut scratch);
                let mut response = Vec::new();
                classifier.classify(&map(&planes), &mut scratch, &mut response);
                assert!(response.iter().all(|v| (0.0..=1.0).contains(v)), "{value} {centre}");
            }
        }
    }
}
