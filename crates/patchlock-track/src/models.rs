//! Finds the files of a network and loads them.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use patchlock::{Method, ModelFile, Network, NetworkError, NetworkUse, Runtime};
use serde::{Deserialize, Serialize};

use crate::error::READ_ADVICE;

/// The name of our own network, in place of the path of a folder. It is the default.
pub const PATCHNET: &str = "patchnet";

/// The word for no network, in place of a path.
pub const NO_NETWORK: &str = "none";

/// The largest file that is read; the library's own limit is the same.
const MAX_BYTES: u64 = 64 << 20;

/// Why a network cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    Unreadable {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        reason: io::Error,
    },
    /// A folder holds no ONNX file.
    #[error("{} holds no file *.onnx", folder.display())]
    NoFiles {
        /// The folder.
        folder: PathBuf,
    },
    /// The files are no network that can be used.
    #[error("{}: {error}", path.display())]
    Unusable {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong.
        error: NetworkError,
    },
    /// The library of a runtime cannot be used.
    #[error("{0}")]
    Runtime(NetworkError),
    /// The method needs a network and has none.
    #[error("the method {method} needs a network")]
    Missing {
        /// The method.
        method: &'static str,
    },
    /// The method has no use for a network.
    #[error("the network {} has no effect with the method {method}", path.display())]
    Unused {
        /// The network.
        path: PathBuf,
        /// The method.
        method: &'static str,
    },
    /// There is no network to be run.
    #[error("the runtime {} has no effect without a network", path.display())]
    UnusedRuntime {
        /// The library.
        path: PathBuf,
    },
}

impl ModelError {
    /// Whether the files or options are wrong, as opposed to a file being unreadable.
    pub fn is_misuse(&self) -> bool {
        !matches!(self, Self::Unreadable { .. })
    }

    /// What the user can do, whichever front end is used; `None` if that depends on the front end,
    /// or nothing helps.
    pub fn advice(&self) -> Option<String> {
        let advice = match self {
            Self::NoFiles { .. } => "give the folder with the model's *.onnx files",
            Self::Unusable { error: NetworkError::Incomplete { .. }, .. } => {
                "give the folder with both files"
            }
            Self::Unreadable { .. } => READ_ADVICE,
            Self::Unusable { .. }
            | Self::Runtime(_)
            | Self::Missing { .. }
            | Self::Unused { .. }
            | Self::UnusedRuntime { .. } => return None,
        };
        Some(advice.to_string())
    }
}

/// The ONNX files of a model: a file itself, or all of a folder, by name.
fn files(path: &Path) -> Result<Vec<PathBuf>, ModelError> {
    let unreadable = |reason| ModelError::Unreadable { path: path.to_path_buf(), reason };
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files = Vec::new();
    for entry in path.read_dir().map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        if crate::files::ends_with(&file, "onnx") {
            files.push(file);
        }
    }
    files.sort_unstable();
    if files.is_empty() {
        return Err(ModelError::NoFiles { folder: path.to_path_buf() });
    }
    Ok(files)
}

/// The bytes of a file of a model.
fn read(path: &Path) -> Result<Vec<u8>, ModelError> {
    let unreadable = |reason| ModelError::Unreadable { path: path.to_path_buf(), reason };
    let size = std::fs::metadata(path).map_err(unreadable)?.len();
    if size > MAX_BYTES {
        let error =
            NetworkError::TooLarge { what: "the number of bytes", value: size, max: MAX_BYTES };
        return Err(ModelError::Unusable { path: path.to_path_buf(), error });
    }
    crate::files::read(path).map_err(unreadable)
}

/// A file of a model: its path and its bytes.
pub type NamedFile = (PathBuf, Cow<'static, [u8]>);

/// The ONNX files of a model, or of [`PATCHNET`].
///
/// # Errors
/// [`ModelError::Unreadable`]; [`ModelError::NoFiles`]; [`ModelError::Unusable`] if a file is too
/// large.
pub fn contents(path: &Path) -> Result<Vec<NamedFile>, ModelError> {
    if path == Path::new(PATCHNET) {
        let names = ["patchnet_backbone.onnx", "patchnet_head.onnx"].map(PathBuf::from);
        return Ok(names.into_iter().zip(Network::PATCHNET_FILES.map(Cow::Borrowed)).collect());
    }
    let read = |file: PathBuf| read(&file).map(|bytes| (file, Cow::Owned(bytes)));
    files(path)?.into_iter().map(read).collect()
}

/// What a file is.
///
/// # Errors
/// [`ModelError::Unreadable`] or [`ModelError::Unusable`].
pub fn examine(path: &Path) -> Result<ModelFile, ModelError> {
    let unusable = |error| ModelError::Unusable { path: path.to_path_buf(), error };
    ModelFile::examine(&read(path)?).map_err(unusable)
}

/// The network in a folder or file, or [`PATCHNET`], run by the built-in runtime or by this library
/// of onnxruntime.
///
/// # Errors
/// [`ModelError`] if a file cannot be read or used.
pub fn load(path: &Path, runtime: Option<&Path>) -> Result<Network, ModelError> {
    let contents = contents(path)?;
    let bytes: Vec<&[u8]> = contents.iter().map(|(_, bytes)| &**bytes).collect();
    Network::with_runtime(&bytes, &self::runtime(runtime)?).map_err(|error| {
        // The file, if one is unusable by itself; otherwise the files do not fit together.
        let mut alone = contents.iter().map(|(file, bytes)| (file, bytes));
        let faulty = alone.find_map(|(file, bytes)| Some((file, ModelFile::examine(bytes).err()?)));
        let (path, error) = faulty.map_or((path, error), |(file, error)| (file, error));
        ModelError::Unusable { path: path.to_path_buf(), error }
    })
}

/// The built-in runtime, or the one of this library of onnxruntime.
///
/// # Errors
/// [`ModelError::Runtime`] if the library cannot be used.
pub fn runtime(library: Option<&Path>) -> Result<Runtime, ModelError> {
    library
        .map_or_else(|| Ok(Runtime::built_in()), Runtime::onnxruntime)
        .map_err(ModelError::Runtime)
}

/// The same path, independent of the working directory. A word for a network stays as it is.
///
/// # Errors
/// The working directory is unknown.
pub fn absolute(path: &Path) -> io::Result<PathBuf> {
    if is_word(path) { Ok(path.to_path_buf()) } else { std::path::absolute(path) }
}

/// Whether a text is a word for a network, not a path.
pub fn is_word(path: &Path) -> bool {
    [PATCHNET, NO_NETWORK].iter().any(|word| path == Path::new(word))
}

/// Where the files of a network are.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ModelPaths {
    /// A folder with the ONNX files of one network, or the only file, or [`PATCHNET`], or
    /// [`NO_NETWORK`]. Without one, it is [`PATCHNET`] for the methods that use a network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// The library of onnxruntime that runs it; without one, the built-in runtime does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runtime: Option<PathBuf>,
}

impl ModelPaths {
    /// The network for a method, which may need one, use one if it has it, or have none.
    ///
    /// # Errors
    /// As [`load`]; [`ModelError::Missing`], [`ModelError::Unused`] and
    /// [`ModelError::UnusedRuntime`].
    pub fn network(&self, method: &Method) -> Result<Option<Network>, ModelError> {
        let name = method.name();
        let network = method.info().network;
        match (network, self.given_or_default(network), &self.runtime) {
            (NetworkUse::Unused, Some(model), _) => {
                Err(ModelError::Unused { path: model.to_path_buf(), method: name })
            }
            (_, Some(model), runtime) => load(model, runtime.as_deref()).map(Some),
            (NetworkUse::Required, None, _) => Err(ModelError::Missing { method: name }),
            (_, None, Some(library)) => Err(ModelError::UnusedRuntime { path: library.clone() }),
            (_, None, None) => Ok(None),
        }
    }

    /// The network for a method with this use of one; `None` for none.
    fn given_or_default(&self, network: NetworkUse) -> Option<&Path> {
        match (&self.model, network) {
            (Some(model), _) => Some(model.as_path()).filter(|path| *path != Path::new(NO_NETWORK)),
            (None, NetworkUse::Unused) => None,
            (None, _) => Some(Path::new(PATCHNET)),
        }
    }

    /// The same paths, independent of the working directory.
    ///
    /// # Errors
    /// [`ModelError::Unreadable`] if the working directory is unknown.
    pub fn absolute(&self) -> Result<Self, ModelError> {
        let full = |path: &PathBuf| {
            absolute(path).map_err(|reason| ModelError::Unreadable { path: path.clone(), reason })
        };
        let Self { model, runtime } = self;
        Ok(Self {
            model: model.as_ref().map(full).transpose()?,
            runtime: runtime.as_ref().map(full).transpose()?,
        })
    }
}

/// The network that a run used, as summaries and manifests name it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UsedNetwork {
    /// Its name.
    pub model: String,
    /// Its hash, [`Network::hash`].
    pub model_sha256: String,
    /// What ran it.
    pub runtime: String,
}

impl From<&Network> for UsedNetwork {
    fn from(network: &Network) -> Self {
        Self {
            model: network.name().to_owned(),
            model_sha256: network.hash().to_owned(),
            runtime: network.runtime().to_string(),
        }
    }
}

impl fmt::Display for UsedNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, runtime {}", self.model, self.runtime)
    }
}

#[cfg(test)]
mod tests {
    use patchlock::{Preset, TrackerConfig};

    use super::*;

    #[test]
    fn our_own_network_is_the_default_of_the_methods_that_use_one() {
        let none = ModelPaths { model: Some(NO_NETWORK.into()), runtime: None };
        for preset in Preset::ALL {
            let method = TrackerConfig::from(preset).method;
            let is_used = preset.info().network != NetworkUse::Unused;
            let by_default = is_used.then(Network::patchnet);
            assert_eq!(ModelPaths::default().network(&method).unwrap(), by_default, "{preset}");
            match (none.network(&method), preset.info().network) {
                (Err(ModelError::Missing { method }), NetworkUse::Required) => {
                    assert_eq!(method, preset.name());
                }
                (network, _) => assert_eq!(network.unwrap(), None, "{preset}"),
            }
        }
    }

    #[test]
    fn our_own_network_is_known_by_its_name_alone() {
        for word in [PATCHNET, NO_NETWORK] {
            let named = ModelPaths { model: Some(word.into()), runtime: None };
            assert_eq!(named.absolute().unwrap(), named);
        }
        let network = load(Path::new(PATCHNET), None).unwrap();
        assert_eq!((network.name(), network), ("PatchNet", Network::patchnet()));
        let files = contents(Path::new(PATCHNET)).unwrap();
        let known = files.iter().map(|(_, bytes)| ModelFile::examine(bytes).unwrap().known);
        let known: Vec<_> = known.map(|known| known.map(|known| Path::new(known.file))).collect();
        assert_eq!(known, files.iter().map(|(file, _)| Some(file.as_path())).collect::<Vec<_>>());
        assert!(load(Path::new("./patchnet"), None).is_err());
    }
}
