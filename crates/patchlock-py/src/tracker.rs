//! The Python class `Tracker`.

use patchlock::FrameView;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::config::{ARGUMENTS, Choice, Config, chosen};
use crate::driver::{CallResult, Driver, PickleState};
use crate::estimate::{Estimate, to_box};
use crate::network::{self, Model, Network, RuntimeName};
use crate::observation::{Observation, Views};

/// Follows one target through the frames of a video.
///
/// It starts on the target: `estimate` is the first estimate, and `update` takes the frames after
/// that.
///
/// Frames are grey or colour arrays of uint8, uint16 or float32 with the shape (height, width) or
/// (height, width, 3), or PIL images. Crops, frames with padding between rows and frames with
/// reversed channels are read in place; arrays with other strides are copied. An array must not be
/// modified while a call is using it.
///
/// Each call releases the GIL, so trackers can run in parallel on several Python threads. One
/// tracker processes one call at a time; a second thread waits. A tracker can be pickled or copied
/// between two frames; the copy gives the same boxes. A pickle holds the paths of the network's
/// files, not the network; see `Network`. In a process that was forked, with `os.fork` or by
/// `multiprocessing`, a tracker continues where it was: a fork waits for calls of other threads.
///
/// Args:
///     frame: The first frame.
///     box: The target in it: left, top, width, height in pixels, counted from 0; may be fractional
///         and partly outside the frame. Width and height must be at least 1.
///     config: A `Config`; `None` for the preset `robust`.
///     preset: The name of a preset, instead of `config`.
///     model: The network: a `Network`, what `Network` takes, or `"none"`. By default that of `config`, or
///         else `"patchnet"` with `robust` and `network`.
///     runtime: What runs the network, as for `Network`, if `model` is not a `Network`.
///     threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool
///         that all such trackers of the process share. The number does not change the boxes.
///     channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry
///         their own order.
///     settings: Settings to change, by name, such as `search=7`; `parameters()` describes them.
///
/// Raises:
///     TypeError: The frame is neither an array of a supported type nor an image, the box does not
///         hold numbers, or a keyword argument is not a setting or has the wrong type.
///     ValueError: The shape of the frame, the box, an argument or a setting is invalid, settings do not fit each
///         other, or the network can't be used.
///     OSError: A file of the network can't be read.
#[pyclass(frozen, module = "patchlock")]
pub struct Tracker {
    driver: Driver<patchlock::Tracker>,
}

#[pymethods]
impl Tracker {
    #[new]
    #[pyo3(signature = (
        frame, r#box, config = None, *, preset = None, model = None, runtime = None, threads = None,
        channels = "rgb", **settings
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
    fn new(
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
        config: Option<Choice>,
        preset: Option<&str>,
        model: Option<Model>,
        runtime: Option<RuntimeName>,
        threads: Option<usize>,
        channels: &str,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let bbox = to_box(r#box)?;
        let settings = chosen(py, (config, preset), (model, runtime), (settings, &ARGUMENTS))?;
        let driver = Driver::start(py, settings, frame, threads, channels, |config, frame| {
            patchlock::Tracker::start(config, frame, bbox)
        })?;
        Ok(Self { driver })
    }

    /// The estimate for the latest frame; after the start, the one for the first frame.
    #[getter]
    fn estimate(&self, py: Python<'_>) -> Estimate {
        self.driver.with(py, |state| {
            Estimate::from_rust(state.tracker.estimate().clone(), state.frame, state.ms)
        })
    }

    /// Finds the target in the next frame and learns from it.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image.
    ///     ValueError: The frame has an invalid shape, or its size differs from the first frame's.
    ///         The tracker is unchanged.
    fn update(&self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<Estimate> {
        let found = self.driver.step(py, frame, |state, frame| {
            let estimate = state.tracker.update(frame)?.clone();
            state.frame += 1;
            Ok(estimate)
        })?;
        Ok(found.into())
    }

    /// Starts again on the target in this box of this frame, which may have another size.
    ///
    /// What was learned before is forgotten. Use it to correct a track, or after the target was
    /// lost.
    ///
    /// Raises:
    ///     TypeError: As for the constructor.
    ///     ValueError: The shape of the frame or the box is invalid. The tracker is unchanged.
    #[pyo3(signature = (frame, r#box))]
    fn restart(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<Estimate> {
        let bbox = to_box(r#box)?;
        let found = self.driver.step(py, frame, |state, frame| {
            let estimate = state.tracker.restart(frame, bbox)?.clone();
            state.frame = 0;
            Ok(estimate)
        })?;
        Ok(found.into())
    }

    /// Does the same as `update` and also returns what happened inside the tracker.
    ///
    /// The estimate is the same, but it takes longer: the method `paper` evaluates every particle
    /// completely, and the method `robust` computes its responses to the estimate again.
    ///
    /// Returns:
    ///     The estimate and a `CommitteeObservation`, without a network a `RobustObservation`, with the
    ///     method `paper` a `PaperObservation`, with `network` a `NetworkObservation`.
    ///
    /// Raises:
    ///     TypeError: As for `update`.
    ///     ValueError: As for `update`.
    fn update_observed(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
    ) -> PyResult<(Estimate, Observation)> {
        let found = self.driver.step(py, frame, |state, frame| {
            let mut views = Views::default();
            let mut observer = |view: &FrameView<'_>| views.add(view);
            let estimate = state.tracker.update_observed(frame, &mut observer)?.clone();
            state.frame += 1;
            Ok((estimate, views))
        })?;
        let CallResult { result: (result, views), frame, ms } = found;
        Ok((CallResult { result, frame, ms }.into(), views.observation(py)?))
    }

    /// A copy of the settings.
    #[getter]
    fn config(&self, py: Python<'_>) -> Config {
        self.driver.config(py)
    }

    /// Number of threads; `None` means one per core, shared by all such trackers.
    #[getter]
    fn threads(&self) -> Option<usize> {
        self.driver.threads()
    }

    /// Channel order of colour arrays: "rgb" or "bgr".
    #[getter]
    fn channels(&self) -> &'static str {
        self.driver.channels()
    }

    /// The complete state of the tracker, as JSON text.
    ///
    /// A tracker restored from it gives the same boxes. It has the hash of a network, not the network. The Rust library reads it as a `Snapshot`.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.driver.text(py)
    }

    /// Restores a tracker from a snapshot.
    ///
    /// Args:
    ///     snapshot: What `snapshot` returned.
    ///     model: The network that the targets were tracked with, as for the constructor; not needed for
    ///         `"patchnet"`. A snapshot holds its hash.
    ///     runtime: As for the constructor.
    ///     threads: As for the constructor.
    ///     channels: As for the constructor.
    ///     frame: Number of frames since the start when the snapshot was taken.
    ///
    /// Raises:
    ///     ValueError: This is not a snapshot, its parts are inconsistent, or it needs another network.
    ///     OSError: A file of the network can't be read.
    #[classmethod]
    #[pyo3(signature = (
        snapshot, *, model = None, runtime = None, threads = None, channels = "rgb", frame = 0
    ))]
    fn restore(
        class: &Bound<'_, PyType>,
        snapshot: &[u8],
        model: Option<Model>,
        runtime: Option<RuntimeName>,
        threads: Option<usize>,
        channels: &str,
        frame: u64,
    ) -> PyResult<Self> {
        let model = network::given(class.py(), model, runtime)?;
        restore(class.py(), snapshot, threads, channels, frame, model)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, PickleState<'py>)> {
        let restore = py.import("patchlock._patchlock")?.getattr("_restore")?;
        Ok((restore, self.driver.saved(py)?))
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyDict>) -> PyResult<Self> {
        Ok(Self { driver: self.driver.copied(py)? })
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let frame = self.driver.with(py, |state| state.frame);
        let threads = self.threads().map_or("None".to_owned(), |count| count.to_string());
        format!("<Tracker threads={threads} channels='{}' frame={frame}>", self.channels())
    }
}

/// Called by pickle.
#[pyfunction]
#[pyo3(name = "_restore", signature = (snapshot, threads, channels, frame, model = None))]
pub fn restore(
    py: Python<'_>,
    snapshot: &[u8],
    threads: Option<usize>,
    channels: &str,
    frame: u64,
    model: Option<Py<Network>>,
) -> PyResult<Tracker> {
    Ok(Tracker { driver: Driver::restored(py, snapshot, model, threads, channels, frame)? })
}
