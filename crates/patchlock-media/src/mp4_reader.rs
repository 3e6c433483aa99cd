//! Reads MP4 files with H.264 video, decoded in pure Rust. Frames are numbered in presentation order, which
//! may differ from the order in which they are stored. Rotation tags and edit lists are ignored.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use rusty_h264::{DecodeError, Decoder, YuvFrame};
use shiguredo_mp4::TrackKind;
use shiguredo_mp4::boxes::{Avc1Box, SampleEntry};
use shiguredo_mp4::demux::{Input, Mp4FileDemuxer};

use crate::colour::{self, Colour, Matrix, Planes};
use crate::h264_sps::{self, StreamInfo};
use crate::{Error, FrameRate, FrameSource, Picture};

/// Frames kept when reading backwards. A longer group of pictures is decoded once per window of this size.
const BACKWARD_WINDOW: usize = 64;
/// Number of pictures decoded on opening to check that the decoder supports the video. By then, an encoder
/// has usually used all of its tools.
const PROBED_PICTURES: usize = 8;
const START_CODE: [u8; 4] = [0, 0, 0, 1];
const DAMAGED: Fault = Fault::Data("the data are damaged");

/// Why a file cannot be read by this decoder.
pub enum OpenError {
    /// The container is valid, but its video is not H.264 or of an unsupported kind of H.264. Completes "the
    /// file holds ...".
    Codec(String),
    /// The file is damaged or unreadable.
    Broken(Error),
}

/// Why a picture cannot be decoded.
#[derive(Debug, thiserror::Error)]
enum Fault {
    #[error("{0}")]
    Decoder(#[from] DecodeError),
    #[error("{0}")]
    File(#[from] io::Error),
    #[error("{0}")]
    Data(&'static str),
    #[error("the file is truncated: {0}")]
    TooShort(io::Error),
}

/// One stored picture.
struct Sample {
    offset: u64,
    size: usize,
    keyframe: bool,
    /// Index in presentation order.
    shown: usize,
}

/// An MP4 file with H.264 video.
pub struct Mp4 {
    file: File,
    name: String,
    /// In storage order, which is the decoding order.
    samples: Vec<Sample>,
    /// Maps an index in presentation order to an index in `samples`.
    stored: Vec<usize>,
    rate: Option<FrameRate>,
    headers: Vec<u8>,
    length_bytes: usize,
    info: StreamInfo,
    decoder: Decoder,
    next: usize,
    last_wanted: usize,
    ready: BTreeMap<usize, YuvFrame>,
}

/// Whether the first bytes of a file look like an MP4 or QuickTime container.
pub fn looks_like_mp4(head: &[u8]) -> bool {
    head.get(4..8)
        .is_some_and(|kind| [b"ftyp", b"moov", b"mdat", b"wide"].iter().any(|known| kind == *known))
}

impl Mp4 {
    /// Opens a file and reads its index.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let name = path.display().to_string();
        let broken = |reason: String| {
            let hint = "the file may be truncated or still being written: copy it again";
            OpenError::Broken(Error::source(format!("cannot read {name}: {reason}"), hint))
        };
        let mut file = File::open(path).map_err(|error| broken(error.to_string()))?;
        let mut demuxer = demux(&mut file).map_err(broken)?;
        let Some((entry, raw)) = video_samples(&mut demuxer).map_err(broken)? else {
            let message = format!("there is no video in {name}, only audio or other data");
            return Err(OpenError::Broken(Error::source(message, "name a file with a video")));
        };
        let avc = match entry {
            Some(SampleEntry::Avc1(avc)) => avc,
            None => return Err(OpenError::Codec("a fragmented or empty video".into())),
            Some(other) => return Err(OpenError::Codec(format!("{} video", codec_name(&other)))),
        };
        let info = supported(&avc)?;
        let (samples, stored) = presentation_order(&raw);
        let mut video = Self {
            file,
            samples,
            stored,
            rate: raw.rate,
            headers: parameter_sets(&avc),
            length_bytes: usize::from(avc.avcc_box.length_size_minus_one.get()) + 1,
            info,
            decoder: Decoder::new(),
            next: 0,
            last_wanted: 0,
            ready: BTreeMap::new(),
            name,
        };
        match video.unsupported_tool() {
            Some(tool) => Err(OpenError::Codec(format!("H.264 with {tool}"))),
            None => Ok(video),
        }
    }

    /// An H.264 coding tool in the first pictures that the decoder does not support. Damage is ignored here:
    /// it is reported when the picture is read.
    fn unsupported_tool(&mut self) -> Option<&'static str> {
        let mut decoder = Decoder::new();
        for at in 0..self.samples.len().min(PROBED_PICTURES) {
            let data = self.read_sample(at).ok()?;
            // The decoder may panic on damaged data; the thread that decodes ahead reports that later.
            let decoded = catch_unwind(AssertUnwindSafe(|| decoder.decode(&data)));
            match decoded.ok()? {
                Err(DecodeError::Unsupported(tool)) => return Some(tool),
                Err(_) => return None,
                Ok(_) => {}
            }
        }
        None
    }

    /// Moves the decoder to the position from which the wanted frame takes the least decoding.
    fn seek_for(&mut self, index: usize) {
        let goal = self.stored[index];
        let keyframe =
            (0..=goal).rev().find(|&k| self.samples[k].keyframe && self.samples[k].shown <= index);
        let keyframe = keyframe.unwrap_or(0);
        if goal < self.next || keyframe > self.next {
            self.decoder = Decoder::new();
            self.next = keyframe;
        }
    }

    fn decode_until(&mut self, index: usize, keep_from: usize) -> Result<YuvFrame, Fault> {
        self.ready = self.ready.split_off(&keep_from);
        while !self.ready.contains_key(&index) {
            if self.next > self.stored[index] {
                return Err(Fault::Data("the data hold no picture"));
            }
            let sample = &self.samples[self.next];
            let shown = sample.shown;
            let data = self.read_sample(self.next)?;
            self.next += 1;
            let frame = self.decoder.decode(&data)?;
            if let Some(frame) = frame
                && shown >= keep_from
            {
                self.ready.insert(shown, frame);
            }
        }
        self.ready.remove(&index).ok_or(Fault::Data("the data hold no picture"))
    }

    /// Reads a stored picture and replaces the lengths of its NAL units by start codes, as the decoder
    /// expects.
    fn read_sample(&mut self, at: usize) -> Result<Vec<u8>, Fault> {
        let sample = &self.samples[at];
        let end = sample.offset.checked_add(sample.size as u64);
        if end.is_none_or(|end| self.file.metadata().is_ok_and(|file| file.len() < end)) {
            return Err(Fault::Data("the file is truncated"));
        }
        let mut data = vec![0; sample.size];
        self.file.seek(SeekFrom::Start(sample.offset))?;
        self.file.read_exact(&mut data).map_err(Fault::TooShort)?;
        let mut stream = if sample.keyframe || at == 0 { self.headers.clone() } else { Vec::new() };
        let mut rest = data.as_slice();
        while !rest.is_empty() {
            let (length, after) = rest.split_at_checked(self.length_bytes).ok_or(DAMAGED)?;
            let length = length.iter().fold(0_usize, |value, &byte| value << 8 | usize::from(byte));
            let (unit, after) = after.split_at_checked(length).ok_or(DAMAGED)?;
            stream.extend(START_CODE);
            stream.extend(unit);
            rest = after;
        }
        Ok(stream)
    }

    fn picture(&self, frame: &YuvFrame) -> Picture {
        let planes = Planes {
            width: frame.width,
            height: frame.height,
            y: &frame.y,
            u: &frame.u,
            v: &frame.v,
            subsampling: (2, 2),
        };
        // If the file does not specify a matrix, BT.601 is used even for high definition: both trackers
        // mostly use luma.
        let matrix = if self.info.matrix == 1 { Matrix::Bt709 } else { Matrix::Bt601 };
        let rgb = colour::to_rgb(&planes, Colour { matrix, full_range: self.info.full_range });
        let (left, top) = (self.info.crop_left, self.info.crop_top);
        let (width, height) = (frame.width.saturating_sub(left), frame.height.saturating_sub(top));
        if (left, top) == (0, 0) {
            return Picture::rgb(width, height, rgb);
        }
        let rows = rgb.chunks_exact(frame.width * 3).skip(top);
        Picture::rgb(width, height, rows.flat_map(|row| &row[left * 3..]).copied().collect())
    }
}

impl FrameSource for Mp4 {
    fn length(&self) -> Option<usize> {
        Some(self.samples.len())
    }

    fn rate(&self) -> Option<FrameRate> {
        self.rate
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if index >= self.samples.len() {
            return Ok(None);
        }
        let backwards = index < self.last_wanted;
        self.last_wanted = index;
        let keep_from = if backwards { index.saturating_sub(BACKWARD_WINDOW) } else { index };
        if !self.ready.contains_key(&index) {
            self.seek_for(index);
        }
        let frame = self.decode_until(index, keep_from).map_err(|fault| {
            let message = format!("cannot decode frame {index} of {}: {fault}", self.name);
            Error::source(message, advice(&fault))
        })?;
        Ok(Some(self.picture(&frame)))
    }
}

/// A hint for a frame that cannot be decoded.
fn advice(fault: &Fault) -> &'static str {
    match fault {
        Fault::Decoder(DecodeError::Unsupported(_)) => {
            "the frames tracked before it are kept; to convert the video: \
             ffmpeg -i IN -c:v libx264 -pix_fmt yuv420p OUT.mp4"
        }
        _ => {
            "the frames tracked before it are kept; skip it with --end before it and --start after it"
        }
    }
}

/// Feeds the container's index to the demultiplexer, in the pieces that it requests. The error is the reason
/// why the index cannot be read.
fn demux(file: &mut File) -> Result<Mp4FileDemuxer, String> {
    let unreadable = |error: io::Error| error.to_string();
    let size = file.metadata().map_err(unreadable)?.len();
    let mut demuxer = Mp4FileDemuxer::new();
    while let Some(wanted) = demuxer.required_input() {
        if wanted.position >= size {
            return Err("the file has no index (moov box)".to_string());
        }
        let rest = size - wanted.position;
        let count = wanted.size.map_or(rest, |count| rest.min(count as u64));
        let mut data = vec![0; usize::try_from(count).map_err(damaged_index)?];
        file.seek(SeekFrom::Start(wanted.position)).map_err(unreadable)?;
        file.read_exact(&mut data).map_err(unreadable)?;
        demuxer.handle_input(Input { position: wanted.position, data: &data });
    }
    demuxer.tracks().map_err(damaged_index)?;
    Ok(demuxer)
}

fn damaged_index(error: impl Display) -> String {
    format!("the index is damaged: {error}")
}

/// The stored pictures as the container lists them.
struct RawSamples {
    list: Vec<(u64, usize, bool, i64)>, // offset, size, keyframe, presentation time
    rate: Option<FrameRate>,
}

/// The codec and the pictures of the first video track; `None` if the file has no video.
fn video_samples(
    demuxer: &mut Mp4FileDemuxer,
) -> Result<Option<(Option<SampleEntry>, RawSamples)>, String> {
    let tracks = demuxer.tracks().map_err(damaged_index)?;
    let Some(video) = tracks.iter().find(|track| track.kind == TrackKind::Video) else {
        return Ok(None);
    };
    let (id, timescale) = (video.track_id, video.timescale.get());
    let (mut entry, mut list, mut duration) = (None, Vec::new(), 0_u64);
    while let Some(sample) = demuxer.next_sample().map_err(damaged_index)? {
        if sample.track.track_id != id {
            continue;
        }
        entry = entry.or_else(|| sample.sample_entry.cloned());
        let shown = i64::try_from(sample.timestamp).map_err(damaged_index)?
            + sample.composition_time_offset.unwrap_or(0);
        duration += u64::from(sample.duration);
        list.push((sample.data_offset, sample.data_size, sample.keyframe, shown));
    }
    let rate = rate(list.len() as u64 * u64::from(timescale), duration);
    Ok(Some((entry, RawSamples { list, rate })))
}

/// The frame rate in lowest terms; `None` if it is not a valid rate.
fn rate(frames: u64, seconds: u64) -> Option<FrameRate> {
    let (mut a, mut b) = (frames, seconds);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    FrameRate::new(u32::try_from(frames.checked_div(a)?).ok()?, u32::try_from(seconds / a).ok()?)
}

/// The samples with their presentation indices, and for each presentation index the sample's index.
fn presentation_order(raw: &RawSamples) -> (Vec<Sample>, Vec<usize>) {
    let mut stored: Vec<usize> = (0..raw.list.len()).collect();
    stored.sort_by_key(|&k| raw.list[k].3); // stable: equal times keep the stored order
    let mut shown = vec![0; stored.len()];
    stored.iter().enumerate().for_each(|(number, &k)| shown[k] = number);
    let samples = raw.list.iter().zip(shown);
    let samples = samples
        .map(|(&(offset, size, keyframe, _), shown)| Sample { offset, size, keyframe, shown })
        .collect();
    (samples, stored)
}

/// Checks that the decoder supports this kind of H.264.
fn supported(avc: &Avc1Box) -> Result<StreamInfo, OpenError> {
    let info = avc.avcc_box.sps_list.first().and_then(|set| h264_sps::parse(set));
    let Some(info) = info else {
        return Err(OpenError::Codec("H.264 without a readable parameter set".into()));
    };
    if info.chroma_format != 1 {
        return Err(OpenError::Codec("H.264 that is not 4:2:0".into()));
    }
    if info.bit_depth != 8 {
        return Err(OpenError::Codec(format!("{}-bit H.264", info.bit_depth)));
    }
    if info.mixed_interlace {
        return Err(OpenError::Codec("interlaced H.264".into()));
    }
    Ok(info)
}

fn parameter_sets(avc: &Avc1Box) -> Vec<u8> {
    let sets = avc.avcc_box.sps_list.iter().chain(&avc.avcc_box.pps_list);
    sets.flat_map(|set| START_CODE.iter().chain(set)).copied().collect()
}

fn codec_name(entry: &SampleEntry) -> String {
    match entry {
        SampleEntry::Hev1(_) | SampleEntry::Hvc1(_) => "H.265 (HEVC)".into(),
        SampleEntry::Vp08(_) => "VP8".into(),
        SampleEntry::Vp09(_) => "VP9".into(),
        SampleEntry::Av01(_) => "AV1".into(),
        SampleEntry::Unknown(other) => format!("{}", other.box_type),
        _ => "unknown".into(),
    }
}
