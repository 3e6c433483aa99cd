//! Finds the files of a network and loads them.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use patchlock::{Method, ModelFile, Network, NetworkError, NetworkUse, Runtime};
use serde::{Deserialize, Serialize};

use crate::{Error, files};

/// The name of our own network, in place of the path of a folder. It is the default.
pub const PATCHNET: &str = "patchnet";

/// The word for no network, in place of a path.
pub const NO_NETWORK: &str = "none";

/// The largest file that is read; the library's own limit is the same.
const MAX_BYTES: u64 = 64 << 20;

/// The ONNX files of a model: a file itself, or all of a folder.
fn files_of(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut all = files::entries(path)?;
    all.retain(|file| files::ends_with(file, "onnx"));
    match all.is_empty() {
        true => Err(Error::NoModel(path.to_path_buf())),
        false => Ok(all),
    }
}

/// The bytes of a file of a model.
fn read(path: &Path) -> Result<Vec<u8>, Error> {
    let unreadable = |error| Error::read(path, error);
    let size = std::fs::metadata(path).map_err(unreadable)?.len();
    if size > MAX_BYTES {
        let error =
            NetworkError::TooLarge { what: "the number of bytes", value: size, max: MAX_BYTES };
        return Err(Error::Model(path.to_path_buf(), error));
    }
    files::read(path).map_err(unreadable)
}

/// A file of a model: its path and its bytes.
pub type NamedFile = (PathBuf, Cow<'static, [u8]>);

/// The ONNX files of a model, or of [`PATCHNET`].
///
/// # Errors
/// [`Error::Read`]; [`Error::NoModel`]; [`Error::Model`] if a file is too large.
pub fn contents(path: &Path) -> Result<Vec<NamedFile>, Error> {
    if path == Path::new(PATCHNET) {
        let names = ["patchnet_backbone.onnx", "patchnet_head.onnx"].map(PathBuf::from);
        return Ok(names.into_iter().zip(Network::PATCHNET_FILES.map(Cow::Borrowed)).collect());
    }
    let read = |file: PathBuf| read(&file).map(|bytes| (file, Cow::Owned(bytes)));
    files_of(path)?.into_iter().map(read).collect()
}

/// What a file is.
///
/// # Errors
/// [`Error::Read`] or [`Error::Model`].
pub fn examine(path: &Path) -> Result<ModelFile, Error> {
    ModelFile::examine(&read(path)?).map_err(|error| Error::Model(path.to_path_buf(), error))
}

/// The network in a folder or file, or [`PATCHNET`], run by the built-in runtime or by this library
/// of onnxruntime.
///
/// # Errors
/// [`Error`] if a file cannot be read or used.
pub fn load(path: &Path, runtime: Option<&Path>) -> Result<Network, Error> {
    let contents = contents(path)?;
    let bytes: Vec<&[u8]> = contents.iter().map(|(_, bytes)| &**bytes).collect();
    Network::with_runtime(&bytes, &self::runtime(runtime)?).map_err(|error| {
        // The file, if one is unusable by itself; otherwise the files do not fit together.
        let mut alone = contents.iter().map(|(file, bytes)| (file, bytes));
        let faulty = alone.find_map(|(file, bytes)| Some((file, ModelFile::examine(bytes).err()?)));
        let (path, error) = faulty.map_or((path, error), |(file, error)| (file, error));
        Error::Model(path.to_path_buf(), error)
    })
}

/// The built-in runtime, or the one of this library of onnxruntime.
///
/// # Errors
/// [`Error::Runtime`] if the library cannot be used.
pub fn runtime(library: Option<&Path>) -> Result<Runtime, Error> {
    library.map_or_else(|| Ok(Runtime::built_in()), Runtime::onnxruntime).map_err(Error::Runtime)
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
    /// As [`load`]; [`Error::MissingModel`], [`Error::UnusedModel`] and
    /// [`Error::UnusedRuntime`].
    pub fn network(&self, method: &Method) -> Result<Option<Network>, Error> {
        let name = method.name();
        let network = method.info().network;
        match (network, self.given_or_default(network), &self.runtime) {
            (NetworkUse::Unused, Some(model), _) => {
                Err(Error::UnusedModel(model.to_path_buf(), name))
            }
            (_, Some(model), runtime) => load(model, runtime.as_deref()).map(Some),
            (NetworkUse::Required, None, _) => Err(Error::MissingModel(name)),
            (_, None, Some(library)) => Err(Error::UnusedRuntime(library.clone())),
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
    /// [`Error::Read`] if the working directory is unknown.
    pub fn absolute(&self) -> Result<Self, Error> {
        let full = |path: &PathBuf| absolute(path).map_err(|error| Error::read(path, error));
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
                (Err(Error::MissingModel(method)), NetworkUse::Required) => {
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
