//! What an operator costs, from the shapes of its inputs, before it is computed: a file cannot make
//! the runtime take more memory or time than the limits here.

use super::graph::{MAX_ELEMENTS, MAX_RANK};
use super::onnx::Node;
use crate::network_error::{NetworkError, at_most, graph};

/// The most multiplications and additions of one run of a graph. The known trackers have below 10^9.
const MAX_MULTIPLICATIONS: u64 = 1 << 31;
/// The most elements of all values of a graph together.
const MAX_ALL_ELEMENTS: u64 = 1 << 26;
/// The largest stride, dilation or padding of a convolution.
const MAX_STEP: i64 = 64;

/// The cost of a graph so far.
#[derive(Debug, Default)]
pub struct Cost {
    elements: u64,
    multiplications: u64,
}

impl Cost {
    /// Adds an operator with inputs of these shapes. An input that is left out has no shape.
    ///
    /// # Errors
    /// The operator does not fit its inputs, or a limit is exceeded.
    pub fn add(&mut self, node: &Node, inputs: &[Option<&[usize]>]) -> Result<(), NetworkError> {
        let (elements, each) = elements(node, inputs)?;
        at_most("the number of dimensions of a value", dimensions(node, inputs), MAX_RANK)?;
        at_most("the number of elements of a value", elements, MAX_ELEMENTS)?;
        self.elements = self.elements.saturating_add(elements);
        at_most("the number of elements of all values", self.elements, MAX_ALL_ELEMENTS)?;
        let multiplications = elements.saturating_mul(each);
        self.multiplications = self.multiplications.saturating_add(multiplications);
        at_most("the number of multiplications", self.multiplications, MAX_MULTIPLICATIONS)
    }
}

/// The most elements of the outputs, and how many multiplications each takes.
fn elements(node: &Node, inputs: &[Option<&[usize]>]) -> Result<(u64, u64), NetworkError> {
    let input = |k: usize| {
        let missing = || graph(format!("an operator {} lacks input {}", node.op_type, k + 1));
        inputs.get(k).copied().flatten().ok_or_else(missing)
    };
    Ok(match node.op_type.as_str() {
        "Conv" => convolution(node, input(0)?, input(1)?)?,
        "MatMul" => {
            let (a, b) = (input(0)?, input(1)?);
            let ([.., rows, inner], [.., columns]) = (a, b) else {
                return Err(graph("an operator MatMul has an input of fewer than two dimensions"));
            };
            let batch = broadcast(node, &a[..a.len() - 2], &b[..b.len().saturating_sub(2)])?;
            let output = product(&[*rows, *columns]);
            (batch.saturating_mul(output), *inner as u64)
        }
        "Gemm" => match (input(0)?, input(1)?) {
            (&[a, b], &[c, d]) => (product(&[a.max(b), c.max(d)]), a.max(b) as u64),
            _ => return Err(graph("an operator Gemm has inputs that are not matrices")),
        },
        "Add" | "Sub" | "Mul" | "Div" | "Pow" => (broadcast(node, input(0)?, input(1)?)?, 1),
        "Concat" => {
            let all = inputs.iter().copied().flatten().map(product);
            (all.fold(0, u64::saturating_add), 1)
        }
        // The output of all others has at most as many elements as their first input.
        _ => (product(input(0)?), 1),
    })
}

/// The most dimensions of the outputs.
fn dimensions(node: &Node, inputs: &[Option<&[usize]>]) -> u64 {
    let rank = |k: usize| inputs.get(k).copied().flatten().map_or(0, <[usize]>::len) as u64;
    let numbers = |k: usize| inputs.get(k).copied().flatten().map_or(0, product);
    match node.op_type.as_str() {
        "Reshape" => numbers(1),
        "Unsqueeze" => rank(0).saturating_add(numbers(1)) + node.ints("axes", &[]).len() as u64,
        _ => rank(0).max(rank(1)),
    }
}

/// The elements of a convolution's output, and the weights that each takes.
fn convolution(
    node: &Node,
    input: &[usize],
    weights: &[usize],
) -> Result<(u64, u64), NetworkError> {
    let damaged = |reason: String| graph(format!("an operator Conv {reason}"));
    let (&[batch, channels, height, width], &[kernels, depth, high, wide]) = (input, weights)
    else {
        return Err(damaged(format!(
            "has an input {input:?} and weights {weights:?}; allowed: images"
        )));
    };
    let group = node.attribute("group").and_then(|group| group.i).unwrap_or(1);
    let groups = usize::try_from(group).unwrap_or(0);
    let fits = groups > 0
        && depth.checked_mul(groups) == Some(channels)
        && kernels.is_multiple_of(groups)
        && [kernels, high, wide].iter().all(|&length| length > 0);
    if !fits {
        return Err(damaged(format!(
            "with {group} groups has weights {weights:?} for an input {input:?}"
        )));
    }
    if node.attribute("auto_pad").is_some_and(|auto| auto.s.as_deref() != Some(b"NOTSET")) {
        return Err(damaged("chooses its padding itself, which is not supported".into()));
    }
    let shape = [high as i64, wide as i64];
    if node.ints("kernel_shape", &shape) != shape {
        return Err(damaged("has weights of another size than its kernel".into()));
    }
    let (pads, strides) = (node.ints("pads", &[0; 4]), node.ints("strides", &[1; 2]));
    let dilations = node.ints("dilations", &[1; 2]);
    let (&[top, left, bottom, right], &[down, across], &[tall, broad]) =
        (&pads[..], &strides[..], &dilations[..])
    else {
        return Err(damaged("has pads, strides or dilations that are not of an image".into()));
    };
    let steps = [down, across, tall, broad].iter().all(|step| (1..=MAX_STEP).contains(step));
    if !steps || !pads.iter().all(|pad| (0..=MAX_STEP).contains(pad)) {
        return Err(damaged(format!(
            "has pads {pads:?}, strides {strides:?}, dilations {dilations:?}; allowed: pads of 0 \
             to {MAX_STEP}, the others 1 to {MAX_STEP}"
        )));
    }
    let along = |length: usize, padding: i64, kernel: usize, dilation: i64, stride: i64| {
        let room = length as i64 + padding - dilation * (kernel as i64 - 1) - 1;
        usize::try_from(room).ok().map(|room| room / stride as usize + 1)
    };
    let rows = along(height, top + bottom, high, tall, down);
    let columns = along(width, left + right, wide, broad, across);
    let (Some(rows), Some(columns)) = (rows, columns) else {
        return Err(damaged(format!("has a kernel {shape:?} larger than its input {input:?}")));
    };
    Ok((product(&[batch, kernels, rows, columns]), product(&[depth, high, wide])))
}

/// The elements of two shapes that are repeated to fit each other.
fn broadcast(node: &Node, a: &[usize], b: &[usize]) -> Result<u64, NetworkError> {
    let length = a.len().max(b.len());
    let from_end = |shape: &[usize], k: usize| shape.len().checked_sub(k).map_or(1, |k| shape[k]);
    let mut shape = Vec::with_capacity(length);
    for k in 1..=length {
        let (left, right) = (from_end(a, k), from_end(b, k));
        if left != right && left != 1 && right != 1 {
            let name = &node.op_type;
            return Err(graph(format!(
                "an operator {name} has inputs {a:?} and {b:?}, which do not fit"
            )));
        }
        shape.push(left.max(right));
    }
    Ok(product(&shape))
}

/// The number of elements of a shape.
fn product(shape: &[usize]) -> u64 {
    shape.iter().fold(1, |count: u64, &length| count.saturating_mul(length as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::onnx::Attribute;

    fn node(op: &str) -> Node {
        Node { op_type: op.into(), ..Node::default() }
    }

    fn with(op: &str, name: &str, ints: &[i64]) -> Node {
        let attribute =
            Attribute { name: name.into(), ints: ints.to_vec(), ..Attribute::default() };
        Node { attribute: vec![attribute], ..node(op) }
    }

    #[test]
    fn each_operator_is_counted() {
        let count = |node: &Node, inputs: &[&[usize]]| {
            let inputs: Vec<_> = inputs.iter().map(|&shape| Some(shape)).collect();
            elements(node, &inputs).unwrap()
        };
        let strided = with("Conv", "strides", &[2, 2]);
        assert_eq!(count(&strided, &[&[1, 3, 9, 7], &[8, 3, 3, 3]]), (8 * 4 * 3, 27));
        assert_eq!(count(&node("MatMul"), &[&[2, 3, 4], &[4, 5]]), (30, 4));
        assert_eq!(count(&node("Gemm"), &[&[1, 8], &[4, 8]]), (64, 8));
        assert_eq!(count(&node("Add"), &[&[4, 1, 3], &[5, 1]]), (60, 1));
        assert_eq!(count(&node("Concat"), &[&[2, 3], &[4, 3]]), (18, 1));
        assert_eq!(count(&node("Relu"), &[&[2, 3]]), (6, 1));
    }

    #[test]
    fn what_does_not_fit_or_is_too_large_is_an_error() {
        let refused = |node: &Node, inputs: &[&[usize]]| {
            let inputs: Vec<_> = inputs.iter().map(|&shape| Some(shape)).collect();
            Cost::default().add(node, &inputs).unwrap_err().to_string()
        };
        let image: &[usize] = &[1, 3, 9, 9];
        let conv = node("Conv");
        assert!(refused(&conv, &[image, &[8, 2, 3, 3]]).contains("groups"));
        assert!(refused(&conv, &[image, &[8, 3, 10, 3]]).contains("larger than its input"));
        assert!(refused(&conv, &[image]).contains("lacks input 2"));
        assert!(refused(&conv, &[image, &[8, 3, 3]]).contains("allowed: images"));
        for (name, ints) in
            [("pads", [1 << 40; 4].as_slice()), ("strides", &[0, 1]), ("dilations", &[-1, 1])]
        {
            assert!(
                refused(&with("Conv", name, ints), &[image, &[8, 3, 3, 3]])
                    .contains("allowed: pads")
            );
        }
        let wide: &[usize] = &[1, 1, 4096];
        assert!(refused(&node("Mul"), &[&[4097, 1], wide]).contains("at most 16777216"));
        assert!(refused(&node("Add"), &[&[2, 3], &[4, 3]]).contains("do not fit"));
        let long: &[usize] = &[1000, 1 << 12];
        assert!(refused(&node("MatMul"), &[long, &[1 << 12, 1000]]).contains("multiplications"));
        let deep = "the number of dimensions of a value is 9";
        assert!(refused(&node("Reshape"), &[image, &[9]]).contains(deep));
        assert!(refused(&node("Unsqueeze"), &[image, &[5]]).contains(deep));
        let axes = with("Unsqueeze", "axes", &[0; 5]);
        assert!(refused(&axes, &[image]).contains(deep));
    }
}
