//! The Python class `Project`: annotations of a video, as `patchlock studio` writes them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use patchlock_media::Limits;
use patchlock_studio::project::{self as rust, Edit, Error, Outline, Store, Target};
use patchlock_studio::{export, import};
use patchlock_track::export::{Format, Options};
use patchlock_track::files;
use pyo3::exceptions::{PyKeyError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::advice;
use crate::estimate::{BoxTuple, Estimate, numbers, to_box};
use crate::export::{Statuses, choice, warn, warn_of};

/// The annotations of a video, in a file as `patchlock studio` writes it.
///
/// Changes are in memory until `save`. The file is not locked before that, so it can be read while
/// `patchlock studio` has it open. Frames count from 0.
///
/// Args:
///     path: The project file, such as `clip.patchlock.json`.
///     video: The video file or folder of images. Needed to begin a project; without it the file must exist,
///         and the video that it names is read only if it is in the folder of the file.
///     max_pixels: Most pixels of a frame, width times height. A video that claims more is refused before
///         memory is taken for it.
///
/// Raises:
///     ValueError: The file is not a project, or belongs to another video.
///     OSError: The file or the video can't be read.
#[pyclass(module = "patchlock")]
pub struct Project {
    store: Store,
}

#[pymethods]
impl Project {
    #[new]
    #[pyo3(signature = (path, video = None, *, max_pixels = 36_000_000))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        video: Option<PathBuf>,
        max_pixels: usize,
    ) -> PyResult<Self> {
        let limits = Limits { pixels: max_pixels, ..Limits::default() };
        let store = py.detach(|| Store::open_shared(&path, video.as_deref(), limits));
        Ok(Self { store: store.map_err(to_python)? })
    }

    /// The project file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.store.path().to_path_buf()
    }

    /// The video file or folder of images.
    #[getter]
    fn video(&self) -> PathBuf {
        self.store.video().to_path_buf()
    }

    /// Number of frames of the video.
    #[getter]
    fn frames(&self) -> usize {
        self.store.project().video.frames
    }

    /// Width and height of the frames in pixels.
    #[getter]
    fn size(&self) -> (usize, usize) {
        let video = &self.store.project().video;
        (video.width, video.height)
    }

    /// How the video has changed since the project was begun, in words; `None` if it has not.
    #[getter]
    fn changed(&self, py: Python<'_>) -> Option<String> {
        py.detach(|| self.store.changed())
    }

    /// Whether a person said that the video is annotated completely. It can be set.
    #[getter]
    fn done(&self) -> bool {
        self.store.project().done
    }

    #[setter]
    fn set_done(&mut self, done: bool) -> PyResult<()> {
        self.apply(vec![Edit::SetDone { done }])
    }

    /// Names and colours (`#rrggbb`) of the labels, in the order in which they are offered.
    #[getter]
    fn labels(&self) -> Vec<(String, String)> {
        let labels = self.store.project().labels.iter();
        labels.map(|label| (label.name.clone(), label.colour.clone())).collect()
    }

    /// The ids of the targets, in the order in which they were made.
    #[getter]
    fn targets(&self) -> Vec<u64> {
        self.store.project().targets.iter().map(|target| target.id).collect()
    }

    /// The label of a target.
    fn label(&self, target: u64) -> PyResult<String> {
        Ok(self.target(target)?.label.clone())
    }

    /// The attributes of a target.
    ///
    /// Without `frame`, those that were set for the whole target. With it, all that hold in the frame, also
    /// those that change and the defaults of its label.
    #[pyo3(signature = (target, frame = None))]
    fn attributes(&self, target: u64, frame: Option<usize>) -> PyResult<BTreeMap<String, String>> {
        let target = self.target(target)?;
        let values = |frame| self.store.project().values(target, frame);
        Ok(frame.map_or_else(|| target.attributes.clone(), values))
    }

    /// The boxes that a person has drawn, by frame.
    ///
    /// Each is a dictionary with `box`, `occluded`, `truncated` and, if one was drawn, `outline`.
    fn keys<'py>(&self, py: Python<'py>, target: u64) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (frame, key) in &self.target(target)?.keys {
            let one = PyDict::new(py);
            one.set_item("box", BoxTuple(key.bbox))?;
            one.set_item("occluded", key.occluded)?;
            one.set_item("truncated", key.truncated)?;
            if let Some(Outline(points)) = &key.outline {
                one.set_item("outline", points.iter().map(|&[x, y]| (x, y)).collect::<Vec<_>>())?;
            }
            all.set_item(frame, one)?;
        }
        Ok(all)
    }

    /// The boxes that were tracked, by frame.
    ///
    /// Each is a dictionary with `box`, `score` (0 to 1), `status` (`"tracked"`, `"uncertain"` or `"lost"`),
    /// and, or `None`, `visible` (the visible share) and `agreement` (the overlap of the boxes tracked
    /// forward and backward).
    fn tracked<'py>(&self, py: Python<'py>, target: u64) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (frame, tracked) in &self.target(target)?.tracked {
            let one = PyDict::new(py);
            one.set_item("box", BoxTuple(tracked.bbox))?;
            one.set_item("score", tracked.score)?;
            one.set_item("status", tracked.status.name())?;
            one.set_item("visible", tracked.visible)?;
            one.set_item("agreement", tracked.agreement)?;
            all.set_item(frame, one)?;
        }
        Ok(all)
    }

    /// All boxes of a target by frame, drawn or tracked, without those where it is lost.
    fn boxes(&self, target: u64) -> PyResult<BTreeMap<usize, BoxTuple>> {
        let target = self.target(target)?;
        let frames = target.keys.keys().chain(target.tracked.keys());
        let boxes = frames.filter_map(|&frame| Some((frame, BoxTuple(target.box_at(frame)?))));
        Ok(boxes.collect())
    }

    /// First and last frame of each stretch in which a target is not visible.
    fn hidden(&self, target: u64) -> PyResult<Vec<(usize, usize)>> {
        Ok(self.target(target)?.hidden.iter().map(|&[from, to]| (from, to)).collect())
    }

    /// Adds a target with one key frame. A label that does not exist is added.
    ///
    /// `outline` is a polygon around the target, of at least three points x, y; pixel `k` is from `k` to
    /// `k + 1`. A rotated box has four. The box is then the upright one around it, and need not be given.
    ///
    /// Returns:
    ///     The id of the target.
    ///
    /// Raises:
    ///     ValueError: The frame is not in the video, or the box or the outline is not possible.
    #[pyo3(signature = (label, frame, r#box = None, *, outline = None))]
    fn add_target(
        &mut self,
        label: String,
        frame: usize,
        r#box: Option<&Bound<'_, PyAny>>,
        outline: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<u64> {
        let ((bbox, outline), id) = (shape(r#box, outline)?, self.store.project().next_id);
        let is_known = self.store.project().labels.iter().any(|known| known.name == label);
        let new = Edit::AddLabel { name: label.clone(), colour: None, at: None };
        let mut edits = if is_known { Vec::new() } else { vec![new] };
        edits.push(Edit::AddTarget { label, frame, bbox, outline });
        self.apply(edits)?;
        Ok(id)
    }

    /// Draws the box or the outline of a target in a frame, as `add_target` takes them. The frame becomes a
    /// key frame.
    ///
    /// Raises:
    ///     ValueError: There is no such target, or the frame, the box or the outline is not possible.
    #[pyo3(signature = (target, frame, r#box = None, *, outline = None, occluded = false, truncated = false))]
    fn set_key(
        &mut self,
        target: u64,
        frame: usize,
        r#box: Option<&Bound<'_, PyAny>>,
        outline: Option<&Bound<'_, PyAny>>,
        occluded: bool,
        truncated: bool,
    ) -> PyResult<()> {
        let (bbox, outline) = shape(r#box, outline)?;
        self.apply(vec![Edit::SetKey { target, frame, bbox, outline, occluded, truncated }])
    }

    /// Adds what a tracker found, by `Estimate.frame`, in place of the tracked boxes so far.
    ///
    /// All from the first to the last of these frames are replaced. Frames with a key and hidden frames stay
    /// as they are.
    ///
    /// Raises:
    ///     ValueError: There is no such target, a frame is not in the video, or there are no estimates.
    fn set_tracked(&mut self, target: u64, estimates: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut tracked = BTreeMap::new();
        for estimate in estimates.try_iter()? {
            let estimate = estimate?.extract::<PyRef<'_, Estimate>>()?;
            let (frame, found) = estimate.to_rust();
            tracked.insert(frame as usize, rust::TrackedBox::from(found));
        }
        let span = tracked.keys().next().copied().zip(tracked.keys().next_back().copied());
        let (from, to) = span.ok_or_else(|| PyValueError::new_err("there are no estimates"))?;
        self.apply(vec![Edit::SetTracked { target, from, to, tracked }])
    }

    /// Says that a target is not visible in the frames `first` to `last`; its boxes there are removed.
    ///
    /// Raises:
    ///     ValueError: There is no such target, or the frames are not in the video.
    fn hide(&mut self, target: u64, first: usize, last: usize) -> PyResult<()> {
        self.apply(vec![Edit::Hide { target, from: first, to: last }])
    }

    /// Deletes a target.
    ///
    /// Raises:
    ///     ValueError: There is no such target.
    fn delete_target(&mut self, target: u64) -> PyResult<()> {
        self.apply(vec![Edit::DeleteTarget { target }])
    }

    /// Applies any edits, all or none, as one step that `undo` takes back.
    ///
    /// Args:
    ///     edits: Dictionaries such as `{"edit": "split", "target": 1, "frame": 30}`; the guide lists them.
    ///
    /// Raises:
    ///     ValueError: An edit is unknown or not possible; nothing is changed.
    fn edit(&mut self, edits: &Bound<'_, PyAny>) -> PyResult<()> {
        let json = edits.py().import("json")?;
        let text: String = json.call_method1("dumps", (edits,))?.extract()?;
        let edits: Vec<Edit> = serde_json::from_str(&text)
            .map_err(|error| PyValueError::new_err(format!("not a list of edits: {error}")))?;
        self.apply(edits)
    }

    /// Takes back the last change; `False` if there is none.
    fn undo(&mut self) -> PyResult<bool> {
        Ok(self.store.step(false).map_err(to_python)?.is_some())
    }

    /// Makes the change again that was taken back last; `False` if there is none.
    fn redo(&mut self) -> PyResult<bool> {
        Ok(self.store.step(true).map_err(to_python)?.is_some())
    }

    /// Adds the targets of a file of another tool, or of a table.
    ///
    /// A warning says what was left out, and how images were matched with frames if not by their names.
    ///
    /// Args:
    ///     file: The file to read; for yolo and voc the folder of the files, which may be in folders of it.
    ///     format: `"csv"` (also JSON lines), `"mot"`, `"cvat"`, `"coco"` (also results of
    ///         detectors), `"label-studio"`, `"yolo"` or `"voc"`.
    ///
    /// Returns:
    ///     The ids of the new targets.
    ///
    /// Raises:
    ///     ValueError: The file has another format, or boxes that are not possible.
    ///     OSError: The file can't be read.
    fn import_file(&mut self, py: Python<'_>, file: PathBuf, format: &str) -> PyResult<Vec<u64>> {
        let format = import::Format::named(format).map_err(to_python)?;
        let first = self.store.project().next_id;
        let store = &mut self.store;
        let imported = py.detach(|| {
            let files = read_files(&file)?;
            let images = store.video_to_read().map(import::names_of).unwrap_or_default();
            let imported = import::read_files(format, &files, store.project(), &images)?;
            let notes = imported.notes.join(". ");
            store.apply(imported.edits(&store.project().labels))?;
            Ok::<_, Error>(notes)
        });
        let notes = imported.map_err(to_python)?;
        if !notes.is_empty() {
            warn_of(py, &notes, 1)?;
        }
        Ok((first..self.store.project().next_id).collect())
    }

    /// Writes the project in the format of another tool, or as a table.
    ///
    /// Files are written completely or not at all.
    ///
    /// Args:
    ///     format: A format of `patchlock.export`, or `"csv"`.
    ///     out: The file or folder to create. A folder must be empty or not exist yet.
    ///     frames: Copy the frames into formats that include them.
    ///     name: Name of the video; `None` for that of its file.
    ///     status: As in `patchlock.export`.
    ///     min_score: As in `patchlock.export`.
    ///     every: As in `patchlock.export`.
    ///     key_frames: As in `patchlock.export`.
    ///     overwrite: Replace an existing file. A folder that is not empty is never replaced.
    ///
    /// Returns:
    ///     The number of files written.
    ///
    /// Raises:
    ///     ValueError: There are no boxes, there is no such format, `out` exists, or frames are needed of a
    ///         video that only the project file names, and not in its folder.
    ///     OSError: A file can't be read or written.
    #[pyo3(signature = (
        format, out, *, frames = false, name = None, status = None, min_score = None, every = 1, key_frames = 1.0,
        overwrite = false
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
    fn export(
        &self,
        py: Python<'_>,
        format: &str,
        out: PathBuf,
        frames: bool,
        name: Option<String>,
        status: Option<Statuses>,
        min_score: Option<f64>,
        every: usize,
        key_frames: f64,
        overwrite: bool,
    ) -> PyResult<usize> {
        let format = Format::named(format, true).map_err(|error| to_python(error.into()))?;
        let stem =
            || self.store.video().file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (name, limits) = (name.unwrap_or_else(stem), self.store.limits());
        let (selection, key_frames) = choice(status, min_score, every, key_frames)
            .map_err(|error| to_python(error.into()))?;
        let video = || self.store.video_to_read().map(Path::to_path_buf);
        let images = export::reads(&format, frames, self.store.video()).then(video);
        let images = images.transpose().map_err(to_python)?;
        let options =
            Options { images, selection, key_frames, limits, ..Options::new(format, name) };
        let project = self.store.project();
        let written = py.detach(|| export::write(project, &options, &out, overwrite));
        let written = written.map_err(to_python)?;
        warn(py, &options.selection, &written, 1)?;
        Ok(written.files)
    }

    /// Writes the file, whole or not at all.
    ///
    /// Raises:
    ///     OSError: It can't be written, another program has the project open, or has changed the file since
    ///         it was read.
    fn save(&mut self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.store.save()).map_err(to_python)
    }

    fn __repr__(&self) -> String {
        let count = self.store.project().targets.len();
        let plural = if count == 1 { "" } else { "s" };
        format!("<Project '{}': {count} target{plural}>", self.store.path().display())
    }
}

impl Project {
    fn target(&self, id: u64) -> PyResult<&Target> {
        let target = self.store.project().target(id);
        target.ok_or_else(|| PyKeyError::new_err(format!("there is no target {id}")))
    }

    fn apply(&mut self, edits: Vec<Edit>) -> PyResult<()> {
        self.store.apply(edits).map(drop).map_err(to_python)
    }
}

/// A file; of a folder, the texts and XML files in it and in the folders below.
fn read_files(path: &Path) -> Result<Vec<import::File>, Error> {
    let read = |path: &Path| -> Result<import::File, Error> {
        let content = files::read(path);
        let content = content.map_err(|source| patchlock_track::Error::read(path, source))?;
        Ok(import::File { name: path.to_string_lossy().into_owned(), content })
    };
    if !path.is_dir() {
        return Ok(vec![read(path)?]);
    }
    let (mut found, mut folders) = (Vec::new(), vec![path.to_path_buf()]);
    while let Some(folder) = folders.pop() {
        for entry in files::entries(&folder)? {
            let is_text = ["txt", "xml", "yaml", "yml", "names"];
            if entry.is_dir() && !entry.is_symlink() {
                folders.push(entry); // a link may lead back to a folder that was seen
            } else if is_text.iter().any(|ending| files::ends_with(&entry, ending)) {
                found.push(read(&entry)?);
            }
        }
    }
    Ok(found)
}

/// What the file system refuses becomes `OSError`, all else `ValueError`.
fn to_python(error: Error) -> PyErr {
    let text = advice::project(&error);
    let is_value =
        matches!(error, Error::Invalid { .. } | Error::Labels { .. } | Error::Version { .. });
    if error.is_misuse() || is_value {
        PyValueError::new_err(text)
    } else {
        PyOSError::new_err(text)
    }
}

/// The box and the outline of a key frame, of which at least one is given.
fn shape(
    r#box: Option<&Bound<'_, PyAny>>,
    outline: Option<&Bound<'_, PyAny>>,
) -> PyResult<(patchlock::BoundingBox, Option<Outline>)> {
    let point = |point: PyResult<Bound<'_, PyAny>>| {
        numbers::<2>(&point?, "a point of an outline is two numbers x, y")
    };
    let points = outline.map(|outline| outline.try_iter()?.map(point).collect::<PyResult<_>>());
    let outline = points.transpose()?.map(Outline);
    if let Some(outline) = &outline {
        outline.check().map_err(PyValueError::new_err)?;
    }
    match (r#box, &outline) {
        (Some(bbox), _) => Ok((to_box(bbox)?, outline)),
        (None, Some(around)) => Ok((around.bounds(), outline)),
        (None, None) => Err(PyValueError::new_err("a key frame needs a box or an outline")),
    }
}
