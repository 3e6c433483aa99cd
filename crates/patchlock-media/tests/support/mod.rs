//! MP4 files for tests: written by this crate, then changed box by box.

#![allow(dead_code)] // each test binary uses a part

pub mod bits;
pub mod ffmpeg;
pub mod images;

use std::io::Cursor;

use bits::{pack, ue};
use patchlock_media::{FrameRate, Mp4Writer};

/// A video of `frames` frames with 25 frames per second: a bright square that moves over a dark
/// gradient. Its index is behind its data, so that offsets stay valid when the index changes.
pub fn small_mp4(width: usize, height: usize, frames: usize) -> Vec<u8> {
    let rate = FrameRate { frames: 25, seconds: 1 };
    let mut writer = Mp4Writer::new(Cursor::new(Vec::new()), width, height, rate, None).unwrap();
    (0..frames).for_each(|k| writer.push(&frame(width, height, k)).unwrap());
    writer.finish().unwrap().into_inner()
}

/// A frame of [`small_mp4`].
pub fn frame(width: usize, height: usize, k: usize) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let inside = (4 + k..20 + k).contains(&x) && (6..18).contains(&y);
            let shade = (20 + 60 * x / width) as u8;
            rgb.extend(if inside { [230, 200, 40] } else { [shade, 40, shade / 2] });
        }
    }
    rgb
}

/// A box of this type with this content.
pub fn boxed(kind: &str, content: &[u8]) -> Vec<u8> {
    let mut all = (content.len() as u32 + 8).to_be_bytes().to_vec();
    all.extend(kind.as_bytes());
    all.extend(content);
    all
}

/// Changes the content of the first box at a path such as `moov/trak/tkhd`. Sizes around it are
/// adapted.
pub fn change(file: &[u8], path: &str, edit: &dyn Fn(&mut Vec<u8>)) -> Vec<u8> {
    let (kind, inner) = path.split_once('/').map_or((path, None), |(a, b)| (a, Some(b)));
    let mut at = 0;
    while at < file.len() {
        let size = match u32::from_be_bytes(file[at..at + 4].try_into().unwrap()) as usize {
            0 => file.len() - at,
            1 => u64::from_be_bytes(file[at + 8..at + 16].try_into().unwrap()) as usize,
            size => size,
        };
        if &file[at + 4..at + 8] == kind.as_bytes() {
            // Sample descriptions have a header before the boxes in them.
            let head = match kind {
                "stsd" => 8,
                "avc1" => 78,
                _ => 0,
            };
            let mut content = file[at + 8..at + size].to_vec();
            match inner {
                None => edit(&mut content),
                Some(inner) => {
                    let changed = change(&content[head..], inner, edit);
                    content.truncate(head);
                    content.extend(changed);
                }
            }
            return [&file[..at], &boxed(kind, &content), &file[at + size..]].concat();
        }
        at += size;
    }
    panic!("there is no box {kind}");
}

/// Replaces four bytes of a box's content.
pub fn put(content: &mut [u8], at: usize, value: u32) {
    content[at..at + 4].copy_from_slice(&value.to_be_bytes());
}

/// A sequence parameter set of the Baseline profile for pictures of this many macroblocks.
pub fn parameter_set(across: u32, down: u32, references: u32, tail: &[(u32, usize)]) -> Vec<u8> {
    let head = [(0x67, 8), (66, 8), (0xc0, 8), (62, 8), ue(0), ue(0), ue(2), ue(references)];
    let size = [(0, 1), ue(across - 1), ue(down - 1), (1, 1), (1, 1)];
    let tail = if tail.is_empty() { &[(0, 1), (0, 1)] } else { tail };
    pack(&[&head[..], &size, tail, &[(1, 1)]].concat())
}

/// The file with another sequence parameter set in its index.
pub fn with_parameter_set(file: &[u8], set: &[u8]) -> Vec<u8> {
    change(file, "moov/trak/mdia/minf/stbl/stsd/avc1/avcC", &|content| {
        let old = u16::from_be_bytes(content[6..8].try_into().unwrap()) as usize;
        let new = [&(set.len() as u16).to_be_bytes()[..], set].concat();
        content.splice(6..8 + old, new);
    })
}
