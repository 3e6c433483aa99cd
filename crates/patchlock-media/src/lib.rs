//! Frames in, frames out: what the program, the benchmark and the Python package read and write as pictures.
//!
//! [`open`] makes a [`FrameSource`] of what the user names: a folder of images, a pattern, a glob, an MP4 or
//! Y4M file, Y4M on standard input, or any other video by way of ffmpeg. [`Order`] says which of its frames
//! are used, and [`Ahead`] decodes them on a thread of its own. A decoded frame is a [`Picture`].
//! [`Mp4Writer`] writes frames as a video, and [`image_file`] reads a single image.
//!
//! Nothing here prints, reads the clock or ends the process, and nothing listens for Ctrl-C: a caller that
//! may be interrupted tells [`Ahead::next_unless`] so.

mod ahead;
pub mod colour;
mod error;
mod ffmpeg;
mod h264_sps;
pub mod image_file;
mod image_sequence;
mod mp4_reader;
mod mp4_writer;
pub mod natural_order;
mod order;
mod picture;
mod source;
mod y4m;

pub use ahead::{Ahead, Next};
pub use error::{Error, without_path};
pub use mp4_writer::Mp4Writer;
pub use order::Order;
pub use picture::{Picture, Pixels};
pub use source::{FrameRate, FrameSource, open};
