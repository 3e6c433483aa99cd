//! What a user should know of a source that goes on.

use serde::{Deserialize, Serialize};

/// What a user should know of a source whose frames can be read nevertheless.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Note {
    /// A live stream was lost and is opened again.
    #[error("the stream was lost: {reason}; it is opened again")]
    Lost {
        /// Why.
        reason: String,
    },
    /// A live stream is back.
    #[error("the stream is back{}", after(*failed))]
    Back {
        /// How often it was opened in vain before.
        failed: usize,
    },
    /// The decoder of a video reports an error, and goes on.
    #[error(
        "ffmpeg found damage in {name}, near frame {frame}: {message}; all frames that it can \
         decode are used"
    )]
    Damage {
        /// The video.
        name: String,
        /// About which frame the first message is.
        frame: usize,
        /// The first message.
        message: String,
    },
    /// Frames at the beginning of a video cannot be decoded, and do not count.
    #[error("{} at the beginning of {name} cannot be decoded: they do not count", number(*frames))]
    NoBeginning {
        /// The video.
        name: String,
        /// The number of frames.
        frames: usize,
    },
    /// Frames at the end of a video cannot be decoded, and do not count.
    #[error("{} at the end of {name} cannot be decoded: they do not count", number(*frames))]
    NoEnd {
        /// The video.
        name: String,
        /// The number of frames.
        frames: usize,
    },
    /// Later frames of a video have another size or format than the first one.
    #[error(
        "from frame {frame} on, the frames of {name} have another size or format; they are scaled \
         to the {} x {} pixels of the first one", size[0], size[1]
    )]
    Scaled {
        /// The video.
        name: String,
        /// The number of the first one of them.
        frame: usize,
        /// Width and height in pixels of the first frame of the video.
        size: [usize; 2],
    },
}

fn after(failed: usize) -> String {
    match failed {
        0 => String::new(),
        failed => format!(" after {failed} failed attempts"),
    }
}

fn number(frames: usize) -> String {
    match frames {
        1 => "1 frame".to_string(),
        frames => format!("{frames} frames"),
    }
}
