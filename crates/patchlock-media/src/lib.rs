//! Reads and writes video and images for the command-line program, the benchmark and the Python
//! package.
//!
//! [`open`] returns a [`FrameSource`] for whatever the user names: a folder of images, a printf
//! pattern, a glob, an MP4 or Y4M file, Y4M on standard input, or any other video through ffmpeg.
//! [`Order`] selects the frames to use, and [`Prefetcher`] decodes them on a separate thread. A decoded
//! frame is a [`Picture`]. [`Mp4Writer`] writes frames as a video, and [`image_file`] reads single
//! images.
//!
//! [`live`] opens cameras and streams. Nothing but the name that a user has typed leads there: [`open`]
//! reads files only.
//!
//! Files are not trusted: [`Limits`] says what they may claim, and a decoder that fails on damaged
//! data gives an [`Error`].
//!
//! Where [`Limits::helper`] names a program for it, [`open_within`] leaves the decoders to that one,
//! which the system keeps to the file of its frames.
//!
//! This crate does not print, read the clock, end the process or handle Ctrl-C. A caller that can
//! be interrupted passes a check to [`Prefetcher::next_unless`].

mod child;
pub mod colour;
mod confine;
mod error;
mod external_encoder;
#[cfg(all(test, target_os = "linux"))]
#[path = "../tests/support/fake_ffmpeg.rs"]
mod fake_ffmpeg;
mod feed;
mod ffmpeg;
mod find;
mod guard;
mod h264;
pub mod image_file;
mod image_parts;
mod image_sequence;
pub mod jpeg;
mod limits;
pub mod live;
mod mp4_edits;
mod mp4_index;
mod mp4_reader;
mod mp4_writer;
pub mod natural_order;
mod note;
mod open;
mod order;
mod orientation;
mod picture;
pub mod plain_file;
mod playlist;
mod prefetch;
mod sandbox;
mod source;
mod tiff_pages;
mod webp_animation;
mod y4m;

pub use child::stop_decoders;
pub use error::{Container, Error, FrameFault, without_path};
pub use feed::Feed;
pub use guard::{DecoderPanic, silence_decoders};
pub use limits::{Limits, MOST_FRAMES, SizeLimitError};
pub use mp4_writer::Mp4Writer;
pub use note::Note;
#[doc(hidden)]
pub use open::open_by;
pub use open::{files_of, open, open_within};
pub use order::{Order, RangeError};
pub use picture::{Picture, Pixels};
pub use prefetch::{NextFrame, Prefetcher};
pub use sandbox::Helper;
#[cfg(target_os = "linux")]
pub use sandbox::serve::serve;
pub use source::{FrameRate, FrameSource, SourceInfo};

/// Y4M from any reader, as [`open`] reads standard input. Only for fuzzing, and no part of the
/// public interface.
///
/// # Errors
/// As [`open`].
#[doc(hidden)]
pub fn open_y4m(
    input: impl std::io::Read + Send + 'static,
    reverse: bool,
) -> Result<Box<dyn FrameSource>, Error> {
    y4m::open_stream(input, "the stream", reverse, Limits::default())
}
