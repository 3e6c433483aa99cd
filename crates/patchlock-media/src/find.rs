//! What a name leads to: a source that this crate reads, or a file for ffmpeg.

use std::ffi::OsStr;
use std::path::Path;

use image::ImageFormat;

use crate::image_sequence::{ImageSequence, Pattern};
use crate::limits::Limits;
use crate::mp4_reader::{self, Mp4};
use crate::plain_file::{self, is_endless};
use crate::playlist::{self, is_playlist};
use crate::webp_animation::{self, WebpAnimation};
use crate::{
    Error, FrameFault, FrameSource, Note, Picture, SourceInfo, ffmpeg, guard, image_file,
    image_parts, y4m,
};

/// What a name leads to.
pub enum OpenedSource<S = Box<dyn FrameSource>> {
    /// A source that this crate reads.
    Source(S),
    /// A file for ffmpeg.
    ForFfmpeg {
        /// Why it is needed, with the file as the subject.
        reason: String,
        /// When each frame is shown, in millionths of a second, if the file tells.
        times: Option<Vec<i64>>,
    },
}

impl OpenedSource {
    pub fn source(source: impl FrameSource + 'static) -> Self {
        Self::Source(Box::new(source))
    }
}

/// Opens what this crate reads, with decoders that may panic. Announced frames of it may be decoded by
/// `program`.
pub fn find_guarded(
    name: &OsStr,
    reverse: bool,
    limits: Limits,
    program: Option<ffmpeg::Program>,
) -> Result<OpenedSource, Error> {
    let shown = name.display().to_string();
    let found = guard::decoding(|| find(name, reverse, limits, program));
    match found.map_err(|panic| Error::unreadable(&shown, panic))?? {
        OpenedSource::Source(source) => {
            Ok(OpenedSource::source(PanicGuard { source, name: shown }))
        }
        found => Ok(found),
    }
}

fn find(
    name: &OsStr,
    reverse: bool,
    limits: Limits,
    program: Option<ffmpeg::Program>,
) -> Result<OpenedSource, Error> {
    if name == "-" {
        let input = std::io::stdin();
        let stream = y4m::open_stream(input, "standard input", reverse, limits);
        return stream.map(OpenedSource::Source);
    }
    let path = Path::new(name);
    // An existing file or folder takes precedence over a pattern or glob of the same name.
    if path.is_dir() {
        return Ok(OpenedSource::source(ImageSequence::folder(path)?.within(limits)));
    }
    if path.exists() {
        return find_file(path, reverse, limits, program);
    }
    match images_of(name) {
        Some(images) => Ok(OpenedSource::source(images?.within(limits))),
        None => Err(Error::Missing { name: name.display().to_string() }),
    }
}

/// Bytes of a PNG in which an animation says that it is one.
const PNG_HEAD: u64 = 1 << 16;

fn find_file(
    path: &Path,
    reverse: bool,
    limits: Limits,
    program: Option<ffmpeg::Program>,
) -> Result<OpenedSource, Error> {
    let others = |reason: &str, times| {
        let reason = reason.to_string();
        Ok(OpenedSource::ForFfmpeg { reason, times })
    };
    let cannot = |error: &dyn std::fmt::Display| Error::unreadable(path.display(), error);
    let mut plain = plain_file::open(path).map_err(|error| match is_endless(&error) {
        true => Error::Endless(path.display().to_string()),
        false => cannot(&error),
    })?;
    let head = plain.read(playlist::HEAD as u64).map_err(|error| cannot(&error))?;
    if head.is_empty() {
        return Err(cannot(&"the file is empty"));
    }
    if head.starts_with(y4m::MAGIC) {
        return Ok(OpenedSource::source(y4m::Y4mFile::open(path, limits)?));
    }
    if webp_animation::is_animated(&head) {
        return Ok(OpenedSource::source(WebpAnimation::open(path, limits)?));
    }
    if image_file::is_image(path) {
        let more = plain.read(PNG_HEAD).map_err(|error| cannot(&error))?;
        if image_parts::pictures(&[head, more].concat(), Some(ImageFormat::Png)) > 1 {
            return others("is an animated PNG", None);
        }
        return Ok(OpenedSource::source(ImageSequence::single(path)?.within(limits)));
    }
    if is_playlist(&head) {
        return Err(Error::Playlist(path.display().to_string()));
    }
    if !mp4_reader::looks_like_mp4(&head) {
        return others("is not an image, MP4 or Y4M file", None);
    }
    match Mp4::open(path, reverse, limits, program) {
        Ok(video) => Ok(OpenedSource::source(video)),
        Err(mp4_reader::OpenError::Codec(codec)) => {
            let times = mp4_reader::frame_times(path);
            others(&format!("holds {codec}"), times)
        }
        Err(mp4_reader::OpenError::Broken(error)) => Err(error),
    }
}

/// The images that match a pattern or a glob; `None` if the name is neither.
pub fn images_of(name: &OsStr) -> Option<Result<ImageSequence, Error>> {
    if let Some(pattern) = Pattern::parse(Path::new(name)) {
        return Some(ImageSequence::pattern(&name.display().to_string(), &pattern));
    }
    let glob = name.to_str().filter(|name| name.contains(['*', '?', '[']))?;
    Some(ImageSequence::glob(glob))
}

/// Opens a source whose decoder may panic.
pub fn guarded(
    name: &OsStr,
    open: impl FnOnce() -> Result<Box<dyn FrameSource>, Error>,
) -> Result<Box<dyn FrameSource>, Error> {
    let name = name.display().to_string();
    let source = guard::decoding(open).map_err(|panic| Error::unreadable(&name, panic))??;
    Ok(Box::new(PanicGuard { source, name }))
}

/// A source whose decoder may panic.
struct PanicGuard {
    source: Box<dyn FrameSource>,
    name: String,
}

impl FrameSource for PanicGuard {
    fn info(&self) -> SourceInfo {
        self.source.info()
    }

    fn notes(&mut self) -> Vec<Note> {
        self.source.notes()
    }

    fn count(&mut self) -> Result<usize, Error> {
        guard::decoding(|| self.source.count()).unwrap_or_else(|panic| {
            let reason = format!("its frames cannot be counted: {panic}");
            Err(Error::unreadable(&self.name, reason))
        })
    }

    fn announce(&mut self, first: usize, span: usize) {
        self.source.announce(first, span);
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        guard::decoding(|| self.source.frame(index)).unwrap_or_else(|panic| {
            let (name, fault) = (self.name.clone(), FrameFault::Unreadable);
            Err(Error::Frame { index, name, fault, reason: panic.to_string() })
        })
    }
}
