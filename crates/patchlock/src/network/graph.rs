//! The graph of a file, checked: known operators, tensors as long as their shapes say, every value
//! made once and before it is used.

use super::error::{NetworkError, at_most, graph};
use super::onnx::{self, FLOAT, INT32, INT64, Node, Tensor, ValueInfo};
use prost::Message;
use std::collections::{HashMap, HashSet};

/// The largest file. The known trackers are below 2 MB.
pub const MAX_BYTES: u64 = 64 << 20;
/// The most operators. The known trackers have below 300.
const MAX_OPERATORS: u64 = 2048;
/// The most elements of one tensor.
pub const MAX_ELEMENTS: u64 = 1 << 24;
/// The range of versions of the operators' definitions.
const OPSETS: std::ops::RangeInclusive<i64> = 9..=21;

/// The operators of the known trackers.
pub const OPERATORS: &[&str] = &[
    "Add",
    "Cast",
    "Clip",
    "Concat",
    "Constant",
    "Conv",
    "Div",
    "Erf",
    "Exp",
    "Gemm",
    "GlobalAveragePool",
    "HardSigmoid",
    "HardSwish",
    "MatMul",
    "Mul",
    "Pow",
    "ReduceMean",
    "Relu",
    "Reshape",
    "Shape",
    "Sigmoid",
    "Slice",
    "Softmax",
    "Split",
    "Sqrt",
    "Squeeze",
    "Sub",
    "Transpose",
    "Unsqueeze",
];

/// A graph whose nodes stand in an order in which they can be computed.
#[derive(Debug, Clone)]
pub struct CheckedGraph {
    pub nodes: Vec<Node>,
    /// The constants, by name.
    pub constants: HashMap<String, Tensor>,
    pub inputs: Vec<ValueInfo>,
    pub outputs: Vec<ValueInfo>,
    /// The version of the operators' definitions.
    pub opset: i64,
    pub ir_version: i64,
}

impl CheckedGraph {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// What is damaged, unknown or above a limit.
    pub fn read(bytes: &[u8]) -> Result<Self, NetworkError> {
        at_most("the number of bytes", bytes.len() as u64, MAX_BYTES)?;
        let not_onnx = |reason: &dyn ToString| NetworkError::NotOnnx(reason.to_string());
        let model = onnx::Model::decode(bytes).map_err(|error| not_onnx(&error))?;
        let opset = opset(&model)?;
        let graph = model.graph.ok_or_else(|| not_onnx(&"it has no graph"))?;
        at_most("the number of operators", graph.node.len() as u64, MAX_OPERATORS)?;
        if !graph.sparse_initializer.is_empty() {
            return Err(self::graph("it has sparse tensors, which are not supported"));
        }
        let mut constants = HashMap::new();
        for tensor in graph.initializer {
            keep_constant(&mut constants, tensor)?;
        }
        let mut nodes = Vec::new();
        for node in graph.node {
            check_node(&node)?;
            match constant_of(&node)? {
                Some(tensor) => keep_constant(&mut constants, tensor)?,
                None => nodes.push(node),
            }
        }
        // Files of old versions list the constants among the inputs.
        let inputs: Vec<_> =
            graph.input.into_iter().filter(|input| !constants.contains_key(&input.name)).collect();
        let nodes = in_order(nodes, &inputs, &constants)?;
        let made =
            |name: &str| nodes.iter().any(|node| node.output.iter().any(|made| made == name));
        if let Some(output) = graph.output.iter().find(|output| !made(&output.name)) {
            return Err(self::graph(format!("nothing computes its output `{}`", output.name)));
        }
        let (outputs, ir_version) = (graph.output, model.ir_version);
        Ok(Self { nodes, constants, inputs, outputs, opset, ir_version })
    }

    /// The number of weights.
    pub fn parameters(&self) -> u64 {
        self.constants.values().map(|tensor| tensor.dims.iter().product::<i64>() as u64).sum()
    }

    /// A file with these nodes, and the constants that they use.
    pub fn file(&self, nodes: &[Node], inputs: Vec<ValueInfo>, outputs: Vec<ValueInfo>) -> Vec<u8> {
        let used: HashSet<&String> = nodes.iter().flat_map(|node| &node.input).collect();
        let mut initializer: Vec<Tensor> = self
            .constants
            .iter()
            .filter(|(name, _)| used.contains(name))
            .map(|(_, tensor)| tensor.clone())
            .collect();
        initializer.sort_by(|a, b| a.name.cmp(&b.name));
        let graph = onnx::Graph {
            node: nodes.to_vec(),
            name: "graph".to_owned(),
            initializer,
            input: inputs,
            output: outputs,
            sparse_initializer: Vec::new(),
        };
        let opset_import = vec![onnx::OperatorSet { domain: String::new(), version: self.opset }];
        onnx::Model { ir_version: self.ir_version, graph: Some(graph), opset_import }
            .encode_to_vec()
    }
}

/// The version of the standard operators.
fn opset(model: &onnx::Model) -> Result<i64, NetworkError> {
    let standard = |set: &&onnx::OperatorSet| set.domain.is_empty() || set.domain == "ai.onnx";
    let version = model.opset_import.iter().find(standard).map(|set| set.version);
    let version = version.ok_or_else(|| NetworkError::NotOnnx("it has no operator set".into()))?;
    if OPSETS.contains(&version) {
        return Ok(version);
    }
    let (first, last) = (OPSETS.start(), OPSETS.end());
    Err(graph(format!("its operator set has version {version}; allowed: {first} to {last}")))
}

/// Checks what a node says of itself.
fn check_node(node: &Node) -> Result<(), NetworkError> {
    let standard = node.domain.is_empty() || node.domain == "ai.onnx";
    if !standard || !OPERATORS.contains(&node.op_type.as_str()) {
        let domain = if standard { String::new() } else { format!("{}.", node.domain) };
        let name = format!("{domain}{}", node.op_type);
        return Err(NetworkError::Operator { name, allowed: OPERATORS.join(", ") });
    }
    for attribute in &node.attribute {
        if attribute.g.is_some() || !attribute.graphs.is_empty() {
            return Err(graph(format!("its operator {} holds a graph", node.op_type)));
        }
        if let Some(tensor) = &attribute.t {
            check_tensor(tensor)?;
        }
    }
    Ok(())
}

/// The tensor of a node of the operator `Constant`.
fn constant_of(node: &Node) -> Result<Option<Tensor>, NetworkError> {
    if node.op_type != "Constant" {
        return Ok(None);
    }
    let tensor = node.attribute("value").and_then(|attribute| attribute.t.clone());
    match (tensor, node.output.first()) {
        (Some(tensor), Some(name)) => Ok(Some(Tensor { name: name.clone(), ..tensor })),
        _ => Err(graph("an operator Constant has no tensor")),
    }
}

fn keep_constant(
    constants: &mut HashMap<String, Tensor>,
    tensor: Tensor,
) -> Result<(), NetworkError> {
    check_tensor(&tensor)?;
    let name = tensor.name.clone();
    match constants.insert(name.clone(), tensor) {
        None => Ok(()),
        Some(_) => Err(graph(format!("two constants have the name `{name}`"))),
    }
}

/// Checks that a tensor holds as many elements as its shape says, in this file.
fn check_tensor(tensor: &Tensor) -> Result<(), NetworkError> {
    let name = &tensor.name;
    if tensor.data_location != 0 || !tensor.external_data.is_empty() {
        return Err(graph(format!("the tensor `{name}` is in another file; allowed: one file")));
    }
    let size = match tensor.data_type {
        FLOAT | INT32 => 4,
        INT64 => 8,
        other => {
            return Err(graph(format!(
                "the tensor `{name}` has the element type {other}; allowed: {FLOAT} (float), \
                 {INT32} (int32), {INT64} (int64)"
            )));
        }
    };
    let product = |count: u64, &dim: &i64| count.checked_mul(u64::try_from(dim).ok()?);
    let count = tensor.dims.iter().try_fold(1, product);
    let count =
        count.ok_or_else(|| graph(format!("the tensor `{name}` has an impossible shape")))?;
    at_most("the number of elements of a tensor", count, MAX_ELEMENTS)?;
    let held = match (&tensor.raw_data, tensor.data_type) {
        (Some(raw), _) if raw.len().is_multiple_of(size) => raw.len() / size,
        (Some(_), _) => usize::MAX,
        (None, FLOAT) => tensor.float_data.len(),
        (None, INT32) => tensor.int32_data.len(),
        (None, _) => tensor.int64_data.len(),
    };
    if held as u64 == count {
        return Ok(());
    }
    let dims = &tensor.dims;
    Err(graph(format!(
        "the tensor `{name}` does not hold the {count} elements of its shape {dims:?}"
    )))
}

/// The nodes in an order in which each value is made before it is used.
fn in_order(
    nodes: Vec<Node>,
    inputs: &[ValueInfo],
    constants: &HashMap<String, Tensor>,
) -> Result<Vec<Node>, NetworkError> {
    let mut known: HashSet<String> = constants.keys().cloned().collect();
    known.extend(inputs.iter().map(|input| input.name.clone()));
    let mut made = known.clone();
    for name in nodes.iter().flat_map(|node| &node.output).filter(|name| !name.is_empty()) {
        if !made.insert(name.clone()) {
            return Err(graph(format!("the value `{name}` is made twice")));
        }
    }
    let absent = nodes
        .iter()
        .flat_map(|node| &node.input)
        .find(|name| !name.is_empty() && !made.contains(*name));
    if let Some(name) = absent {
        return Err(graph(format!("nothing computes the value `{name}`")));
    }
    let (mut waiting, mut ordered) = (nodes, Vec::new());
    while !waiting.is_empty() {
        let before = ordered.len();
        let mut blocked = Vec::new();
        for node in waiting {
            if node.input.iter().all(|name| name.is_empty() || known.contains(name)) {
                known.extend(node.output.iter().cloned());
                ordered.push(node);
            } else {
                blocked.push(node);
            }
        }
        if ordered.len() == before {
            return Err(graph("its operators depend on each other in a circle"));
        }
        waiting = blocked;
    }
    Ok(ordered)
}
