//! What can go wrong, said so that the caller knows what to change.

/// Every error of the library. Each names what was wrong, the value that was given and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field of the configuration is outside its range.
    #[error("configuration field `{field}` is {value}; allowed: {allowed}")]
    Config {
        /// The field's name in [`TrackerConfig`](crate::TrackerConfig).
        field: &'static str,
        /// The value that was given.
        value: String,
        /// The values that are allowed.
        allowed: String,
    },
    /// No preset has this name.
    #[error("unknown preset `{name}`; there are: {known}")]
    UnknownPreset {
        /// The name that was given.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The instructions that the environment asks for do not exist, or not on this processor.
    #[error(
        "the environment variable `{variable}` is `{value}`; allowed on this processor: {allowed}. Unset it to use the fastest"
    )]
    Instructions {
        /// The variable's name.
        variable: &'static str,
        /// What it holds.
        value: String,
        /// What it may hold.
        allowed: String,
    },
    /// The pixels do not form a frame.
    #[error("not a frame: {0}")]
    Frame(String),
    /// The box is not one: a size or position is not finite, or a side is shorter than one pixel.
    #[error(
        "the box has x {x}, y {y}, width {w}, height {h}; all must be finite, width and height at least 1 pixel and at most {max}"
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
        /// The longest side that is accepted, in pixels.
        max: f64,
    },
    /// The box does not touch the frame.
    #[error(
        "the box x {x}, y {y}, width {w}, height {h} lies outside the frame of {width}x{height} pixels; it must cover a part of it"
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
    /// A frame has another size than the one that tracking began on.
    #[error(
        "the frame is {width}x{height} pixels, but tracking began on {expected_width}x{expected_height}; give frames of one size, or begin again with `init`"
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
    /// `update` was called before `init`.
    #[error("the tracker has no target yet: call `init` with a frame and a box first")]
    NotInitialised,
    /// No target has this id.
    #[error("there is no target {id}; there is: {}", if known.is_empty() { "none" } else { known })]
    UnknownTarget {
        /// The id that was given.
        id: u64,
        /// The ids that there are.
        known: String,
    },
    /// A saved state does not fit together.
    #[error("the saved state can't be used: {0}")]
    Snapshot(String),
}

/// The error for a saved state that cannot be used for this reason.
pub(crate) fn snapshot(reason: impl Into<String>) -> Error {
    Error::Snapshot(reason.into())
}
