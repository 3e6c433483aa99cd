//! Videos and images.

use std::io::Cursor;
use std::num::NonZeroU32;

use patchlock_media::{
    FrameRate, FrameSource, Limits, Mp4Writer, Picture, image_file, open_by, open_y4m,
};
use shiguredo_mp4::boxes::{Avc1Box, AvccBox, SampleEntry, VisualSampleEntryFields};
use shiguredo_mp4::mux::{Mp4FileMuxer, Sample};
use shiguredo_mp4::{TrackKind, Uint};

use crate::check::{accepted, picture, said};
use crate::choice;
use crate::scratch::Scratch;

/// Frames that are read of each video.
const FRAMES: usize = 4;
/// Frames of at most this many pixels are also written again.
const WRITTEN_PIXELS: usize = 96 * 96;

/// A file that says that it is MP4: its boxes, its index, and a few frames. An even first byte
/// reads forwards, an odd one backwards; the rest is the file.
pub fn mp4(data: &[u8]) {
    let (first, file) = choice(data);
    video("v.mp4", file, first % 2 == 1);
}

/// Units of H.264, each after a start code, in an MP4 of ours. Parameter sets go into the index,
/// and each other unit is a frame; with an odd first byte all are one frame.
pub fn h264(data: &[u8]) {
    let (first, rest) = choice(data);
    let units = units(rest);
    if let Some(file) = wrapped(&units, first % 2 == 1) {
        video("v.mp4", &file, first & 2 == 2);
    }
}

/// Y4M as a stream and as a file, forwards and backwards.
pub fn y4m(data: &[u8]) {
    let (first, rest) = choice(data);
    let file = [b"YUV4MPEG2", rest].concat();
    let reverse = first % 2 == 1;
    if first & 2 == 2 {
        video("v.y4m", &file, reverse);
    } else if let Some(source) = accepted(open_y4m(Cursor::new(file), reverse)) {
        frames(source, reverse);
    }
}

/// A single image of any format.
pub fn images(data: &[u8]) {
    let scratch = Scratch::new();
    let file = scratch.file("image.png", data);
    let size = accepted(image_file::size(&file));
    let loaded = accepted(image_file::load(&file));
    let decoded = accepted(image_file::decode(data, Limits::default()));
    assert_eq!(loaded, decoded);
    if let Some(read) = decoded {
        picture(&read);
        assert_eq!(size, Some((read.width, read.height)), "the size without the pixels");
    }
}

/// Reads frames of a file. A panic of the decoder library becomes an error where it is called; one
/// that was caught further out is ours.
fn video(name: &str, bytes: &[u8], reverse: bool) {
    patchlock_media::silence_decoders();
    let scratch = Scratch::new();
    let file = scratch.file(name, bytes);
    match open_by(file.as_ref(), reverse, Limits::default(), None) {
        Ok(source) => frames(source, reverse),
        Err(error) => not_ours(&said(error)),
    }
}

/// The units of a stream, without their start codes. None is empty.
fn units(stream: &[u8]) -> Vec<&[u8]> {
    let mut units = Vec::new();
    let mut rest = stream;
    loop {
        let at = rest.windows(3).position(|three| three == [0, 0, 1]);
        units.push(&rest[..at.unwrap_or(rest.len())]);
        match at {
            Some(at) => rest = &rest[at + 3..],
            None => break,
        }
    }
    units.retain(|unit| !unit.is_empty());
    units
}

fn not_ours(error: &str) {
    let panicked = error.contains("the decoder failed");
    assert!(!panicked || error.starts_with("cannot decode frame"), "a panic was caught: {error}");
}

/// Reads the first frames, or the last ones backwards, and writes small ones again.
fn frames(mut source: Box<dyn FrameSource>, reverse: bool) {
    let length = source.length().unwrap_or(FRAMES);
    let mut read = Vec::new();
    for k in 0..length.min(FRAMES) {
        match source.frame(if reverse { length - 1 - k } else { k }) {
            Ok(Some(frame)) => {
                picture(&frame);
                read.push(frame);
            }
            Ok(None) => break,
            Err(error) => {
                not_ours(&said(error));
                break;
            }
        }
    }
    written_again(&read);
}

/// Frames of one small size are written as MP4, and as many are read.
fn written_again(frames: &[Picture]) {
    let Some(&Picture { width, height, .. }) = frames.first() else { return };
    let alike = frames.iter().all(|frame| (frame.width, frame.height) == (width, height));
    if !alike || width * height > WRITTEN_PIXELS {
        return;
    }
    let out = Cursor::new(Vec::new());
    let Some(mut writer) = accepted(Mp4Writer::new(out, width, height, FrameRate::DEFAULT, None))
    else {
        return;
    };
    for frame in frames {
        writer.push_at(&frame.to_rgb(), frame.time).expect("what was read can be written");
    }
    let file = writer.finish().expect("what was read can be written").into_inner();
    let scratch = Scratch::new();
    let path = scratch.file("again.mp4", &file);
    let again = open_by(path.as_ref(), false, Limits::default(), None);
    let mut again = again.expect("what was written can be opened");
    assert_eq!(again.length(), Some(frames.len()));
    for k in 0..frames.len() {
        let frame = again.frame(k).expect("what was written can be read").expect("a frame");
        // H.264 of 4:2:0 has even sides; one row or column more is written.
        let even = (width.next_multiple_of(2), height.next_multiple_of(2));
        assert_eq!((frame.width, frame.height), even);
    }
}

/// An MP4 with these units; `None` if there are none, or too many for its index.
fn wrapped(units: &[&[u8]], joined: bool) -> Option<Vec<u8>> {
    let of_type = |kind: u8| units.iter().filter(move |unit| unit[0] & 31 == kind);
    let owned = |kind: u8, most: usize| -> Vec<Vec<u8>> {
        of_type(kind).take(most).filter(|u| u.len() < 1 << 16).map(|unit| unit.to_vec()).collect()
    };
    let (sps, pps) = (owned(7, 31), owned(8, 255));
    let prefixed = |unit: &&[u8]| [&(unit.len() as u32).to_be_bytes()[..], unit].concat();
    let pictures = units.iter().filter(|unit| !matches!(unit[0] & 31, 7 | 8));
    let mut samples: Vec<Vec<u8>> = pictures.map(prefixed).collect();
    if joined {
        samples = vec![units.iter().flat_map(prefixed).collect()];
    }
    let mut muxer = Mp4FileMuxer::new().ok()?;
    let mut file = muxer.initial_boxes_bytes().to_vec();
    for (k, sample) in samples.iter().enumerate() {
        let entry = (k == 0).then(|| SampleEntry::Avc1(entry(sps.clone(), pps.clone())));
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry: entry,
            keyframe: k == 0 || sample.get(4).is_some_and(|byte| byte & 31 == 5),
            timescale: NonZeroU32::new(25)?,
            duration: 1,
            composition_time_offset: None,
            data_offset: file.len() as u64,
            data_size: sample.len(),
        };
        muxer.append_sample(&sample).ok()?;
        file.extend(&samples[k]);
    }
    let boxes = muxer.finalize().ok()?;
    for (offset, bytes) in boxes.offset_and_bytes_pairs() {
        let (begin, end) = (offset as usize, offset as usize + bytes.len());
        file.resize(file.len().max(end), 0);
        file[begin..end].copy_from_slice(bytes);
    }
    Some(file)
}

fn entry(sps: Vec<Vec<u8>>, pps: Vec<Vec<u8>>) -> Avc1Box {
    let profile = sps.first().and_then(|unit| unit.get(1).copied()).unwrap_or(66);
    let high = !matches!(profile, 66 | 77 | 88);
    Avc1Box {
        visual: VisualSampleEntryFields {
            data_reference_index: VisualSampleEntryFields::DEFAULT_DATA_REFERENCE_INDEX,
            width: 64,
            height: 48,
            horizresolution: VisualSampleEntryFields::DEFAULT_HORIZRESOLUTION,
            vertresolution: VisualSampleEntryFields::DEFAULT_VERTRESOLUTION,
            frame_count: VisualSampleEntryFields::DEFAULT_FRAME_COUNT,
            compressorname: VisualSampleEntryFields::NULL_COMPRESSORNAME,
            depth: VisualSampleEntryFields::DEFAULT_DEPTH,
        },
        avcc_box: AvccBox {
            avc_profile_indication: profile,
            profile_compatibility: 0,
            avc_level_indication: 62,
            length_size_minus_one: Uint::new(3),
            sps_list: sps,
            pps_list: pps,
            chroma_format: high.then(|| Uint::new(1)),
            bit_depth_luma_minus8: high.then(|| Uint::new(0)),
            bit_depth_chroma_minus8: high.then(|| Uint::new(0)),
            sps_ext_list: Vec::new(),
        },
        unknown_boxes: Vec::new(),
    }
}
