//! The frames of an animated WebP. Each is drawn on the one before it, so they are decoded from the
//! first one on.

use std::io::Cursor;
use std::path::Path;

use image_webp::WebPDecoder;

use crate::image_file::{LoadError, Source};
use crate::limits::{self, Limits};
use crate::{Error, FrameRate, FrameSource, Picture, SourceInfo, image_parts, plain_file};

/// Whether a file with these first bytes is an animated WebP.
pub fn is_animated(head: &[u8]) -> bool {
    let has_canvas = head.starts_with(b"RIFF") && head.get(8..16) == Some(b"WEBPVP8X");
    has_canvas && head.get(20).is_some_and(|flags| flags & 2 != 0)
}

/// An animated WebP.
pub struct WebpAnimation {
    decoder: WebPDecoder<Source<'static>>,
    name: String,
    next: usize,
    /// When the next frame is shown, in milliseconds.
    time: u64,
}

impl WebpAnimation {
    /// Reads a file.
    pub fn open(path: &Path, limits: Limits) -> Result<Self, Error> {
        let most = limits::image_bytes(limits.pixels as u64);
        let read = || -> Result<_, LoadError> {
            let bytes = plain_file::open(path)?.read(most)?;
            image_parts::check(&bytes, Some(image::ImageFormat::WebP))?;
            let source: Source = Box::new(Cursor::new(bytes));
            let mut decoder = WebPDecoder::new(source).map_err(damaged)?;
            let (width, height) = decoder.dimensions();
            limits.check(width as usize, height as usize)?;
            decoder.set_memory_limit(usize::try_from(most).unwrap_or(usize::MAX));
            Ok(decoder)
        };
        let name = path.display().to_string();
        let decoder = read().map_err(|error| match error {
            LoadError::TooLarge(size) => Error::TooLarge { what: name.clone(), size },
            error => Error::unreadable(&name, error),
        })?;
        Ok(Self { decoder, name, next: 0, time: 0 })
    }

    fn read(&mut self, index: usize) -> Result<Picture, LoadError> {
        if index < self.next {
            self.decoder.reset_animation();
            (self.next, self.time) = (0, 0);
        }
        let (width, height) = self.decoder.dimensions();
        let bytes = self.decoder.output_buffer_size().ok_or(LoadError::Cut)?;
        let mut pixels = vec![0; bytes];
        let mut begin = self.time;
        while self.next <= index {
            begin = self.time;
            self.time += u64::from(self.decoder.read_frame(&mut pixels).map_err(damaged)?);
            self.next += 1;
        }
        if self.decoder.has_alpha() {
            pixels =
                pixels.as_chunks::<4>().0.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
        }
        let picture = Picture::rgb(width as usize, height as usize, pixels);
        Ok(picture.at(Some(begin as f64 / 1000.0)))
    }
}

fn damaged(error: image_webp::DecodingError) -> LoadError {
    std::io::Error::new(std::io::ErrorKind::InvalidData, error).into()
}

impl FrameSource for WebpAnimation {
    fn info(&self) -> SourceInfo {
        let frames = self.decoder.num_frames();
        let milliseconds = u32::try_from(self.decoder.loop_duration()).ok();
        // The average.
        let rate = frames.checked_mul(1000).zip(milliseconds);
        let rate = rate.and_then(|(frames, time)| FrameRate::new(frames, time));
        SourceInfo { length: Some(frames as usize), rate, sound: false }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if index >= self.decoder.num_frames() as usize {
            return Ok(None);
        }
        self.read(index).map(Some).map_err(|error| {
            let (file, reason) = (self.name.clone(), error.to_string());
            Error::Image { index, file, reason }
        })
    }
}
