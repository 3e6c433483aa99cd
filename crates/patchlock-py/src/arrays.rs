//! Numbers as numpy arrays. Their number must fit the shape.

use numpy::ndarray::{Array, ArrayView, Dimension, StrideShape};
use numpy::{Element, IntoPyArray as _, PyArray, ToPyArray as _};
use pyo3::prelude::*;

use crate::errors;

/// An array that takes over these numbers.
pub fn owning<'py, T: Element, D: Dimension>(
    py: Python<'py>,
    shape: impl Into<StrideShape<D>>,
    numbers: Vec<T>,
) -> PyResult<Bound<'py, PyArray<T, D>>> {
    let array = Array::from_shape_vec(shape, numbers).map_err(errors::of_value)?;
    Ok(array.into_pyarray(py))
}

/// An array with a copy of these numbers.
pub fn copied<'py, T: Element, D: Dimension>(
    py: Python<'py>,
    shape: impl Into<StrideShape<D>>,
    numbers: &[T],
) -> PyResult<Bound<'py, PyArray<T, D>>> {
    let array = ArrayView::from_shape(shape, numbers).map_err(errors::of_value)?;
    Ok(array.to_pyarray(py))
}
