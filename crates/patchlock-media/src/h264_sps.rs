//! Parses the H.264 sequence parameter set (Rec. H.264, 7.3.2.1.1 and annex E) for what the decoder library
//! does not report: whether it can decode the stream at all, the crop at the left and top, and the colour
//! encoding.

/// Properties of a stream that must be known before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StreamInfo {
    /// `chroma_format_idc`: 0 is grey, 1 is 4:2:0, 2 is 4:2:2, 3 is 4:4:4.
    pub chroma_format: u32,
    /// The larger of the bit depths of luma and chroma.
    pub bit_depth: u32,
    /// Whether a picture may mix interlaced and progressive macroblocks.
    pub mixed_interlace: bool,
    /// Luma pixels to crop at the left.
    pub crop_left: usize,
    /// Luma rows to crop at the top.
    pub crop_top: usize,
    /// Whether luma covers 0..=255.
    pub full_range: bool,
    /// `matrix_coefficients` of the VUI; 2 means "unspecified".
    pub matrix: u32,
}

/// Parses a sequence parameter set NAL unit, header byte included. `None` if it is truncated.
pub fn parse(nal: &[u8]) -> Option<StreamInfo> {
    let rbsp = without_emulation_prevention(nal.get(1..)?);
    let mut bits = Bits { data: &rbsp, at: 0 };
    let mut info =
        StreamInfo { chroma_format: 1, bit_depth: 8, matrix: 2, ..StreamInfo::default() };
    let profile = bits.take(8)?;
    bits.take(16)?; // constraint flags, level
    bits.ue()?; // seq_parameter_set_id
    if matches!(profile, 100 | 110 | 122 | 244 | 44 | 83 | 86 | 118 | 128 | 138 | 139 | 134 | 135) {
        high_profile(&mut bits, &mut info)?;
    }
    picture_order(&mut bits)?;
    bits.ue()?; // reference frames
    bits.take(1)?; // gaps allowed
    bits.ue()?; // width in macroblocks
    bits.ue()?; // height in map units
    let frames_only = bits.flag()?;
    info.mixed_interlace = !frames_only && bits.flag()?;
    bits.take(1)?; // direct 8x8 inference
    if bits.flag()? {
        let unit_y = if info.chroma_format == 1 { 2 } else { 1 } * if frames_only { 1 } else { 2 };
        let unit_x = if matches!(info.chroma_format, 1 | 2) { 2 } else { 1 };
        info.crop_left = bits.ue()? as usize * unit_x;
        bits.ue()?; // the decoder crops right and bottom itself
        info.crop_top = bits.ue()? as usize * unit_y;
        bits.ue()?;
    }
    if bits.flag()? {
        // A parameter set may end within the optional VUI; what was read so far is still valid.
        let _ = usability_information(&mut bits, &mut info);
    }
    Some(info)
}

fn high_profile(bits: &mut Bits<'_>, info: &mut StreamInfo) -> Option<()> {
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

fn skip_scaling_list(bits: &mut Bits<'_>, size: usize) -> Option<()> {
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

fn picture_order(bits: &mut Bits<'_>) -> Option<()> {
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

fn usability_information(bits: &mut Bits<'_>, info: &mut StreamInfo) -> Option<()> {
    const EXTENDED_ASPECT: u32 = 255;
    if bits.flag()? && bits.take(8)? == EXTENDED_ASPECT {
        bits.take(32)?;
    }
    if bits.flag()? {
        bits.take(1)?; // overscan
    }
    if bits.flag()? {
        bits.take(3)?; // video format
        info.full_range = bits.flag()?;
        if bits.flag()? {
            bits.take(16)?; // primaries, transfer
            info.matrix = bits.take(8)?;
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

struct Bits<'a> {
    data: &'a [u8],
    at: usize,
}

impl Bits<'_> {
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
mod tests {
    use super::*;

    /// Packs (value, bits) pairs, most significant bit first.
    fn pack(fields: &[(u32, usize)]) -> Vec<u8> {
        let bits: Vec<u8> = fields
            .iter()
            .flat_map(|&(v, n)| (0..n).rev().map(move |k| (v >> k & 1) as u8))
            .collect();
        bits.chunks(8)
            .map(|c| c.iter().enumerate().fold(0, |byte, (k, b)| byte | b << (7 - k)))
            .collect()
    }

    /// `ue(v)` as a (value, bits) pair: v + 1, in twice its bit length minus one bits.
    fn ue(value: u32) -> (u32, usize) {
        let code = value + 1;
        (code, 2 * (32 - code.leading_zeros() as usize) - 1)
    }

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
            ue(0),
            ue(3),
            ue(0), // crop 2 at the left, 6 at the top
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
        assert!(info.full_range);
        assert_eq!(info.matrix, 1);
        assert_eq!((info.chroma_format, info.bit_depth), (1, 8));
    }

    #[test]
    fn a_truncated_parameter_set_is_none() {
        for length in 0..8 {
            assert_eq!(parse(&[0x67, 100, 0, 30, 0xac, 0xd9, 0x40, 0x50][..length]), None);
        }
    }
}
