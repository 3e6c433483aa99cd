//! The Python class `Observation`.

use numpy::ndarray::{Array2, Array3};
use numpy::{PyArray1, PyArray2, PyArray3, ToPyArray};
use patchlock::{FrameView, Observer};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// What happened inside the tracker during one frame; `Tracker.update_observed` returns it.
#[pyclass(frozen, module = "patchlock")]
pub struct Observation {
    particles: Vec<[f64; 6]>,
    likelihoods: Vec<f64>,
    best: usize,
    side: usize,
    candidate: Vec<f32>,
    templates: Vec<Vec<f32>>,
    replaced: Option<usize>,
    mask: Vec<f64>,
}

/// Stores what the tracker shows to an observer.
#[derive(Default)]
pub struct Keeper {
    kept: Option<Observation>,
}

impl Keeper {
    /// The stored observation.
    pub fn into_observation(self) -> PyResult<Observation> {
        self.kept.ok_or_else(|| PyValueError::new_err("the method has nothing to observe"))
    }
}

impl Observer for Keeper {
    fn observe(&mut self, view: &FrameView<'_>) {
        let FrameView::Patchwise(view) = view else { return };
        let numbers = |state: &patchlock::State| {
            [state.x, state.y, state.scale, state.rotation, state.aspect, state.skew]
        };
        self.kept = Some(Observation {
            particles: view.particles.iter().map(numbers).collect(),
            likelihoods: view.likelihoods.to_vec(),
            best: view.best,
            side: view.candidate.len().isqrt(),
            candidate: view.candidate.to_vec(),
            templates: view.templates.to_vec(),
            replaced: view.update.map(|update| update.replaced),
            mask: view.update.map_or(Vec::new(), |update| update.mask.to_vec()),
        });
    }
}

#[pymethods]
impl Observation {
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
        format!("<Observation of {} particles, best {}>", self.particles.len(), self.best)
    }
}

fn square<T>(side: usize, samples: Vec<T>) -> PyResult<Array2<T>> {
    Array2::from_shape_vec((side, side), samples)
        .map_err(|error| PyValueError::new_err(error.to_string()))
}
