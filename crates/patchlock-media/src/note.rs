//! What a user should know of a source that goes on.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What a user should know of a source whose frames can be read nevertheless.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Note {
    /// A live stream was lost and is opened again.
    Lost {
        /// Why.
        reason: String,
    },
    /// A live stream is back.
    Back {
        /// How often it was opened in vain before.
        failed: usize,
    },
    /// The decoder of a video reports an error, and goes on.
    Damage {
        /// The video.
        name: String,
        /// About which frame the first message is.
        frame: usize,
        /// The first message.
        message: String,
    },
    /// Frames at the beginning of a video cannot be decoded, and do not count.
    NoBeginning {
        /// The video.
        name: String,
        /// The number of frames.
        frames: usize,
    },
    /// Frames at the end of a video cannot be decoded, and do not count.
    NoEnd {
        /// The video.
        name: String,
        /// The number of frames.
        frames: usize,
    },
    /// Later frames of a video have another size or format than the first one.
    Scaled {
        /// The video.
        name: String,
        /// The number of the first one of them.
        frame: usize,
        /// Width and height in pixels of the first frame of the video.
        size: [usize; 2],
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |frames: usize| match frames {
            1 => "1 frame".to_string(),
            frames => format!("{frames} frames"),
        };
        match self {
            Self::Lost { reason } => write!(f, "the stream was lost: {reason}; it is opened again"),
            Self::Back { failed: 0 } => f.write_str("the stream is back"),
            Self::Back { failed } => write!(f, "the stream is back after {failed} failed attempts"),
            Self::Damage { name, frame, message } => write!(
                f,
                "ffmpeg found damage in {name}, near frame {frame}: {message}; all frames that it \
                 can decode are used"
            ),
            Self::NoBeginning { name, frames } => write!(
                f,
                "{} at the beginning of {name} cannot be decoded: they do not count",
                number(*frames)
            ),
            Self::NoEnd { name, frames } => write!(
                f,
                "{} at the end of {name} cannot be decoded: they do not count",
                number(*frames)
            ),
            Self::Scaled { name, frame, size: [width, height] } => write!(
                f,
                "from frame {frame} on, the frames of {name} have another size or format; they are \
                 scaled to the {width} x {height} pixels of the first one"
            ),
        }
    }
}
