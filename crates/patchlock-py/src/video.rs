//! The Python class `VideoWriter`: the annotated video of the command, from frames and estimates of Python.

use std::path::PathBuf;
use std::process;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use patchlock_cli::failure::{Exit, Failure};
use patchlock_cli::output::pending::PendingFile;
use patchlock_cli::output::video::Video;
use patchlock_cli::output::view::View;
use patchlock_cli::output::{Sink as _, TargetResult, TrackedFrame};
use patchlock_media::{FrameRate, Picture};
use patchlock_track::files;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyTuple};

use crate::errors;
use crate::estimate::Estimate;
use crate::pixels::{Channels, Pixels};

/// Frames per second that are allowed.
const RATES: std::ops::RangeInclusive<f64> = 0.001..=1000.0;
/// The largest denominator of a rate: 1001 of television, times a stride.
const SECONDS: u32 = 60_060;
/// The largest quantiser of H.264.
const COARSEST: u8 = 51;

/// Writes a video with the track drawn in (MP4, H.264), as `patchlock track --video` does.
///
/// ```python
/// scene = patchlock.Scene("simple")            # your frames
/// tracker = patchlock.Tracker(scene[0], scene.truth(0))
/// with patchlock.VideoWriter("tracked.mp4", rate=25) as video:
///     video.write(scene[0], tracker.estimate)
///     for k in range(1, 8):
///         video.write(scene[k], tracker.update(scene[k]))
/// ```
///
/// `track(..., video="tracked.mp4")` does so for its frames. The file appears when the writer is closed, at
/// the end of `with`, also after an exception: it then has the frames up to there. Without frames there is no
/// file. If ffmpeg with libx264 is installed, it encodes long videos.
///
/// Args:
///     file: The file, whose name ends in `.mp4`.
///     rate: Frames per second, 0.001 to 1000, of frames without a time.
///     count: Number of frames, if it is known: players can then start before they have the whole file.
///     panel: Whether to draw panels with score, frame number and visible patches, which avoid the target.
///     quality: Quantiser, from 0 (best picture, largest file) to 51; 6 more roughly halve the size.
///     channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV.
///     overwrite: Replace an existing file.
///
/// Raises:
///     ValueError: An argument is invalid, or the file exists.
///     OSError: The file can't be written.
#[pyclass(frozen, module = "patchlock")]
pub struct VideoWriter {
    state: Mutex<State>,
    channels: Channels,
    /// The process that writes. A copy in a forked one must not touch the file.
    process: u32,
}

struct State {
    /// `None` when the video is closed.
    video: Option<Box<Video>>,
    /// Width and height of the frames.
    size: Option<(usize, usize)>,
    /// How many frames were written.
    frames: usize,
}

#[pymethods]
impl VideoWriter {
    #[new]
    #[pyo3(signature = (
        file, *, rate = 30.0, count = None, panel = true, quality = 26, channels = "rgb",
        overwrite = false
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
    fn new(
        py: Python<'_>,
        file: PathBuf,
        rate: f64,
        count: Option<usize>,
        panel: bool,
        quality: u8,
        channels: &str,
        overwrite: bool,
    ) -> PyResult<Self> {
        let (channels, rate) = (Channels::parse(channels)?, to_rate(rate)?);
        let shown = file.display();
        if !files::ends_with(&file, "mp4") {
            let message = format!("{shown}: only .mp4 can be written; use a name that ends in it");
            return Err(PyValueError::new_err(message));
        }
        if quality > COARSEST {
            let message = format!("quality is {quality}; allowed: 0 to {COARSEST}");
            return Err(PyValueError::new_err(message));
        }
        if file.is_file() && !overwrite {
            let message = format!("{shown} already exists (overwrite=True replaces it)");
            return Err(PyValueError::new_err(message));
        }
        let pending = py.detach(|| PendingFile::create(&file, overwrite));
        let pending = pending.map_err(|failure| worded(&failure))?;
        let view = View::new(panel, None);
        let video = Some(Box::new(Video::new(pending, rate, view, quality, count)));
        let state = Mutex::new(State { video, size: None, frames: 0 });
        Ok(Self { state, channels, process: process::id() })
    }

    /// Draws a frame with its estimates and adds it.
    ///
    /// Args:
    ///     frame: The frame, as for `Tracker`; all have the same size.
    ///     estimates: The estimate of the frame, or of many targets one for each id, as `MultiTracker.update`
    ///         returns them. `Estimate.frame` is the number that is drawn.
    ///     time: When the frame is shown, in seconds; if it and the next frame have a time, the frame lasts from
    ///         one to the other. `None` for the time by `rate`.
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image, or the estimates are none.
    ///     ValueError: The frame has an invalid shape or another size than the first, or the video is closed.
    ///     OSError: The video can't be written; it is then abandoned.
    #[pyo3(signature = (frame, estimates, *, time = None))]
    fn write(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        estimates: &Bound<'_, PyAny>,
        time: Option<f64>,
    ) -> PyResult<()> {
        if let Some(time) = time.filter(|time| !(0.0..=1e9).contains(time)) {
            let message = format!("time is {time}; allowed: 0 to 1e9 seconds");
            return Err(PyValueError::new_err(message));
        }
        let pixels = Pixels::of(frame, self.channels)?;
        let (size, rgb) = (pixels.size()?, pixels.to_rgb()?);
        let results = target_results(estimates)?;
        let picture = Arc::new(Picture { time, ..Picture::rgb(size.0, size.1, rgb) });
        py.detach(|| {
            let mut state = self.state()?;
            state.check_size(size)?;
            let number = results.iter().map(|(number, _)| *number).max().unwrap_or(state.frames);
            let targets: Vec<TargetResult> =
                results.into_iter().map(|(_, result)| result).collect();
            let tracked =
                TrackedFrame { frame: number, ms: 0.0, targets: &targets, picture: &picture };
            let video = state.video.as_mut().ok_or_else(closed)?;
            video.write(&tracked).map_err(|error| {
                Failure::of(&error).map_or_else(|| PyOSError::new_err(error.to_string()), worded)
            })?;
            state.frames += 1;
            Ok(())
        })
    }

    /// Completes the file. A closed video can be closed again.
    ///
    /// Raises:
    ///     OSError: The file can't be written.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            let video = self.state()?.video.take();
            let finished = video.map_or(Ok(None), |video| video.finish());
            finished.map(drop).map_err(|error| {
                Failure::of(&error).map_or_else(|| PyOSError::new_err(error.to_string()), worded)
            })
        })
    }

    fn __enter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }
}

impl VideoWriter {
    fn state(&self) -> PyResult<MutexGuard<'_, State>> {
        if self.process != process::id() {
            return Err(PyRuntimeError::new_err(
                "the video was opened before this process was forked; write it in the other one",
            ));
        }
        Ok(self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for VideoWriter {
    fn drop(&mut self) {
        if self.process != process::id() {
            let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
            // The file is still written by the process that opened it.
            std::mem::forget(state.video.take());
        }
    }
}

impl State {
    /// Refuses a frame of another size than the first.
    fn check_size(&mut self, size: (usize, usize)) -> PyResult<()> {
        let (width, height) = *self.size.get_or_insert(size);
        if size == (width, height) {
            return Ok(());
        }
        Err(PyValueError::new_err(format!(
            "the frame is {}x{} pixels, but the frames before it are {width}x{height}",
            size.0, size.1
        )))
    }
}

fn closed() -> PyErr {
    PyValueError::new_err("the video is closed; another VideoWriter writes another file")
}

/// The targets of a frame, with the number of the frame.
fn target_results(estimates: &Bound<'_, PyAny>) -> PyResult<Vec<(usize, TargetResult)>> {
    let result = |id: Option<u64>, estimate: &Bound<'_, Estimate>| {
        let (number, inner) = estimate.get().to_rust();
        let (bbox, estimate) = (inner.bbox, inner.clone());
        (number as usize, TargetResult { id, name: None, bbox, estimate })
    };
    if let Ok(estimate) = estimates.cast::<Estimate>() {
        return Ok(vec![result(None, estimate)]);
    }
    let expected = || {
        PyTypeError::new_err(format!(
            "estimates is an Estimate, or a dictionary of an Estimate for each id; not {}",
            errors::shown(estimates)
        ))
    };
    let mapping = estimates.cast::<PyMapping>().map_err(|_| expected())?;
    let mut targets = Vec::new();
    for item in mapping.items()? {
        let (id, estimate): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let id: u64 = id.extract().map_err(|_| expected())?;
        targets.push(result(Some(id), estimate.cast::<Estimate>().map_err(|_| expected())?));
    }
    Ok(targets)
}

/// A rate as a fraction.
fn to_rate(rate: f64) -> PyResult<FrameRate> {
    if !RATES.contains(&rate) {
        return Err(PyValueError::new_err(format!(
            "rate is {rate}; allowed: {} to {} frames per second",
            RATES.start(),
            RATES.end()
        )));
    }
    let is_whole = |seconds: &u32| {
        let frames = rate * f64::from(*seconds);
        frames >= 0.5 && (frames - frames.round()).abs() < 1e-6
    };
    let seconds = (1..=SECONDS).find(is_whole).unwrap_or(SECONDS);
    let frames = (rate * f64::from(seconds)).round() as u32;
    Ok(FrameRate { frames, seconds })
}

/// A failure of the command's output; advice that names options of the command is left out.
fn worded(failure: &Failure) -> PyErr {
    let advice = failure.advice().filter(|advice| !advice.contains("--"));
    let text = match advice {
        Some(advice) => format!("{failure} ({advice})"),
        None => failure.to_string(),
    };
    match failure.exit {
        Exit::Usage => PyValueError::new_err(text),
        Exit::Failed | Exit::Interrupted => PyOSError::new_err(text),
    }
}
