//! The Python class `Tracker`.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use patchlock::{Frame, Snapshot, TrackerConfig};
use patchlock_track::session::timed_on;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::errors;
use crate::estimate::{Estimate, to_box};
use crate::observation::{Keeper, Seen};
use crate::pixels::{Channels, Pixels};
use crate::settings;
use crate::threads::Threads;

/// What `__reduce__` returns: a function and the arguments from which it makes an equal tracker.
type Reduced<'py> = (Bound<'py, PyAny>, (Bound<'py, PyBytes>, Option<usize>, &'static str, u64));

/// Follows one target through the frames of a video.
///
/// Frames are grey or colour arrays of uint8, uint16 or float32 with the shape (height, width) or
/// (height, width, 3), or PIL images. Crops, frames with padding between rows and frames with reversed
/// channels are read in place; arrays with other strides are copied. An array must not be modified while a
/// call is using it.
///
/// Each call releases the GIL, so trackers can run in parallel on several Python threads. One tracker
/// processes one call at a time; a second thread waits. A tracker can be pickled or copied between two
/// frames; the copy gives the same boxes.
///
/// Args:
///     preset: The preset to start from; `PRESETS` lists the names.
///     config: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
///     threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool that all
///         such trackers of the process share. The number does not change the boxes.
///     channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry their
///         own order.
///     **overrides: Settings that differ from the preset and the file, such as `seed=3`. `parameters()` lists
///         all settings; `lambda` is written `lambda_`.
///
/// Raises:
///     TypeError: There is no such setting, or its value has the wrong type.
///     ValueError: A setting is out of range, or the file is invalid.
///     OSError: The file can't be read.
#[pyclass(frozen, module = "patchlock")]
pub struct Tracker {
    run: Mutex<Run>,
    threads: Threads,
    channels: Channels,
}

/// What changes from frame to frame.
struct Run {
    config: TrackerConfig,
    /// `None` before `init`.
    tracker: Option<patchlock::Tracker>,
    /// Frames since `init`.
    frames: u64,
}

/// Why a frame could not be processed.
enum StepError {
    Tracker(patchlock::Error),
    NotStarted,
}

impl From<patchlock::Error> for StepError {
    fn from(error: patchlock::Error) -> Self {
        Self::Tracker(error)
    }
}

impl From<StepError> for PyErr {
    fn from(error: StepError) -> Self {
        match error {
            StepError::Tracker(error) => errors::of_tracker(error),
            StepError::NotStarted => PyRuntimeError::new_err(
                "the tracker has no target yet: call init(frame, box) first",
            ),
        }
    }
}

impl Run {
    fn started(&mut self) -> Result<&mut patchlock::Tracker, StepError> {
        self.tracker.as_mut().ok_or(StepError::NotStarted)
    }
}

impl Tracker {
    fn with(
        tracker: patchlock::Tracker,
        frames: u64,
        threads: Threads,
        channels: Channels,
    ) -> Self {
        let (config, tracker) = (tracker.config().clone(), Some(tracker));
        Self { run: Mutex::new(Run { config, tracker, frames }), threads, channels }
    }

    fn run(&self) -> MutexGuard<'_, Run> {
        self.run.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Processes a frame while other Python threads continue. The lock lets one thread in at a time.
    fn step(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        step: impl FnOnce(&mut Run, &Frame<'_>) -> Result<patchlock::Estimate, StepError> + Send,
    ) -> PyResult<Estimate> {
        let pixels = Pixels::of(frame, self.channels)?;
        let frame = pixels.frame()?;
        let pool = self.threads.pool()?;
        let found = py.detach(|| {
            let run = &mut *self.run();
            let (estimate, seconds) = timed_on(&pool, || step(run, &frame))?;
            Ok::<_, StepError>((estimate, run.frames, seconds * 1e3))
        });
        let (estimate, number, ms) = found.map_err(PyErr::from)?;
        Ok(Estimate::from_rust(estimate, number, ms))
    }
}

#[pymethods]
impl Tracker {
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
        let run = Mutex::new(Run { config, tracker: None, frames: 0 });
        Ok(Self { run, threads: Threads::new(threads)?, channels: Channels::parse(channels)? })
    }

    /// Starts tracking the target in this box of this frame.
    ///
    /// If the tracker already has a target, it is forgotten.
    ///
    /// Args:
    ///     frame: The first frame.
    ///     box: Left, top, width, height in pixels, counted from 0; may be fractional and partly outside the
    ///         frame. Width and height must be at least 1.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image, or the box does not
    ///         hold numbers.
    ///     ValueError: The shape of the frame or the box is invalid. The tracker is unchanged.
    #[pyo3(signature = (frame, r#box))]
    fn init(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<Estimate> {
        let bbox = to_box(r#box)?;
        self.step(py, frame, |run, frame| {
            let tracker = patchlock::Tracker::start(run.config.clone(), frame, bbox)?;
            let estimate = tracker.estimate().clone();
            (run.tracker, run.frames) = (Some(tracker), 0);
            Ok(estimate)
        })
    }

    /// Finds the target in the next frame and learns from it.
    ///
    /// Raises:
    ///     RuntimeError: `init` has not been called.
    ///     TypeError: The frame is neither an array of a supported type nor an image.
    ///     ValueError: The frame has an invalid shape, or its size differs from the first frame's. The
    ///         tracker is unchanged.
    fn update(&self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<Estimate> {
        self.step(py, frame, |run, frame| {
            let estimate = run.started()?.update(frame)?.clone();
            run.frames += 1;
            Ok(estimate)
        })
    }

    /// Does the same as `update` and also returns what happened inside the tracker.
    ///
    /// The estimate is the same, but it takes longer: the method `patchwise` evaluates every particle
    /// completely, and the method `robust` computes its responses to the estimate again.
    ///
    /// Returns:
    ///     The estimate and an `Observation`, or with the method `robust` a `RobustObservation`.
    ///
    /// Raises:
    ///     RuntimeError: `init` has not been called.
    ///     TypeError: The frame is neither an array of a supported type nor an image.
    ///     ValueError: The frame has an invalid shape, or its size differs from the first frame's. The
    ///         tracker is unchanged.
    fn update_observed(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
    ) -> PyResult<(Estimate, Seen)> {
        let mut keeper = Keeper::default();
        let estimate = self.step(py, frame, |run, frame| {
            let estimate = run.started()?.update_observed(frame, &mut keeper)?.clone();
            run.frames += 1;
            Ok(estimate)
        })?;
        Ok((estimate, keeper.into_seen()?))
    }

    /// All settings, by name.
    #[getter]
    fn config<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let config = py.detach(|| self.run().config.clone());
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
    /// A tracker restored from it gives the same boxes. The Rust library reads it as a `Snapshot`.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(self.saved(py)?.0)
    }

    /// Restores a tracker from a snapshot.
    ///
    /// Args:
    ///     snapshot: What `snapshot` returned.
    ///     threads: As for the constructor.
    ///     channels: As for the constructor.
    ///     frame: Number of frames since `init` when the snapshot was taken.
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
        restore(snapshot, threads, channels, frame)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let restore = py.import("patchlock._patchlock")?.getattr("_restore")?;
        let (snapshot, frames) = self.saved(py)?;
        Ok((restore, (snapshot, self.threads.count, self.channels.name(), frames)))
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        let threads = Threads::new(self.threads.count)?;
        let copy = py.detach(|| {
            let mut run = self.run();
            let snapshot = run.started()?.snapshot();
            Ok::<_, StepError>((patchlock::Tracker::restore(snapshot)?, run.frames))
        });
        let (tracker, frames) = copy.map_err(PyErr::from)?;
        Ok(Self::with(tracker, frames, threads, self.channels))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let frames = py.detach(|| self.run().frames);
        let threads = self.threads.count.map_or("None".to_string(), |count| count.to_string());
        format!("<Tracker threads={threads} channels='{}' frames={frames}>", self.channels.name())
    }
}

impl Tracker {
    /// The state as text, and the number of frames since `init`.
    fn saved<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyBytes>, u64)> {
        let (text, frames) = py.detach(|| {
            let mut run = self.run();
            let snapshot = run.started()?.snapshot();
            Ok::<_, StepError>((serde_json::to_vec(&snapshot), run.frames))
        })?;
        let text = text.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok((PyBytes::new(py, &text), frames))
    }
}

/// Called by pickle.
#[pyfunction]
#[pyo3(name = "_restore")]
pub fn restore(
    snapshot: &[u8],
    threads: Option<usize>,
    channels: &str,
    frame: u64,
) -> PyResult<Tracker> {
    let snapshot: Snapshot = serde_json::from_slice(snapshot).map_err(|error| {
        PyValueError::new_err(format!("this is not a tracker snapshot: {error}"))
    })?;
    let tracker = patchlock::Tracker::restore(snapshot).map_err(errors::of_tracker)?;
    Ok(Tracker::with(tracker, frame, Threads::new(threads)?, Channels::parse(channels)?))
}
