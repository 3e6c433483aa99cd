//! Parses the H.264 sequence parameter set (Rec. H.264, 7.3.2.1.1 and annex E) for what the decoder
//! library does not report: whether it can decode the stream at all, what memory it would need, the
//! crop at the left and top, and the colour encoding.

use std::iter;

/// Type of the NAL units that hold a sequence parameter set.
pub const PARAMETER_SET: u8 = 7;
/// Types of the NAL units that hold a part of a picture; the second, of one from which a decoder can
/// always start.
const SLICES: [u8; 2] = [1, 5];
/// Side of a macroblock in pixels.
const MACROBLOCK: usize = 16;

/// The NAL units of a stream in which each follows a start code, divided as decoders do: a start
/// code within a unit also begins a unit.
pub fn units(stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = after_start_code(stream);
    iter::from_fn(move || {
        let unit = rest?;
        rest = after_start_code(unit);
        Some(&unit[..unit.len() - rest.map_or(0, |rest| rest.len() + 3)])
    })
}

fn after_start_code(data: &[u8]) -> Option<&[u8]> {
    data.windows(3).position(|three| three == [0, 0, 1]).map(|at| &data[at + 3..])
}

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
    units(stream).all(|unit| unit.first().is_none_or(|header| header & REFERENCE_BITS == 0))
}

/// Whether no part of a picture refers to another picture.
pub fn is_intra(stream: &[u8]) -> bool {
    // I and SI; each type has a second number, for pictures of which all slices are of it.
    const INTRA: [u32; 4] = [2, 4, 7, 9];
    let slices = units(stream).filter(|unit| unit_type(unit) == Some(SLICES[0]));
    let mut types = slices.map(|unit| {
        let head = without_emulation_prevention(unit.get(1..unit.len().min(32))?);
        let mut bits = BitReader { data: &head, at: 0 };
        bits.ue()?; // first_mb_in_slice
        bits.ue()
    });
    types.all(|kind| kind.is_some_and(|kind| INTRA.contains(&kind)))
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

/// Parses a sequence parameter set NAL unit, header byte included. `None` if it is truncated, or
/// crops more than there is.
pub fn parse(nal: &[u8]) -> Option<StreamInfo> {
    let rbsp = without_emulation_prevention(nal.get(1..)?);
    let mut bits = BitReader { data: &rbsp, at: 0 };
    let mut info = StreamInfo { chroma_format: 1, bit_depth: 8, ..StreamInfo::default() };
    let profile = bits.take(8)?;
    bits.take(16)?; // constraint flags, level
    bits.ue()?; // seq_parameter_set_id
    if matches!(profile, 100 | 110 | 122 | 244 | 44 | 83 | 86 | 118 | 128 | 138 | 139 | 134 | 135) {
        high_profile(&mut bits, &mut info)?;
    }
    picture_order(&mut bits)?;
    info.references = bits.ue()? as usize;
    bits.take(1)?; // gaps allowed
    info.width = (bits.ue()? as usize + 1) * MACROBLOCK;
    let map_units = bits.ue()? as usize + 1;
    let frames_only = bits.flag()?;
    info.height = map_units * if frames_only { 1 } else { 2 } * MACROBLOCK;
    info.mixed_interlace = !frames_only && bits.flag()?;
    bits.take(1)?; // direct 8x8 inference
    if bits.flag()? {
        let unit_y = if info.chroma_format == 1 { 2 } else { 1 } * if frames_only { 1 } else { 2 };
        let unit_x = if matches!(info.chroma_format, 1 | 2) { 2 } else { 1 };
        info.crop_left = bits.ue()? as usize * unit_x;
        info.crop_right = bits.ue()? as usize * unit_x; // the decoder crops right and bottom itself
        info.crop_top = bits.ue()? as usize * unit_y;
        info.crop_bottom = bits.ue()? as usize * unit_y;
        let crop = [info.crop_left + info.crop_right, info.crop_top + info.crop_bottom];
        if crop[0] >= info.width || crop[1] >= info.height {
            return None;
        }
    }
    if bits.flag()? {
        // A parameter set may end within the optional VUI; what was read so far is still valid.
        let _ = usability_information(&mut bits, &mut info);
    }
    Some(info)
}

fn high_profile(bits: &mut BitReader<'_>, info: &mut StreamInfo) -> Option<()> {
    info.chroma_format = bits.ue()?;
    if info.chroma_format == 3 {
        bits.take(1)?; // separate colour planes
    }
    info.bit_depth = 8 + bits.ue()?.max(bits.ue()?);
    bits.take(1)?; // lossless bypass
    if bits.flag()? {
        let lists = if info.chroma_format == 3 { 12 } else { 8 };
        for list in 0..lists {
            if bits.flag()? {
                skip_scaling_list(bits, if list < 6 { 16 } else { 64 })?;
            }
        }
    }
    Some(())
}

fn skip_scaling_list(bits: &mut BitReader<'_>, size: usize) -> Option<()> {
    let (mut last, mut next) = (8_i64, 8_i64);
    for _ in 0..size {
        if next != 0 {
            next = (last + i64::from(bits.se()?)).rem_euclid(256);
        }
        if next != 0 {
            last = next;
        }
    }
    Some(())
}

fn picture_order(bits: &mut BitReader<'_>) -> Option<()> {
    bits.ue()?; // bits of frame_num
    match bits.ue()? {
        0 => {
            bits.ue()?;
        }
        1 => {
            bits.take(1)?;
            bits.se()?;
            bits.se()?;
            for _ in 0..bits.ue()?.min(255) {
                bits.se()?;
            }
        }
        _ => {}
    }
    Some(())
}

fn usability_information(bits: &mut BitReader<'_>, info: &mut StreamInfo) -> Option<()> {
    const EXTENDED_ASPECT: u32 = 255;
    if bits.flag()? && bits.take(8)? == EXTENDED_ASPECT {
        bits.take(32)?;
    }
    if bits.flag()? {
        bits.take(1)?; // overscan
    }
    if bits.flag()? {
        bits.take(3)?; // video format
        info.full_range = Some(bits.flag()?);
        if bits.flag()? {
            bits.take(16)?; // primaries, transfer
            info.matrix = Some(bits.take(8)?);
        }
    }
    Some(())
}

fn without_emulation_prevention(data: &[u8]) -> Vec<u8> {
    let mut clean = Vec::with_capacity(data.len());
    let mut zeros = 0;
    for &byte in data {
        if zeros >= 2 && byte == 3 {
            zeros = 0;
            continue;
        }
        zeros = if byte == 0 { zeros + 1 } else { 0 };
        clean.push(byte);
    }
    clean
}

struct BitReader<'a> {
    data: &'a [u8],
    at: usize,
}

impl BitReader<'_> {
    fn take(&mut self, count: usize) -> Option<u32> {
        let mut value = 0_u64;
        for _ in 0..count {
            let byte = *self.data.get(self.at / 8)?;
            value = value << 1 | u64::from(byte >> (7 - self.at % 8) & 1);
            self.at += 1;
        }
        u32::try_from(value).ok()
    }

    fn flag(&mut self) -> Option<bool> {
        Some(self.take(1)? == 1)
    }

    /// Unsigned Exp-Golomb code.
    fn ue(&mut self) -> Option<u32> {
        let mut zeros = 0;
        while !self.flag()? {
            zeros += 1;
            if zeros > 31 {
                return None;
            }
        }
        Some((1_u32 << zeros) - 1 + self.take(zeros)?)
    }

    /// Signed Exp-Golomb code.
    fn se(&mut self) -> Option<i32> {
        let code = i64::from(self.ue()?);
        let magnitude = (code + 1) / 2;
        i32::try_from(if code % 2 == 1 { magnitude } else { -magnitude }).ok()
    }
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
        assert_eq!(set(7), None, "16 columns less 2 and 14");
        assert_eq!(set(1 << 30), None);
    }

    #[test]
    fn units_are_divided_at_every_start_code() {
        let stream = [9, 0, 0, 0, 1, 0x65, 0x88, 1, 0, 0, 1, 0x67, 0, 0, 1];
        let found: Vec<&[u8]> = units(&stream).collect();
        assert_eq!(found, [&[0x65, 0x88, 1][..], &[0x67], &[]]);
        assert_eq!(unit_type(found[1]), Some(PARAMETER_SET));
        assert!(begins_picture(found[0]) && !begins_picture(found[1]) && !begins_picture(&[0x41]));
        assert_eq!(units(&[1, 2]).count(), 0);
    }

    #[test]
    fn a_truncated_parameter_set_is_none() {
        for length in 0..8 {
            assert_eq!(parse(&[0x67, 100, 0, 30, 0xac, 0xd9, 0x40, 0x50][..length]), None);
        }
    }
}
