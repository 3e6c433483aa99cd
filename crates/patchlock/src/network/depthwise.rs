//! Depthwise convolutions of planes: each channel with a kernel of its own. In `rten` they took some
//! 80 % of the time of NanoTrack v3 (2026-11-25).
//!
//! A channel is first copied with zeros around it, its columns sorted by their remainder after
//! division by the stride, so that neighbouring results always read neighbouring samples. Products
//! are added in the order of the plain loop, so that its results have the same bits, with any
//! instructions and on any number of threads.

use super::onnx::{FLOAT, Node, Tensor};
use crate::numeric::instructions::{Instructions, dispatch};
use crate::numeric::parallel::*;
use pulp::{Simd, bytemuck};

/// Results of a row are computed in groups of at most `LANES`, in `ROWS` rows at once.
const LANES: usize = 16;
const ROWS: usize = 8;

/// A depthwise convolution of one image.
#[derive(Debug, Clone)]
pub struct DepthwiseConvolution {
    channels: usize,
    /// Height and width of the image, the kernel and the result.
    image: [usize; 2],
    kernel: [usize; 2],
    result: [usize; 2],
    stride: usize,
    /// Rows and columns of zeros above and to the left.
    before: [usize; 2],
    bias: Vec<f32>,
}

/// Buffers of [`DepthwiseConvolution::run`], one for each channel that is computed at the same time.
#[derive(Debug, Default)]
pub struct DepthwiseScratch {
    padded: Vec<f32>,
}

/// How a channel lies in the buffer.
#[derive(Debug, Clone, Copy)]
struct Layout {
    /// Samples of one remainder in a row.
    part: usize,
    /// Samples of a row: those of all remainders.
    row: usize,
    rows: usize,
}

impl DepthwiseConvolution {
    /// The convolution that a node computes for an image and weights of these shapes, if it is
    /// depthwise.
    pub fn of(
        node: &Node,
        image: &[usize],
        weights: &[usize],
        bias: Option<&Tensor>,
    ) -> Option<Self> {
        let (&[1, channels, height, width], &[kernels, 1, high, wide]) = (image, weights) else {
            return None;
        };
        let group = node.attribute("group").and_then(|group| group.i);
        let strides = node.ints("strides", &[1; 2]);
        let (&[down, across], &[top, left, bottom, right]) =
            (&strides[..], &node.ints("pads", &[0; 4])[..])
        else {
            return None;
        };
        let counted = group? == channels as i64 && kernels == channels;
        let types = bias.is_none_or(|bias| bias.data_type == FLOAT);
        let plain = node.ints("dilations", &[1; 2]) == [1; 2] && (1..=2).contains(&down);
        if node.op_type != "Conv" || !counted || !types || !plain || down != across {
            return None;
        }
        let (kernel, stride) = ([high, wide], down as usize);
        let bias = bias.map_or_else(|| vec![0.0; channels], Tensor::floats);
        if bias.len() != channels {
            return None;
        }
        let along = |length: usize, padding: i64, kernel: usize| {
            (length + padding as usize).checked_sub(kernel).map(|room| room / stride + 1)
        };
        let result =
            [along(height, top + bottom, kernel[0])?, along(width, left + right, kernel[1])?];
        let before = [top as usize, left as usize];
        let image = [height, width];
        Some(Self { channels, image, kernel, result, stride, before, bias })
    }

    /// Convolves the planes of all channels, one after the other, with the weights of each channel,
    /// row by row.
    pub fn run(
        &self,
        (image, weights): (&[f32], &[f32]),
        scratch: &mut DepthwiseScratch,
        result: &mut Vec<f32>,
    ) {
        let layout = self.layout();
        let (plane, cells) = (self.image[0] * self.image[1], self.result[0] * self.result[1]);
        let length = self.kernel[0] * self.kernel[1];
        if [image.len(), weights.len()] != [plane, length].map(|each| self.channels * each) {
            return;
        }
        result.resize(self.channels * cells, 0.0);
        let groups = current_num_threads().clamp(1, self.channels);
        let each = self.channels.div_ceil(groups);
        scratch.padded.resize(groups * layout.row * layout.rows, 0.0);
        let buffers = scratch.padded.par_chunks_mut(layout.row * layout.rows);
        result.par_chunks_mut(each * cells).zip(buffers).enumerate().for_each(
            |(group, (result, padded))| {
                let planes = image.chunks_exact(plane).enumerate().skip(group * each);
                padded.fill(0.0);
                dispatch!(Instructions::default(), |simd| {
                    for ((channel, plane), result) in planes.zip(result.chunks_exact_mut(cells)) {
                        pad(self, layout, plane, padded);
                        let weights = &weights[channel * length..][..length];
                        let kernel = (weights, self.bias[channel]);
                        self.convolve_channel(simd, layout, kernel, padded, result);
                    }
                });
            },
        );
    }

    /// Convolves one channel.
    #[inline(always)]
    fn convolve_channel<S: Simd>(
        &self,
        simd: S,
        layout: Layout,
        kernel: (&[f32], f32),
        padded: &[f32],
        result: &mut [f32],
    ) {
        match self.kernel {
            [3, 3] => convolve::<S, 3>(simd, (self, layout), kernel, padded, result),
            [4, 4] => convolve::<S, 4>(simd, (self, layout), kernel, padded, result),
            [5, 5] => convolve::<S, 5>(simd, (self, layout), kernel, padded, result),
            _ => convolve::<S, 0>(simd, (self, layout), kernel, padded, result),
        }
    }

    fn layout(&self) -> Layout {
        let [rows, columns] = self.result;
        let columns = columns.next_multiple_of(LANES);
        // The last vector also reads to the right of what its results need.
        let filled = [self.image[1], self.before[1]].map(|length| length.div_ceil(self.stride));
        let part = (columns + (self.kernel[1] - 1) / self.stride).max(filled[0] + filled[1]);
        let needed = (rows.next_multiple_of(ROWS) - 1) * self.stride + self.kernel[0];
        let rows = needed.max(self.image[0] + self.before[0]);
        Layout { part, row: part * self.stride, rows }
    }
}

/// Copies a plane between the zeros.
#[inline(always)]
fn pad(convolution: &DepthwiseConvolution, layout: Layout, plane: &[f32], padded: &mut [f32]) {
    let DepthwiseConvolution { stride, before: [top, left], image: [_, width], .. } = *convolution;
    let rows = padded.chunks_exact_mut(layout.row).skip(top);
    for (row, samples) in rows.zip(plane.chunks_exact(width)) {
        if stride == 1 {
            row[left..left + width].copy_from_slice(samples);
            continue;
        }
        let (even, odd) = row.split_at_mut(layout.part);
        let (first, second) = if left.is_multiple_of(2) { (even, odd) } else { (odd, even) };
        let pairs = samples.chunks(2);
        let (first, second) = (&mut first[left / 2..], &mut second[left.div_ceil(2)..]);
        for ((pair, first), second) in pairs.zip(first).zip(second) {
            *first = pair[0];
            if let Some(&sample) = pair.get(1) {
                *second = sample;
            }
        }
    }
}

/// One channel. `K` is the side of the kernel, or 0 for any.
#[inline(always)]
fn convolve<S: Simd, const K: usize>(
    simd: S,
    (convolution, layout): (&DepthwiseConvolution, Layout),
    (weights, bias): (&[f32], f32),
    padded: &[f32],
    result: &mut [f32],
) {
    let DepthwiseConvolution { stride, result: [_, width], .. } = *convolution;
    let [high, wide] = if K > 0 { [K; 2] } else { convolution.kernel };
    let bias = simd.splat_f32s(bias);
    let (lanes, down) = (S::F32_LANES, stride * layout.row);
    for (block, rows) in result.chunks_mut(ROWS * width).enumerate() {
        for x in (0..width).step_by(lanes) {
            let mut sums = [bias; ROWS];
            for ky in 0..high {
                let first = (block * ROWS * stride + ky) * layout.row + x;
                for kx in 0..wide {
                    let weight = simd.splat_f32s(weights[ky * wide + kx]);
                    let column = first + kx % stride * layout.part + kx / stride;
                    let samples = &padded[column..][..(ROWS - 1) * down + lanes];
                    for (r, sum) in sums.iter_mut().enumerate() {
                        let samples = S::as_simd_f32s(&samples[r * down..][..lanes]).0[0];
                        // Not fused, so that the bits are those of the plain loop.
                        *sum = simd.add_f32s(*sum, simd.mul_f32s(weight, samples));
                    }
                }
            }
            let inside = lanes.min(width - x);
            for (row, sum) in rows.chunks_exact_mut(width).zip(&sums) {
                let sums = bytemuck::cast_slice::<S::f32s, f32>(std::slice::from_ref(sum));
                row[x..][..inside].copy_from_slice(&sums[..inside]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::onnx::Attribute;
    use proptest::prelude::*;

    /// The same by the definition.
    fn plain(convolution: &DepthwiseConvolution, image: &[f32], weights: &[f32]) -> Vec<f32> {
        let DepthwiseConvolution { image: [height, width], kernel: [high, wide], .. } =
            *convolution;
        let DepthwiseConvolution { result: [rows, columns], before: [top, left], stride, .. } =
            *convolution;
        let mut result = Vec::new();
        for channel in 0..convolution.channels {
            for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                let mut sum = convolution.bias[channel];
                for (ky, kx) in (0..high).flat_map(|ky| (0..wide).map(move |kx| (ky, kx))) {
                    let row = (y * stride + ky).checked_sub(top).filter(|&row| row < height);
                    let column = (x * stride + kx).checked_sub(left).filter(|&x| x < width);
                    if let (Some(row), Some(column)) = (row, column) {
                        let weight = weights[(channel * high + ky) * wide + kx];
                        sum += weight * image[(channel * height + row) * width + column];
                    }
                }
                result.push(sum);
            }
        }
        result
    }

    fn node(ints: &[(&str, &[i64])], group: i64) -> Node {
        let attribute = |(name, ints): &(&str, &[i64])| Attribute {
            name: (*name).into(),
            ints: ints.to_vec(),
            ..Attribute::default()
        };
        let group = Attribute { name: "group".into(), i: Some(group), ..Attribute::default() };
        let attribute = ints.iter().map(attribute).chain([group]).collect();
        Node { op_type: "Conv".into(), attribute, ..Node::default() }
    }

    fn tensor(dims: &[usize], value: impl Fn(usize) -> f32) -> Tensor {
        let float_data = (0..dims.iter().product()).map(value).collect();
        let dims = dims.iter().map(|&dim| dim as i64).collect();
        Tensor { dims, data_type: FLOAT, float_data, ..Tensor::default() }
    }

    fn value(seed: usize) -> impl Fn(usize) -> f32 {
        move |k| ((k * 7919 + seed * 104_729) % 2003) as f32 / 1000.0 - 1.0
    }

    proptest! {
        #[test]
        fn the_kernel_equals_the_plain_loop(
            channels in 1_usize..6,
            (height, width) in (1_usize..40, 1_usize..40),
            (high, wide) in (1_usize..6, 1_usize..6),
            pads in [0_i64..3, 0..3, 0..3, 0..3],
            stride in 1_i64..3,
            square in any::<bool>(),
            seed in 0_usize..1000,
        ) {
            let (high, wide) = if square { (high | 1, high | 1) } else { (high, wide) };
            let node = node(&[("pads", &pads), ("strides", &[stride; 2])], channels as i64);
            let weights: Vec<f32> = (0..channels * high * wide).map(value(seed)).collect();
            let bias = tensor(&[channels], value(seed + 1));
            let shape = [1, channels, height, width];
            let weights_shape = [channels, 1, high, wide];
            let convolution = DepthwiseConvolution::of(&node, &shape, &weights_shape, Some(&bias));
            let Some(convolution) = convolution else {
                // Only where the kernel is larger than the padded image.
                let fits = |length: usize, padding: i64, kernel| length + padding as usize >= kernel;
                prop_assert!(!fits(height, pads[0] + pads[2], high) || !fits(width, pads[1] + pads[3], wide));
                return Ok(());
            };
            let image: Vec<f32> = (0..channels * height * width).map(value(seed + 2)).collect();
            let (mut scratch, mut result) = (DepthwiseScratch::default(), vec![9.0; 3]);
            for _ in 0..2 {
                convolution.run((&image, &weights), &mut scratch, &mut result);
                prop_assert_eq!(&result, &plain(&convolution, &image, &weights));
            }
        }
    }

    #[test]
    fn other_convolutions_are_left_to_the_runtime() {
        let of = |ints: &[(&str, &[i64])], group, image: &[usize], weights: &[usize]| {
            DepthwiseConvolution::of(&node(ints, group), image, weights, None).is_some()
        };
        let image = [1, 4, 9, 9];
        assert!(of(&[], 4, &image, &[4, 1, 3, 3]));
        assert!(!of(&[], 1, &image, &[4, 4, 3, 3]), "one group");
        assert!(!of(&[], 4, &image, &[8, 1, 3, 3]), "two kernels for each channel");
        assert!(!of(&[], 4, &[2, 4, 9, 9], &[4, 1, 3, 3]), "two images");
        assert!(!of(&[("strides", &[1, 2])], 4, &image, &[4, 1, 3, 3]));
        assert!(!of(&[("strides", &[3, 3])], 4, &image, &[4, 1, 3, 3]));
        assert!(!of(&[("dilations", &[2, 2])], 4, &image, &[4, 1, 3, 3]));
    }
}
