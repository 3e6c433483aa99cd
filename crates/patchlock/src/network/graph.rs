//! The graph of a file, checked: known operators, tensors as long as their shapes say, every value
//! made once and before it is used.

use super::onnx::{self, FLOAT, INT32, INT64, Node, Tensor, ValueInfo};
use crate::network_error::{NetworkError, at_most, graph};
use prost::Message;
use std::collections::{BTreeSet, HashMap, HashSet};

/// The largest file. The known trackers are below 2 MB.
pub const MAX_BYTES: u64 = 64 << 20;
/// The most operators. The known trackers have below 300.
const MAX_OPERATORS: u64 = 2048;
/// The most elements of one tensor.
pub const MAX_ELEMENTS: u64 = 1 << 24;
/// The most inputs and outputs of a file and of one operator.
const MAX_VALUES: u64 = 64;
/// The most dimensions of a tensor.
pub const MAX_RANK: u64 = 8;
/// The longest name, in bytes.
const MAX_NAME: usize = 256;
/// The range of versions of the operators' definitions.
const OPSETS: std::ops::RangeInclusive<i64> = 9..=21;

/// Calls a macro with the operators of the known trackers, in the order of the alphabet. `Constant`,
/// whose tensors are taken out of the graph, belongs where the semicolon is.
macro_rules! with_operators {
    ($each:ident) => {
        $each!(
            Add Cast Clip Concat; Conv Div Erf Exp Gemm GlobalAveragePool HardSigmoid HardSwish
            MatMul Mul Pow ReduceMean Relu Reshape Shape Sigmoid Slice Softmax Split Sqrt Squeeze
            Sub Transpose Unsqueeze
        )
    };
}
pub(super) use with_operators;

macro_rules! names {
    ($($early:ident)*; $($late:ident)*) => {
        &[$(stringify!($early),)* "Constant", $(stringify!($late)),*]
    };
}

/// The names of the operators that a file may have.
const OPERATORS: &[&str] = with_operators!(names);

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
        let mut values = graph.input.iter().chain(&graph.output);
        values.try_for_each(|value| check_name(&value.name))?;
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
        at_most("the number of inputs", inputs.len() as u64, MAX_VALUES)?;
        at_most("the number of outputs", graph.output.len() as u64, MAX_VALUES)?;
        let nodes = in_order(nodes, &inputs, &constants)?;
        let made: HashSet<&String> = nodes.iter().flat_map(|node| &node.output).collect();
        if let Some(output) = graph.output.iter().find(|output| !made.contains(&output.name)) {
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

/// Checks a name, which messages repeat.
fn check_name(name: &str) -> Result<(), NetworkError> {
    if name.len() <= MAX_NAME && !name.contains(char::is_control) {
        return Ok(());
    }
    Err(graph(format!("a name in it has control characters or more than {MAX_NAME} bytes")))
}

/// Checks what a node says of itself.
fn check_node(node: &Node) -> Result<(), NetworkError> {
    let values = (node.input.len() as u64).max(node.output.len() as u64);
    at_most("the number of inputs or outputs of an operator", values, MAX_VALUES)?;
    let names = node.input.iter().chain(&node.output).chain([&node.op_type, &node.domain]);
    names.into_iter().try_for_each(|name| check_name(name))?;
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
    check_name(name)?;
    at_most("the number of dimensions of a tensor", tensor.dims.len() as u64, MAX_RANK)?;
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
    sorted(nodes, &known)
}

/// The nodes, each after those that make its inputs, and otherwise in the order in which they stand.
fn sorted(nodes: Vec<Node>, known: &HashSet<String>) -> Result<Vec<Node>, NetworkError> {
    let mut users: HashMap<&str, Vec<usize>> = HashMap::new();
    let mut waits_for = vec![0_usize; nodes.len()];
    for (k, node) in nodes.iter().enumerate() {
        for name in node.input.iter().filter(|name| !name.is_empty() && !known.contains(*name)) {
            users.entry(name).or_default().push(k);
            waits_for[k] += 1;
        }
    }
    let mut ready: BTreeSet<usize> = (0..nodes.len()).filter(|&k| waits_for[k] == 0).collect();
    let mut order = Vec::with_capacity(nodes.len());
    while let Some(k) = ready.pop_first() {
        order.push(k);
        for user in nodes[k].output.iter().flat_map(|name| users.remove(name.as_str())).flatten() {
            waits_for[user] -= 1;
            if waits_for[user] == 0 {
                ready.insert(user);
            }
        }
    }
    if order.len() < nodes.len() {
        return Err(graph("its operators depend on each other in a circle"));
    }
    let mut nodes: Vec<Option<Node>> = nodes.into_iter().map(Some).collect();
    Ok(order.into_iter().filter_map(|k| nodes[k].take()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::onnx::{Attribute, Graph, Model, OperatorSet};

    const HEAD: &[u8] = include_bytes!("../../tests/golden/network/nanotrack_head.onnx");

    /// The made-up head after a change, as a file.
    fn changed(change: impl FnOnce(&mut Model)) -> Vec<u8> {
        let mut model = Model::decode(HEAD).unwrap();
        change(&mut model);
        model.encode_to_vec()
    }

    fn refused(bytes: &[u8], words: &str) {
        let error = CheckedGraph::read(bytes).err();
        let message = error.unwrap_or_else(|| panic!("not refused: {words}")).to_string();
        assert!(message.contains(words), "{message}, not {words}");
    }

    fn refused_graph(words: &str, change: impl FnOnce(&mut Graph)) {
        refused(&changed(|model| change(model.graph.as_mut().unwrap())), words);
    }

    fn refused_tensor(words: &str, change: impl FnOnce(&mut Tensor)) {
        refused_graph(words, |graph| change(&mut graph.initializer[0]));
    }

    fn relu(input: &str, output: &str) -> Node {
        let (input, output) = (vec![input.to_owned()], vec![output.to_owned()]);
        Node { op_type: "Relu".to_owned(), input, output, ..Node::default() }
    }

    #[test]
    fn a_file_that_is_cut_or_is_something_else_is_refused() {
        assert!(CheckedGraph::read(&changed(|_| ())).is_ok());
        for length in (0..HEAD.len()).step_by(97) {
            assert!(CheckedGraph::read(&HEAD[..length]).is_err(), "{length} bytes");
        }
        for bytes in [b"".as_slice(), b"a text", b"\x89PNG\r\n\x1a\n", &[0xff; 99], &[0x0a; 99]] {
            refused(bytes, "not an ONNX file");
        }
        refused(&vec![0; MAX_BYTES as usize + 1], "the number of bytes is 67108865");
        refused(&changed(|model| model.graph = None), "it has no graph");
    }

    #[test]
    fn other_versions_and_operators_are_refused() {
        for version in [i64::MIN, 8, 22] {
            let set = OperatorSet { domain: String::new(), version };
            refused(&changed(|model| model.opset_import = vec![set]), "allowed: 9 to 21");
        }
        let other = OperatorSet { domain: "ai.onnx.ml".to_owned(), version: 3 };
        refused(&changed(|model| model.opset_import = vec![other]), "no operator set");
        refused_graph("the operator `Loop`; allowed: Add, ", |graph| {
            graph.node[3].op_type = "Loop".to_owned();
        });
        refused_graph("the operator `com.microsoft.", |graph| {
            graph.node[3].domain = "com.microsoft".to_owned();
        });
        for attribute in [
            Attribute { g: Some(vec![]), ..Attribute::default() },
            Attribute { graphs: vec![vec![]], ..Attribute::default() },
        ] {
            refused_graph("holds a graph", |graph| graph.node[3].attribute.push(attribute));
        }
        refused_graph("sparse", |graph| graph.sparse_initializer.push(vec![1]));
    }

    #[test]
    fn tensors_that_are_not_what_they_say_are_refused() {
        refused_tensor("in another file", |tensor| tensor.data_location = 1);
        refused_tensor("in another file", |tensor| tensor.external_data.push(vec![]));
        refused_tensor("element type 10", |tensor| tensor.data_type = 10);
        for dims in [vec![-1], vec![1 << 40, 1 << 40], vec![i64::MIN, 2]] {
            refused_tensor("impossible shape", |tensor| tensor.dims = dims);
        }
        refused_tensor("allowed: at most 16777216", |tensor| tensor.dims = vec![1 << 40]);
        refused_tensor("allowed: at most 8", |tensor| tensor.dims = vec![1; 9]);
        refused_tensor("does not hold the 5 elements", |tensor| tensor.dims = vec![5]);
        refused_tensor("does not hold", |tensor| tensor.raw_data.as_mut().unwrap().truncate(7));
        refused_tensor("does not hold", |tensor| {
            (tensor.raw_data, tensor.float_data) = (None, vec![0.5]);
        });
        for name in ["\u{1b}[2J".to_owned(), "x".repeat(257)] {
            refused_tensor("control characters or more than 256 bytes", |tensor| {
                tensor.name = name
            });
        }
        refused_graph("two constants have the name", |graph| {
            let first = graph.initializer[0].clone();
            graph.initializer.push(first);
        });
        refused_graph("Constant has no tensor", |graph| {
            graph.node.push(Node { op_type: "Constant".to_owned(), ..Node::default() });
        });
    }

    #[test]
    fn operators_that_cannot_be_computed_in_any_order_are_refused() {
        refused_graph("nothing computes the value `gone`", |graph| {
            graph.node.last_mut().unwrap().input[0] = "gone".to_owned();
        });
        refused_graph("depend on each other in a circle", |graph| {
            graph.node.extend([relu("a", "b"), relu("b", "a")]);
        });
        refused_graph("depend on each other in a circle", |graph| graph.node.push(relu("a", "a")));
        refused_graph("the value `input1` is made twice", |graph| {
            graph.node.push(relu("input2", "input1"));
        });
        refused_graph("nothing computes its output `gone`", |graph| {
            graph.output[1].name = "gone".to_owned();
        });
        refused_graph("the number of operators is", |graph| {
            graph.node = (0..2049).map(|k| relu("input1", &k.to_string())).collect();
        });
        refused_graph("inputs or outputs of an operator is 65", |graph| {
            graph.node[3].input = vec![String::new(); 65];
        });
        refused_graph("the number of outputs is 65", |graph| {
            let output = graph.output[0].clone();
            graph.output = vec![output; 65];
        });
    }

    #[test]
    fn operators_are_put_in_an_order_in_which_they_can_be_computed() {
        let whole = CheckedGraph::read(HEAD).unwrap();
        let turned =
            CheckedGraph::read(&changed(|model| model.graph.as_mut().unwrap().node.reverse()));
        let turned = turned.unwrap();
        let mut known: HashSet<&String> = turned.constants.keys().collect();
        known.extend(turned.inputs.iter().map(|input| &input.name));
        for node in &turned.nodes {
            assert!(node.input.iter().all(|name| name.is_empty() || known.contains(name)));
            known.extend(&node.output);
        }
        assert_eq!((turned.nodes.len(), turned.constants), (whole.nodes.len(), whole.constants));
    }
}
