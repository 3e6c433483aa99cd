//! The Python class `Frames`: frames of a video, folder or pattern as numpy arrays, decoded by the same code
//! as in the command.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Mutex, PoisonError};

use numpy::ndarray::{Array2, Array3};
use numpy::{Element, IntoPyArray};
use patchlock_media::{Ahead, Error, Limits, Next, Order, Picture, Pixels, open_within};
use pyo3::exceptions::{PyFileNotFoundError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::errors;

/// Iterates over the frames of a source with their numbers, decoding ahead on a thread.
///
/// It yields pairs of a frame number and an array of shape (height, width) or (height, width, 3) in RGB
/// order, uint8 or uint16 as in the source.
///
/// A process that was forked after frames were opened can't read on: iterating is a `RuntimeError` there.
///
/// Args:
///     source: Any source that the command accepts: a folder of images, a pattern such as
///         `"img/%04d.jpg"`, a glob, an MP4 (H.264) or Y4M file, any other video if `ffmpeg` is installed, or
///         `"-"` for Y4M on standard input.
///     start: Number of the first frame of the range.
///     end: Number of the first frame after the range; `None` for the end of the source.
///     stride: Take every `stride`-th frame.
///     reverse: Go from the last frame of the range to the first.
///     max_pixels: Most pixels of a frame, width times height. A source that claims more is refused before
///         memory is taken for it.
///
/// Raises:
///     ValueError: The range contains no frame.
///     OSError: The source can't be read; `FileNotFoundError` if it does not exist.
#[pyclass(frozen, module = "patchlock")]
pub struct Frames {
    ahead: Mutex<Ahead>,
    /// The process that has the thread that decodes.
    process: u32,
    count: Option<usize>,
    rate: Option<f64>,
}

// Python shows defaults that are written as numbers.
const _: () = assert!(Limits::DEFAULT_PIXELS == 36_000_000);

#[pymethods]
impl Frames {
    #[new]
    #[pyo3(signature = (
        source, *, start = 0, end = None, stride = 1, reverse = false, max_pixels = 36_000_000
    ))]
    fn new(
        py: Python<'_>,
        source: PathBuf,
        start: usize,
        end: Option<usize>,
        stride: usize,
        reverse: bool,
        max_pixels: usize,
    ) -> PyResult<Self> {
        let order = Order { start, end, stride, reverse };
        let opened = py.detach(|| -> Result<Self, Error> {
            order.check()?;
            let opened = open_within(&source, reverse, Limits { pixels: max_pixels })?;
            let (length, rate) = (opened.length(), opened.rate());
            let indices = order.indices(length)?;
            Ok(Self {
                ahead: Mutex::new(Ahead::start(opened, indices)),
                process: process::id(),
                count: order.count(length),
                rate: rate.map(|rate| f64::from(rate.frames) / f64::from(rate.seconds)),
            })
        });
        opened.map_err(|error| {
            let exception = errors::of_media(error);
            if is_missing(&source) {
                return PyFileNotFoundError::new_err(exception.value(py).to_string());
            }
            exception
        })
    }

    /// Number of frames in the range; `None` if it is not known in advance.
    #[getter]
    fn count(&self) -> Option<usize> {
        self.count
    }

    /// Frames per second of the source; `None` if the source does not say.
    #[getter]
    fn rate(&self) -> Option<f64> {
        self.rate
    }

    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<(usize, Bound<'py, PyAny>)>> {
        if self.process != process::id() {
            return Err(PyRuntimeError::new_err(
                "the frames were opened before this process was forked; open them again in it",
            ));
        }
        loop {
            let next =
                py.detach(|| self.ahead.lock().unwrap_or_else(PoisonError::into_inner).wait());
            match next.map_err(errors::of_media)? {
                Next::Frame(index, picture) => return Ok(Some((index, to_array(py, picture)?))),
                Next::End => return Ok(None),
                Next::NotYet => py.check_signals()?,
            }
        }
    }
}

/// Whether the source is a path that does not exist, rather than a pattern.
fn is_missing(source: &Path) -> bool {
    let name = source.to_string_lossy();
    !source.exists() && name != "-" && !name.contains(['*', '?', '[', '%'])
}

/// The pixels as an array of shape (height, width) or (height, width, 3).
fn to_array(py: Python<'_>, picture: Picture) -> PyResult<Bound<'_, PyAny>> {
    let (width, height) = (picture.width, picture.height);
    match picture.pixels {
        Pixels::Grey8(samples) => grey(py, samples, width, height),
        Pixels::Grey16(samples) => grey(py, samples, width, height),
        Pixels::Rgb8(samples) => Array3::from_shape_vec((height, width, 3), samples)
            .map(|array| array.into_pyarray(py).into_any())
            .map_err(|error| PyValueError::new_err(error.to_string())),
    }
}

fn grey<T: Element>(
    py: Python<'_>,
    samples: Vec<T>,
    width: usize,
    height: usize,
) -> PyResult<Bound<'_, PyAny>> {
    Array2::from_shape_vec((height, width), samples)
        .map(|array| array.into_pyarray(py).into_any())
        .map_err(|error| PyValueError::new_err(error.to_string()))
}
