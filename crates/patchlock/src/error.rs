//! The errors of the library. Their messages tell the caller what to change.

use crate::network_error::NetworkError;
use crate::value::Kind;

/// Any error of the library. Its message states what was wrong, the given value and what is
/// allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting is outside its range.
    #[error("the setting `{field}` is {value}; allowed: {allowed}")]
    Config {
        /// The setting's name.
        field: &'static str,
        /// The value that was given.
        value: String,
        /// The allowed values.
        allowed: String,
    },
    /// No setting has this name.
    #[error("unknown setting `{name}`")]
    UnknownSetting {
        /// The name that was given.
        name: String,
    },
    /// The setting belongs to another method.
    #[error(
        "the setting `{name}` has no effect with the method `{method}`; it belongs to `{owner}`"
    )]
    UnusedSetting {
        /// The setting.
        name: &'static str,
        /// The method of the configuration.
        method: &'static str,
        /// The method that uses the setting.
        owner: &'static str,
    },
    /// The value of a setting is of the wrong kind.
    #[error("the setting `{name}` is {value}; it takes {kind}")]
    SettingKind {
        /// The setting.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// The kind of value that it takes.
        kind: Kind,
    },
    /// No preset has this name.
    #[error("unknown preset `{name}`; there are: {known}")]
    UnknownPreset {
        /// The name that was given.
        name: String,
        /// The existing names.
        known: String,
    },
    /// The environment variable names instructions that are unknown or that this processor does not
    /// support.
    #[error(
        "the environment variable `{variable}` is `{value}`; allowed on this processor: {allowed}. \
         Unset it to use the fastest"
    )]
    Instructions {
        /// The variable's name.
        variable: &'static str,
        /// The variable's value.
        value: String,
        /// The allowed values.
        allowed: String,
    },
    /// The pixels do not form a frame.
    #[error("not a frame: {0}")]
    Frame(String),
    /// The box is invalid: a number is not finite, or a side is shorter than one pixel or too long.
    #[error(
        "the box has x {x}, y {y}, width {w}, height {h}; all must be finite, \
         width and height at least 1 pixel and at most {max}"
    )]
    BoxShape {
        /// Left edge in pixels.
        x: f64,
        /// Top edge in pixels.
        y: f64,
        /// Width in pixels.
        w: f64,
        /// Height in pixels.
        h: f64,
        /// The maximum length of a side, in pixels.
        max: f64,
    },
    /// The box and the frame do not overlap.
    #[error(
        "the box x {x}, y {y}, width {w}, height {h} lies outside the frame of {width}x{height} \
         pixels; it must cover a part of it"
    )]
    BoxOutside {
        /// Left edge in pixels.
        x: f64,
        /// Top edge in pixels.
        y: f64,
        /// Width in pixels.
        w: f64,
        /// Height in pixels.
        h: f64,
        /// The frame's width in pixels.
        width: usize,
        /// The frame's height in pixels.
        height: usize,
    },
    /// The box is too small for the method `paper`.
    #[error(
        "the box of {w}x{h} pixels is too small for the method `paper`, which compares patches of \
         it and would take seconds for a frame; its area must be at least {least} pixels. Take \
         another preset"
    )]
    BoxTooSmall {
        /// Width in pixels.
        w: f64,
        /// Height in pixels.
        h: f64,
        /// The smallest area, in pixels.
        least: f64,
    },
    /// The size of a frame differs from that of the frame on which tracking began.
    #[error(
        "the frame is {width}x{height} pixels, but tracking began on {expected_width}x{expected_height}; \
         give frames of one size, or start a new tracker"
    )]
    FrameSize {
        /// Width of the frame that was given.
        width: usize,
        /// Height of the frame that was given.
        height: usize,
        /// Width of the first frame.
        expected_width: usize,
        /// Height of the first frame.
        expected_height: usize,
    },
    /// No target has this id.
    #[error("unknown target {id}; known: {}", if known.is_empty() { "none" } else { known })]
    UnknownTarget {
        /// The id that was given.
        id: u64,
        /// The ids of the existing targets.
        known: String,
    },
    /// A network cannot be used.
    #[error("the network can't be used: {0}")]
    Network(#[from] NetworkError),
    /// A saved state is damaged or inconsistent.
    #[error("the saved state can't be used: {0}")]
    Snapshot(String),
}

/// The error for a saved state that cannot be used for this reason.
pub(crate) fn snapshot(reason: impl Into<String>) -> Error {
    Error::Snapshot(reason.into())
}
