//! Patchlock for JavaScript: the tracker as WebAssembly, on one thread. It reads pixels and gives
//! boxes; it has no files, no clock and no network.
//!
//! The classes are those of the Rust library: a [`TrackerConfig`], perhaps with a [`Network`], and
//! a [`Tracker`]. Errors are thrown, with the messages of the library.

mod pixels;

use js_sys::{Array, Number, Reflect, Uint8Array, Uint8ClampedArray};
use patchlock::{BoundingBox, Error, Frame, NetworkError, Preset, Value};
use pixels::Pixels;
use wasm_bindgen::prelude::*;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("types.d.ts");

#[wasm_bindgen]
extern "C" {
    /// What a caller gives as a frame.
    #[wasm_bindgen(typescript_type = "Pixels")]
    pub type GivenPixels;
    /// What a caller gives as a box.
    #[wasm_bindgen(typescript_type = "Box")]
    pub type GivenBox;
    /// What a caller gives as the value of a setting.
    #[wasm_bindgen(typescript_type = "boolean | number | string")]
    pub type GivenValue;
    /// What a caller gets for a frame.
    #[wasm_bindgen(typescript_type = "Estimate")]
    pub type EstimateObject;
    /// The names of the presets.
    #[wasm_bindgen(typescript_type = "Preset[]")]
    pub type PresetNames;
}

/// The version of the package.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// The names of the presets, the default first.
#[wasm_bindgen]
pub fn presets() -> PresetNames {
    let names: Array = Preset::ALL.iter().map(|preset| JsValue::from(preset.name())).collect();
    JsValue::from(names).unchecked_into()
}

/// A network: PatchNet, or one of the user from its ONNX files: NanoTrack (a backbone and a head) or
/// VitTrack.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Network(patchlock::Network);

#[wasm_bindgen]
impl Network {
    /// PatchNet, our own network: it is in the module, and needs no file.
    pub fn patchnet() -> Network {
        Self(patchlock::Network::patchnet())
    }

    /// The network in these files, in any order.
    ///
    /// # Errors
    /// A file is damaged, above a limit or of no known family, or a part is missing.
    #[wasm_bindgen(js_name = fromFiles)]
    pub fn from_files(files: Vec<Uint8Array>) -> Result<Network, JsError> {
        let files: Vec<Vec<u8>> = files.iter().map(Uint8Array::to_vec).collect();
        let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
        patchlock::Network::from_bytes(&files).map(Self).map_err(|error| thrown(&error.into()))
    }

    /// The name, such as "NanoTrack v3".
    #[wasm_bindgen(getter)]
    pub fn name(&self) -> String {
        self.0.name().to_owned()
    }

    /// The SHA-256 of its files, in hexadecimal.
    #[wasm_bindgen(getter)]
    pub fn hash(&self) -> String {
        self.0.hash().to_owned()
    }
}

/// How a tracker works: a preset, and perhaps other settings and a network.
#[wasm_bindgen]
#[derive(Debug, Clone)]
pub struct TrackerConfig(patchlock::TrackerConfig);

#[wasm_bindgen]
impl TrackerConfig {
    /// The settings of a preset; without a name of the default, `robust`.
    ///
    /// # Errors
    /// No preset has this name.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(unchecked_optional_param_type = "Preset")] preset: Option<String>,
    ) -> Result<TrackerConfig, JsError> {
        let preset = preset.map_or(Ok(Preset::default()), |name| name.parse());
        preset.map(|preset: Preset| Self(preset.into())).map_err(|error| thrown(&error))
    }

    /// Changes a setting; the names are those of `patchlock config`.
    ///
    /// # Errors
    /// No setting has this name, the method does not use it, or the value is not allowed.
    pub fn set(&mut self, name: &str, value: &GivenValue) -> Result<(), JsError> {
        let value = setting(name, value)?;
        self.0.set(name, value).map_err(|error| thrown(&error))
    }

    /// Gives the tracker a network: the preset `network` needs one, `robust` uses it as a
    /// second tracker.
    #[wasm_bindgen(js_name = useNetwork)]
    pub fn use_network(&mut self, network: &Network) {
        self.0.network = Some(network.0.clone());
    }
}

/// Follows one target from frame to frame.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Tracker {
    tracker: patchlock::Tracker,
    pixels: Pixels,
}

#[wasm_bindgen]
impl Tracker {
    /// A tracker that follows the target in this box of this frame.
    ///
    /// # Errors
    /// The configuration, the frame or the box is not valid.
    pub fn start(
        config: &TrackerConfig,
        frame: &GivenPixels,
        bbox: &GivenBox,
    ) -> Result<Tracker, JsError> {
        let mut pixels = Pixels::default();
        let target = target(bbox)?;
        let frame = read(frame, &mut pixels)?;
        let tracker = patchlock::Tracker::start(config.0.clone(), &frame, target);
        Ok(Self { tracker: tracker.map_err(|error| thrown(&error))?, pixels })
    }

    /// Finds the target in the next frame, and learns from it.
    ///
    /// # Errors
    /// The frame is not valid or has another size than the first one; the tracker is unchanged.
    pub fn update(&mut self, frame: &GivenPixels) -> Result<EstimateObject, JsError> {
        let frame = read(frame, &mut self.pixels)?;
        object(self.tracker.update(&frame).map_err(|error| thrown(&error))?)
    }

    /// Starts again on a box of this frame, which may have another size.
    ///
    /// # Errors
    /// The frame or the box is not valid; the tracker is unchanged.
    pub fn restart(
        &mut self,
        frame: &GivenPixels,
        bbox: &GivenBox,
    ) -> Result<EstimateObject, JsError> {
        let target = target(bbox)?;
        let frame = read(frame, &mut self.pixels)?;
        object(self.tracker.restart(&frame, target).map_err(|error| thrown(&error))?)
    }

    /// What the tracker said of the latest frame.
    ///
    /// # Errors
    /// None.
    #[wasm_bindgen(getter)]
    pub fn estimate(&self) -> Result<EstimateObject, JsError> {
        object(self.tracker.estimate())
    }
}

/// The error that a caller catches.
fn thrown(error: &Error) -> JsError {
    let advice = match error {
        Error::Network(NetworkError::None | NetworkError::Other { .. }) => {
            " (give it one with useNetwork)"
        }
        Error::Network(NetworkError::Incomplete { .. }) => " (give the bytes of both files)",
        _ => "",
    };
    JsError::new(&format!("{error}{advice}"))
}

/// A field of an object; `what` names the object.
fn field(object: &JsValue, what: &str, name: &str) -> Result<JsValue, JsError> {
    if !object.is_object() {
        return Err(JsError::new(&format!("{what} is {}, not an object", shown(object))));
    }
    Reflect::get(object, &name.into())
        .map_err(|_| JsError::new(&format!("the field `{name}` of {what} cannot be read")))
}

fn number(object: &JsValue, what: &str, name: &str) -> Result<f64, JsError> {
    let value = field(object, what, name)?;
    value.as_f64().ok_or_else(|| {
        let given = shown(&value);
        JsError::new(&format!("the field `{name}` of {what} is {given}; it takes a number"))
    })
}

/// A value in an error message: a text, a number or a truth value as it is, of others the type.
fn shown(value: &JsValue) -> String {
    let number = || value.as_f64().map(|number| number.to_string());
    let truth = || value.as_bool().map(|truth| truth.to_string());
    let other = || format!("of the type {}", value.js_typeof().as_string().unwrap_or_default());
    value.as_string().or_else(number).or_else(truth).unwrap_or_else(other)
}

fn target(bbox: &JsValue) -> Result<BoundingBox, JsError> {
    let side = |name| number(bbox, "the box", name);
    Ok(BoundingBox { x: side("x")?, y: side("y")?, w: side("w")?, h: side("h")? })
}

fn setting(name: &str, value: &JsValue) -> Result<Value, JsError> {
    if let Some(number) = value.as_f64() {
        return Ok(match Number::is_safe_integer(value) {
            true => Value::Whole(number as i64),
            false => Value::Number(number),
        });
    }
    let other = value.as_bool().map(Value::Flag).or_else(|| value.as_string().map(Value::Word));
    other.ok_or_else(|| {
        let given = shown(value);
        JsError::new(&format!(
            "the setting `{name}` is {given}; it takes a boolean, number or string"
        ))
    })
}

fn read<'a>(given: &JsValue, pixels: &'a mut Pixels) -> Result<Frame<'a>, JsError> {
    let what = "the frame";
    let size = [number(given, what, "width")?, number(given, what, "height")?];
    let data = field(given, what, "data")?;
    let frame = if let Some(data) = data.dyn_ref::<Uint8ClampedArray>() {
        pixels.frame(size, data.length() as usize, |out| data.copy_to(out))
    } else if let Some(data) = data.dyn_ref::<Uint8Array>() {
        pixels.frame(size, data.length() as usize, |out| data.copy_to(out))
    } else {
        return Err(JsError::new(
            "the field `data` of the frame takes a Uint8ClampedArray or a Uint8Array",
        ));
    };
    frame.map_err(|error| thrown(&error))
}

fn object(estimate: &patchlock::Estimate) -> Result<EstimateObject, JsError> {
    let object = serde_wasm_bindgen::to_value(estimate);
    object.map(JsValue::unchecked_into).map_err(|error| JsError::new(&error.to_string()))
}
