//! Parses the H.264 sequence parameter set (Rec. H.264, 7.3.2.1.1 and annex E) for what the decoder
//! library does not report: whether it can decode the stream at all, what memory it would need, the
//! crop at the left and top, and the colour encoding.

use rusty_h264_common::bit_reader::{BitReader, OutOfData};
use rusty_h264_common::nal::emulation_unprevent;

/// The NAL units of a stream in which each follows a start code, divided as the decoder does: a start
/// code within a unit also begins a unit.
pub use rusty_h264_common::nal::split_annex_b as units;

/// Type of the NAL units that hold a sequence parameter set.
pub const PARAMETER_SET: u8 = 7;
/// Types of the NAL units that hold a part of a picture; the second, of one from which a decoder can
/// always start.
const SLICES: [u8; 2] = [1, 5];
/// Side of a macroblock in pixels.
const MACROBLOCK: usize = 16;

/// The type of a NAL unit; `None` if it is empty.
pub fn unit_type(unit: &[u8]) -> Option<u8> {
    unit.first().map(|header| header & 31)
}

/// Whether a NAL unit begins a picture, which is so if its first macroblock is number 0.
pub fn begins_picture(unit: &[u8]) -> bool {
    unit_type(unit).is_some_and(|kind| SLICES.contains(&kind))
        && unit.get(1).is_some_and(|byte| byte & 0x80 != 0)
}

/// Whether no other picture needs these units: none is a parameter set or a part of a reference.
pub fn is_disposable(stream: &[u8]) -> bool {
    const REFERENCE_BITS: u8 = 0x60;
    units(stream).iter().all(|unit| unit.first().is_none_or(|header| header & REFERENCE_BITS == 0))
}

/// Whether no part of a picture refers to another picture.
pub fn is_intra(stream: &[u8]) -> bool {
    // I and SI; each type has a second number, for pictures of which all slices are of it.
    const INTRA: [u32; 4] = [2, 4, 7, 9];
    let slices = units(stream).into_iter().filter(|unit| unit_type(unit) == Some(SLICES[0]));
    let mut types = slices.map(|unit| {
        let head = emulation_unprevent(unit.get(1..unit.len().min(32)).unwrap_or_default());
        let mut bits = BitReader::new(&head);
        bits.read_ue()?; // first_mb_in_slice
        bits.read_ue()
    });
    types.all(|kind| kind.is_ok_and(|kind| INTRA.contains(&kind)))
}

/// Properties of a stream that must be known before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StreamInfo {
    /// `chroma_format_idc`: 0 is grey, 1 is 4:2:0, 2 is 4:2:2, 3 is 4:4:4.
    pub chroma_format: u32,
    /// The larger of the bit depths of luma and chroma.
    pub bit_depth: u32,
    /// Whether a picture may mix interlaced and progressive macroblocks.
    pub mixed_interlace: bool,
    /// Number of pictures that later ones may refer to.
    pub references: usize,
    /// Width of the coded picture in pixels, before the crop.
    pub width: usize,
    /// Height of the coded picture in pixels, before the crop.
    pub height: usize,
    /// Luma pixels to crop at the left.
    pub crop_left: usize,
    /// Luma rows to crop at the top.
    pub crop_top: usize,
    /// Luma pixels to crop at the right.
    pub crop_right: usize,
    /// Luma rows to crop at the bottom.
    pub crop_bottom: usize,
    /// Whether luma covers 0..=255; `None` if the stream does not say.
    pub full_range: Option<bool>,
    /// `matrix_coefficients`; `None` if the stream does not say, 2 if it says "unspecified".
    pub matrix: Option<u32>,
}

impl StreamInfo {
    /// Width and height without what is cropped.
    pub fn shown(&self) -> [usize; 2] {
        let Self { crop_left, crop_right, crop_top, crop_bottom, .. } = self;
        [self.width - crop_left - crop_right, self.height - crop_top - crop_bottom]
    }

    /// Pixels of the coded picture; at least one.
    pub fn pixels(&self) -> usize {
        self.width.saturating_mul(self.height).max(1)
    }
}

/// Parses a sequence parameter set NAL unit, header byte included. An error if it is truncated, or
/// crops more than there is.
pub fn parse(nal: &[u8]) -> Result<StreamInfo, OutOfData> {
    let rbsp = emulation_unprevent(nal.get(1..).unwrap_or_default());
    let mut bits = BitReader::new(&rbsp);
    let mut info = StreamInfo { chroma_format: 1, bit_depth: 8, ..StreamInfo::default() };
    let profile = bits.read_bits(8)?;
    bits.read_bits(16)?; // constraint flags, level
    bits.read_ue()?; // seq_parameter_set_id
    if matches!(profile, 100 | 110 | 122 | 244 | 44 | 83 | 86 | 118 | 128 | 138 | 139 | 134 | 135) {
        high_profile(&mut bits, &mut info)?;
    }
    picture_order(&mut bits)?;
    info.references = bits.read_ue()? as usize;
    bits.read_bit()?; // gaps allowed
    info.width = (bits.read_ue()? as usize + 1) * MACROBLOCK;
    let map_units = bits.read_ue()? as usize + 1;
    let frames_only = bits.read_bit()?;
    info.height = map_units * if frames_only { 1 } else { 2 } * MACROBLOCK;
    info.mixed_interlace = !frames_only && bits.read_bit()?;
    bits.read_bit()?; // direct 8x8 inference
    if bits.read_bit()? {
        let unit_y = if info.chroma_format == 1 { 2 } else { 1 } * if frames_only { 1 } else { 2 };
        let unit_x = if matches!(info.chroma_format, 1 | 2) { 2 } else { 1 };
        info.crop_left = bits.read_ue()? as usize * unit_x;
        info.crop_right = bits.read_ue()? as usize * unit_x; // the decoder crops right and bottom itself
        info.crop_top = bits.read_ue()? as usize * unit_y;
        info.crop_bottom = bits.read_ue()? as usize * unit_y;
        let crop = [info.crop_left + info.crop_right, info.crop_top + info.crop_bottom];
        if crop[0] >= info.width || crop[1] >= info.height {
            return Err(OutOfData);
        }
    }
    if bits.read_bit()? {
        // A parameter set may end within the optional VUI; what was read so far is still valid.
        let _ = usability_information(&mut bits, &mut info);
    }
    Ok(info)
}

fn high_profile(bits: &mut BitReader<'_>, info: &mut StreamInfo) -> Result<(), OutOfData> {
    info.chroma_format = bits.read_ue()?;
    if info.chroma_format == 3 {
        bits.read_bit()?; // separate colour planes
    }
    info.bit_depth = 8 + bits.read_ue()?.max(bits.read_ue()?);
    bits.read_bit()?; // lossless bypass
    if bits.read_bit()? {
        let lists = if info.chroma_format == 3 { 12 } else { 8 };
        for list in 0..lists {
            if bits.read_bit()? {
                skip_scaling_list(bits, if list < 6 { 16 } else { 64 })?;
            }
        }
    }
    Ok(())
}

fn skip_scaling_list(bits: &mut BitReader<'_>, size: usize) -> Result<(), OutOfData> {
    let (mut last, mut next) = (8_i64, 8_i64);
    for _ in 0..size {
        if next != 0 {
            next = (last + i64::from(bits.read_se()?)).rem_euclid(256);
        }
        if next != 0 {
            last = next;
        }
    }
    Ok(())
}

fn picture_order(bits: &mut BitReader<'_>) -> Result<(), OutOfData> {
    bits.read_ue()?; // bits of frame_num
    match bits.read_ue()? {
        0 => {
            bits.read_ue()?;
        }
        1 => {
            bits.read_bit()?;
            bits.read_se()?;
            bits.read_se()?;
            for _ in 0..bits.read_ue()?.min(255) {
                bits.read_se()?;
            }
        }
        _ => {}
    }
    Ok(())
}

fn usability_information(bits: &mut BitReader<'_>, info: &mut StreamInfo) -> Result<(), OutOfData> {
    const EXTENDED_ASPECT: u32 = 255;
    if bits.read_bit()? && bits.read_bits(8)? == EXTENDED_ASPECT {
        bits.read_bits(32)?;
    }
    if bits.read_bit()? {
        bits.read_bit()?; // overscan
    }
    if bits.read_bit()? {
        bits.read_bits(3)?; // video format
        info.full_range = Some(bits.read_bit()?);
        if bits.read_bit()? {
            bits.read_bits(16)?; // primaries, transfer
            info.matrix = Some(bits.read_bits(8)?);
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "../tests/support/bits.rs"]
mod bits;

#[cfg(test)]
mod tests {
    use super::bits::{pack, ue};
    use super::*;

    #[test]
    fn reads_crop_range_and_matrix() {
        let mut nal = vec![0x67];
        nal.extend(pack(&[
            (77, 8),
            (0, 8),
            (30, 8),
            ue(0), // Main profile
            ue(0),
            ue(2),
            ue(1),
            (0, 1),
            ue(19),
            ue(14),
            (1, 1),
            (1, 1), // order type 2, 320x240
            (1, 1),
            ue(1),
            ue(4),
            ue(3),
            ue(5), // crop 2 at the left, 8 at the right, 6 at the top, 10 at the bottom
            (1, 1),
            (0, 1),
            (0, 1),
            (1, 1),
            (5, 3),
            (1, 1),
            (1, 1),
            (1, 8),
            (1, 8),
            (1, 8),
            (1, 1),
        ]));
        let info = parse(&nal).expect("the parameter set is complete");
        assert_eq!((info.crop_left, info.crop_top), (2, 6));
        assert_eq!((info.crop_right, info.crop_bottom), (8, 10));
        assert_eq!((info.full_range, info.matrix), (Some(true), Some(1)));
        assert_eq!((info.chroma_format, info.bit_depth), (1, 8));
        assert_eq!((info.width, info.height, info.references), (320, 240, 1));
    }

    #[test]
    fn a_crop_that_leaves_nothing_is_refused() {
        let set = |right: u32| {
            let size = [ue(0), ue(0), ue(2), ue(1), (0, 1), ue(0), ue(0), (1, 1), (1, 1)];
            let crop = [(1, 1), ue(1), ue(right), ue(0), ue(0), (0, 1)];
            let fields = [&[(0x67, 8), (77, 8), (0, 8), (30, 8)], &size[..], &crop].concat();
            parse(&pack(&fields))
        };
        assert_eq!(set(5).expect("4 columns are left").crop_left, 2);
        assert_eq!(set(7), Err(OutOfData), "16 columns less 2 and 14");
        assert_eq!(set(1 << 30), Err(OutOfData));
    }

    #[test]
    fn units_are_divided_at_every_start_code() {
        let stream = [9, 0, 0, 0, 1, 0x65, 0x88, 1, 0, 0, 1, 0x67, 0, 0, 1];
        let found = units(&stream);
        assert_eq!(found, [&[0x65, 0x88, 1][..], &[0x67]]);
        assert_eq!(unit_type(found[1]), Some(PARAMETER_SET));
        assert!(begins_picture(found[0]) && !begins_picture(found[1]) && !begins_picture(&[0x41]));
        assert!(units(&[1, 2]).is_empty());
    }

    #[test]
    fn a_truncated_parameter_set_is_an_error() {
        for length in 0..8 {
            assert!(parse(&[0x67, 100, 0, 30, 0xac, 0xd9, 0x40, 0x50][..length]).is_err());
        }
    }
}
