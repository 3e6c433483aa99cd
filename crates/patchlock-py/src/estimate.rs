//! The Python class `Estimate`.

use numpy::{PyArray2, PyArray3, PyReadonlyArray2, ToPyArray, ndarray::Array2};
use patchlock::{BoundingBox, Status, Visibility, VisibilityMap};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};

use crate::arrays;
use crate::draw;
use crate::driver::CallResult;
use crate::errors;
use crate::pixels::Channels;

/// The maps of visible patches, large and small.
type Maps<'py> = (Bound<'py, PyArray2<bool>>, Bound<'py, PyArray2<bool>>);

/// What `__reduce__` returns: the class and the arguments that make an equal value.
type ReduceValue<'py> =
    (Bound<'py, PyType>, (BoxTuple, Vec<[f64; 2]>, f64, &'static str, Option<Maps<'py>>, u64, f64));

/// Where the target is in one frame, how certain that is, and how much of it is visible.
///
/// Two estimates are equal if all fields except `ms` are equal. Pickling keeps every field.
///
/// Args:
///     box: Left, top, width, height in pixels, counted from 0.
///     corners: Corners of the rotated outline, shape (4, 2).
///     score: How certain the tracker is, 0 to 1.
///     status: `"tracked"`, `"uncertain"` or `"lost"`.
///     visibility: Maps of the visible patches, large and small; `None` if the method does not know.
///     frame: Number of the frame.
///     ms: Milliseconds that the tracker took for the frame.
///
/// Raises:
///     TypeError: An argument has the wrong type.
///     ValueError: The status is unknown, or the number of corners is not 4.
#[pyclass(frozen, module = "patchlock")]
pub struct Estimate {
    /// Number of the frame.
    ///
    /// With `track` it is the number in the source; with a tracker it counts from the first frame.
    #[pyo3(get)]
    frame: u64,
    /// Milliseconds that the tracker took for the frame.
    #[pyo3(get)]
    ms: f64,
    inner: patchlock::Estimate,
}

impl Estimate {
    pub fn from_rust(inner: patchlock::Estimate, frame: u64, ms: f64) -> Self {
        Self { frame, ms, inner }
    }

    /// The number of the frame, and what was found there.
    pub fn to_rust(&self) -> (u64, &patchlock::Estimate) {
        (self.frame, &self.inner)
    }
}

impl From<CallResult<patchlock::Estimate>> for Estimate {
    fn from(found: CallResult<patchlock::Estimate>) -> Self {
        Self::from_rust(found.result, found.frame, found.ms)
    }
}

#[pymethods]
impl Estimate {
    #[new]
    #[pyo3(signature = (r#box, corners, score, status, visibility = None, frame = 0, ms = 0.0))]
    fn new(
        r#box: &Bound<'_, PyAny>,
        corners: &Bound<'_, PyAny>,
        score: f64,
        status: &str,
        visibility: Option<(Bound<'_, PyAny>, Bound<'_, PyAny>)>,
        frame: u64,
        ms: f64,
    ) -> PyResult<Self> {
        let corners: Vec<[f64; 2]> = corners
            .try_iter()?
            .map(|corner| numbers(&corner?, "a corner is x, y"))
            .collect::<PyResult<_>>()?;
        let corners =
            corners.try_into().map_err(|_| PyValueError::new_err("there must be four corners"))?;
        let maps = |(large, small): (Bound<'_, PyAny>, Bound<'_, PyAny>)| -> PyResult<_> {
            Ok(Visibility { large: map(&large)?, small: map(&small)? })
        };
        let visibility = visibility.map(maps).transpose()?;
        let (bbox, status) = (to_box(r#box)?, to_status(status)?);
        let inner = patchlock::Estimate { bbox, corners, score, status, visibility };
        Ok(Self { frame, ms, inner })
    }

    /// The upright box `(x, y, w, h)` in pixels, counted from 0; may be fractional.
    #[getter]
    fn r#box(&self) -> BoxTuple {
        BoxTuple(self.inner.bbox)
    }

    /// Corners of the rotated outline as x, y in pixels, shape (4, 2).
    ///
    /// The order is top left, top right, bottom right, bottom left of the unrotated target.
    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        Array2::from(self.inner.corners.to_vec()).to_pyarray(py)
    }

    /// How certain the tracker is, 0 to 1.
    ///
    /// With the methods `robust` and `network` it is an estimate of the probability that the box overlaps the
    /// target by at least half; that of a network is often too sure of what looks like the target. With `paper`
    /// it is the visible share of the target: the mean over both scales.
    #[getter]
    fn score(&self) -> f64 {
        self.inner.score
    }

    /// Whether the target is followed: "tracked", "uncertain" or "lost".
    ///
    /// While it is lost, the box and the corners are the last ones that were known; with the method `network`
    /// they are where the network is least unsure.
    #[getter]
    fn status(&self) -> &'static str {
        self.inner.status.name()
    }

    /// Which patches are visible, large and small; `None` if the method does not know.
    ///
    /// Patches are in row order of the unrotated target: by default 3 x 3 and 7 x 7.
    #[getter]
    fn visibility<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(maps) = self.maps(py)? else { return Ok(None) };
        VISIBILITY.import(py, TYPES, "Visibility")?.call1(maps).map(Some)
    }

    /// One row of the table that `patchlock track` saves, by column name, without the time.
    ///
    /// The columns are frame, x, y, w, h, score, visible_large, visible_small, x1, y1 to x4, y4, ms and
    /// status. The visible shares are `None` if the method does not know them. The position of a lost target
    /// is what is still followed, or the last known one, as with `--lost keep`.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Self { frame, ms, inner } = self;
        let dict = PyDict::new(py);
        dict.set_item("frame", frame)?;
        let BoundingBox { x, y, w, h } = inner.bbox;
        let numbers = [("x", x), ("y", y), ("w", w), ("h", h), ("score", inner.score)];
        numbers.iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        let visibility = inner.visibility.as_ref();
        dict.set_item("visible_large", visibility.map(|visibility| visibility.large.share()))?;
        dict.set_item("visible_small", visibility.map(|visibility| visibility.small.share()))?;
        for (k, [x, y]) in inner.corners.iter().enumerate() {
            dict.set_item(format!("x{}", k + 1), x)?;
            dict.set_item(format!("y{}", k + 1), y)?;
        }
        dict.set_item("ms", ms)?;
        dict.set_item("status", inner.status.name())?;
        Ok(dict)
    }

    /// A copy of the estimate with another frame number.
    fn numbered(&self, frame: u64) -> Self {
        Self { frame, ms: self.ms, inner: self.inner.clone() }
    }

    /// Draws the estimate on a copy of a frame.
    ///
    /// The lines are those of the command `patchlock track --video`: the upright box is white, the outline
    /// goes from orange to teal with the score, both are dashed while the target is uncertain. Of a lost target
    /// only the box is drawn, in grey: what is still followed, or the last known one.
    ///
    /// Args:
    ///     frame: The frame, as for `Tracker`. uint16 samples are divided by 256, float32 samples are from 0
    ///         to 1.
    ///     channels: Channel order of colour arrays, also of the result.
    ///
    /// Returns:
    ///     The picture, uint8, shape (height, width, 3).
    ///
    /// Raises:
    ///     TypeError: The frame is neither an array of a supported type nor an image.
    ///     ValueError: The frame has an invalid shape.
    #[pyo3(signature = (frame, *, channels = "rgb"))]
    fn draw<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        channels: &str,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        draw::on_frame(py, &self.inner, frame, Channels::parse(channels)?)
    }

    fn __eq__(&self, other: &Self) -> bool {
        // The time is left out: it differs between otherwise equal runs.
        self.frame == other.frame && self.inner == other.inner
    }

    fn __repr__(&self) -> String {
        let BoundingBox { x, y, w, h } = self.inner.bbox;
        format!(
            "Estimate(frame={}, box=({x:.2}, {y:.2}, {w:.2}, {h:.2}), score={:.3}, status='{}')",
            self.frame, self.inner.score, self.inner.status
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<ReduceValue<'py>> {
        let corners = self.inner.corners.to_vec();
        let maps = self.maps(py)?;
        let (score, status) = (self.inner.score, self.inner.status.name());
        let args = (self.r#box(), corners, score, status, maps, self.frame, self.ms);
        Ok((py.get_type::<Self>(), args))
    }
}

impl Estimate {
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Option<Maps<'py>>> {
        let Some(Visibility { large, small }) = &self.inner.visibility else { return Ok(None) };
        let visible =
            |map: &VisibilityMap| arrays::copied(py, (map.rows, map.columns), &map.visible);
        Ok(Some((visible(large)?, visible(small)?)))
    }
}

/// The module of the named tuples, and those of them that have been used.
const TYPES: &str = "patchlock._types";
static BOX: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static VISIBILITY: PyOnceLock<Py<PyType>> = PyOnceLock::new();

/// The status of this name.
pub fn to_status(name: &str) -> PyResult<Status> {
    let all = [Status::Tracked, Status::Uncertain, Status::Lost];
    all.into_iter().find(|status| status.name() == name).ok_or_else(|| {
        let allowed = Status::NAMES.join(", ");
        PyValueError::new_err(format!("status is '{name}'; allowed: {allowed}"))
    })
}

fn map(visible: &Bound<'_, PyAny>) -> PyResult<VisibilityMap> {
    let visible: PyReadonlyArray2<'_, bool> = visible.extract().map_err(|_| {
        PyTypeError::new_err("visibility must hold two boolean arrays of shape (rows, columns)")
    })?;
    let array = visible.as_array();
    let (rows, columns) = array.dim();
    Ok(VisibilityMap { rows, columns, visible: array.iter().copied().collect() })
}

/// A box, in Python the package's named tuple.
#[derive(Clone, Copy)]
pub struct BoxTuple(pub BoundingBox);

impl<'py> IntoPyObject<'py> for BoxTuple {
    type Target = PyAny;
    type Output = Bound<'py, PyAny>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let BoundingBox { x, y, w, h } = self.0;
        BOX.import(py, TYPES, "Box")?.call1((x, y, w, h))
    }
}

/// Reads a box from any iterable of four numbers.
pub fn to_box(object: &Bound<'_, PyAny>) -> PyResult<BoundingBox> {
    let sides = "a box is four numbers x, y, w, h: left, top, width, height in pixels";
    Ok(numbers::<4>(object, sides)?.into())
}

/// A box of any four numbers: left, top, width, height or, with `corners`, left, top, right, bottom.
#[pyfunction]
#[pyo3(name = "_box", signature = (numbers, corners = false))]
pub fn box_of(numbers: &Bound<'_, PyAny>, corners: bool) -> PyResult<BoxTuple> {
    if !corners {
        return to_box(numbers).map(BoxTuple);
    }
    let sides = "a box is four numbers x1, y1, x2, y2: left, top, right, bottom in pixels";
    let [left, top, right, bottom] = self::numbers(numbers, sides)?;
    if right < left || bottom < top {
        return Err(PyValueError::new_err(format!(
            "a box from x {left} to {right} and from y {top} to {bottom} ends before it begins; \
             {sides}"
        )));
    }
    Ok(BoxTuple(BoundingBox { x: left, y: top, w: right - left, h: bottom - top }))
}

/// Intersection over union of two boxes of any four numbers.
#[pyfunction]
#[pyo3(name = "_iou")]
pub fn iou(one: &Bound<'_, PyAny>, other: &Bound<'_, PyAny>) -> PyResult<f64> {
    Ok(to_box(one)?.overlap(&to_box(other)?))
}

/// Reads exactly `N` numbers from a tuple, a list, an array or another iterable.
pub fn numbers<const N: usize>(object: &Bound<'_, PyAny>, expected: &str) -> PyResult<[f64; N]> {
    let wrong = || format!("{expected}; not {}", errors::shown(object));
    let items = object.try_iter().map_err(|_| PyTypeError::new_err(wrong()))?;
    let numbers: PyResult<Vec<f64>> = items.map(|item| item?.extract()).collect();
    let numbers = numbers.map_err(|_| PyTypeError::new_err(wrong()))?;
    numbers.try_into().map_err(|_| PyValueError::new_err(wrong()))
}
