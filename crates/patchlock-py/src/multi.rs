//! The Python class `MultiTracker`.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use patchlock::{Error, Frame, MultiSnapshot, TargetId, Tracked};
use patchlock_track::session::timed_on;
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::errors;
use crate::estimate::{Estimate, to_box};
use crate::pixels::{Channels, Pixels};
use crate::settings;
use crate::threads::Threads;

/// What `__reduce__` returns: a function and the arguments from which it makes an equal tracker.
type Reduced<'py> = (Bound<'py, PyAny>, (Bound<'py, PyBytes>, Option<usize>, &'static str, u64));

/// Follows many targets through the frames of a video.
///
/// Each target gets the boxes that a `Tracker` of its own would give. Targets can be added and removed at any
/// frame. Each frame is converted once for all targets, and all threads work on all targets. To add targets
/// on a frame where others are already tracked, call `update` first and then `add`.
///
/// Frames, threads, pickling and copying work as for `Tracker`. All targets share the same settings.
///
/// Args:
///     preset: The preset to start from; `PRESETS` lists the names.
///     config: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
///     threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool that all
///         such trackers of the process share. The number does not change the boxes.
///     channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry their
///         own order.
///     **overrides: Settings that differ from the preset; `parameters()` lists all of them.
///
/// Raises:
///     TypeError: There is no such setting, or its value has the wrong type.
///     ValueError: A setting is out of range, or the file is invalid.
///     OSError: The file can't be read.
#[pyclass(frozen, module = "patchlock")]
pub struct MultiTracker {
    run: Mutex<Run>,
    threads: Threads,
    channels: Channels,
}

/// What changes from frame to frame.
struct Run {
    tracker: patchlock::MultiTracker,
    /// Calls of `update` so far. This is the frame number: on frame 0, targets are added without `update`.
    frames: u64,
}

impl MultiTracker {
    fn with(
        tracker: patchlock::MultiTracker,
        frames: u64,
        threads: Threads,
        channels: Channels,
    ) -> Self {
        Self { run: Mutex::new(Run { tracker, frames }), threads, channels }
    }

    fn run(&self) -> MutexGuard<'_, Run> {
        self.run.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Processes a frame while other Python threads continue. Returns the result, the frame number and the
    /// milliseconds.
    fn step<T: Send>(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        step: impl FnOnce(&mut Run, &Frame<'_>) -> Result<T, Error> + Send,
    ) -> PyResult<(T, u64, f64)> {
        let pixels = Pixels::of(frame, self.channels)?;
        let frame = pixels.frame()?;
        let pool = self.threads.pool()?;
        let found = py.detach(|| {
            let run = &mut *self.run();
            let (found, seconds) = timed_on(&pool, || step(run, &frame))?;
            Ok((found, run.frames, seconds * 1e3))
        });
        found.map_err(of_targets)
    }
}

/// An unknown id is a `KeyError`; other errors are those of a single tracker.
fn of_targets(error: Error) -> PyErr {
    match error {
        Error::UnknownTarget { .. } => PyKeyError::new_err(error.to_string()),
        error => errors::of_tracker(error),
    }
}

#[pymethods]
impl MultiTracker {
    #[new]
    #[pyo3(signature = (
        preset = "robust", *, config = None, threads = None, channels = "rgb", **overrides
    ))]
    fn new(
        preset: &str,
        config: Option<PathBuf>,
        threads: Option<usize>,
        channels: &str,
        overrides: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let config = settings::resolve(preset, config.as_deref(), overrides)?;
        let tracker = patchlock::MultiTracker::new(config).map_err(of_targets)?;
        Ok(Self::with(tracker, 0, Threads::new(threads)?, Channels::parse(channels)?))
    }

    /// Adds the target in this box of this frame; returns its id and first estimate.
    ///
    /// Ids count from 1 and are never reused.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image, or the box does not
    ///         hold numbers.
    ///     ValueError: The box is invalid, or the frame's size differs from earlier frames'. The tracker is
    ///         unchanged.
    #[pyo3(signature = (frame, r#box))]
    fn add(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<(u64, Estimate)> {
        let bbox = to_box(r#box)?;
        let (Tracked { id, estimate }, number, ms) =
            self.step(py, frame, |run, frame| run.tracker.add(frame, bbox).cloned())?;
        Ok((id.number(), Estimate::from_rust(estimate, number, ms)))
    }

    /// Restarts an existing target on a box of this frame.
    ///
    /// Use it to correct a track by hand, or after the target was lost.
    ///
    /// Raises:
    ///     KeyError: There is no target with this id.
    ///     TypeError: As for `add`.
    ///     ValueError: As for `add`.
    #[pyo3(signature = (id, frame, r#box))]
    fn reinit(
        &self,
        py: Python<'_>,
        id: u64,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<Estimate> {
        let bbox = to_box(r#box)?;
        let (estimate, number, ms) = self.step(py, frame, |run, frame| {
            run.tracker.restart(TargetId::from(id), frame, bbox).cloned()
        })?;
        Ok(Estimate::from_rust(estimate, number, ms))
    }

    /// Removes a target.
    ///
    /// Raises:
    ///     KeyError: There is no target with this id.
    fn remove(&self, py: Python<'_>, id: u64) -> PyResult<()> {
        py.detach(|| self.run().tracker.remove(TargetId::from(id))).map_err(of_targets)
    }

    /// Finds all targets in the next frame and learns from it; returns an estimate for each id.
    ///
    /// `Estimate.ms` is the time for all targets together.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image.
    ///     ValueError: The frame has an invalid shape, or its size differs from earlier frames'. All targets
    ///         are unchanged.
    fn update<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (estimates, number, ms) = self.step(py, frame, |run, frame| {
            let estimates = run.tracker.update(frame)?.to_vec();
            run.frames += 1;
            Ok(estimates)
        })?;
        let dict = PyDict::new(py);
        for Tracked { id, estimate } in estimates {
            dict.set_item(id.number(), Estimate::from_rust(estimate, number, ms))?;
        }
        Ok(dict)
    }

    /// The ids of the targets, in the order in which they were added.
    #[getter]
    fn ids(&self, py: Python<'_>) -> Vec<u64> {
        py.detach(|| self.run().tracker.ids().map(TargetId::number).collect())
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        py.detach(|| self.run().tracker.ids().len())
    }

    /// All settings, by name.
    #[getter]
    fn config<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let config = py.detach(|| self.run().tracker.config().clone());
        settings::to_dict(py, &config)
    }

    /// Number of threads; `None` means one per core, shared by all such trackers.
    #[getter]
    fn threads(&self) -> Option<usize> {
        self.threads.count
    }

    /// Channel order of colour arrays: "rgb" or "bgr".
    #[getter]
    fn channels(&self) -> &'static str {
        self.channels.name()
    }

    /// The complete state of the tracker, as JSON text.
    ///
    /// A tracker restored from it gives the same boxes. The Rust library reads it as a `MultiSnapshot`.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(self.saved(py)?.0)
    }

    /// Restores a tracker from a snapshot.
    ///
    /// Args:
    ///     snapshot: What `snapshot` returned.
    ///     threads: As for the constructor.
    ///     channels: As for the constructor.
    ///     frame: Number of calls of `update` before the snapshot was taken.
    ///
    /// Raises:
    ///     ValueError: This is not a snapshot, or its parts are inconsistent.
    #[classmethod]
    #[pyo3(signature = (snapshot, *, threads = None, channels = "rgb", frame = 0))]
    fn restore(
        _class: &Bound<'_, PyType>,
        snapshot: &[u8],
        threads: Option<usize>,
        channels: &str,
        frame: u64,
    ) -> PyResult<Self> {
        restore_many(snapshot, threads, channels, frame)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let restore = py.import("patchlock._patchlock")?.getattr("_restore_many")?;
        let (snapshot, frames) = self.saved(py)?;
        Ok((restore, (snapshot, self.threads.count, self.channels.name(), frames)))
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        let threads = Threads::new(self.threads.count)?;
        let copy = py.detach(|| {
            let run = self.run();
            patchlock::MultiTracker::restore(run.tracker.snapshot())
                .map(|tracker| (tracker, run.frames))
        });
        let (tracker, frames) = copy.map_err(of_targets)?;
        Ok(Self::with(tracker, frames, threads, self.channels))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (ids, frames) = (self.ids(py), py.detach(|| self.run().frames));
        format!("<MultiTracker ids={ids:?} channels='{}' frames={frames}>", self.channels.name())
    }
}

impl MultiTracker {
    /// The state as text, and the number of frames so far.
    fn saved<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyBytes>, u64)> {
        let (text, frames) = py.detach(|| {
            let run = self.run();
            (serde_json::to_vec(&run.tracker.snapshot()), run.frames)
        });
        let text = text.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok((PyBytes::new(py, &text), frames))
    }
}

/// Called by pickle.
#[pyfunction]
#[pyo3(name = "_restore_many")]
pub fn restore_many(
    snapshot: &[u8],
    threads: Option<usize>,
    channels: &str,
    frame: u64,
) -> PyResult<MultiTracker> {
    let snapshot: MultiSnapshot = serde_json::from_slice(snapshot).map_err(|error| {
        PyValueError::new_err(format!("this is not a snapshot of a MultiTracker: {error}"))
    })?;
    let tracker = patchlock::MultiTracker::restore(snapshot).map_err(of_targets)?;
    Ok(MultiTracker::with(tracker, frame, Threads::new(threads)?, Channels::parse(channels)?))
}
