//! The Python classes `PaperObservation`, `RobustObservation`, `NetworkObservation` and
//! `CommitteeObservation`.

use numpy::ndarray::{Array2, Array3};
use numpy::{PyArray1, PyArray2, PyArray3, ToPyArray};
use patchlock::{
    BoundingBox, CommitteeView, FrameView, MemberView, NetworkView, PaperView, RobustView,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::estimate::{Estimate, box_tuple};

/// What the method `paper` computed on one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, module = "patchlock")]
pub struct PaperObservation {
    particles: Vec<[f64; 6]>,
    likelihoods: Vec<f64>,
    best: usize,
    side: usize,
    candidate: Vec<f32>,
    templates: Vec<Vec<f32>>,
    replaced: Option<usize>,
    mask: Vec<f64>,
}

/// What the method `robust` computed on one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, module = "patchlock")]
pub struct RobustObservation {
    frame: u64,
    certainty: f64,
    elsewhere: f64,
    early: f64,
    contrast: f64,
    visible: f64,
    mean_visible: f64,
    mean_elsewhere: f64,
    mean_early: f64,
    side: usize,
    cell: f64,
    tracking_filter: Vec<f32>,
    memory: Vec<f32>,
}

/// What the method `network` saw on one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, module = "patchlock")]
pub struct NetworkObservation {
    cells: usize,
    scores: Vec<f64>,
    logits: Vec<f64>,
    chosen: usize,
    seen: BoundingBox,
}

/// What the default tracker and a network said on one frame, each for itself; `Tracker.update_observed`
/// returns it.
#[pyclass(frozen, module = "patchlock")]
pub struct CommitteeObservation {
    /// What each member said, and its observation.
    members: Vec<(MemberView, Py<PyAny>)>,
    agrees: bool,
}

/// The observation of any tracker.
#[derive(IntoPyObject)]
pub enum Observation {
    Paper(PaperObservation),
    Robust(RobustObservation),
    Network(NetworkObservation),
    Committee(CommitteeObservation),
}

/// What a tracker showed of a frame: a committee shows each member before itself.
#[derive(Default)]
pub struct Views {
    observations: Vec<Observation>,
    committee: Option<(Vec<MemberView>, bool)>,
}

impl Views {
    /// Keeps a copy of what is shown.
    pub fn add(&mut self, view: &FrameView<'_>) {
        match view {
            FrameView::Paper(view) => {
                self.observations.push(Observation::Paper(PaperObservation::of(view)))
            }
            FrameView::Robust(view) => {
                self.observations.push(Observation::Robust(RobustObservation::of(view)))
            }
            FrameView::Network(view) => {
                self.observations.push(Observation::Network(NetworkObservation::of(view)))
            }
            FrameView::Committee(CommitteeView { members, agrees, .. }) => {
                self.committee = Some((members.to_vec(), *agrees));
            }
            _ => {}
        }
    }

    /// The observation of the tracker.
    pub fn observation(self, py: Python<'_>) -> PyResult<Observation> {
        let Some((members, agrees)) = self.committee else {
            let first = self.observations.into_iter().next();
            return first
                .ok_or_else(|| PyValueError::new_err("the tracker has nothing to observe"));
        };
        let members = members
            .into_iter()
            .zip(self.observations)
            .map(|(member, observation)| Ok((member, observation.into_pyobject(py)?.unbind())));
        let members = members.collect::<PyResult<_>>()?;
        Ok(Observation::Committee(CommitteeObservation { members, agrees }))
    }
}

impl PaperObservation {
    fn of(view: &PaperView<'_>) -> Self {
        let numbers = |state: &patchlock::State| {
            [state.x, state.y, state.scale, state.rotation, state.aspect, state.skew]
        };
        Self {
            particles: view.particles.iter().map(numbers).collect(),
            likelihoods: view.likelihoods.to_vec(),
            best: view.best,
            side: view.candidate.len().isqrt(),
            candidate: view.candidate.to_vec(),
            templates: view.templates.to_vec(),
            replaced: view.update.map(|update| update.replaced),
            mask: view.update.map_or(Vec::new(), |update| update.mask.to_vec()),
        }
    }
}

impl RobustObservation {
    fn of(view: &RobustView<'_>) -> Self {
        Self {
            frame: view.frame,
            certainty: view.certainty,
            elsewhere: view.elsewhere,
            early: view.early,
            contrast: view.contrast,
            visible: view.visible,
            mean_visible: view.mean_visible,
            mean_elsewhere: view.mean_elsewhere,
            mean_early: view.mean_early,
            side: view.side,
            cell: view.cell,
            tracking_filter: view.tracking_filter.to_vec(),
            memory: view.memory.to_vec(),
        }
    }
}

impl NetworkObservation {
    fn of(view: &NetworkView<'_>) -> Self {
        Self {
            cells: view.cells,
            scores: view.scores.to_vec(),
            logits: view.logits.to_vec(),
            chosen: view.chosen,
            seen: view.seen,
        }
    }
}

#[pymethods]
impl PaperObservation {
    /// The particles, shape (particles, 6).
    ///
    /// The columns are x and y of the centre in pixels, scale, rotation, aspect and skew.
    #[getter]
    fn particles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        Array2::from(self.particles.clone()).to_pyarray(py)
    }

    /// The likelihood of each particle (Eq. 24); larger is better, with no fixed scale.
    #[getter]
    fn likelihoods<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.likelihoods.to_pyarray(py)
    }

    /// Index of the particle that became the estimate.
    #[getter]
    fn best(&self) -> usize {
        self.best
    }

    /// The estimate's candidate, shape (side, side): warped to the template size, with unit norm.
    #[getter]
    fn candidate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        Ok(square(self.side, self.candidate.clone())?.to_pyarray(py))
    }

    /// All templates after this frame, shape (templates, side, side), newest last.
    #[getter]
    fn templates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let shape = (self.templates.len(), self.side, self.side);
        let array = Array3::from_shape_vec(shape, self.templates.concat());
        Ok(array.map_err(|error| PyValueError::new_err(error.to_string()))?.to_pyarray(py))
    }

    /// Former index of the template that this frame replaced; `None` if none was replaced.
    #[getter]
    fn replaced(&self) -> Option<usize> {
        self.replaced
    }

    /// Occlusion mask of the new template, shape (side, side); `None` if no template was replaced.
    ///
    /// 1 is visible, 0 is hidden.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        if self.mask.is_empty() {
            return Ok(None);
        }
        Ok(Some(square(self.side, self.mask.clone())?.to_pyarray(py)))
    }

    fn __repr__(&self) -> String {
        format!("<PaperObservation of {} particles, best {}>", self.particles.len(), self.best)
    }
}

#[pymethods]
impl RobustObservation {
    /// Frames since the start.
    #[getter]
    fn frame(&self) -> u64 {
        self.frame
    }

    /// How certain the memory is of the estimate: its response there over its mean on sure frames.
    #[getter]
    fn certainty(&self) -> f64 {
        self.certainty
    }

    /// The memory's strongest response more than half the target's width or height away from the estimate.
    ///
    /// It is relative to the response at the estimate, from 0 to 2.
    #[getter]
    fn elsewhere(&self) -> f64 {
        self.elsewhere
    }

    /// How sure the memory was when it had seen no more than the first sure frames.
    ///
    /// It is the response of what the memory was then, relative to its mean then.
    #[getter]
    fn early(&self) -> f64 {
        self.early
    }

    /// How well colour tells the target from what is around it: from -1 through 0, not at all, to 1.
    #[getter]
    fn contrast(&self) -> f64 {
        self.contrast
    }

    /// The visible share of the target, 0 to 1; 0 once the target is given up.
    #[getter]
    fn visible(&self) -> f64 {
        self.visible
    }

    /// The running mean of the visible share over all frames, which the score counts.
    #[getter]
    fn mean_visible(&self) -> f64 {
        self.mean_visible
    }

    /// The running mean of `elsewhere` over the last frames, which the score counts.
    #[getter]
    fn mean_elsewhere(&self) -> f64 {
        self.mean_elsewhere
    }

    /// The running mean of `early` over the last frames, each from 0 to 1.5, which the score counts.
    #[getter]
    fn mean_early(&self) -> f64 {
        self.mean_early
    }

    /// Number of cells on a side of the search window around the estimate.
    #[getter]
    fn side(&self) -> usize {
        self.side
    }

    /// Side of a cell, in pixels of the frame.
    #[getter]
    fn cell(&self) -> f64 {
        self.cell
    }

    /// The response of the tracking filter, shape (side, side).
    ///
    /// The entry [0, 0] is the centre of the estimate; entries further on are displacements down and to the
    /// right, those beyond half the side up and to the left. `numpy.fft.fftshift` puts the centre into the
    /// middle.
    #[getter]
    fn tracking_filter<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        Ok(square(self.side, self.tracking_filter.clone())?.to_pyarray(py))
    }

    /// The memory's response, shape (side, side), in the same order.
    #[getter]
    fn memory<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        Ok(square(self.side, self.memory.clone())?.to_pyarray(py))
    }

    fn __repr__(&self) -> String {
        format!("<RobustObservation of frame {}, certainty {:.2}>", self.frame, self.certainty)
    }
}

#[pymethods]
impl NetworkObservation {
    /// The score of each cell of the search window, 0 to 1, shape (cells, cells): the network's own; of
    /// PatchNet, a weighted mean of the network's and its classifier's.
    #[getter]
    fn scores<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(square(self.cells, self.scores.clone())?.to_pyarray(py))
    }

    /// The logarithm of the odds that the network gives each cell, shape (cells, cells).
    #[getter]
    fn logits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(square(self.cells, self.logits.clone())?.to_pyarray(py))
    }

    /// Row and column of the cell that was chosen.
    #[getter]
    fn chosen(&self) -> (usize, usize) {
        (self.chosen / self.cells, self.chosen % self.cells)
    }

    /// The box `(x, y, w, h)` that the chosen cell saw, before its size was smoothed.
    #[getter]
    fn seen<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        box_tuple(py, &self.seen)
    }

    fn __repr__(&self) -> String {
        let score = self.scores.get(self.chosen).copied().unwrap_or_default();
        format!("<NetworkObservation of {0} x {0} cells, score {score:.3}>", self.cells)
    }
}

fn square<T>(side: usize, samples: Vec<T>) -> PyResult<Array2<T>> {
    Array2::from_shape_vec((side, side), samples)
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

#[pymethods]
impl CommitteeObservation {
    /// The estimate of each member by its name, `"robust"` and `"network"`.
    ///
    /// These have no visibility, and their frame is 0.
    #[getter]
    fn estimates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let estimates = PyDict::new(py);
        for (member, _) in &self.members {
            let estimate = Estimate::from_rust(member.estimate.clone(), 0, 0.0);
            estimates.set_item(member.name, estimate)?;
        }
        Ok(estimates)
    }

    /// The observation of each member by its name: a `RobustObservation` and a `NetworkObservation`.
    #[getter]
    fn observations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let observations = PyDict::new(py);
        for (member, seen) in &self.members {
            observations.set_item(member.name, seen)?;
        }
        Ok(observations)
    }

    /// The logarithm of the odds that the other members give the box of each member, by its name.
    ///
    /// `None` where they agree with it or judge no boxes but their own.
    #[getter]
    fn judgements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let judgements = PyDict::new(py);
        for (member, _) in &self.members {
            judgements.set_item(member.name, member.judgement)?;
        }
        Ok(judgements)
    }

    /// The names of the members whose boxes make the box of the estimate.
    #[getter]
    fn believed(&self) -> Vec<&'static str> {
        let believed = self.members.iter().filter(|(member, _)| member.is_believed);
        believed.map(|(member, _)| member.name).collect()
    }

    /// Whether the members agree on the place.
    #[getter]
    fn agrees(&self) -> bool {
        self.agrees
    }

    fn __repr__(&self) -> String {
        format!("<CommitteeObservation, believed: {}>", self.believed().join(" and "))
    }
}
