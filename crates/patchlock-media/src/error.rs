//! Errors of reading and writing frames.

use std::io;

use serde::{Deserialize, Serialize};

use crate::image_file::EXTENSIONS;
use crate::limits::SizeLimitError;
use crate::live;
use crate::order::RangeError;

const CONVERT: &str = "convert the video to an MP4 with 8-bit 4:2:0 H.264 (yuv420p)";

/// An error of this crate. The message states what is wrong, with the value and what is allowed.
/// [`Error::advice`] is for users of any front end; what names an option is worded by the front end.
#[derive(Debug, thiserror::Error, Serialize, Deserialize)]
pub enum Error {
    /// The range of frames is invalid, or does not fit the source.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// There is no source of this name.
    #[error("there is no file or folder {}", if name.is_empty() { "\"\"" } else { name })]
    Missing {
        /// The name as given.
        name: String,
    },
    /// The source of this path is a pipe or a device, which may never end.
    #[error("{0} is a pipe or a device, not a file")]
    Endless(String),
    /// The source is an address, here without its password, of a protocol that is not known.
    #[error("{} is not an address that can be opened: only {}", .0, live::schemes())]
    Scheme(String),
    /// A live source that cannot be opened.
    #[error("cannot open {name}: {reason}")]
    NotLive {
        /// The source.
        name: String,
        /// Whether it is a camera of this machine.
        is_camera: bool,
        /// The reason, given by ffmpeg.
        reason: String,
    },
    /// A source of the network that is a list of addresses, as of HLS or DASH.
    #[error("{name} is a list of addresses ({format}), which are not opened")]
    AddressList {
        /// The address, without its password.
        name: String,
        /// The format of the list, as ffmpeg calls it: `hls` or `dash`.
        format: String,
    },
    /// A live source that has stopped, and did not come back if it may.
    #[error("{name} has stopped: {reason}")]
    Gone {
        /// The source.
        name: String,
        /// Why it stopped, and how often it was tried again.
        reason: String,
    },
    /// The source of this path is a playlist or another file that names files, which are not opened.
    #[error("{0} is a list of files or addresses, not a video; what it names is not opened")]
    Playlist(String),
    /// A folder has no images.
    #[error("no images in the folder {folder}")]
    NoImages {
        /// The folder.
        folder: String,
        /// The first of its subfolders that has images.
        inner: Option<String>,
    },
    /// No file matches a pattern or a glob.
    #[error("no {} {pattern}", if *is_glob { "image matches" } else { "file matches the pattern" })]
    NoMatch {
        /// The pattern.
        pattern: String,
        /// Whether it is a glob, as opposed to a pattern with a number, such as `img/%04d.jpg`.
        is_glob: bool,
    },
    /// The file of this name has no video.
    #[error("there is no video in {0}, only audio or other data")]
    NoVideo(String),
    /// The source has no frames.
    #[error("the source has no frames")]
    NoFrames,
    /// A frame has more pixels than [`crate::Limits::pixels`].
    #[error("cannot read {what}: {size}")]
    TooLarge {
        /// The source or frame.
        what: String,
        /// Its size and the limit.
        size: SizeLimitError,
    },
    /// The frames of a video have more pixels than [`crate::Limits::pixels`]; how many is unknown.
    #[error("cannot read {name}: its frames have more than the {limit} pixels that are accepted")]
    TooManyPixels {
        /// The source.
        name: String,
        /// The limit.
        limit: usize,
    },
    /// The source takes ffmpeg to read, which is not installed.
    #[error("{path} {reason}; reading it needs ffmpeg, which is not on the PATH")]
    FfmpegMissing {
        /// The source.
        path: String,
        /// Why ffmpeg is needed, with the path as the subject: `holds VP9 video`.
        reason: String,
    },
    /// A source cannot be opened or listed.
    #[error("cannot read {name}: {reason}")]
    Unreadable {
        /// The source.
        name: String,
        /// How its data are stored; `None` if that does not matter or is unknown.
        container: Option<Container>,
        /// The reason, given by a decoder or the operating system.
        reason: String,
    },
    /// An image file that is a frame cannot be read. [`Error::TooLarge`] is for one with too many
    /// pixels.
    #[error("cannot read frame {index}, {file}: {reason}")]
    Image {
        /// Index of the frame.
        index: usize,
        /// The file.
        file: String,
        /// The reason.
        reason: String,
    },
    /// A frame of a video cannot be read. Earlier frames are not affected.
    #[error("cannot {} frame {index} of {name}: {reason}", fault.verb())]
    Frame {
        /// Index of the frame.
        index: usize,
        /// The video.
        name: String,
        /// The kind of fault.
        fault: FrameFault,
        /// The reason, given by a decoder or the operating system.
        reason: String,
    },
    /// A decoder ended without a result.
    #[error(
        "the decoder failed at {}: the video data are damaged",
        after.map_or("the first frame".to_string(), |index| format!("the frame after {index}"))
    )]
    DecoderEnded {
        /// Index of the last frame that was decoded.
        after: Option<usize>,
    },
    /// A stream cannot be read to its end, which reverse order requires.
    #[error("cannot read {name} to its end, which reverse order needs: {reason}")]
    StreamEnd {
        /// The stream.
        name: String,
        /// The reason, given by a decoder or the operating system.
        reason: String,
    },
    /// A stream cannot be copied to a temporary file, which reverse order requires.
    #[error(
        "cannot copy {name} to a temporary file in {folder}, which reverse order needs: {reason}"
    )]
    StreamCopy {
        /// The stream.
        name: String,
        /// The folder of temporary files.
        folder: String,
        /// The error of the operating system.
        reason: String,
    },
    /// A video cannot be written. The caller knows the name of the file.
    #[error(transparent)]
    #[serde(skip)]
    Write(#[from] io::Error),
    /// A frame cannot be encoded.
    #[error("{0}")]
    Encode(String),
}

/// How the data of a source are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Container {
    /// Uncompressed video, with a header in text.
    Y4m,
    /// MP4 or QuickTime.
    Mp4,
    /// Any other video, which ffmpeg decodes.
    Other,
}

impl Container {
    /// What the user can do about a source in this container that cannot be opened.
    fn advice(self) -> &'static str {
        match self {
            Self::Y4m => {
                "this writes a supported stream: ffmpeg -i IN -f yuv4mpegpipe -pix_fmt yuv420p -"
            }
            Self::Mp4 => "the file may be truncated or still being written: copy it again",
            Self::Other => CONVERT,
        }
    }
}

/// Why a frame of a video cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FrameFault {
    /// The data end early, or cannot be read from here on.
    Unreadable,
    /// The data of this frame are damaged; later ones may be readable.
    Damaged,
    /// The video uses a coding tool that the decoder does not support.
    Unsupported,
}

impl FrameFault {
    /// What cannot be done with the frame.
    fn verb(self) -> &'static str {
        match self {
            Self::Unreadable => "read",
            Self::Damaged | Self::Unsupported => "decode",
        }
    }
}

impl Error {
    /// Why a live source needs ffmpeg, with its address as the subject.
    pub(crate) const LIVE: &str = "is a live source";

    /// Whether the request was invalid (a usage error), as opposed to a failure while serving it.
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::Range(_))
    }

    /// What the user can do, whichever front end is used; `None` if that depends on the front end,
    /// or nothing helps.
    pub fn advice(&self) -> Option<String> {
        let advice = match self {
            Self::Range(error) => return error.advice(),
            Self::NoImages { inner: Some(inner), .. } => {
                return Some(format!("the folder {inner} has images: name that folder instead"));
            }
            Self::NoImages { inner: None, .. } => {
                return Some(format!("the image formats are {}", EXTENSIONS.join(", ")));
            }
            Self::NoMatch { is_glob: true, .. } => "check the folder and the extension",
            Self::NoMatch { is_glob: false, .. } => {
                "%d stands for a number, %04d for one padded to four digits"
            }
            Self::NoVideo(_) => "name a file with a video",
            Self::Playlist(_) => {
                "name the video itself; ffmpeg -i LIST OUT.mp4 makes one of a list that you trust"
            }
            Self::FfmpegMissing { reason, .. } if reason == Self::LIVE => "install ffmpeg",
            Self::FfmpegMissing { .. } => {
                return Some(format!("install ffmpeg, or {CONVERT} elsewhere"));
            }
            Self::Unreadable { container: Some(container), .. } => container.advice(),
            Self::Image { .. } => "replace or remove that file",
            Self::Frame { fault: FrameFault::Unreadable | FrameFault::Damaged, .. } => {
                "the frames before it can be used"
            }
            Self::Frame { fault: FrameFault::Unsupported, .. } | Self::DecoderEnded { .. } => {
                CONVERT
            }
            Self::Scheme(_) => "name a file by its path, without file://",
            Self::NotLive { is_camera: true, .. } => {
                "check that the camera is connected, that no other program uses it, and that you may \
                 read it; on Linux, cameras are /dev/video0, /dev/video1 and so on"
            }
            Self::NotLive { is_camera: false, .. } => {
                "check the address, with user and password if it needs them: ffplay ADDRESS shows what \
                 works"
            }
            Self::AddressList { .. } => {
                "ffmpeg opens the addresses of a list that you trust: ffmpeg -i ADDRESS OUT.mp4"
            }
            Self::Gone { .. } => "the frames before it can be used",
            Self::StreamCopy { .. } => {
                "make room there, or set TMPDIR to a folder with room for the uncompressed video"
            }
            Self::Missing { .. }
            | Self::Endless(_)
            | Self::NoFrames
            | Self::TooLarge { .. }
            | Self::TooManyPixels { .. }
            | Self::Unreadable { container: None, .. }
            | Self::StreamEnd { .. }
            | Self::Write(_)
            | Self::Encode(_) => return None,
        };
        Some(advice.to_string())
    }

    /// [`Error::Unreadable`] of a source whose container does not matter.
    pub(crate) fn unreadable(name: impl ToString, reason: impl ToString) -> Self {
        Self::Unreadable { name: name.to_string(), container: None, reason: reason.to_string() }
    }

    /// [`Error::Unreadable`] of a source in this container.
    pub(crate) fn unreadable_in(
        container: Container,
        name: impl ToString,
        reason: impl ToString,
    ) -> Self {
        let (name, reason) = (name.to_string(), reason.to_string());
        Self::Unreadable { name, container: Some(container), reason }
    }
}

/// The cause of an error of the `tempfile` crate, without the path that the crate appends: users
/// know the file under another name. `None` for other errors.
pub fn without_path(error: &io::Error) -> Option<io::Error> {
    error.get_ref()?;
    let text = error.to_string();
    let (cause, _) = text.split_once(" at path \"")?;
    Some(io::Error::new(error.kind(), cause))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_temporary_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let error = tempfile::NamedTempFile::new_in(folder.path().join("there")).unwrap_err();
        assert!(error.to_string().contains("at path"), "{error}");
        assert!(!without_path(&error).unwrap().to_string().contains("at path"));
        assert!(without_path(&io::Error::other("words")).is_none());
    }
}
