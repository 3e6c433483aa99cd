//! Networks of the user: small trackers in ONNX files, which the method `network` follows with.
//!
//! A file is checked before anything of it runs (`graph`, `cost`), run by the built-in runtime or
//! by onnxruntime (`program`), and understood by its family (`nanotrack`, `vittrack`).

mod built_in;
mod cost;
mod depthwise;
mod error;
mod family;
mod graph;
mod known;
mod look;
mod nanotrack;
mod onnx;
#[cfg(feature = "onnxruntime")]
mod onnxruntime;
mod program;
mod runtime;
pub(crate) mod target;
pub(crate) mod view;
mod vittrack;

pub use error::NetworkError;
use family::{Family, recognise};
use graph::CheckedGraph;
pub use known::{KNOWN_MODELS, KnownModel};
pub use runtime::Runtime;
use sha2::{Digest, Sha256};
use std::fmt;
use std::sync::Arc;

/// A network that follows a target: a value made from the bytes of its ONNX files, loaded once for
/// any number of targets and trackers. A clone is the same network.
///
/// It is recognised by its inputs and outputs. Known are NanoTrack (versions 2 and 3, a backbone
/// and a head) and VitTrack (one file).
///
/// ```no_run
/// use patchlock::{Network, Preset, TrackerConfig};
///
/// let files = ["nanotrack_backbone.onnx", "nanotrack_head.onnx"].map(std::fs::read);
/// let [backbone, head] = files;
/// let network = Network::from_bytes(&[&backbone?, &head?])?;
/// let mut config = TrackerConfig::from(Preset::Network);
/// config.network = Some(network);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Network(Arc<Loaded>);

struct Loaded {
    family: Box<dyn Family>,
    hash: String,
    runtime: Runtime,
}

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
            values: family::described(&graph),
            operators: graph.nodes.len(),
            parameters: graph.parameters(),
            known: KnownModel::with_hash(&sha256),
            sha256,
        })
    }
}

impl Network {
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
        Ok(Self(Arc::new(Loaded { family: network, hash, runtime: runtime.clone() })))
    }

    /// The name of the network, such as "NanoTrack v3".
    pub fn name(&self) -> &'static str {
        self.0.family.name()
    }

    /// The SHA-256 of its files, one after the other in the order of the family (the backbone
    /// before the head), in hexadecimal. A snapshot names its network by it.
    pub fn hash(&self) -> &str {
        &self.0.hash
    }

    /// What runs it.
    pub fn runtime(&self) -> &Runtime {
        &self.0.runtime
    }

    fn family(&self) -> &dyn Family {
        &*self.0.family
    }
}

/// Two networks are equal if their files are.
impl PartialEq for Network {
    fn eq(&self, other: &Self) -> bool {
        self.hash() == other.hash()
    }
}

impl fmt::Debug for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Network").field("name", &self.name()).field("hash", &self.hash()).finish()
    }
}

fn unusable(given: String) -> NetworkError {
    let known = family::FAMILIES.iter().map(|family| family.files).collect::<Vec<_>>().join("; ");
    NetworkError::Family { given, known }
}

fn hexadecimal(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
