//! A graph that runs on inputs of fixed shapes, with the runtime that the user chose.

use super::built_in::{Pipeline, PipelineScratch};
use super::graph::CheckedGraph;
#[cfg(feature = "onnxruntime")]
use super::onnxruntime::Session;
use super::runtime::{Runtime, RuntimeKind};
use crate::network_error::NetworkError;

/// A graph, ready to run.
#[derive(Debug)]
pub struct Program {
    engine: Engine,
    output_shapes: Vec<Vec<usize>>,
}

#[derive(Debug)]
enum Engine {
    BuiltIn(Pipeline),
    #[cfg(feature = "onnxruntime")]
    OnnxRuntime(Session),
}

/// Buffers of a run.
pub type ProgramScratch = PipelineScratch;

impl Program {
    /// Prepares a graph for inputs of these shapes. The built-in runtime tries it out first, with
    /// its limits, whichever runtime is chosen.
    ///
    /// # Errors
    /// The graph does not fit the inputs, exceeds a limit, or is refused by the runtime.
    pub fn new(
        graph: &CheckedGraph,
        inputs: &[&[usize]],
        runtime: &Runtime,
    ) -> Result<Self, NetworkError> {
        let pipeline = Pipeline::new(graph, inputs)?;
        let output_shapes = pipeline.output_shapes();
        let engine = match runtime.kind() {
            RuntimeKind::BuiltIn => Engine::BuiltIn(pipeline),
            #[cfg(feature = "onnxruntime")]
            RuntimeKind::OnnxRuntime => {
                Engine::OnnxRuntime(Session::new(graph, inputs, &output_shapes)?)
            }
        };
        Ok(Self { engine, output_shapes })
    }

    /// The shapes of the outputs.
    pub fn output_shapes(&self) -> &[Vec<usize>] {
        &self.output_shapes
    }

    /// Computes the outputs. There are as many inputs and outputs as the graph has, and the inputs
    /// have their lengths.
    ///
    /// # Errors
    /// The runtime's own.
    pub fn run(
        &self,
        inputs: &[&[f32]],
        scratch: &mut ProgramScratch,
        outputs: &mut [Vec<f32>],
    ) -> Result<(), NetworkError> {
        match &self.engine {
            Engine::BuiltIn(pipeline) => pipeline.run(inputs, scratch, outputs),
            #[cfg(feature = "onnxruntime")]
            Engine::OnnxRuntime(session) => session.run(inputs, outputs),
        }
    }
}
