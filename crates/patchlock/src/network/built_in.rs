//! The built-in runtime: `rten` in pure Rust, with a kernel of our own for depthwise convolutions,
//! which take it some 80 % of the time (benchmarks/record/committee.md).
//!
//! A graph is cut at its depthwise convolutions. Everything between them is a graph of its own for
//! `rten`. Operators that do not depend on each other's convolutions are in one graph, so that two
//! branches of a head take as few runs as one.

use super::cost::Cost;
use super::depthwise::{DepthwiseConvolution, DepthwiseScratch};
use super::graph::{CheckedGraph, with_operators};
use super::onnx::{FLOAT, INT64, Node, ValueInfo};
use crate::network_error::{NetworkError, graph as damaged};
use crate::numeric::parallel::current_num_threads;
use rten::{Model, ModelOptions, NodeId, RunOptions, ThreadPool, Value, ValueOrView, ValueView};
use rten_tensor::prelude::*;
use rten_tensor::{Tensor, TensorView};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A graph, ready to run on inputs of fixed shapes.
#[derive(Debug)]
pub struct Pipeline {
    steps: Vec<Step>,
    /// The shape of each value that goes from one step to another.
    shapes: Vec<Vec<usize>>,
    /// Which of them are the inputs and the outputs.
    inputs: Vec<usize>,
    outputs: Vec<usize>,
}

/// Operators that `rten` computes. Values have the ids of `rten`, and numbers among those that go
/// from step to step.
#[derive(Debug)]
struct Operators {
    model: Box<Model>,
    inputs: Vec<(NodeId, usize)>,
    outputs: Vec<NodeId>,
    /// The numbers of the outputs.
    numbers: Vec<usize>,
}

#[derive(Debug)]
enum Step {
    /// Operators that `rten` computes.
    Operators(Operators),
    Depthwise {
        convolution: Box<DepthwiseConvolution>,
        weights: Weights,
        input: usize,
        output: usize,
    },
}

/// The weights of a depthwise convolution.
#[derive(Debug)]
enum Weights {
    Constant(Vec<f32>),
    /// Those of a value, as where a template is correlated with a window.
    Value(usize),
}

/// Buffers of a run.
#[derive(Debug, Default)]
pub struct PipelineScratch {
    values: Vec<TensorBuffer>,
    depthwise: DepthwiseScratch,
}

/// A value between two steps.
#[derive(Debug, Default)]
struct TensorBuffer {
    /// Of `rten`.
    value: Option<Value>,
    /// Of our own kernel; empty if there is a value.
    samples: Vec<f32>,
}

impl TensorBuffer {
    fn view<'a>(&'a self, shape: &'a [usize]) -> ValueView<'a> {
        match &self.value {
            Some(value) => value.as_view(),
            None => TensorView::from_data(shape, self.samples.as_slice()).into(),
        }
    }
}

/// What is known of a value after a trial run.
#[derive(Debug, Clone)]
struct NodeInfo {
    shape: Vec<usize>,
    element: i32,
}

impl Pipeline {
    /// Prepares a graph for inputs of these shapes.
    ///
    /// # Errors
    /// The graph does not fit the inputs, or exceeds a limit.
    pub fn new(graph: &CheckedGraph, inputs: &[&[usize]]) -> Result<Self, NetworkError> {
        let known = try_out(graph, inputs)?;
        let mut plan = Plan { graph, known: &known, slots: BTreeMap::new() };
        let slots = |plan: &mut Plan<'_>, values: &[ValueInfo]| {
            values.iter().map(|value| plan.slot(&value.name)).collect::<Vec<_>>()
        };
        let inputs = slots(&mut plan, &graph.inputs);
        let outputs = slots(&mut plan, &graph.outputs);
        let steps = plan.steps()?;
        let mut shapes = vec![Vec::new(); plan.slots.len()];
        for (name, slot) in &plan.slots {
            shapes[*slot].clone_from(&known[name.as_str()].shape);
        }
        Ok(Self { steps, shapes, inputs, outputs })
    }

    /// The shapes of the outputs.
    pub fn output_shapes(&self) -> Vec<Vec<usize>> {
        self.outputs.iter().map(|&slot| self.shapes[slot].clone()).collect()
    }

    /// Computes the outputs, on the threads of a pool as large as the caller's `rayon` pool.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn run(
        &self,
        inputs: &[&[f32]],
        scratch: &mut PipelineScratch,
        outputs: &mut [Vec<f32>],
    ) -> Result<(), NetworkError> {
        let pool = pool(current_num_threads());
        pool.run(|| self.run_here(inputs, &pool, scratch, outputs))
    }

    fn run_here(
        &self,
        inputs: &[&[f32]],
        pool: &Arc<ThreadPool>,
        scratch: &mut PipelineScratch,
        outputs: &mut [Vec<f32>],
    ) -> Result<(), NetworkError> {
        let PipelineScratch { values, depthwise } = scratch;
        values.resize_with(self.shapes.len(), TensorBuffer::default);
        for (&slot, samples) in self.inputs.iter().zip(inputs) {
            values[slot].value = None;
            values[slot].samples.clear();
            values[slot].samples.extend_from_slice(samples);
        }
        for step in &self.steps {
            match step {
                Step::Operators(operators) => self.run_operators(operators, pool, values)?,
                Step::Depthwise { convolution, weights, input, output } => {
                    let mut result = std::mem::take(&mut values[*output].samples);
                    let samples = self.samples(values, *input)?;
                    let weights = match weights {
                        Weights::Constant(weights) => weights,
                        Weights::Value(slot) => self.samples(values, *slot)?,
                    };
                    convolution.run((samples, weights), depthwise, &mut result);
                    values[*output] = TensorBuffer { value: None, samples: result };
                }
            }
        }
        for (output, &slot) in outputs.iter_mut().zip(&self.outputs) {
            output.clear();
            output.extend_from_slice(self.samples(values, slot)?);
        }
        Ok(())
    }

    /// The samples of a value.
    fn samples<'a>(
        &self,
        values: &'a [TensorBuffer],
        slot: usize,
    ) -> Result<&'a [f32], NetworkError> {
        match &values[slot].value {
            None => Ok(&values[slot].samples),
            Some(Value::FloatTensor(tensor)) => {
                tensor.data().ok_or_else(|| failed("a value has gaps"))
            }
            Some(_) => Err(failed("a value is not of floats")),
        }
    }

    fn run_operators(
        &self,
        operators: &Operators,
        pool: &Arc<ThreadPool>,
        values: &mut [TensorBuffer],
    ) -> Result<(), NetworkError> {
        let Operators { model, inputs, outputs, numbers } = operators;
        let given = |&(id, slot): &(NodeId, usize)| {
            (id, ValueOrView::View(values[slot].view(&self.shapes[slot])))
        };
        let given = inputs.iter().map(given).collect();
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(pool)));
        let made = model.run(given, outputs, Some(options)).map_err(|error| failed(&error))?;
        for (&slot, value) in numbers.iter().zip(made) {
            values[slot].value = Some(contiguous(value));
        }
        Ok(())
    }
}

/// The same value without gaps, as our own kernel reads it.
fn contiguous(value: Value) -> Value {
    match value {
        Value::FloatTensor(tensor) if !tensor.is_contiguous() => {
            Tensor::from_data(tensor.shape(), tensor.to_vec()).into()
        }
        value => value,
    }
}

fn failed(reason: impl ToString) -> NetworkError {
    NetworkError::Runtime { runtime: "rten".to_owned(), reason: reason.to_string() }
}

type Pools = BTreeMap<(u32, usize), Arc<ThreadPool>>;

/// The pool with this number of threads. `rten` runs on pools of its own only. A forked process has
/// none of the threads of its parent, so its pools are others. Callers that want a single thread
/// each have their own, so that they do not wait for each other.
fn pool(threads: usize) -> Arc<ThreadPool> {
    static SHARED: Mutex<Pools> = Mutex::new(BTreeMap::new());
    thread_local!(static OWN: RefCell<Pools> = const { RefCell::new(BTreeMap::new()) });
    let of = |pools: &mut Pools| {
        let new = || Arc::new(ThreadPool::with_num_threads(threads));
        Arc::clone(pools.entry((process(), threads)).or_insert_with(new))
    };
    if threads == 1 {
        return OWN.with_borrow_mut(of);
    }
    of(&mut SHARED.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The number of this process, where the system has processes.
fn process() -> u32 {
    if cfg!(target_family = "wasm") { 0 } else { std::process::id() }
}

macro_rules! registry {
    ($($early:ident)*; $($late:ident)*) => { rten::op_registry!($($early,)* $($late),*) };
}

/// Loads a file with the operators that trackers use.
fn load(file: Vec<u8>, optimize: bool) -> Result<Model, NetworkError> {
    let operators = with_operators!(registry);
    // To optimise, `rten` waits for threads of its own, which a forked process does not have.
    static FIRST: OnceLock<u32> = OnceLock::new();
    let optimize = optimize && *FIRST.get_or_init(process) == process();
    let mut options = ModelOptions::with_ops(operators);
    options.enable_optimization(optimize).prepack_weights(optimize);
    options.load(file).map_err(|error| failed(&error))
}

/// Runs a graph once, operator by operator, and checks what each costs before it runs. Returns the
/// shape and type of each value.
fn try_out(
    graph: &CheckedGraph,
    inputs: &[&[usize]],
) -> Result<HashMap<String, NodeInfo>, NetworkError> {
    let names: Vec<&str> = graph.inputs.iter().map(|input| input.name.as_str()).collect();
    let typed = |(name, shape): (&&str, &&[usize])| ValueInfo::new(name, FLOAT, shape);
    let typed: Vec<ValueInfo> = names.iter().zip(inputs).map(typed).collect();
    let model = load(graph.file(&graph.nodes, typed, graph.outputs.clone()), false)?;
    let mut values: HashMap<&str, Value> = HashMap::new();
    for (&name, shape) in names.iter().zip(inputs) {
        values.insert(name, Tensor::<f32>::zeros(shape).into());
    }
    let (mut cost, pool) = (Cost::default(), pool(1));
    for node in &graph.nodes {
        let shapes: Vec<Option<Vec<usize>>> =
            node.input.iter().map(|name| shape_of(name, graph, &values)).collect();
        let shapes: Vec<_> = shapes.iter().map(Option::as_deref).collect();
        cost.add(node, &shapes)?;
        let given: BTreeSet<&String> =
            node.input.iter().filter(|name| values.contains_key(name.as_str())).collect();
        let given = given.into_iter().map(|name| {
            Ok((id(&model, name)?, ValueOrView::View(values[name.as_str()].as_view())))
        });
        let given = given.collect::<Result<Vec<_>, NetworkError>>()?;
        let wanted: Vec<&String> = node.output.iter().filter(|name| !name.is_empty()).collect();
        let ids = wanted.iter().map(|name| id(&model, name)).collect::<Result<Vec<_>, _>>()?;
        let options = RunOptions::default().with_thread_pool(Some(Arc::clone(&pool)));
        let made = model.run(given, &ids, Some(options));
        let made = made.map_err(|error| damaged(format!("operator {}: {error}", node.op_type)))?;
        values.extend(wanted.into_iter().map(String::as_str).zip(made));
    }
    let known = |(name, value): (&str, Value)| {
        let element = if matches!(value, Value::FloatTensor(_)) { FLOAT } else { INT64 };
        (name.to_owned(), NodeInfo { shape: value.as_view().shape().to_vec(), element })
    };
    Ok(values.into_iter().map(known).collect())
}

fn shape_of(name: &str, graph: &CheckedGraph, values: &HashMap<&str, Value>) -> Option<Vec<usize>> {
    let constant = || {
        let tensor = graph.constants.get(name)?;
        Some(tensor.dims.iter().map(|&dim| dim as usize).collect())
    };
    values.get(name).map(|value| value.as_view().shape().to_vec()).or_else(constant)
}

fn id(model: &Model, name: &str) -> Result<NodeId, NetworkError> {
    model.find_node(name).ok_or_else(|| damaged(format!("the value `{name}` is lost")))
}

/// How a graph is cut into steps.
struct Plan<'a> {
    graph: &'a CheckedGraph,
    known: &'a HashMap<String, NodeInfo>,
    /// The numbers of the values that go from one step to another.
    slots: BTreeMap<String, usize>,
}

impl Plan<'_> {
    fn slot(&mut self, name: &str) -> usize {
        let next = self.slots.len();
        *self.slots.entry(name.to_owned()).or_insert(next)
    }

    /// The steps, in order: at each depth the operators, then the depthwise convolutions that
    /// depend on them.
    fn steps(&mut self) -> Result<Vec<Step>, NetworkError> {
        let graph = self.graph;
        let (mut depths, mut levels) = (HashMap::<&str, usize>::new(), BTreeMap::new());
        for node in &graph.nodes {
            let depth = |name: &String| depths.get(name.as_str()).copied().unwrap_or(0);
            let depth = node.input.iter().map(depth).max().unwrap_or(0);
            let convolution = self.depthwise(node);
            let after = depth + usize::from(convolution.is_some());
            depths.extend(node.output.iter().map(|name| (name.as_str(), after)));
            let (nodes, convolutions): &mut (Vec<&Node>, Vec<(DepthwiseConvolution, &Node)>) =
                levels.entry(depth).or_default();
            match convolution {
                Some(convolution) => convolutions.push((convolution, node)),
                None => nodes.push(node),
            }
        }
        let mut steps = Vec::new();
        for (nodes, convolutions) in levels.into_values() {
            steps.extend(self.operators(&nodes)?.map(Step::Operators));
            for (convolution, node) in convolutions {
                let weights = match graph.constants.get(&node.input[1]) {
                    Some(weights) => Weights::Constant(weights.floats()),
                    None => Weights::Value(self.slot(&node.input[1])),
                };
                let (input, output) = (self.slot(&node.input[0]), self.slot(&node.output[0]));
                let convolution = Box::new(convolution);
                steps.push(Step::Depthwise { convolution, weights, input, output });
            }
        }
        Ok(steps)
    }

    /// The node as a depthwise convolution, if it is one.
    fn depthwise(&self, node: &Node) -> Option<DepthwiseConvolution> {
        let [image, weights, bias @ ..] = &node.input[..] else { return None };
        let constant = |name: &String| self.graph.constants.get(name);
        let bias = match bias {
            [name] if !name.is_empty() => Some(constant(name)?),
            _ => None,
        };
        let image = &self.known.get(image)?.shape;
        let shape = match (constant(weights), self.known.get(weights)) {
            (Some(tensor), _) if tensor.data_type == FLOAT => {
                tensor.dims.iter().map(|&length| length as usize).collect()
            }
            (None, Some(NodeInfo { shape, element: FLOAT })) => shape.clone(),
            _ => return None,
        };
        DepthwiseConvolution::of(node, image, &shape, bias)
    }

    /// Operators that `rten` computes, with the values that they take from and give to others.
    /// None if nothing else uses a value of theirs.
    fn operators(&mut self, nodes: &[&Node]) -> Result<Option<Operators>, NetworkError> {
        let within: BTreeSet<&str> = names(nodes.iter().flat_map(|node| &node.output));
        let used: BTreeSet<&str> = names(nodes.iter().flat_map(|node| &node.input));
        let is_value = |name: &&str| self.known.contains_key(*name);
        let taken: Vec<&str> = used.difference(&within).copied().filter(is_value).collect();
        let outside = |node: &&Node| !nodes.iter().any(|own| std::ptr::eq(*own, *node));
        let later = self.graph.nodes.iter().filter(outside).flat_map(|node| &node.input);
        let wanted = names(later.chain(self.graph.outputs.iter().map(|output| &output.name)));
        let given: Vec<&str> = within.intersection(&wanted).copied().collect();
        if given.is_empty() {
            return Ok(None);
        }
        let info = |&name: &&str| {
            let NodeInfo { shape, element } = &self.known[name];
            ValueInfo::new(name, *element, shape)
        };
        let (inputs, outputs) =
            (taken.iter().map(info).collect(), given.iter().map(info).collect());
        let nodes: Vec<Node> = nodes.iter().map(|&node| node.clone()).collect();
        let model = Box::new(load(self.graph.file(&nodes, inputs, outputs), true)?);
        let mut slots = |names: &[&str]| {
            let slot = |&name: &&str| Ok((id(&model, name)?, self.slot(name)));
            names.iter().map(slot).collect::<Result<Vec<_>, NetworkError>>()
        };
        let inputs = slots(&taken)?;
        let (outputs, numbers) = slots(&given)?.into_iter().unzip();
        Ok(Some(Operators { model, inputs, outputs, numbers }))
    }
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> BTreeSet<&'a str> {
    names.map(String::as_str).filter(|name| !name.is_empty()).collect()
}
