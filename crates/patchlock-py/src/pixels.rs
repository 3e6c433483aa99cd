//! Frames from Python: numpy arrays and PIL images as the library's [`Frame`]. Arrays whose rows are
//! contiguous, such as crops and images with reversed channels, are not copied.

use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use patchlock::Frame;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;

use crate::errors;

const EXPECTED: &str = "a frame is a numpy array of shape (height, width) or (height, width, 3) \
                        and type uint8, uint16 or float32, or a PIL image";

/// The channel order of colour arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    Rgb,
    Bgr,
}

impl Channels {
    pub fn parse(name: &str) -> PyResult<Self> {
        match name {
            "rgb" => Ok(Self::Rgb),
            "bgr" => Ok(Self::Bgr),
            _ => Err(PyValueError::new_err(format!("channels is '{name}'; allowed: 'rgb', 'bgr'"))),
        }
    }

    pub fn name(self) -> &'static str {
        if self == Self::Rgb { "rgb" } else { "bgr" }
    }
}

/// The memory of the samples: the array itself, or the array of which it is a view.
enum Memory<'py> {
    U8(PyReadonlyArrayDyn<'py, u8>),
    U16(PyReadonlyArrayDyn<'py, u16>),
    F32(PyReadonlyArrayDyn<'py, f32>),
}

/// The pixels of a Python object, borrowed.
pub struct Pixels<'py> {
    memory: Memory<'py>,
    /// Offset of the first pixel, in samples.
    start: usize,
    layout: Layout,
    bgr: bool,
}

/// Memory layout of the pixels; the stride is in samples.
#[derive(Debug, Clone, Copy)]
struct Layout {
    height: usize,
    width: usize,
    channels: usize,
    stride: usize,
    /// Whether the channels are reversed in memory.
    backwards: bool,
}

impl<'py> Pixels<'py> {
    /// The pixels of an array or an image.
    pub fn of(object: &Bound<'py, PyAny>, channels: Channels) -> PyResult<Self> {
        if let Ok(array) = object.cast::<PyUntypedArray>() {
            return Self::of_array(array, channels);
        }
        match image_to_array(object)? {
            Some(array) => Self::of_array(&array, Channels::Rgb),
            None => Err(PyTypeError::new_err(format!("{EXPECTED}; this is {}", kind(object)?))),
        }
    }

    fn of_array(array: &Bound<'py, PyUntypedArray>, channels: Channels) -> PyResult<Self> {
        check_shape(array.shape())?;
        if let Ok(array) = array.cast::<PyArrayDyn<u8>>() {
            Self::borrow(array, channels, Memory::U8)
        } else if let Ok(array) = array.cast::<PyArrayDyn<u16>>() {
            Self::borrow(array, channels, Memory::U16)
        } else if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
            Self::borrow(array, channels, Memory::F32)
        } else {
            Err(PyTypeError::new_err(format!(
                "{EXPECTED}; this array is of type {}; \
                 convert samples from 0 to 255 with .astype(numpy.uint8), or divide them by their white \
                 and use .astype(numpy.float32)",
                array.dtype()
            )))
        }
    }

    fn borrow<T: Element>(
        array: &Bound<'py, PyArrayDyn<T>>,
        channels: Channels,
        memory: impl Fn(PyReadonlyArrayDyn<'py, T>) -> Memory<'py>,
    ) -> PyResult<Self> {
        let whole = |array: &Bound<'py, PyArrayDyn<T>>| -> PyResult<Self> {
            let layout = Layout::of(array).ok_or_else(|| PyValueError::new_err(EXPECTED))?;
            let memory = memory(array.try_readonly()?);
            Ok(Self { memory, start: 0, layout, bgr: channels == Channels::Bgr })
        };
        if array.is_c_contiguous() && array.is_aligned() {
            return whole(array);
        }
        if let Some((owner, start, layout)) = window(array) {
            let bgr = (channels == Channels::Bgr) != layout.backwards;
            return Ok(Self { memory: memory(owner.try_readonly()?), start, layout, bgr });
        }
        let copy = array.call_method1(intern!(array.py(), "copy"), ("C",))?;
        whole(copy.cast::<PyArrayDyn<T>>()?)
    }

    /// The pixels as a frame of the library.
    pub fn frame(&self) -> PyResult<Frame<'_>> {
        let Layout { width, height, channels, stride, .. } = self.layout;
        let frame = match (&self.memory, channels) {
            (Memory::U8(array), 1) => Frame::grey8(self.part(array)?, width, height),
            (Memory::U8(array), _) => Frame::rgb8(self.part(array)?, width, height),
            (Memory::U16(array), 1) => Frame::grey16(self.part(array)?, width, height),
            (Memory::U16(array), _) => Frame::rgb16(self.part(array)?, width, height),
            (Memory::F32(array), 1) => Frame::grey32f(self.part(array)?, width, height),
            (Memory::F32(array), _) => Frame::rgb32f(self.part(array)?, width, height),
        };
        let frame = frame.and_then(|frame| frame.with_stride(stride)).map_err(errors::of_value)?;
        Ok(if self.bgr { frame.bgr() } else { frame })
    }

    /// Width and height, of a frame that is valid.
    pub fn size(&self) -> PyResult<(usize, usize)> {
        self.frame().map(|frame| (frame.width(), frame.height()))
    }

    /// The pixels as 8-bit RGB. 16-bit samples are divided by 256, float samples are from 0 to 1.
    pub fn to_rgb(&self) -> PyResult<Vec<u8>> {
        self.frame()?;
        Ok(match &self.memory {
            Memory::U8(array) => self.rgb(self.part(array)?, |sample| sample),
            Memory::U16(array) => self.rgb(self.part(array)?, |sample| (sample >> 8) as u8),
            Memory::F32(array) => {
                self.rgb(self.part(array)?, |sample| (255.0 * sample).round() as u8)
            }
        })
    }

    fn rgb<T: Copy>(&self, samples: &[T], to_byte: impl Fn(T) -> u8) -> Vec<u8> {
        let Layout { height, width, channels, stride, .. } = self.layout;
        let mut rgb = Vec::with_capacity(3 * width * height);
        for row in samples.chunks(stride).take(height) {
            for pixel in row.chunks_exact(channels).take(width) {
                let mut bytes = [0, 1, 2].map(|k| to_byte(pixel[k.min(channels - 1)]));
                if self.bgr {
                    bytes.reverse();
                }
                rgb.extend(bytes);
            }
        }
        rgb
    }

    fn part<'a, T: Element>(&self, array: &'a PyReadonlyArrayDyn<'py, T>) -> PyResult<&'a [T]> {
        Ok(array.as_slice()?.get(self.start..).unwrap_or(&[]))
    }
}

impl Layout {
    /// The layout of an array whose rows are contiguous; `None` for any other array.
    fn of<T: Element>(array: &Bound<'_, PyArrayDyn<T>>) -> Option<Self> {
        let (height, width, channels) = match *array.shape() {
            [height, width] => (height, width, 1),
            [height, width, channels] => (height, width, channels),
            _ => return None,
        };
        if array.is_c_contiguous() {
            let stride = width * channels;
            return Some(Self { height, width, channels, stride, backwards: false });
        }
        let size = size_of::<T>() as isize;
        let steps: Vec<isize> = array.strides().iter().map(|step| step / size).collect();
        let exact = array.strides().iter().all(|step| step % size == 0);
        let backwards = channels > 1 && steps[2] == -1;
        let pixels_follow = steps[1] == channels as isize;
        let channels_follow = channels == 1 || backwards || steps[2] == 1;
        let stride = usize::try_from(steps[0]).ok()?;
        (exact && pixels_follow && channels_follow && stride >= width * channels).then_some(Self {
            height,
            width,
            channels,
            stride,
            backwards,
        })
    }
}

/// The array of which this one is a view, and the offset in it, if its memory is contiguous.
fn window<'py, T: Element>(
    array: &Bound<'py, PyArrayDyn<T>>,
) -> Option<(Bound<'py, PyArrayDyn<T>>, usize, Layout)> {
    let layout = Layout::of(array)?;
    let owner = array.getattr(intern!(array.py(), "base")).ok()?;
    let owner = owner.cast_into::<PyArrayDyn<T>>().ok()?;
    if !(owner.is_contiguous() && owner.is_aligned() && array.is_aligned()) {
        return None;
    }
    let first = if layout.backwards { layout.channels - 1 } else { 0 } * size_of::<T>();
    let bytes = (array.data() as usize).checked_sub(first)?.checked_sub(owner.data() as usize)?;
    let needed = layout.stride * layout.height.checked_sub(1)? + layout.width * layout.channels;
    let start = bytes / size_of::<T>();
    (bytes % size_of::<T>() == 0 && start + needed <= owner.len()).then_some((owner, start, layout))
}

fn check_shape(shape: &[usize]) -> PyResult<()> {
    let advice = match *shape {
        [_, _] | [_, _, 1 | 3] => return Ok(()),
        [_, _, 4] => "; drop the fourth channel with frame[..., :3]",
        [3 | 1, _, _] => "; move the channels to the end with frame.transpose(1, 2, 0)",
        [_, _, _, _] => "; pass one frame at a time",
        _ => "",
    };
    Err(PyValueError::new_err(format!(
        "{EXPECTED}; this array has the shape {}{advice}",
        written(shape)
    )))
}

/// A shape in Python's notation.
fn written(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        all => format!("({})", all.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn kind(object: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(object.get_type().fully_qualified_name()?.to_string())
}

/// The pixels of a PIL image: grey and 16-bit grey unchanged, all else as RGB. `None` if it is not an image.
fn image_to_array<'py>(object: &Bound<'py, PyAny>) -> PyResult<Option<Bound<'py, PyUntypedArray>>> {
    let py = object.py();
    // If the object is a PIL image, PIL has been imported already.
    let modules = py.import(intern!(py, "sys"))?.getattr(intern!(py, "modules"))?;
    let Ok(pil) = modules.get_item(intern!(py, "PIL.Image")) else { return Ok(None) };
    if !object.is_instance(&pil.getattr(intern!(py, "Image"))?)? {
        return Ok(None);
    }
    let mode: String = object.getattr(intern!(py, "mode"))?.extract()?;
    let image = match mode.as_str() {
        "L" | "RGB" | "I;16" | "F" => object.clone(),
        "1" | "LA" | "La" => object.call_method1(intern!(py, "convert"), ("L",))?,
        "I" | "I;16B" | "I;16L" | "I;16N" => {
            return Err(PyValueError::new_err(format!(
                "the PIL image has the mode {mode}; pass numpy.asarray(image).astype(numpy.uint16) instead"
            )));
        }
        _ => object.call_method1(intern!(py, "convert"), ("RGB",))?,
    };
    let array = py.import(intern!(py, "numpy"))?.call_method1(intern!(py, "asarray"), (image,))?;
    Ok(Some(array.cast_into::<PyUntypedArray>()?))
}
