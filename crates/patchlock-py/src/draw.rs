//! Draws estimates on frames, as the command draws them on videos.

use numpy::PyArray3;
use patchlock::{Estimate, Status};
use patchlock_cli::output::TargetResult;
use patchlock_cli::output::draw::{annotate_on, colour, score_label};
use patchlock_drawing::canvas::Canvas;
use patchlock_drawing::tag;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays;
use crate::pixels::{Channels, Pixels};

/// A copy of a frame with an estimate drawn on it, in the channel order of the frame.
pub fn on_frame<'py>(
    py: Python<'py>,
    estimate: &Estimate,
    frame: &Bound<'py, PyAny>,
    channels: Channels,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let pixels = Pixels::of(frame, channels)?;
    let (width, height) = pixels.size()?;
    let mut canvas = Canvas::from_rgb(width, height, &pixels.to_rgb()?).ok_or_else(|| {
        PyValueError::new_err(format!("a frame of {width}x{height} pixels is too large to draw on"))
    })?;
    let target =
        TargetResult { id: None, name: None, bbox: estimate.bbox, estimate: estimate.clone() };
    py.detach(|| {
        annotate_on(&mut canvas, 0, &[target], None);
        if estimate.status != Status::Lost {
            tag(&mut canvas, estimate.bbox, &score_label(estimate), colour(estimate));
        }
    });
    let mut samples = canvas.to_rgb();
    if channels == Channels::Bgr {
        samples.chunks_exact_mut(3).for_each(<[u8]>::reverse);
    }
    arrays::owning(py, (height, width, 3), samples)
}
