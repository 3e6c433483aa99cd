//! What a family of networks must be able to do. Each family is a file.

use super::graph::CheckedGraph;
use super::look::{Buffers, Look, Place, Settled};
use super::runtime::Runtime;
use super::{nanotrack, vittrack};
use crate::network_error::NetworkError;
use crate::vision::frame::Frame;
use std::fmt::Debug;

/// A network of a family, ready to run.
pub trait Family: Debug + Send + Sync {
    /// The name, such as "NanoTrack v3".
    fn name(&self) -> &'static str;

    /// What it keeps of the target: numbers that only the same network understands.
    ///
    /// # Errors
    /// The runtime's own.
    fn template(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        place: Place,
        buffers: &mut Buffers,
    ) -> Result<Vec<f32>, NetworkError>;

    /// The length of a template.
    fn template_length(&self) -> usize;

    /// Looks for the target in the window around a place; the result is in `buffers.look`.
    ///
    /// # Errors
    /// The runtime's own.
    fn look(
        &self,
        frame: &Frame<'_>,
        border: [f32; 3],
        template: &[f32],
        place: Place,
        buffers: &mut Buffers,
    ) -> Result<(), NetworkError>;

    /// The logarithm of the odds that the box overlaps the target by at least half, from the logit
    /// of its cell.
    fn odds(&self, logit: f64) -> f64;

    /// The new place, by the rules that were published with the network.
    fn settle(&self, look: &Look, last: Place) -> Settled;
}

/// What a file is, by its inputs and outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// The family.
    pub family: &'static str,
    /// The part of the family's network that the file holds.
    pub name: &'static str,
}

/// Makes a network of its parts, in order.
type Build = fn(&[CheckedGraph], &Runtime) -> Result<Box<dyn Family>, NetworkError>;

/// A family, by what its files look like.
pub struct Recogniser {
    /// The parts, in order.
    pub parts: &'static [Part],
    /// The inputs and outputs of the files, in words.
    pub files: &'static str,
    /// The number of the part that a file holds.
    pub part: fn(&CheckedGraph) -> Option<usize>,
    /// Makes the network of its parts, in order.
    pub build: Build,
}

/// All families.
pub const FAMILIES: &[Recogniser] = &[nanotrack::RECOGNISER, vittrack::RECOGNISER];

/// The part that a file holds.
///
/// # Errors
/// [`NetworkError::Family`] if its inputs and outputs are those of no known family.
pub fn recognise(graph: &CheckedGraph) -> Result<(&'static Recogniser, usize), NetworkError> {
    let found = FAMILIES.iter().find_map(|family| Some((family, (family.part)(graph)?)));
    found.ok_or_else(|| NetworkError::Family {
        given: format!("it has {}", described(graph)),
        known: FAMILIES.iter().map(|family| family.files).collect::<Vec<_>>().join("; "),
    })
}

/// The inputs and outputs of a graph.
pub fn described(graph: &CheckedGraph) -> String {
    let values = |values: &[super::onnx::ValueInfo]| {
        let value = |value: &super::onnx::ValueInfo| {
            let length =
                |length: &Option<i64>| length.map_or("?".into(), |length| length.to_string());
            let shape: Vec<String> = value.shape().iter().map(length).collect();
            format!("`{}` [{}]", value.name, shape.join(", "))
        };
        values.iter().map(value).collect::<Vec<_>>().join(", ")
    };
    format!("the inputs {} and the outputs {}", values(&graph.inputs), values(&graph.outputs))
}
