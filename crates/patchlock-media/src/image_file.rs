//! Reads single image files.

use std::io::{BufRead, BufReader, Cursor, Seek};
use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::guard::{self, DecoderPanic};
use crate::image_parts;
use crate::limits::{self, Limits, SizeLimitError};
use crate::plain_file::{self, PlainFile};
use crate::tiff_pages::{self, Page};
use crate::{Picture, Pixels, orientation};

/// Extensions of image files, in lower case.
pub const EXTENSIONS: &[&str] = &["jpg", "jpeg", "png", "tif", "tiff", "bmp", "webp"];

/// Why an image cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be opened or read, or is not a file.
    #[error("{0}")]
    File(#[from] std::io::Error),
    /// The file is empty.
    #[error("the file is empty")]
    Empty,
    /// The data are not an image, or are damaged.
    #[error("{0}")]
    Damaged(#[from] image::ImageError),
    /// The image data are truncated.
    #[error("the image data are truncated")]
    Cut,
    /// The decoder failed on the data.
    #[error("{0}")]
    Panicked(#[from] DecoderPanic),
    /// The image has more pixels than are accepted.
    #[error("{0}")]
    TooLarge(#[from] SizeLimitError),
    /// The image is one of several in its file.
    #[error("it holds {0} pictures; name the file itself, and each of them is a frame")]
    Several(usize),
    /// A picture within the image does not fit it.
    #[error("{0}")]
    Parts(String),
}

/// What images are read from. Decoders are generic: each further type would compile all of them again.
pub(crate) type Source<'a> = Box<dyn ReadSeek + 'a>;

/// Bytes that can be read from any place.
pub(crate) trait ReadSeek: BufRead + Seek + Send {}

impl<T: BufRead + Seek + Send> ReadSeek for T {}

/// Whether the extension of a path is one of [`EXTENSIONS`], in any case.
pub fn is_image(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    EXTENSIONS.iter().any(|known| known.eq_ignore_ascii_case(extension))
}

/// Width and height in pixels of what [`load`] gives, read from the header of the file alone.
///
/// # Errors
/// [`LoadError`]. Damage to the pixel data is not detected.
pub fn size(file: &Path) -> Result<(usize, usize), LoadError> {
    size_of(&mut plain_file::open(file)?)
}

/// The same as [`size`] for an open file, which is at its beginning afterwards.
///
/// # Errors
/// As [`size`].
pub fn size_of(plain: &mut PlainFile) -> Result<(usize, usize), LoadError> {
    if plain.length == 0 {
        return Err(LoadError::Empty);
    }
    let source: Source = Box::new(BufReader::new(&plain.file));
    let reader = ImageReader::new(source).with_guessed_format()?;
    let (width, height, orientation) = guard::decoding(|| -> Result<_, LoadError> {
        let mut decoder = reader.into_decoder()?;
        let (width, height) = decoder.dimensions();
        Ok((width as usize, height as usize, orientation_of(&mut decoder)))
    })??;
    plain.file.rewind()?;
    Ok(if orientation::swaps_sides(orientation) { (height, width) } else { (width, height) })
}

/// How the image says that it is to be turned; a damaged tag counts as none.
fn orientation_of(decoder: &mut impl ImageDecoder) -> Orientation {
    decoder.orientation().unwrap_or(Orientation::NoTransforms)
}

/// Reads an image and keeps its bit depth. It is turned as its orientation tag (EXIF) says.
///
/// # Errors
/// [`LoadError`].
pub fn load(file: &Path) -> Result<Picture, LoadError> {
    load_from(plain_file::open(file)?, Limits::default())
}

/// Reads an open file as [`load`] does, with other limits.
///
/// # Errors
/// [`LoadError`].
pub fn load_from(mut plain: PlainFile, limits: Limits) -> Result<Picture, LoadError> {
    let bytes = plain.read(limits::image_bytes(limits.pixels as u64))?;
    decode(&bytes, limits)
}

/// Decodes the bytes of an image file, as [`load_from`] does.
///
/// # Errors
/// [`LoadError`].
pub fn decode(bytes: &[u8], limits: Limits) -> Result<Picture, LoadError> {
    guard::decoding(|| decode_unguarded(bytes, limits))?
}

/// The pages of a TIFF that are frames; none of a file that is no TIFF.
///
/// # Errors
/// [`LoadError`] if the list of the pages is damaged.
pub(crate) fn pages(file: &Path) -> Result<Vec<u64>, LoadError> {
    let plain = plain_file::open(file)?;
    let source = Box::new(BufReader::new(plain.file));
    Ok(guard::decoding(|| tiff_pages::find(source, plain.length))??)
}

/// Reads the page of a TIFF that begins here, as [`load_from`] reads an image.
///
/// # Errors
/// [`LoadError`].
pub(crate) fn load_page(file: &Path, begin: u64, limits: Limits) -> Result<Picture, LoadError> {
    let plain = plain_file::open(file)?;
    let page = || -> Result<Source, LoadError> {
        let page = Page::new(plain.file.try_clone()?, begin)?.ok_or(LoadError::Cut)?;
        Ok(Box::new(BufReader::new(page)))
    };
    guard::decoding(|| {
        image_parts::check_tiff(page()?, plain.length)?;
        let reader = ImageReader::with_format(page()?, ImageFormat::Tiff);
        Ok(to_picture(decode_reader(reader, limits, || Ok(()))?))
    })?
}

fn decode_unguarded(bytes: &[u8], limits: Limits) -> Result<Picture, LoadError> {
    if bytes.is_empty() {
        return Err(LoadError::Empty);
    }
    let source: Source = Box::new(Cursor::new(bytes));
    let reader = ImageReader::new(source).with_guessed_format()?;
    let format = reader.format();
    let image = decode_reader(reader, limits, || image_parts::check(bytes, format))?;
    if format == Some(ImageFormat::Jpeg) && !jpeg_is_complete(bytes) {
        return Err(LoadError::Cut);
    }
    let pages = tiff_pages::find(Box::new(Cursor::new(bytes)), bytes.len() as u64)?;
    let pictures = pages.len().max(image_parts::pictures(bytes, format));
    if pictures > 1 {
        return Err(LoadError::Several(pictures));
    }
    Ok(to_picture(image))
}

/// Decodes an image after it was checked.
fn decode_reader(
    mut reader: ImageReader<Source>,
    limits: Limits,
    check: impl FnOnce() -> Result<(), LoadError>,
) -> Result<DynamicImage, LoadError> {
    let mut within = image::Limits::default();
    within.max_alloc = Some(limits::image_bytes(limits.pixels as u64));
    reader.limits(within.clone());
    let mut decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    limits.check(width as usize, height as usize)?;
    check()?;
    within.reserve(decoder.total_bytes())?;
    decoder.set_limits(within)?;
    let orientation = orientation_of(&mut decoder);
    let mut image = DynamicImage::from_decoder(decoder)?;
    image.apply_orientation(orientation);
    Ok(image)
}

/// JPEG decoders silently fill missing data with grey, which would corrupt the track. A complete
/// file has an end marker after its last start of scan; neither marker can occur within compressed
/// data.
fn jpeg_is_complete(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    last(0xd9) > last(0xda)
}

fn to_picture(image: DynamicImage) -> Picture {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = match image {
        DynamicImage::ImageLuma8(grey) => Pixels::Grey8(grey.into_raw()),
        DynamicImage::ImageLuma16(grey) => Pixels::Grey16(grey.into_raw()),
        DynamicImage::ImageLumaA8(_) => Pixels::Grey8(image.into_luma8().into_raw()),
        DynamicImage::ImageLumaA16(_) => Pixels::Grey16(image.into_luma16().into_raw()),
        other => Pixels::Rgb8(other.into_rgb8().into_raw()),
    };
    Picture::new(width, height, pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_truncated_jpeg_is_detected() {
        assert!(jpeg_is_complete(&[0xff, 0xd8, 0xff, 0xda, 1, 2, 0xff, 0xd9]));
        assert!(
            !jpeg_is_complete(&[0xff, 0xd8, 0xff, 0xd9, 0xff, 0xda, 1, 2]),
            "the end marker belongs to a thumbnail"
        );
        assert!(!jpeg_is_complete(&[0xff, 0xd8, 0xff, 0xda, 1, 2]));
    }
}
