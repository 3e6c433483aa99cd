//! Runs a graph with an installed library of onnxruntime (<https://onnxruntime.ai>).

use super::graph::CheckedGraph;
use super::onnx::{FLOAT, ValueInfo};
use crate::network_error::NetworkError;
use crate::numeric::parallel::current_num_threads;
use ort::environment::Environment;
use ort::session::{Session as OrtSession, SessionInputValue};
use ort::value::TensorRef;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The library of this process, and its environment, which lives as long.
static LOADED: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);

/// Loads the library, once for the process.
///
/// # Errors
/// [`NetworkError::Runtime`] if there is no such library, or another one is loaded.
pub fn load(library: &Path) -> Result<(), NetworkError> {
    let path = library.canonicalize().map_err(|error| unusable(library, &error))?;
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    match &*loaded {
        Some((other, _)) if *other == path => return Ok(()),
        Some((other, _)) => {
            let reason = format!("this process uses {}; it can use one library", other.display());
            return Err(unusable(library, &reason));
        }
        None => {}
    }
    let builder = ort::init_from(&path).map_err(|error| unusable(library, &error))?;
    let environment = builder.build().map_err(|error| unusable(library, &error))?;
    *loaded = Some((path, environment));
    Ok(())
}

/// A graph, ready to run on inputs of fixed shapes.
#[derive(Debug)]
pub struct Session {
    file: Vec<u8>,
    inputs: Vec<Vec<usize>>,
    /// The lengths of the outputs.
    outputs: Vec<usize>,
    /// Sessions that nobody uses now, with their number of threads. One can run one input at a
    /// time.
    idle: Mutex<Vec<(usize, OrtSession)>>,
}

impl Session {
    /// Prepares a graph whose outputs have these shapes.
    ///
    /// # Errors
    /// [`NetworkError::Runtime`] if the library refuses it.
    pub fn new(
        graph: &CheckedGraph,
        inputs: &[&[usize]],
        outputs: &[Vec<usize>],
    ) -> Result<Self, NetworkError> {
        let typed =
            |(value, shape): (&ValueInfo, &[usize])| ValueInfo::new(&value.name, FLOAT, shape);
        let given = graph.inputs.iter().zip(inputs.iter().copied()).map(typed).collect();
        let made = graph.outputs.iter().zip(outputs.iter().map(Vec::as_slice)).map(typed).collect();
        let session = Self {
            file: graph.file(&graph.nodes, given, made),
            inputs: inputs.iter().map(|shape| shape.to_vec()).collect(),
            outputs: outputs.iter().map(|shape| shape.iter().product()).collect(),
            idle: Mutex::default(),
        };
        let first = session.start(current_num_threads())?;
        session.put_back(first);
        Ok(session)
    }

    /// Computes the outputs.
    ///
    /// # Errors
    /// [`NetworkError::Runtime`].
    pub fn run(&self, inputs: &[&[f32]], outputs: &mut [Vec<f32>]) -> Result<(), NetworkError> {
        let mut session = self.take(current_num_threads())?;
        let result = self.run_in(&mut session.1, inputs, outputs);
        self.put_back(session);
        result.map_err(|reason| failed(&reason))
    }

    fn run_in(
        &self,
        session: &mut OrtSession,
        inputs: &[&[f32]],
        outputs: &mut [Vec<f32>],
    ) -> Result<(), String> {
        let mut given: Vec<SessionInputValue<'_>> = Vec::with_capacity(inputs.len());
        for (samples, shape) in inputs.iter().zip(&self.inputs) {
            let tensor = TensorRef::from_array_view((shape.as_slice(), *samples));
            given.push(tensor.map_err(|error| error.to_string())?.into());
        }
        let made = session.run(given.as_slice()).map_err(|error| error.to_string())?;
        for ((k, output), &length) in outputs.iter_mut().enumerate().zip(&self.outputs) {
            let (_, samples) =
                made[k].try_extract_tensor::<f32>().map_err(|error| error.to_string())?;
            if samples.len() != length {
                return Err(format!("output {k} has {} elements, not {length}", samples.len()));
            }
            output.clear();
            output.extend_from_slice(samples);
        }
        Ok(())
    }

    /// A session with this number of threads.
    fn take(&self, threads: usize) -> Result<(usize, OrtSession), NetworkError> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        match idle.iter().position(|(count, _)| *count == threads) {
            Some(k) => Ok(idle.swap_remove(k)),
            None => {
                drop(idle);
                self.start(threads)
            }
        }
    }

    fn put_back(&self, session: (usize, OrtSession)) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(session);
    }

    fn start(&self, threads: usize) -> Result<(usize, OrtSession), NetworkError> {
        let loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, environment) = loaded.as_ref().ok_or_else(|| failed(&"it is not loaded"))?;
        let build = || -> ort::Result<OrtSession> {
            let builder = OrtSession::builder(environment)?.with_intra_threads(threads)?;
            // Threads that spin while they wait would take the time of other targets.
            builder.with_intra_op_spinning(false)?.commit_from_memory(&self.file)
        };
        build().map(|session| (threads, session)).map_err(|error| failed(&error))
    }
}

fn failed(reason: &dyn ToString) -> NetworkError {
    NetworkError::Runtime { runtime: "onnxruntime".to_owned(), reason: reason.to_string() }
}

fn unusable(library: &Path, reason: &dyn ToString) -> NetworkError {
    let runtime = format!("onnxruntime in {}", library.display());
    NetworkError::Runtime { runtime, reason: reason.to_string() }
}
