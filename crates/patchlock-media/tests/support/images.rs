//! Images that hold other images: TIFF with JPEG, WebP with a canvas.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, GrayImage, ImageEncoder as _};

/// A grey JPEG.
pub fn jpeg(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let image = GrayImage::new(width, height);
    image.write_with_encoder(JpegEncoder::new(&mut bytes)).unwrap();
    bytes
}

/// The JPEG with another size in its header.
pub fn jpeg_that_claims(width: u16, height: u16) -> Vec<u8> {
    let mut bytes = jpeg(16, 16);
    let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    bytes[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
    bytes[frame + 7..frame + 9].copy_from_slice(&width.to_be_bytes());
    bytes
}

/// A grey TIFF. `tags` are further ones; `parts` are the offsets and lengths of its strips or
/// tiles in `data`.
pub struct Tiff<'a> {
    pub size: (u32, u32),
    pub compression: u32,
    /// Rows of a strip, or width and height of a tile.
    pub place: TiffLayout,
    pub data: &'a [u8],
    pub parts: &'a [(u32, u32)],
}

pub enum TiffLayout {
    Strip(u32),
    Tile(u32, u32),
}

impl Tiff<'_> {
    pub fn bytes(&self) -> Vec<u8> {
        const HEADER: u32 = 8;
        let count = self.parts.len() as u32;
        let after = HEADER + self.data.len() as u32;
        let (offsets, counts) = (after, after + 4 * count);
        let place = match self.place {
            TiffLayout::Strip(rows) => {
                vec![(273, offsets, count), (278, rows, 1), (279, counts, count)]
            }
            TiffLayout::Tile(width, height) => {
                vec![(322, width, 1), (323, height, 1), (324, offsets, count), (325, counts, count)]
            }
        };
        let mut tags = vec![
            (256, self.size.0, 1),
            (257, self.size.1, 1),
            (258, 8, 1),
            (259, self.compression, 1),
            (262, 1, 1),
            (277, 1, 1),
        ];
        tags.extend(place);
        tags.sort_unstable();
        let mut bytes = b"II\x2a\0".to_vec();
        bytes.extend((counts + 4 * count).to_le_bytes());
        bytes.extend(self.data);
        let first = |(from, _): &(u32, u32)| HEADER + from;
        let lists = self.parts.iter().map(first).chain(self.parts.iter().map(|part| part.1));
        bytes.extend(lists.flat_map(u32::to_le_bytes));
        bytes.extend((tags.len() as u16).to_le_bytes());
        for (tag, value, length) in tags {
            // A list of one number is that number.
            let value = match (length, tag) {
                (1, 273 | 324) => first(&self.parts[0]),
                (1, 279 | 325) => self.parts[0].1,
                _ => value,
            };
            bytes.extend((tag as u16).to_le_bytes());
            bytes.extend(4_u16.to_le_bytes());
            bytes.extend([length, value].iter().flat_map(|number| number.to_le_bytes()));
        }
        bytes.extend([0; 4]);
        bytes
    }
}

/// The picture chunk of a WebP: its letters, length and bytes.
pub fn webp_picture(width: u32, height: u32) -> Vec<u8> {
    webp_picture_of(width, height, 90)
}

/// The same with this value of all samples.
pub fn webp_picture_of(width: u32, height: u32, value: u8) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let pixels = vec![value; (3 * width * height) as usize];
    let encoder = WebPEncoder::new_lossless(&mut bytes);
    encoder.write_image(&pixels, width, height, ExtendedColorType::Rgb8).unwrap();
    bytes.into_inner().split_off(12)
}

/// A chunk of a WebP.
pub fn chunk(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_vec();
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    bytes
}

/// A WebP with a canvas and these chunks. The flag 2 says that it moves.
pub fn webp_canvas(width: u32, height: u32, flags: u8, chunks: &[u8]) -> Vec<u8> {
    let side = |side: u32| (side - 1).to_le_bytes();
    let header = [&[flags, 0, 0, 0], &side(width)[..3], &side(height)[..3]].concat();
    let content = [&b"WEBP"[..], &chunk(b"VP8X", &header), chunks].concat();
    chunk(b"RIFF", &content)
}
