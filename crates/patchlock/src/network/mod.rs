//! Networks: small trackers in ONNX files.
//!
//! A file is checked before anything of it runs (`graph`, `cost`), run by the built-in runtime or
//! by onnxruntime (`program`), and understood by its family (`nanotrack`, `vittrack`). All of that
//! needs the feature `network`; without it there is the type, and no way to make one.

#[cfg(feature = "network")]
mod built_in;
#[cfg(feature = "network")]
mod cost;
#[cfg(feature = "network")]
mod depthwise;
mod family;
#[cfg(test)]
#[path = "../../tests/golden/network/programs.rs"]
mod golden;
#[cfg(feature = "network")]
mod graph;
#[cfg(feature = "network")]
mod known;
#[cfg(feature = "network")]
mod load;
#[cfg(feature = "network")]
mod nanotrack;
#[cfg(feature = "network")]
mod onnx;
#[cfg(feature = "onnxruntime")]
mod onnxruntime;
pub(crate) mod predictions;
#[cfg(feature = "network")]
mod program;
#[cfg(feature = "network")]
mod recognise;
#[cfg(feature = "network")]
mod runtime;
#[cfg(feature = "network")]
mod selection;
#[cfg(feature = "network")]
mod vittrack;

use family::Family;
pub(crate) use family::{FeatureMap, TemplateUpdate};
#[cfg(feature = "network")]
pub use known::{KNOWN_MODELS, KnownModel};
#[cfg(feature = "network")]
pub use load::ModelFile;
#[cfg(feature = "network")]
pub use runtime::Runtime;
use std::fmt;
use std::sync::Arc;

/// A network that follows a target: a value made from the bytes of its ONNX files, loaded once for
/// any number of targets and trackers. A clone is the same network.
///
/// It is recognised by its inputs and outputs. Known are PatchNet, our own, and NanoTrack (versions 2
/// and 3), each a backbone and a head, and VitTrack (one file). The feature `network` has the
/// functions that make one.
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
pub struct Network(Arc<NetworkParts>);

struct NetworkParts {
    family: Box<dyn Family>,
    hash: String,
    #[cfg(feature = "network")]
    runtime: Runtime,
}

impl Network {
    /// The name of the network, such as "NanoTrack v3".
    pub fn name(&self) -> &'static str {
        self.0.family.name()
    }

    /// The SHA-256 of its files, one after the other in the order of the family (the backbone
    /// before the head), in hexadecimal. A snapshot names its network by it.
    pub fn hash(&self) -> &str {
        &self.0.hash
    }

    /// What its family can do.
    pub(crate) fn family(&self) -> &dyn Family {
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
