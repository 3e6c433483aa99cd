//! The Python class `Frames`: frames of a video, folder or pattern as numpy arrays, decoded by the same code
//! as in the command.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use patchlock_media::live::{Address, LiveSource, Options};
use patchlock_media::{
    Error, Feed, Limits, NextFrame, Order, Picture, Pixels, Prefetcher, open_within,
};
use pyo3::exceptions::{
    PyFileNotFoundError, PyRuntimeError, PyTypeError, PyUserWarning, PyValueError,
};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyInt};

use crate::{arrays, errors};

/// Iterates over the frames of a source with their numbers, decoding ahead on a thread. Of a live source,
/// each step gives the newest frame.
///
/// It yields pairs of a frame number and an array of shape (height, width) or (height, width, 3) in RGB
/// order, uint8 or uint16 as in the source.
///
/// A process that was forked after frames were opened can't read on: iterating is a `RuntimeError` there.
///
/// Args:
///     source: Any source that the command accepts: a folder of images, a pattern such as
///         `"img/%04d.jpg"`, a glob, an MP4 (H.264) or Y4M file, any other video if `ffmpeg` is installed, or
///         `"-"` for Y4M on standard input. A number is a camera of this machine, and an address such as
///         `"rtsp://host/path"` a live stream; `ffmpeg` opens both.
///     start: Number of the first frame of the range.
///     end: Number of the first frame after the range; `None` for the end of the source.
///     stride: Take every `stride`-th frame.
///     reverse: Go from the last frame of the range to the first.
///     max_pixels: Most pixels of a frame, width times height. A source that claims more is refused before
///         memory is taken for it.
///     reconnect: Seconds to wait in all, between attempts to open a live stream that was lost; with 0, the
///         frames end there.
///
/// Raises:
///     ValueError: The range contains no frame, or the source is live and has no such range.
///     OSError: The source can't be read; `FileNotFoundError` if it does not exist.
#[pyclass(frozen, module = "patchlock")]
pub struct Frames {
    feed: Mutex<Feed>,
    /// The process that has the thread that decodes.
    process: u32,
    /// Number of frames in the range; `None` if it is not known in advance.
    #[pyo3(get)]
    count: Option<usize>,
    /// Frames per second of the source; `None` if the source does not say, or is live.
    #[pyo3(get)]
    rate: Option<f64>,
    /// When the latest frame is shown.
    time: Mutex<Option<f64>>,
}

// Python shows defaults that are written as numbers.
const _: () = assert!(Limits::DEFAULT_PIXELS == 36_000_000);

#[pymethods]
impl Frames {
    #[new]
    #[pyo3(signature = (
        source, *, start = 0, end = None, stride = 1, reverse = false, max_pixels = 36_000_000,
        reconnect = 60.0
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn new(
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        start: usize,
        end: Option<usize>,
        stride: usize,
        reverse: bool,
        max_pixels: usize,
        reconnect: f64,
    ) -> PyResult<Self> {
        let order = Order { start, end, stride, reverse };
        let limits = Limits { pixels: max_pixels, ..Limits::default() };
        let source = match address(source)? {
            Source::Live(address) => {
                order.check().map_err(errors::of_media)?;
                return Self::live(address, order, limits, reconnect);
            }
            Source::File(path) => path,
        };
        let opened = py.detach(|| -> Result<Self, Error> {
            order.check()?;
            let opened = open_within(&source, reverse, limits)?;
            let (length, rate) = (opened.length(), opened.rate());
            let indices = order.indices(length)?;
            Ok(Self {
                feed: Mutex::new(Feed::File(Prefetcher::start(opened, indices))),
                process: process::id(),
                count: order.count(length),
                rate: rate.map(|rate| f64::from(rate.frames) / f64::from(rate.seconds)),
                time: Mutex::default(),
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

    /// Frames of a live source that were left out so far because a newer one had come; 0 for others.
    #[getter]
    fn dropped(&self) -> usize {
        self.feed().dropped().unwrap_or(0)
    }

    /// When the latest frame is shown, in seconds from the first frame of the source; `None` before the first
    /// frame and if the source has no times.
    #[getter]
    fn time(&self) -> Option<f64> {
        *self.time.lock().unwrap_or_else(PoisonError::into_inner)
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
            let (next, notes) = py.detach(|| {
                let mut feed = self.feed();
                (feed.wait(), feed.notes())
            });
            for note in notes {
                let text = CString::new(note.to_string()).unwrap_or_default();
                PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
            }
            match next.map_err(errors::of_media)? {
                NextFrame::Frame(index, picture) => {
                    *self.time.lock().unwrap_or_else(PoisonError::into_inner) = picture.time;
                    return Ok(Some((index, to_array(py, picture)?)));
                }
                NextFrame::End => return Ok(None),
                NextFrame::NotYet => py.check_signals()?,
            }
        }
    }
}

impl Frames {
    fn feed(&self) -> MutexGuard<'_, Feed> {
        self.feed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The newest frames of a live source.
    fn live(address: Address, order: Order, limits: Limits, reconnect: f64) -> PyResult<Self> {
        if order.stride > 1 || order.reverse {
            let option = if order.reverse { "reverse" } else { "stride" };
            let message = format!("{option} is for files; {} is live", address.shown());
            return Err(PyValueError::new_err(message));
        }
        let reconnect = Duration::try_from_secs_f64(reconnect)
            .map_err(|error| PyValueError::new_err(format!("reconnect is {reconnect}: {error}")))?;
        let Order { start, end, .. } = order;
        let live = LiveSource::open(address, Options { limits, start, end, reconnect });
        let (feed, process) = (Mutex::new(Feed::Live(live)), process::id());
        Ok(Self { feed, process, count: None, rate: None, time: Mutex::default() })
    }
}

/// What the user has named.
enum Source {
    Live(Address),
    File(PathBuf),
}

/// A number is a camera; a name may be that of a file or of a live source.
fn address(source: &Bound<'_, PyAny>) -> PyResult<Source> {
    if source.is_instance_of::<PyInt>() && !source.is_instance_of::<PyBool>() {
        let number = source.extract().map_err(|_| {
            PyValueError::new_err(format!("source is {source}; cameras count from 0"))
        })?;
        return Ok(Source::Live(Address::camera(number)));
    }
    let path: PathBuf = source.extract().map_err(|_| {
        let kind = source.get_type();
        PyTypeError::new_err(format!(
            "source is of type {kind}; it must be the name of a source, or the number of a camera"
        ))
    })?;
    let address = Address::parse(&path).map_err(errors::of_media)?;
    Ok(address.map_or(Source::File(path), Source::Live))
}

/// Whether the source is a path that does not exist, rather than a pattern.
fn is_missing(source: &Path) -> bool {
    let name = source.to_string_lossy();
    !source.exists() && name != "-" && !name.contains(['*', '?', '[', '%'])
}

/// The pixels as an array of shape (height, width) or (height, width, 3).
fn to_array(py: Python<'_>, picture: Picture) -> PyResult<Bound<'_, PyAny>> {
    let (width, height) = (picture.width, picture.height);
    Ok(match picture.pixels {
        Pixels::Grey8(samples) => arrays::owning(py, (height, width), samples)?.into_any(),
        Pixels::Grey16(samples) => arrays::owning(py, (height, width), samples)?.into_any(),
        Pixels::Rgb8(samples) => arrays::owning(py, (height, width, 3), samples)?.into_any(),
    })
}
