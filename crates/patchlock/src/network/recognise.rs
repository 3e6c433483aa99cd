//! Recognises the family of a file by its inputs and outputs.

use super::family::Family;
use super::graph::CheckedGraph;
use super::runtime::Runtime;
use super::{nanotrack, vittrack};
use crate::network_error::NetworkError;

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
