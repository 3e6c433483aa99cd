//! The Python classes `Network` and `ModelFile`, and the arguments `model` and `runtime`.

use std::path::{self, Path, PathBuf};

use patchlock::{Method, MethodInfo, NetworkError, NetworkUse, Preset};
use patchlock_track::{ModelPaths, models};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict};

use crate::errors;
use crate::fork::detached;

/// What `__reduce__` returns: a function and the arguments that load the same network again.
type ReduceValue<'py> = (Bound<'py, PyAny>, (Vec<PathBuf>, Option<PathBuf>, String));

/// A small tracking network from ONNX files, which the preset `network` follows with.
///
/// Known are PatchNet (part of the package), NanoTrack (versions 2 and 3, a backbone and a head) and
/// VitTrack (one file). Load it
/// once and pass it to any number of trackers. Two networks are equal if their files are.
///
/// A pickle does not hold the network but the full paths of its files, which must be unchanged
/// where it is loaded again. A network made from bytes can't be pickled.
///
/// Args:
///     model: A folder with the ONNX files of one network, one file, a list of files, the bytes of
///         one file or of a list of files, or `"patchnet"`, the network that is part of the package.
///     runtime: What runs it: `None` for the built-in runtime, `"onnxruntime"` for the library of
///         the installed package onnxruntime (`pip install "patchlock[onnxruntime]"`), or the path
///         of another library of onnxruntime. A process uses one such library.
///
/// Raises:
///     ValueError: A file is damaged, too large or of no known family, or a file is missing.
///     TypeError: `model` or `runtime` is none of these.
///     OSError: A file can't be read.
///     ImportError: `runtime` is `"onnxruntime"`, which is not installed.
#[pyclass(frozen, module = "patchlock")]
pub struct Network {
    network: patchlock::Network,
    /// The full paths that it was loaded from; none if it was made from bytes.
    paths: Vec<PathBuf>,
    /// The argument `runtime`.
    runtime: Option<PathBuf>,
    /// The library of onnxruntime, if that runs it.
    library: Option<PathBuf>,
}

impl Network {
    /// The network of the library.
    pub fn to_rust(&self) -> patchlock::Network {
        self.network.clone()
    }

    /// Its files, for runs in other processes.
    ///
    /// # Errors
    /// It was not loaded from one path.
    pub fn paths_for_jobs(&self) -> PyResult<ModelPaths> {
        let [model] = self.paths.as_slice() else {
            return Err(PyValueError::new_err(
                "a batch loads the network in other processes: model must be one folder or file",
            ));
        };
        Ok(ModelPaths { model: Some(model.clone()), runtime: self.library.clone() })
    }

    /// Reads the files and prepares the network.
    fn load(py: Python<'_>, files: Files, runtime: Option<RuntimeName>) -> PyResult<Self> {
        let library = library(py, runtime.as_ref())?;
        // A pickle finds the package again where it is loaded, or the library at its full path.
        let runtime = match runtime {
            Some(RuntimeName(name)) if is_package(&name) => Some(name),
            _ => library.clone(),
        };
        let (network, paths) = detached(py, || match files {
            Files::Paths(paths) => {
                let paths = paths
                    .iter()
                    .map(|path| models::absolute(path))
                    .collect::<Result<Vec<_>, _>>()?;
                Ok::<_, PyErr>((from_paths(&paths, library.as_deref())?, paths))
            }
            Files::Bytes(files) => Ok((from_bytes(&files, library.as_deref())?, Vec::new())),
        })?;
        Ok(Self { network, paths, runtime, library })
    }
}

#[pymethods]
impl Network {
    #[new]
    #[pyo3(signature = (model, *, runtime = None))]
    fn new(py: Python<'_>, model: Files, runtime: Option<RuntimeName>) -> PyResult<Self> {
        Self::load(py, model, runtime)
    }

    /// Its name, such as "NanoTrack v3".
    #[getter]
    fn name(&self) -> &'static str {
        self.network.name()
    }

    /// The SHA-256 of its files, in hexadecimal; snapshots name their network by it.
    #[getter]
    fn hash(&self) -> &str {
        self.network.hash()
    }

    /// What runs it: "built-in" or "onnxruntime".
    #[getter]
    fn runtime(&self) -> String {
        self.network.runtime().to_string()
    }

    /// The full paths that it was loaded from; empty if it was made from bytes.
    #[getter]
    fn paths(&self) -> Vec<PathBuf> {
        self.paths.clone()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.network == other.network
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.network.hash().into_pyobject(py)?.hash()
    }

    fn __repr__(&self) -> String {
        let hash = &self.network.hash()[..8];
        format!("<Network '{}' {hash}, runtime {}>", self.name(), self.runtime())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<ReduceValue<'py>> {
        if self.paths.is_empty() {
            return Err(PyTypeError::new_err(
                "a network that was made from bytes can't be pickled; make it from its files",
            ));
        }
        let restore = py.import("patchlock._patchlock")?.getattr("_restore_network")?;
        Ok((restore, (self.paths.clone(), self.runtime.clone(), self.network.hash().to_owned())))
    }

    // A copy is the same network.

    fn __copy__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __deepcopy__(this: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        this
    }
}

/// Called by pickle.
#[pyfunction]
#[pyo3(name = "_restore_network")]
pub fn restore_network(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    runtime: Option<PathBuf>,
    hash: &str,
) -> PyResult<Network> {
    let network = Network::load(py, Files::Paths(paths), runtime.map(RuntimeName))?;
    let found = network.network.hash();
    if found != hash {
        let message = format!(
            "the network in {} has changed since it was pickled: its SHA-256 is {found}, not {hash}",
            shown(&network.paths)
        );
        return Err(PyValueError::new_err(message));
    }
    Ok(network)
}

/// What an ONNX file is, read without running it.
///
/// Args:
///     file: The path of the file, or its bytes.
///
/// Raises:
///     ValueError: The file is damaged, too large or of no known family.
///     OSError: The file can't be read.
#[pyclass(frozen, get_all, module = "patchlock")]
pub struct ModelFile {
    /// The family of networks that it belongs to, such as "NanoTrack".
    family: &'static str,
    /// The part of the network that it holds, such as "head".
    part: &'static str,
    /// Its inputs and outputs with their shapes.
    values: String,
    /// Number of operators.
    operators: usize,
    /// Number of weights.
    parameters: u64,
    /// Its SHA-256, in hexadecimal.
    sha256: String,
    /// The published network that it is a file of, such as "NanoTrack v3"; `None` if it is not a known file.
    name: Option<&'static str>,
    /// Who publishes it, and where in the repository it is; `None` if it is not a known file.
    origin: Option<&'static str>,
    /// The licence that its publisher states; `None` if it is not a known file.
    licence: Option<&'static str>,
    /// What it was trained on, and what that means for its use; `None` if it is not a known file.
    training: Option<&'static str>,
}

#[pymethods]
impl ModelFile {
    #[new]
    fn new(py: Python<'_>, file: File) -> PyResult<Self> {
        let read = detached(py, || match file {
            File::Path(path) => models::examine(&path).map_err(errors::of_track),
            File::Bytes(bytes) => patchlock::ModelFile::examine(&bytes).map_err(of_network),
        });
        let patchlock::ModelFile {
            family, part, values, operators, parameters, sha256, known, ..
        } = read?;
        Ok(Self {
            family,
            part,
            values,
            operators,
            parameters,
            sha256,
            name: known.map(|model| model.name),
            origin: known.map(|model| model.origin),
            licence: known.map(|model| model.licence),
            training: known.map(|model| model.training),
        })
    }

    fn __repr__(&self) -> String {
        let Self { family, part, sha256, .. } = self;
        let name = self.name.unwrap_or("not a known file");
        format!("<ModelFile {family} {part}, {name}, sha256 {}>", &sha256[..8])
    }
}

/// Our own network with the built-in runtime, which is loaded once in a process.
static PATCHNET: PyOnceLock<Py<Network>> = PyOnceLock::new();

/// The argument `model` of whatever uses a network: a network, what makes one, or the word for none.
pub enum Model {
    Loaded(Py<Network>),
    Files(Files),
    None,
}

impl Model {
    /// The network in a folder or file, or the one that a word stands for.
    pub fn of_path(path: PathBuf) -> Self {
        match path == Path::new(models::NO_NETWORK) {
            true => Self::None,
            false => Self::Files(Files::Paths(vec![path])),
        }
    }

    /// The network of a method where none is named: our own, if the method uses one.
    pub fn default_of(method: &Method) -> Option<Self> {
        let is_used = method.info().network != NetworkUse::Unused;
        is_used.then(|| Self::of_path(models::PATCHNET.into()))
    }

    /// The network; `runtime` belongs to files.
    pub fn network(
        self,
        py: Python<'_>,
        runtime: Option<RuntimeName>,
    ) -> PyResult<Option<Py<Network>>> {
        match (self, runtime) {
            (Self::Loaded(network), None) => Ok(Some(network)),
            (Self::Loaded(_), Some(_)) => Err(PyValueError::new_err(
                "model is a Network, which has its runtime; give runtime= where the Network is made",
            )),
            (Self::Files(files), None) if files.is_patchnet() => patchnet(py).map(Some),
            (Self::Files(files), runtime) => {
                Py::new(py, Network::load(py, files, runtime)?).map(Some)
            }
            (Self::None, None) => Ok(None),
            (Self::None, Some(_)) => Err(unused_runtime()),
        }
    }
}

/// The network for a saved state, if one is named; a runtime alone runs our own.
pub fn given(
    py: Python<'_>,
    model: Option<Model>,
    runtime: Option<RuntimeName>,
) -> PyResult<Option<Py<Network>>> {
    let ours = || runtime.as_ref().map(|_| Model::of_path(models::PATCHNET.into()));
    model.or_else(ours).map_or(Ok(None), |model| model.network(py, runtime))
}

/// Our own network.
pub fn patchnet(py: Python<'_>) -> PyResult<Py<Network>> {
    let load = || {
        let files = Files::Paths(vec![models::PATCHNET.into()]);
        Py::new(py, Network::load(py, files, None)?)
    };
    PATCHNET.get_or_try_init(py, load).map(|network| network.clone_ref(py))
}

/// The error of a runtime without a network.
pub fn unused_runtime() -> PyErr {
    PyValueError::new_err("runtime is what runs a network, but there is none")
}

impl<'py> FromPyObject<'_, 'py> for Model {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match object.cast::<Network>() {
            Ok(network) => Ok(Self::Loaded(network.to_owned().unbind())),
            Err(_) if object.extract::<&str>().is_ok_and(|word| word == models::NO_NETWORK) => {
                Ok(Self::None)
            }
            Err(_) => object.extract().map(Self::Files),
        }
    }
}

/// The files of a network.
pub enum Files {
    Paths(Vec<PathBuf>),
    Bytes(Vec<Vec<u8>>),
}

impl Files {
    fn is_patchnet(&self) -> bool {
        matches!(self, Self::Paths(paths) if *paths == [Path::new(models::PATCHNET)])
    }
}

impl<'py> FromPyObject<'_, 'py> for Files {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(file) = object.extract::<File>() {
            return Ok(match file {
                File::Path(path) => Self::Paths(vec![path]),
                File::Bytes(bytes) => Self::Bytes(vec![bytes]),
            });
        }
        let listed = object.extract::<Vec<File>>().map_err(|_| {
            PyTypeError::new_err(format!(
                "model is a path, the bytes of a file, or a list of one of them; not {}",
                name_of(object)
            ))
        })?;
        let (mut paths, mut bytes) = (Vec::new(), Vec::new());
        for file in listed {
            match file {
                File::Path(path) => paths.push(path),
                File::Bytes(file) => bytes.push(file),
            }
        }
        match (paths.is_empty(), bytes.is_empty()) {
            (true, true) => Err(PyValueError::new_err("model is an empty list")),
            (false, true) => Ok(Self::Paths(paths)),
            (true, false) => Ok(Self::Bytes(bytes)),
            _ => Err(PyTypeError::new_err("model is a list of paths and bytes; give one kind")),
        }
    }
}

/// A file: its path or its bytes.
pub enum File {
    Path(PathBuf),
    Bytes(Vec<u8>),
}

impl<'py> FromPyObject<'_, 'py> for File {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match object.cast::<PyBytes>() {
            Ok(bytes) => Ok(Self::Bytes(bytes.as_bytes().to_vec())),
            Err(_) => object.extract().map(Self::Path),
        }
    }
}

/// The argument `runtime`: `"onnxruntime"`, or the path of a library.
pub struct RuntimeName(pub PathBuf);

impl<'py> FromPyObject<'_, 'py> for RuntimeName {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        object.extract().map(Self).map_err(|_| {
            PyTypeError::new_err(format!(
                "runtime is None, \"onnxruntime\" or the path of a library; not {}",
                name_of(object)
            ))
        })
    }
}

fn name_of(object: Borrowed<'_, '_, PyAny>) -> String {
    object.get_type().name().map_or("this".to_owned(), |name| name.to_string())
}

/// Whether `runtime` stands for the library of the installed package.
fn is_package(runtime: &Path) -> bool {
    runtime == Path::new("onnxruntime")
}

/// The library of onnxruntime that `runtime` stands for; `None` for the built-in runtime.
pub fn library(py: Python<'_>, runtime: Option<&RuntimeName>) -> PyResult<Option<PathBuf>> {
    match runtime {
        Some(RuntimeName(name)) if is_package(name) => {
            py.import("patchlock._onnxruntime")?.call_method0("library")?.extract().map(Some)
        }
        Some(RuntimeName(path)) => Ok(Some(path::absolute(path)?)),
        None => Ok(None),
    }
}

fn from_paths(paths: &[PathBuf], library: Option<&Path>) -> PyResult<patchlock::Network> {
    if let [path] = paths {
        return models::load(path, library).map_err(errors::of_track);
    }
    let contents = paths.iter().map(|path| models::contents(path));
    let contents = contents.collect::<Result<Vec<_>, _>>().map_err(errors::of_track)?;
    let files: Vec<Vec<u8>> =
        contents.into_iter().flatten().map(|(_, bytes)| bytes.into_owned()).collect();
    from_bytes(&files, library)
}

fn from_bytes(files: &[Vec<u8>], library: Option<&Path>) -> PyResult<patchlock::Network> {
    let runtime = models::runtime(library).map_err(errors::of_track)?;
    let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
    patchlock::Network::with_runtime(&files, &runtime).map_err(of_network)
}

/// The network of settings with this method, which may have none.
///
/// # Errors
/// The method has no use for a network.
pub fn check_use(method: &Method, network: Option<&patchlock::Network>) -> PyResult<()> {
    let uses_one = |info: &MethodInfo| info.network != NetworkUse::Unused;
    let Some(network) = network.filter(|_| !uses_one(method.info())) else { return Ok(()) };
    let presets = Preset::ALL.into_iter().filter(|preset| uses_one(preset.info()));
    let presets: Vec<&str> = presets.map(Preset::name).collect();
    Err(PyValueError::new_err(format!(
        "the network {} has no effect with the method {} (the presets {} use one)",
        network.name(),
        method.name(),
        presets.join(" and ")
    )))
}

fn shown(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

fn of_network(error: NetworkError) -> PyErr {
    errors::of_tracker(error.into())
}
