//! The Python classes `PaperObservation`, `RobustObservation`, `NetworkObservation` and
//! `CommitteeObservation`.

use numpy::{Element, PyArrayDyn};
use patchlock::{CommitteeView, FrameView, MemberView, NetworkView, PaperView, RobustView};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict as _, PyDict};

use crate::arrays;
use crate::estimate::{BoxTuple, Estimate};

/// Numbers that Python reads as a new array each time.
struct Numbers<T> {
    shape: Vec<usize>,
    numbers: Vec<T>,
}

impl<T: Clone> Numbers<T> {
    /// Numbers with `side` rows and columns.
    fn square(side: usize, numbers: &[T]) -> Self {
        Self { shape: vec![side, side], numbers: numbers.to_vec() }
    }
}

impl<'py, T: Element> IntoPyObject<'py> for &Numbers<T> {
    type Target = PyArrayDyn<T>;
    type Output = Bound<'py, Self::Target>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        arrays::copied(py, self.shape.clone(), &self.numbers)
    }
}

/// What the method `paper` computed on one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, get_all, module = "patchlock")]
pub struct PaperObservation {
    /// The particles, shape (particles, 6).
    ///
    /// The columns are x and y of the centre in pixels, scale, rotation, aspect and skew.
    particles: Numbers<f64>,
    /// The likelihood of each particle (Eq. 24); larger is better, with no fixed scale.
    likelihoods: Numbers<f64>,
    /// Index of the particle that became the estimate.
    best: usize,
    /// The estimate's candidate, shape (side, side): warped to the template size, with unit norm.
    candidate: Numbers<f32>,
    /// All templates after this frame, shape (templates, side, side), newest last.
    templates: Numbers<f32>,
    /// Former index of the template that this frame replaced; `None` if none was replaced.
    replaced: Option<usize>,
    /// Occlusion mask of the new template, shape (side, side); `None` if no template was replaced.
    ///
    /// 1 is visible, 0 is hidden.
    mask: Option<Numbers<f64>>,
}

/// What the method `robust` computed on one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, get_all, module = "patchlock")]
pub struct RobustObservation {
    /// Frames since the start.
    frame: u64,
    /// What the filters do: "tracking"; "occluded", where hardly anything of the target is visible and it is
    /// also searched for elsewhere; "verifying" a re-detection; "lost", where it is only searched for.
    phase: &'static str,
    /// How certain the memory is of the estimate: its response there over its mean on sure frames.
    certainty: f64,
    /// The memory's strongest response more than half the target's width or height away from the estimate.
    ///
    /// It is relative to the response at the estimate, from 0 to 2.
    elsewhere: f64,
    /// How sure the memory was when it had seen no more than the first sure frames.
    ///
    /// It is the response of what the memory was then, relative to its mean then.
    early: f64,
    /// How well colour tells the target from what is around it: from -1 through 0, not at all, to 1.
    contrast: f64,
    /// The visible share of the target, 0 to 1; 0 once the target is given up.
    visible: f64,
    /// The running mean of the visible share over all frames, which the score counts.
    mean_visible: f64,
    /// The running mean of `elsewhere` over the last frames, which the score counts.
    mean_elsewhere: f64,
    /// The running mean of `early` over the last frames, each from 0 to 1.5, which the score counts.
    mean_early: f64,
    /// Number of cells on a side of the search window around the estimate.
    side: usize,
    /// Side of a cell, in pixels of the frame.
    cell: f64,
    /// The response of the tracking filter, shape (side, side).
    ///
    /// The entry [0, 0] is the centre of the estimate; entries further on are displacements down and to the
    /// right, those beyond half the side up and to the left. `numpy.fft.fftshift` puts the centre into the
    /// middle.
    tracking_filter: Numbers<f32>,
    /// The memory's response, shape (side, side), in the same order.
    memory: Numbers<f32>,
}

/// What the method `network` saw on one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, get_all, module = "patchlock")]
pub struct NetworkObservation {
    /// The score of each cell of the search window, 0 to 1, shape (cells, cells): the network's own; of
    /// PatchNet, a weighted mean of the network's and its classifier's.
    scores: Numbers<f64>,
    /// The logarithm of the odds that the network gives each cell, shape (cells, cells).
    logits: Numbers<f64>,
    /// Row and column of the cell that was chosen.
    chosen: (usize, usize),
    /// The box `(x, y, w, h)` that the chosen cell saw, before its size was smoothed.
    seen: BoxTuple,
}

/// What the default tracker and a network said on one frame, each for itself; `Tracker.update_observed`
/// returns it.
#[pyclass(frozen, module = "patchlock")]
pub struct CommitteeObservation {
    /// What each member said, and its observation.
    members: Vec<(MemberView, Py<PyAny>)>,
    /// Whether the members agree on the place.
    #[pyo3(get)]
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
        self.observations.push(match view {
            FrameView::Paper(view) => Observation::Paper(PaperObservation::of(view)),
            FrameView::Robust(view) => Observation::Robust(RobustObservation::of(view)),
            FrameView::Network(view) => Observation::Network(NetworkObservation::of(view)),
            FrameView::Committee(CommitteeView { members, agrees, .. }) => {
                self.committee = Some((members.to_vec(), *agrees));
                return;
            }
            _ => return,
        });
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
        let particles: Vec<[f64; 6]> = view.particles.iter().map(numbers).collect();
        let side = view.candidate.len().isqrt();
        let templates = view.templates;
        Self {
            particles: Numbers {
                shape: vec![particles.len(), 6],
                numbers: particles.into_flattened(),
            },
            likelihoods: Numbers {
                shape: vec![view.likelihoods.len()],
                numbers: view.likelihoods.to_vec(),
            },
            best: view.best,
            candidate: Numbers::square(side, view.candidate),
            templates: Numbers {
                shape: vec![templates.len(), side, side],
                numbers: templates.concat(),
            },
            replaced: view.update.map(|update| update.replaced),
            mask: view.update.map(|update| Numbers::square(side, update.mask)),
        }
    }
}

impl RobustObservation {
    fn of(view: &RobustView<'_>) -> Self {
        Self {
            frame: view.frame,
            phase: view.phase,
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
            tracking_filter: Numbers::square(view.side, view.tracking_filter),
            memory: Numbers::square(view.side, view.memory),
        }
    }
}

impl NetworkObservation {
    fn of(view: &NetworkView<'_>) -> Self {
        Self {
            scores: Numbers::square(view.cells, view.scores),
            logits: Numbers::square(view.cells, view.logits),
            chosen: (view.chosen / view.cells, view.chosen % view.cells),
            seen: BoxTuple(view.seen),
        }
    }
}

#[pymethods]
impl PaperObservation {
    fn __repr__(&self) -> String {
        let particles = self.likelihoods.numbers.len();
        format!("<PaperObservation of {particles} particles, best {}>", self.best)
    }
}

#[pymethods]
impl RobustObservation {
    fn __repr__(&self) -> String {
        let Self { frame, phase, certainty, .. } = self;
        format!("<RobustObservation of frame {frame}, {phase}, certainty {certainty:.2}>")
    }
}

#[pymethods]
impl NetworkObservation {
    fn __repr__(&self) -> String {
        let (cells, (row, column)) = (self.scores.shape[0], self.chosen);
        let score = self.scores.numbers.get(row * cells + column).copied().unwrap_or_default();
        format!("<NetworkObservation of {cells} x {cells} cells, score {score:.3}>")
    }
}

#[pymethods]
impl CommitteeObservation {
    /// The estimate of each member by its name, `"filters"` and `"network"`.
    ///
    /// These have no visibility, and their frame is 0.
    #[getter]
    fn estimates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let estimate = |member: &MemberView| Estimate::from_rust(member.estimate.clone(), 0, 0.0);
        self.members.iter().map(|(member, _)| (member.name, estimate(member))).into_py_dict(py)
    }

    /// The observation of each member by its name: a `RobustObservation` and a `NetworkObservation`.
    #[getter]
    fn observations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.members.iter().map(|(member, seen)| (member.name, seen)).into_py_dict(py)
    }

    /// The logarithm of the odds that the other members give the box of each member, by its name.
    ///
    /// `None` where they agree with it or judge no boxes but their own.
    #[getter]
    fn judgements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.members.iter().map(|(member, _)| (member.name, member.judgement)).into_py_dict(py)
    }

    /// The names of the members whose boxes make the box of the estimate.
    #[getter]
    fn believed(&self) -> Vec<&'static str> {
        let believed = self.members.iter().filter(|(member, _)| member.is_believed);
        believed.map(|(member, _)| member.name).collect()
    }

    fn __repr__(&self) -> String {
        format!("<CommitteeObservation, believed: {}>", self.believed().join(" and "))
    }
}
