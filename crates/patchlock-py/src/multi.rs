//! The Python class `MultiTracker`.

use std::collections::BTreeMap;

use patchlock::{FrameView, TargetEstimate, TargetId};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::config::{ARGUMENTS, Choice, Config, chosen};
use crate::driver::{CallResult, Driver, PickleState, to_python};
use crate::estimate::{Estimate, to_box};
use crate::network::{self, Model, Network, RuntimeName};
use crate::observation::Views;

/// Follows many targets through the frames of a video.
///
/// Each target gets the boxes that a `Tracker` for it alone would give. Targets can be added and
/// removed at any frame. Each frame is converted once for all targets, and all threads work on all
/// targets. To add targets on a frame where others are already tracked, call `update` first and then
/// `add`.
///
/// Frames, threads, pickling and copying work as for `Tracker`. All targets share the same settings.
///
/// Args:
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
///     TypeError: `config` or `model` is none of these, or a keyword argument is not a setting or has
///         the wrong type.
///     ValueError: An argument or a setting is invalid, settings do not fit each other, or the network can't be
///         used.
///     OSError: A file of the network can't be read.
#[pyclass(frozen, module = "patchlock")]
pub struct MultiTracker {
    driver: Driver<patchlock::MultiTracker>,
}

/// Estimates by id, and observations by id.
type ObservedEstimates<'py> = (Bound<'py, PyDict>, Bound<'py, PyDict>);

#[pymethods]
impl MultiTracker {
    #[new]
    #[pyo3(signature = (
        config = None, *, preset = None, model = None, runtime = None, threads = None,
        channels = "rgb", **settings
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
    fn new(
        py: Python<'_>,
        config: Option<Choice>,
        preset: Option<&str>,
        model: Option<Model>,
        runtime: Option<RuntimeName>,
        threads: Option<usize>,
        channels: &str,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let settings = chosen(py, (config, preset), (model, runtime), (settings, &ARGUMENTS))?;
        let make = patchlock::MultiTracker::new;
        Ok(Self { driver: Driver::new(settings, threads, channels, make)? })
    }

    /// Adds the target in this box of this frame; returns its id and first estimate.
    ///
    /// Ids count from 1 and are never reused.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image, or the box does
    ///         not hold numbers.
    ///     ValueError: The box is invalid, or the frame's size differs from earlier frames'. The
    ///         tracker is unchanged.
    #[pyo3(signature = (frame, r#box))]
    fn add(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<(u64, Estimate)> {
        let bbox = to_box(r#box)?;
        let found = self
            .driver
            .step(py, frame, |state, frame| Ok(state.tracker.add(frame, bbox)?.clone()))?;
        let CallResult { result: TargetEstimate { id, estimate }, frame, ms } = found;
        Ok((id.number(), Estimate::from_rust(estimate, frame, ms)))
    }

    /// Starts again with an existing target on a box of this frame.
    ///
    /// Use it to correct a track, or after the target was lost.
    ///
    /// Raises:
    ///     KeyError: There is no target with this id.
    ///     TypeError: As for `add`.
    ///     ValueError: As for `add`.
    #[pyo3(signature = (id, frame, r#box))]
    fn restart(
        &self,
        py: Python<'_>,
        id: u64,
        frame: &Bound<'_, PyAny>,
        r#box: &Bound<'_, PyAny>,
    ) -> PyResult<Estimate> {
        let bbox = to_box(r#box)?;
        let found = self.driver.step(py, frame, |state, frame| {
            Ok(state.tracker.restart(TargetId::from(id), frame, bbox)?.clone())
        })?;
        Ok(found.into())
    }

    /// Removes a target.
    ///
    /// Raises:
    ///     KeyError: There is no target with this id.
    fn remove(&self, py: Python<'_>, id: u64) -> PyResult<()> {
        let removed = self.driver.with(py, |state| state.tracker.remove(TargetId::from(id)));
        removed.map_err(to_python)
    }

    /// Finds all targets in the next frame and learns from it; returns an estimate for each id.
    ///
    /// `Estimate.ms` is the time for all targets together.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image.
    ///     ValueError: The frame has an invalid shape, or its size differs from earlier frames'. All
    ///         targets are unchanged.
    fn update<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = self.driver.step(py, frame, |state, frame| {
            let tracked = state.tracker.update(frame)?.to_vec();
            state.frame += 1;
            Ok(tracked)
        })?;
        by_id(py, found)
    }

    /// Does the same as `update` and also returns what happened inside the tracker.
    ///
    /// The estimates are the same, but it takes longer: targets are tracked one after another, each
    /// as `Tracker.update_observed` does it.
    ///
    /// Returns:
    ///     The estimates, and for each id a `CommitteeObservation`, without a network a
    ///     `RobustObservation`, with the method `paper` a `PaperObservation`, with `network` a
    ///     `NetworkObservation`.
    ///
    /// Raises:
    ///     TypeError: As for `update`.
    ///     ValueError: As for `update`.
    fn update_observed<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
    ) -> PyResult<ObservedEstimates<'py>> {
        let found = self.driver.step(py, frame, |state, frame| {
            let mut views = BTreeMap::<u64, Views>::new();
            let mut observer = |id: TargetId, view: &FrameView<'_>| {
                views.entry(id.number()).or_default().add(view);
            };
            let tracked = state.tracker.update_observed(frame, &mut observer)?.to_vec();
            state.frame += 1;
            Ok((tracked, views))
        })?;
        let CallResult { result: (result, views), frame, ms } = found;
        let observations = PyDict::new(py);
        for (id, views) in views {
            observations.set_item(id, views.observation(py)?)?;
        }
        Ok((by_id(py, CallResult { result, frame, ms })?, observations))
    }

    /// The ids of the targets, in the order in which they were added.
    #[getter]
    fn ids(&self, py: Python<'_>) -> Vec<u64> {
        self.driver.with(py, |state| state.tracker.ids().map(TargetId::number).collect())
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.driver.with(py, |state| state.tracker.ids().len())
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
    /// A tracker restored from it gives the same boxes. It has the hash of a network, not the network. The Rust library reads it as a
    /// `MultiSnapshot`.
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
    ///     frame: Number of calls of `update` before the snapshot was taken.
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
        restore_many(class.py(), snapshot, threads, channels, frame, model)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, PickleState<'py>)> {
        let restore = py.import("patchlock._patchlock")?.getattr("_restore_many")?;
        Ok((restore, self.driver.saved(py)?))
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyDict>) -> PyResult<Self> {
        Ok(Self { driver: self.driver.copied(py)? })
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let (ids, frame) = (self.ids(py), self.driver.with(py, |state| state.frame));
        format!("<MultiTracker ids={ids:?} channels='{}' frame={frame}>", self.channels())
    }
}

/// The estimates by id.
fn by_id(py: Python<'_>, found: CallResult<Vec<TargetEstimate>>) -> PyResult<Bound<'_, PyDict>> {
    let CallResult { result, frame, ms } = found;
    let dict = PyDict::new(py);
    for TargetEstimate { id, estimate } in result {
        dict.set_item(id.number(), Estimate::from_rust(estimate, frame, ms))?;
    }
    Ok(dict)
}

/// Called by pickle.
#[pyfunction]
#[pyo3(name = "_restore_many", signature = (snapshot, threads, channels, frame, model = None))]
pub fn restore_many(
    py: Python<'_>,
    snapshot: &[u8],
    threads: Option<usize>,
    channels: &str,
    frame: u64,
    model: Option<Py<Network>>,
) -> PyResult<MultiTracker> {
    Ok(MultiTracker { driver: Driver::restored(py, snapshot, model, threads, channels, frame)? })
}
