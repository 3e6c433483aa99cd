//! Makes a [`Network`] of the bytes of its ONNX files.

use super::graph::CheckedGraph;
use super::known::KnownModel;
use super::recognise::{FAMILIES, described, recognise};
use super::runtime::Runtime;
use super::{Network, NetworkParts};
use crate::network_error::NetworkError;
use sha2::{Digest, Sha256};
use std::sync::Arc;
#[cfg(feature = "patchnet")]
use std::sync::LazyLock;

/// What an ONNX file is.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ModelFile {
    /// The family of networks that it belongs to, such as "NanoTrack".
    pub family: &'static str,
    /// The part of the network that it holds, such as "head".
    pub part: &'static str,
    /// Its inputs and outputs with their shapes.
    pub values: String,
    /// The number of operators.
    pub operators: usize,
    /// The number of weights.
    pub parameters: u64,
    /// Its SHA-256, in hexadecimal.
    pub sha256: String,
    /// The published file with this hash, if it is a known one.
    pub known: Option<&'static KnownModel>,
}

impl ModelFile {
    /// Reads a file, without running anything of it.
    ///
    /// # Errors
    /// [`NetworkError`] if the file is damaged, above a limit or of no known family.
    pub fn examine(bytes: &[u8]) -> Result<Self, NetworkError> {
        let graph = CheckedGraph::read(bytes)?;
        let (family, part) = recognise(&graph)?;
        let sha256 = hexadecimal(Sha256::new_with_prefix(bytes));
        Ok(Self {
            family: family.parts[part].family,
            part: family.parts[part].name,
            values: described(&graph),
            operators: graph.nodes.len(),
            parameters: graph.parameters(),
            known: KnownModel::with_hash(&sha256),
            sha256,
        })
    }
}

impl Network {
    /// PatchNet, our own network: it is in the library, and needs no file.
    #[cfg(feature = "patchnet")]
    pub fn patchnet() -> Self {
        static NETWORK: LazyLock<Network> = LazyLock::new(|| {
            Network::from_bytes(&Network::PATCHNET_FILES).expect("a test loads these files")
        });
        NETWORK.clone()
    }

    /// The ONNX files of [`Network::patchnet`]: the backbone and the head.
    #[cfg(feature = "patchnet")]
    pub const PATCHNET_FILES: [&[u8]; 2] = [
        include_bytes!("../../models/patchnet_backbone.onnx"),
        include_bytes!("../../models/patchnet_head.onnx"),
    ];

    /// The network in these ONNX files, in any order, run by the built-in runtime.
    ///
    /// # Errors
    /// [`NetworkError`] if a file is damaged, above a limit or of no known family, if a part is
    /// missing, or if the parts do not fit together.
    pub fn from_bytes(files: &[&[u8]]) -> Result<Self, NetworkError> {
        Self::with_runtime(files, &Runtime::built_in())
    }

    /// As [`Network::from_bytes`], run by this runtime.
    ///
    /// # Errors
    /// As [`Network::from_bytes`].
    pub fn with_runtime(files: &[&[u8]], runtime: &Runtime) -> Result<Self, NetworkError> {
        let mut parts = Vec::new();
        for bytes in files {
            let graph = CheckedGraph::read(bytes)?;
            let (family, part) = recognise(&graph)?;
            parts.push((part, family, graph, *bytes));
        }
        parts.sort_by_key(|(part, ..)| *part);
        let Some(&(first, family, ..)) = parts.first() else {
            return Err(unusable("there is no file".into()));
        };
        let given: Vec<_> = parts.iter().map(|(part, family, ..)| family.parts[*part]).collect();
        if given != family.parts {
            let missing = family.parts.iter().find(|part| !given.contains(part));
            return Err(match missing {
                Some(missing) if given.len() == 1 => NetworkError::Incomplete {
                    family: missing.family,
                    given: family.parts[first].name,
                    missing: missing.name,
                },
                _ => {
                    let each: Vec<_> = given
                        .iter()
                        .map(|part| format!("a {} {}", part.family, part.name))
                        .collect();
                    unusable(format!("the files are {}", each.join(", ")))
                }
            });
        }
        let mut hasher = Sha256::new();
        parts.iter().for_each(|(.., bytes)| hasher.update(bytes));
        let hash = hexadecimal(hasher);
        let graphs: Vec<CheckedGraph> = parts.into_iter().map(|(_, _, graph, _)| graph).collect();
        let network = (family.build)(&graphs, runtime)?;
        Ok(Self(Arc::new(NetworkParts { family: network, hash, runtime: runtime.clone() })))
    }

    /// What runs it.
    pub fn runtime(&self) -> &Runtime {
        &self.0.runtime
    }
}

fn unusable(given: String) -> NetworkError {
    let known = FAMILIES.iter().map(|family| family.files).collect::<Vec<_>>().join("; ");
    NetworkError::Family { given, known }
}

fn hexadecimal(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::onnx::{self, Model, Shape, ValueInfo};
    use prost::Message;

    const BACKBONE: &[u8] = include_bytes!("../../tests/golden/network/nanotrack_backbone.onnx");
    const HEAD: &[u8] = include_bytes!("../../tests/golden/network/nanotrack_head.onnx");
    const VITTRACK: &[u8] = include_bytes!("../../tests/golden/network/vittrack.onnx");

    fn refused(files: &[&[u8]], words: &str) {
        let message = Network::from_bytes(files).unwrap_err().to_string();
        assert!(message.contains(words), "{message}, not {words}");
    }

    /// A file after a change of its graph.
    fn changed(file: &[u8], change: impl FnOnce(&mut onnx::Graph)) -> Vec<u8> {
        let mut model = Model::decode(file).unwrap();
        change(model.graph.as_mut().unwrap());
        model.encode_to_vec()
    }

    fn shape_of(value: &mut ValueInfo) -> &mut Shape {
        value.r#type.as_mut().unwrap().tensor_type.as_mut().unwrap().shape.as_mut().unwrap()
    }

    #[test]
    fn a_file_says_what_it_is() {
        for (file, family, part) in [
            (BACKBONE, "NanoTrack", "backbone"),
            (HEAD, "NanoTrack", "head"),
            (VITTRACK, "VitTrack", "network"),
        ] {
            let known = ModelFile::examine(file).unwrap();
            assert_eq!((known.family, known.part, known.known), (family, part, None));
            assert_eq!(known.sha256.len(), 64);
            assert!(known.operators > 9 && known.parameters > 999, "{known:?}");
        }
    }

    #[test]
    fn the_files_must_be_those_of_one_network() {
        refused(&[], "there is no file; known are NanoTrack");
        refused(&[HEAD], "only the head of NanoTrack; the backbone is missing");
        refused(&[BACKBONE], "only the backbone of NanoTrack; the head is missing");
        refused(&[BACKBONE, BACKBONE], "a NanoTrack backbone, a NanoTrack backbone");
        refused(
            &[BACKBONE, HEAD, HEAD],
            "a NanoTrack backbone, a NanoTrack head, a NanoTrack head",
        );
        refused(&[VITTRACK, VITTRACK], "a VitTrack network, a VitTrack network");
        refused(&[BACKBONE, VITTRACK], "a NanoTrack backbone, a VitTrack network");
        refused(&[BACKBONE, b"a text"], "not an ONNX file");
    }

    #[test]
    fn inputs_and_outputs_of_no_family_are_named() {
        let one =
            changed(BACKBONE, |graph| shape_of(&mut graph.input[0]).dim[1].dim_value = Some(4));
        refused(&[&one, HEAD], "`input` [1, 4, ");
        let wide = changed(VITTRACK, |graph| shape_of(&mut graph.input[1]).dim[3].dim_value = None);
        refused(&[&wide], "`search` [1, 3, 256, ?]");
        let none = changed(VITTRACK, |graph| graph.input[0].r#type = None);
        refused(&[&none], "`template` []");
    }

    #[test]
    fn shapes_that_do_not_fit_each_other_are_refused() {
        let narrow = changed(BACKBONE, |graph| {
            let wide = |tensor: &&mut onnx::Tensor| tensor.dims.len() == 4 && tensor.dims[1] > 3;
            let weights = graph.initializer.iter_mut().find(wide).unwrap();
            weights.dims[1] = 1;
            let length: i64 = weights.dims.iter().product();
            weights.raw_data.as_mut().unwrap().truncate(4 * length as usize);
        });
        refused(&[&narrow, HEAD], "Conv with");
        let stepped = changed(BACKBONE, |graph| {
            let convolution = graph.node.iter_mut().find(|node| node.op_type == "Conv").unwrap();
            let of = |attribute: &&mut onnx::Attribute| attribute.name == "strides";
            convolution.attribute.iter_mut().find(of).unwrap().ints = vec![1, 1];
        });
        refused(&[&stepped, HEAD], "the outputs of its backbone have the shapes");
        let twice = changed(HEAD, |graph| graph.output[1].name = graph.output[0].name.clone());
        refused(&[BACKBONE, &twice], "the outputs of its head have the shapes");
    }

    #[test]
    fn a_file_cannot_take_much_memory_or_time() {
        // A tall tower of values that are each twice as large as the one before.
        let grown = changed(HEAD, |graph| {
            let mut last = graph.output[0].name.clone();
            for k in 0..40 {
                let mut double = onnx::Node { op_type: "Concat".into(), ..Default::default() };
                let axis =
                    onnx::Attribute { name: "axis".into(), i: Some(2), ..Default::default() };
                double.attribute.push(onnx::Attribute { r#type: 2, ..axis });
                double.input = vec![last.clone(), last];
                last = format!("double_{k}");
                double.output = vec![last.clone()];
                graph.node.push(double);
            }
        });
        refused(&[BACKBONE, &grown], "the number of elements of a value is");
    }
}
