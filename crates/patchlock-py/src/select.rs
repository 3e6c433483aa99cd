//! Lets a person draw a box on a frame, on a page in the browser.

use std::cell::RefCell;
use std::convert::Infallible;
use std::sync::Arc;

use patchlock::BoundingBox;
use patchlock_media::Picture;
use patchlock_studio::server::window::{Window, WindowOptions};
use patchlock_studio::server::{AllowedHost, AllowedHosts};
use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::prelude::*;

use crate::errors;
use crate::pixels::{Channels, Pixels};

/// Serves a page with the frame until a person has drawn a box there. `host` is the host of the
/// address at which a proxy serves the page. `opened` is called with the address of the page and one
/// for the arguments of a browser, which works once.
#[pyfunction]
#[pyo3(name = "_select_boxes")]
pub fn select_boxes(
    py: Python<'_>,
    frame: &Bound<'_, PyAny>,
    channels: &str,
    in_notebook: bool,
    port: u16,
    host: Option<&str>,
    opened: &Bound<'_, PyAny>,
) -> PyResult<Vec<(f64, f64, f64, f64)>> {
    let pixels = Pixels::of(frame, Channels::parse(channels)?)?;
    let (width, height) = pixels.size()?;
    let picture = Arc::new(Picture::rgb(width, height, pixels.to_rgb()?));
    let cannot = |error: patchlock_studio::server::Error| PyOSError::new_err(error.to_string());
    let allowed = host.map(str::parse::<AllowedHost>).transpose().map_err(errors::of_value)?;
    let advice = "give select_box the address at which you read the page: address=\"...\"";
    let hosts = AllowedHosts { allowed: allowed.into_iter().collect(), advice };
    let options = WindowOptions { port, hosts, in_notebook };
    let window = py.detach(|| Window::open(options)).map_err(cannot)?;
    opened.call1((window.address(), window.address_once().map_err(cannot)?))?;
    let (boxes, signal) = py.detach(|| {
        let signal = RefCell::new(None);
        // Ctrl-C is an exception of Python.
        let stopped = || match Python::attach(|py| py.check_signals()) {
            Ok(()) => false,
            Err(error) => {
                *signal.borrow_mut() = Some(error);
                true
            }
        };
        let Ok(boxes) = window.ask::<Infallible>(&mut (0, picture), None, &stopped);
        drop(window);
        (boxes, signal.into_inner())
    });
    if let Some(error) = signal {
        return Err(error);
    }
    if boxes.is_empty() {
        return Err(PyRuntimeError::new_err("no box was drawn: the page was cancelled"));
    }
    Ok(boxes.into_iter().map(|BoundingBox { x, y, w, h }| (x, y, w, h)).collect())
}
