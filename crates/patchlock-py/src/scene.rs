//! The Python class `Scene`: rendered videos with known truth, to try the tracker without any files.

use numpy::PyArray3;
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

use crate::arrays;
use crate::estimate::BoxTuple;

/// A short rendered video whose true boxes are known.
///
/// It needs no file: `scene[k]` is frame k as an RGB array, and `track` accepts the scene as a source.
///
/// Args:
///     name: `"demo"` (210 frames with rotation, a tree that hides all of the target, and changes of light),
///         `"simple"` (40 frames of slow motion) or `"occluded"` (60 frames with occlusion by a tree).
///
/// Raises:
///     ValueError: There is no scene with this name.
#[pyclass(frozen, module = "patchlock")]
pub struct Scene {
    name: &'static str,
    inner: patchlock_scene::Scene,
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (name = "demo"))]
    fn new(name: &str) -> PyResult<Self> {
        Ok(match name {
            "demo" => Self { name: "demo", inner: patchlock_scene::Scene::demo() },
            "simple" => Self { name: "simple", inner: patchlock_scene::Scene::simple() },
            "occluded" => Self { name: "occluded", inner: patchlock_scene::Scene::occluded() },
            _ => {
                return Err(PyValueError::new_err(format!(
                    "there is no scene '{name}'; the scenes are 'demo', 'simple', 'occluded'"
                )));
            }
        })
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        index: isize,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let k = self.place(index)?;
        let frame = py.detach(|| self.inner.frame(k));
        arrays::owning(py, (frame.height, frame.width, 3), frame.rgb)
    }

    /// The target's true box in a frame.
    fn truth(&self, index: isize) -> PyResult<BoxTuple> {
        Ok(BoxTuple(self.inner.truth(self.place(index)?).bbox.into()))
    }

    /// Share of the target that is hidden in a frame, 0 to 1.
    fn hidden(&self, index: isize) -> PyResult<f64> {
        Ok(self.inner.truth(self.place(index)?).hidden)
    }

    fn __repr__(&self) -> String {
        let config = self.inner.config();
        format!(
            "<Scene '{}': {} frames of {}x{}>",
            self.name, config.frames, config.width, config.height
        )
    }
}

impl Scene {
    /// Resolves a Python index: negative numbers count from the end.
    fn place(&self, index: isize) -> PyResult<usize> {
        let length = self.inner.len();
        let k = if index < 0 { index + length as isize } else { index };
        usize::try_from(k).ok().filter(|&k| k < length).ok_or_else(|| {
            PyIndexError::new_err(format!("frame {index} of a scene of {length} frames"))
        })
    }
}
