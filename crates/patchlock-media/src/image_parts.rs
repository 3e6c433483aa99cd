//! Checks what an image file holds within: decoders compare only the outer size with the limits.
//!
//! A TIFF is made of strips or tiles, each of which may be a JPEG with a size of its own. A WebP
//! has a canvas and pictures on it. The checks read headers alone.

use std::io::{Cursor, Read, Seek, SeekFrom};

use image::ImageFormat;
use image::error::{DecodingError, ImageError};
use tiff::TiffError;
use tiff::decoder::{ChunkType, Decoder};
use tiff::tags::{CompressionMethod, Tag};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;

use crate::image_file::{LoadError, Source};

/// Checks the parts of an image whose outer size is within the limits.
pub fn check(bytes: &[u8], format: Option<ImageFormat>) -> Result<(), LoadError> {
    match format {
        Some(ImageFormat::Tiff) => check_tiff(Box::new(Cursor::new(bytes)), bytes.len() as u64),
        Some(ImageFormat::WebP) => check_webp(bytes),
        _ => Ok(()),
    }
}

/// How many pictures an animation shows one after the other, as far as these bytes tell; 1 for other
/// images.
pub fn pictures(bytes: &[u8], format: Option<ImageFormat>) -> usize {
    match format {
        Some(ImageFormat::WebP) => {
            let chunks = Chunks { bytes, at: WEBP_HEADER };
            chunks.filter(|(kind, _)| *kind == b"ANMF").count().max(1)
        }
        // A signature, and the header of 25 bytes; the chunk comes before the data.
        Some(ImageFormat::Png) if bytes.starts_with(b"\x89PNG") => {
            let data = bytes.windows(4).position(|kind| kind == b"IDAT").unwrap_or(bytes.len());
            let control = bytes[..data].windows(4).position(|kind| kind == b"acTL");
            let count = control.and_then(|at| bytes.get(at + 4..at + 8));
            count.map_or(1, |count| count.iter().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
        }
        _ => 1,
    }
}

/// Pixels that the tiles of a small TIFF may have together.
const TILED_PIXELS: usize = 1 << 20;

/// Checks the first page of a TIFF of this many bytes.
pub fn check_tiff(source: Source, file: u64) -> Result<(), LoadError> {
    let damaged = |error: TiffError| {
        LoadError::Damaged(ImageError::Decoding(DecodingError::new(
            ImageFormat::Tiff.into(),
            error,
        )))
    };
    let mut tiff = Decoder::new(source).map_err(damaged)?;
    let image = sides(tiff.dimensions().map_err(damaged)?);
    let is_tiled = tiff.get_chunk_type() == ChunkType::Tile;
    let place = sides(tiff.chunk_dimensions());
    // A single strip may claim any number of rows.
    let place = if is_tiled { place } else { (place.0, place.1.min(image.1)) };
    let padded = |whole: usize, part: usize| whole.next_multiple_of(part.max(1));
    let tiled = padded(image.0, place.0).saturating_mul(padded(image.1, place.1));
    if tiled > image.0.saturating_mul(image.1).saturating_mul(4).max(TILED_PIXELS) {
        return Err(LoadError::Parts(format!(
            "its tiles of {} x {} pixels are far larger than the image of {} x {}",
            place.0, place.1, image.0, image.1
        )));
    }
    let compression = tiff.find_tag_unsigned::<u16>(Tag::Compression).map_err(damaged)?;
    if compression.map(CompressionMethod::from_u16_exhaustive)
        != Some(CompressionMethod::ModernJPEG)
    {
        return Ok(());
    }
    let tables = tiff.find_tag(Tag::JPEGTables).map_err(damaged)?;
    let tables = tables.map(|value| value.into_u8_vec()).transpose().map_err(damaged)?;
    let (offsets, counts) = match is_tiled {
        true => (Tag::TileOffsets, Tag::TileByteCounts),
        false => (Tag::StripOffsets, Tag::StripByteCounts),
    };
    let offsets = tiff.get_tag_u64_vec(offsets).map_err(damaged)?;
    let counts = tiff.get_tag_u64_vec(counts).map_err(damaged)?;
    let parts = counts.iter().fold(0, |sum: u64, count| sum.saturating_add(*count));
    if parts > file {
        return Err(LoadError::Parts(format!(
            "its parts share their bytes: they have {parts} bytes together, the file has {file}"
        )));
    }
    let source = tiff.inner();
    for (offset, count) in offsets.into_iter().zip(counts) {
        let mut part = Vec::new();
        source.seek(SeekFrom::Start(offset))?;
        source.take(count).read_to_end(&mut part)?;
        // The decoder refuses what is not there.
        if part.len() as u64 == count {
            check_jpeg(part, tables.as_deref(), place)?;
        }
    }
    Ok(())
}

/// Checks a JPEG that is a strip or a tile. The tables of all are put before it, without the
/// markers between the two, as the decoder does.
fn check_jpeg(
    part: Vec<u8>,
    tables: Option<&[u8]>,
    place: (usize, usize),
) -> Result<(), LoadError> {
    let joined = tables.and_then(|tables| {
        Some([tables.get(..tables.len().checked_sub(2)?)?, part.get(2..)?].concat())
    });
    let mut jpeg = JpegDecoder::new(ZCursor::new(joined.unwrap_or(part)));
    // The decoder fails at headers that cannot be read.
    let size = jpeg.decode_headers().ok().and_then(|()| jpeg.dimensions());
    // Encoders fill the last strip up to whole blocks.
    let whole_blocks = (place.0, place.1.next_multiple_of(16));
    size.map_or(Ok(()), |part| fits(part, whole_blocks, place))
}

fn fits(
    part: (usize, usize),
    most: (usize, usize),
    place: (usize, usize),
) -> Result<(), LoadError> {
    match part.0 <= most.0 && part.1 <= most.1 {
        true => Ok(()),
        false => Err(LoadError::Parts(format!(
            "it holds a picture of {} x {} pixels where there is place for {} x {}",
            part.0, part.1, place.0, place.1
        ))),
    }
}

/// The bytes before the first chunk of a WebP.
const WEBP_HEADER: usize = 12;
/// The bytes of an animated frame before its chunks.
const ANIMATED_HEADER: usize = 16;

/// Checks that no picture of a WebP is larger than its canvas. Without a canvas there is one
/// picture, whose size is that of the image.
fn check_webp(bytes: &[u8]) -> Result<(), LoadError> {
    let mut chunks = Chunks { bytes, at: WEBP_HEADER };
    let Some((b"VP8X", header)) = chunks.next() else { return Ok(()) };
    let side = |at: usize| Some(1 + le(header.get(at..at + 3)?));
    let Some(canvas) = side(4).zip(side(7)) else { return Ok(()) };
    for (kind, content) in chunks {
        check_picture(kind, content, canvas)?;
        if kind == b"ANMF" {
            for (kind, content) in (Chunks { bytes: content, at: ANIMATED_HEADER }) {
                check_picture(kind, content, canvas)?;
            }
        }
    }
    Ok(())
}

fn check_picture(kind: &[u8], content: &[u8], canvas: (usize, usize)) -> Result<(), LoadError> {
    let size = match kind {
        b"VP8 " => {
            content.get(6..10).map(|size| (le(&size[..2]) & 0x3fff, le(&size[2..]) & 0x3fff))
        }
        b"VP8L" => content.get(1..5).map(le).map(|both| {
            let side = |bits: usize| (bits & 0x3fff) + 1;
            (side(both), side(both >> 14))
        }),
        _ => None,
    };
    size.map_or(Ok(()), |part| fits(part, canvas, canvas))
}

/// The chunks of a WebP: four letters, a length, and so many bytes, or as many as there are.
struct Chunks<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Iterator for Chunks<'a> {
    type Item = (&'a [u8; 4], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.bytes.get(self.at..)?;
        let (kind, rest) = rest.split_first_chunk()?;
        let (length, rest) = rest.split_at_checked(4)?;
        let length = le(length);
        // A byte fills an odd length up.
        self.at = self.at.checked_add(8)?.checked_add(length.checked_next_multiple_of(2)?)?;
        Some((kind, rest.get(..length).unwrap_or(rest)))
    }
}

/// A number whose lowest byte is the first.
fn le(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte))
}

fn sides((width, height): (u32, u32)) -> (usize, usize) {
    (width as usize, height as usize)
}
