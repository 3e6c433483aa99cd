//! Reads MP4 files with H.264 video, decoded in pure Rust. Frames are numbered in presentation
//! order, which may differ from the order in which they are stored. Rotation tags and edit lists
//! are applied, so frames are what a player shows.

mod by_ffmpeg;
mod pictures;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::mem;
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use rusty_h264::{DecodeError, Decoder, YuvFrame};
use shiguredo_mp4::boxes::{Avc1Box, SampleEntry};

use crate::colour::{self, Colour, Matrix, Planes};
use crate::ffmpeg::Program;
use crate::h264::{self, StreamInfo};
use crate::limits::{self, Limits, SizeLimitError};
use crate::mp4_edits::PresentedFrame;
use crate::mp4_index::{self, Sample, Track};
use crate::{
    Container, Error, FrameFault, FrameRate, FrameSource, Note, Picture, SourceInfo, guard,
    orientation,
};

use by_ffmpeg::ExternalReader;
use pictures::{Pictures, micros};

pub use pictures::frame_times;

/// Pixels of the frames kept when reading backwards, which take 200 MB: 64 frames of 1920 x 1080. A
/// longer group of pictures is decoded once per window of this size.
const BACKWARD_PIXELS: usize = 64 * 1920 * 1088;
/// Most frames kept when reading backwards.
const BACKWARD_WINDOW: usize = 64;
/// Number of pictures decoded on opening to check that the decoder supports the video. By then, an
/// encoder has usually used all of its tools.
const PROBED_PICTURES: usize = 8;
const START_CODE: [u8; 4] = [0, 0, 0, 1];

/// Why a file cannot be read by this decoder.
pub enum OpenError {
    /// The container is valid, but its video is not H.264 or of an unsupported kind of H.264.
    /// Completes "the file holds ...".
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
    Panicked(#[from] guard::DecoderPanic),
    #[error("{0}")]
    File(#[from] io::Error),
    #[error("{0}")]
    Data(&'static str),
    #[error("it holds {0}")]
    Kind(String),
    #[error("{0}")]
    TooLarge(#[from] SizeLimitError),
}

const DAMAGED: Fault = Fault::Data("the data are damaged");
const TRUNCATED: Fault = Fault::Data("the file is truncated");

/// The colour box (`colr`) of a file.
#[derive(Debug, Clone, Copy, Default)]
struct ColourTag {
    matrix: Option<u32>,
    full_range: Option<bool>,
}

impl ColourTag {
    fn of(avc: &Avc1Box) -> Self {
        let tag = avc.unknown_boxes.iter().find(|found| found.box_type.as_bytes() == b"colr");
        match tag.map(|found| found.payload.as_slice()) {
            // Primaries, transfer and matrix in two bytes each; QuickTime writes `nclc` without a
            // range.
            Some([b'n', b'c', b'l', kind, _, _, _, _, high, low, rest @ ..]) => Self {
                matrix: Some(u32::from(*high) << 8 | u32::from(*low)),
                full_range: rest.first().filter(|_| *kind == b'x').map(|flags| flags & 0x80 != 0),
            },
            _ => Self::default(),
        }
    }
}

/// An MP4 file with H.264 video.
pub struct Mp4 {
    file: File,
    bytes: u64,
    path: PathBuf,
    name: String,
    limits: Limits,
    /// What may decode instead of the decoder.
    program: Option<Program>,
    external: Option<ExternalReader>,
    pictures: Pictures,
    /// The frames that the edit list shows. In all else, pictures count as they are stored, in the
    /// order of their times.
    frames: Vec<PresentedFrame>,
    /// Ticks per second of the times of frames.
    timescale: u32,
    orientation: Orientation,
    rate: Option<FrameRate>,
    headers: Vec<u8>,
    length_bytes: usize,
    /// What the file says of the colours.
    tagged: ColourTag,
    /// Whether the file has sound too.
    sound: bool,
    notes: Vec<Note>,
    /// Of the last parameter set that was read.
    info: StreamInfo,
    decoder: Decoder,
    next: usize,
    /// The first frame that is sure to be whole since the decoder began anew: those that are shown
    /// before its entrance may refer to pictures that it has not seen.
    whole_from: usize,
    last_wanted: usize,
    /// Whether frames before the wanted one are kept, since they may be wanted next.
    reverse: bool,
    /// Decoded frames that are shown later, with the parameters of their stream.
    ready: BTreeMap<usize, (YuvFrame, StreamInfo)>,
}

/// Whether the first bytes of a file look like an MP4 or QuickTime container.
pub fn looks_like_mp4(head: &[u8]) -> bool {
    head.get(4..8)
        .is_some_and(|kind| [b"ftyp", b"moov", b"mdat", b"wide"].iter().any(|known| kind == *known))
}

impl Mp4 {
    /// Opens a file and reads its index. With `reverse`, it keeps the frames before the wanted one.
    /// Announced frames may be decoded by `program`.
    pub fn open(
        path: &Path,
        reverse: bool,
        limits: Limits,
        program: Option<Program>,
    ) -> Result<Self, OpenError> {
        let name = path.display().to_string();
        let broken =
            |reason: String| OpenError::Broken(Error::unreadable_in(Container::Mp4, &name, reason));
        let mut file = File::open(path).map_err(|error| broken(error.to_string()))?;
        let bytes = file.metadata().map_err(|error| broken(error.to_string()))?.len();
        let Some(track) = mp4_index::read(&mut file, bytes).map_err(broken)? else {
            return Err(OpenError::Broken(Error::NoVideo(name)));
        };
        if track.fragmented {
            return Err(OpenError::Codec("a fragmented video".into()));
        }
        if track.samples.is_empty() {
            return Err(broken("its video has no frames".into()));
        }
        let rate = rate(&track);
        let avc = match track.entry {
            Some(SampleEntry::Avc1(avc)) => avc,
            None => return Err(OpenError::Codec("a video in several encodings".into())),
            Some(other) => return Err(OpenError::Codec(format!("{} video", codec_name(&other)))),
        };
        let pictures = Pictures::new(track.samples);
        let mut frames = pictures.shown(track.timescale, &track.edits, bytes).map_err(broken)?;
        if frames.is_empty() {
            return Err(broken("its edit list shows no frame".into()));
        }
        let missing = pictures.cut(&mut frames, bytes);
        if frames.is_empty() {
            return Err(broken("the file is truncated before the first frame".into()));
        }
        let note = Note::NoEnd { name: name.clone(), frames: missing };
        let notes = Vec::from_iter(Some(note).filter(|_| missing > 0));
        let headers = parameter_sets(&avc).map_err(broken)?;
        let info = stream_info(&headers, &limits).map_err(|fault| match fault {
            Fault::Kind(codec) => OpenError::Codec(codec),
            Fault::TooLarge(size) => {
                OpenError::Broken(Error::TooLarge { what: name.clone(), size })
            }
            other => broken(other.to_string()),
        })?;
        let Some(info) = info else {
            return Err(OpenError::Codec("H.264 without a parameter set".into()));
        };
        let mut video = Self {
            file,
            bytes,
            path: path.to_path_buf(),
            limits,
            program,
            external: None,
            pictures,
            frames,
            timescale: track.timescale,
            orientation: track.orientation,
            rate,
            headers,
            tagged: ColourTag::of(&avc),
            sound: track.sound,
            notes,
            length_bytes: usize::from(avc.avcc_box.length_size_minus_one.get()) + 1,
            info,
            decoder: Decoder::new(),
            next: 0,
            whole_from: 0,
            last_wanted: 0,
            reverse,
            ready: BTreeMap::new(),
            name,
        };
        match video.unsupported_tool() {
            Some(tool) => Err(OpenError::Codec(format!("H.264 with {tool}"))),
            None => Ok(video),
        }
    }

    /// An H.264 coding tool in the first pictures that the decoder does not support. Damage is
    /// ignored here: it is reported when the picture is read.
    fn unsupported_tool(&mut self) -> Option<&'static str> {
        let mut decoder = Decoder::new();
        let probed = (limits::PROBED_PIXELS / self.info.pixels()).clamp(1, PROBED_PICTURES);
        for at in 0..self.pictures.samples.len().min(probed) {
            let data = self.read_sample(at).ok()?;
            match guard::decoding(|| decoder.decode(&data)).ok()? {
                Err(DecodeError::Unsupported(tool)) => return Some(tool),
                Err(_) => return None,
                Ok(_) => {}
            }
        }
        None
    }

    /// The last sample from which a decoder can reach a frame. A sample that the file calls a key
    /// frame, but of which a part refers to pictures before it, is none: encoders that refresh a
    /// picture piece by piece mark where that begins.
    fn entrance(&mut self, index: usize) -> usize {
        while let Some(at) = self.pictures.entrance(index) {
            let sample = self.pictures.entrances[at];
            // What cannot be read is an error when it is decoded.
            if sample == 0 || self.read_sample(sample).map_or(true, |data| h264::is_intra(&data)) {
                return sample;
            }
            self.pictures.entrances.remove(at);
        }
        0
    }

    /// Moves the decoder to the position from which the wanted frame takes the least decoding.
    fn seek_for(&mut self, index: usize) {
        let goal = self.pictures.stored[index];
        let entrance = self.entrance(index);
        if goal < self.next || entrance > self.next {
            self.decoder = Decoder::new();
            self.next = entrance;
            self.whole_from = if entrance == 0 { 0 } else { self.pictures.shown[entrance] };
            // What comes after the entrance is decoded again.
            self.ready.clear();
        }
    }

    fn decode_until(&mut self, index: usize, keep_from: usize) -> Result<(), Fault> {
        self.ready = self.ready.split_off(&keep_from);
        let held = self.limits.held_frames(self.info.pixels(), limits::REFERENCES);
        let held = held + index - keep_from;
        while !self.ready.contains_key(&index) {
            if self.next > self.pictures.stored[index] {
                return Err(Fault::Data("the data hold no picture"));
            }
            let shown = self.pictures.shown[self.next];
            let data = self.read_sample(self.next)?;
            self.next += 1;
            if shown < keep_from && h264::is_disposable(&data) {
                continue;
            }
            let Some(frame) = self.decode(&data)? else { continue };
            if shown < keep_from.max(self.whole_from) {
                continue;
            }
            if self.ready.len() > held {
                return Err(Fault::Data(
                    "too many frames are stored before those shown before them",
                ));
            }
            self.ready.insert(shown, (frame, self.info));
        }
        Ok(())
    }

    /// Decodes the data of a picture. After a panic of the decoder, the next picture is decoded by
    /// a new one.
    fn decode(&mut self, data: &[u8]) -> Result<Option<YuvFrame>, Fault> {
        let decoder = &mut self.decoder;
        match guard::decoding(|| decoder.decode(data)) {
            Ok(frame) => Ok(frame?),
            Err(panic) => {
                self.decoder = Decoder::new();
                Err(panic.into())
            }
        }
    }

    /// Reads a stored picture and replaces the lengths of its NAL units by start codes, as the
    /// decoder expects.
    fn read_sample(&mut self, at: usize) -> Result<Vec<u8>, Fault> {
        let Sample { offset, size, keyframe, .. } = self.pictures.samples[at];
        let size = size as usize;
        if size > limits::COMPRESSED_BYTES {
            return Err(Fault::Data("it has more bytes than a frame may have"));
        }
        if offset.saturating_add(size as u64) > self.bytes {
            return Err(TRUNCATED);
        }
        let mut data = vec![0; size];
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.read_exact(&mut data)?;
        let mut stream = if keyframe || at == 0 { self.headers.clone() } else { Vec::new() };
        let mut rest = data.as_slice();
        while !rest.is_empty() {
            let (length, after) = rest.split_at_checked(self.length_bytes).ok_or(DAMAGED)?;
            let length = length.iter().fold(0_usize, |value, &byte| value << 8 | usize::from(byte));
            let (unit, after) = after.split_at_checked(length).ok_or(DAMAGED)?;
            if !unit.is_empty() {
                stream.extend(START_CODE);
                stream.extend(unit);
            }
            rest = after;
        }
        self.check(&stream)?;
        Ok(stream)
    }

    /// Checks what a stored picture would make the decoder do. It may hold parameter sets of its
    /// own.
    fn check(&mut self, stream: &[u8]) -> Result<(), Fault> {
        let pictures = h264::units(stream).iter().filter(|unit| h264::begins_picture(unit)).count();
        if pictures > limits::PICTURES_PER_SAMPLE {
            return Err(DAMAGED);
        }
        if let Some(info) = stream_info(stream, &self.limits)? {
            self.info = info;
        }
        Ok(())
    }

    /// The error for a frame with this fault. Of a damaged one, it names the next key frame that is
    /// there.
    fn failure(&mut self, fault: Fault, index: usize) -> Error {
        let mut error = fault.of(index, &self.name);
        if let Error::Frame { fault: FrameFault::Damaged, reason, .. } = &mut error
            && let Some(next) = self.next_key_frame(index)
        {
            *reason += &format!("; the next key frame is {next}");
        }
        error
    }

    fn next_key_frame(&mut self, index: usize) -> Option<usize> {
        let info = self.info;
        let picture = self.frames.get(index)?.picture;
        let Pictures { entrances, shown, .. } = &self.pictures;
        let later = entrances.partition_point(|&sample| shown[sample] <= picture);
        let later = entrances[later..].to_vec();
        let is_whole =
            |sample: &usize| self.read_sample(*sample).is_ok_and(|data| h264::is_intra(&data));
        let next = later.into_iter().find(is_whole);
        self.info = info;
        let shown = self.pictures.shown[next?];
        let after = self.frames.iter().skip(index).position(|frame| frame.picture == shown)?;
        Some(index + after)
    }

    /// What the stream says of its colours, else what the file says, else what is usual for the
    /// size.
    fn colour(&self, frame: &Planes<'_>, info: &StreamInfo) -> Colour {
        let matrix = info.matrix.or(self.tagged.matrix).and_then(Matrix::of_code);
        Colour {
            matrix: matrix.unwrap_or_else(|| Matrix::usual(frame.width, frame.height)),
            full_range: info.full_range.or(self.tagged.full_range).unwrap_or(false),
        }
    }

    fn picture(&self, frame: &Planes<'_>, info: &StreamInfo) -> Picture {
        let colour = self.colour(frame, info);
        let rgb = colour::to_rgb(frame, colour);
        let (left, top) = (info.crop_left, info.crop_top);
        if (left, top) == (0, 0) || left >= frame.width || top >= frame.height {
            return orientation::oriented(frame.width, frame.height, rgb, self.orientation);
        }
        let rows = rgb.chunks_exact(frame.width * 3).skip(top);
        let rgb = rows.flat_map(|row| &row[left * 3..]).copied().collect();
        orientation::oriented(frame.width - left, frame.height - top, rgb, self.orientation)
    }
}

impl FrameSource for Mp4 {
    fn info(&self) -> SourceInfo {
        SourceInfo { length: Some(self.frames.len()), rate: self.rate, sound: self.sound }
    }

    fn notes(&mut self) -> Vec<Note> {
        mem::take(&mut self.notes)
    }

    fn announce(&mut self, first: usize, span: usize) {
        self.external = None;
        let span = span.min(self.frames.len().saturating_sub(first));
        if span.saturating_mul(self.info.pixels()) >= by_ffmpeg::LONG && !self.reverse {
            self.external = self.start_ffmpeg(first);
        }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let Some(&PresentedFrame { picture, time }) = self.frames.get(index) else {
            return Ok(None);
        };
        let ticks = time.saturating_sub(self.frames[0].time);
        let seconds = ticks as f64 / f64::from(self.timescale);
        if let Some((data, info)) = self.by_ffmpeg(picture) {
            self.last_wanted = picture;
            let [width, height] = info.shown();
            let shown = self.picture(&planes_of(&data, width, height), &info);
            return Ok(Some(shown.at(Some(seconds))));
        }
        let backwards = self.reverse || picture < self.last_wanted;
        self.last_wanted = picture;
        let window = (BACKWARD_PIXELS / self.info.pixels().max(1)).clamp(1, BACKWARD_WINDOW);
        let keep_from = if backwards { picture.saturating_sub(window) } else { picture };
        if !self.ready.contains_key(&picture) {
            self.seek_for(picture);
        }
        if let Err(fault) = self.decode_until(picture, keep_from) {
            return Err(self.failure(fault, index));
        }
        let shown = self.ready.get(&picture).map(|(frame, info)| {
            let &YuvFrame { width, height, ref y, ref u, ref v } = frame;
            let planes = Planes { width, height, y, u, v, subsampling: (2, 2) };
            self.picture(&planes, info).at(Some(seconds))
        });
        if !self.reverse {
            self.ready.remove(&picture);
        }
        Ok(shown)
    }
}

/// The planes of a picture that are one after the other.
fn planes_of(data: &[u8], width: usize, height: usize) -> Planes<'_> {
    let (y, chroma) = data.split_at(width * height);
    let (u, v) = chroma.split_at(chroma.len() / 2);
    Planes { width, height, y, u, v, subsampling: (2, 2) }
}

impl Fault {
    /// The error for a frame with this fault.
    fn of(self, index: usize, name: &str) -> Error {
        let fault = match self {
            Self::TooLarge(size) => {
                return Error::TooLarge { what: format!("frame {index} of {name}"), size };
            }
            Self::Decoder(DecodeError::Unsupported(_)) | Self::Kind(_) => FrameFault::Unsupported,
            _ => FrameFault::Damaged,
        };
        Error::Frame { index, name: name.to_string(), fault, reason: self.to_string() }
    }
}

/// The frame rate in lowest terms; `None` if it is not a valid rate.
fn rate(track: &Track) -> Option<FrameRate> {
    let (frames, seconds) =
        (track.samples.len() as u64 * u64::from(track.timescale), track.duration);
    let (mut a, mut b) = (frames, seconds);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    FrameRate::new(u32::try_from(frames.checked_div(a)?).ok()?, u32::try_from(seconds / a).ok()?)
}

/// The last parameter set in a stream. All are checked, since pictures may use any of them.
fn stream_info(stream: &[u8], limits: &Limits) -> Result<Option<StreamInfo>, Fault> {
    let sets =
        h264::units(stream).into_iter().filter(|u| h264::unit_type(u) == Some(h264::PARAMETER_SET));
    let mut last = None;
    for set in sets {
        let Ok(info) = h264::parse(set) else {
            return Err(Fault::Kind("H.264 without a readable parameter set".into()));
        };
        supported(&info, limits)?;
        last = Some(info);
    }
    Ok(last)
}

/// Checks that the decoder supports this kind of H.264, and that it needs no more memory than it
/// may.
fn supported(info: &StreamInfo, limits: &Limits) -> Result<(), Fault> {
    let kind = |what: String| Err(Fault::Kind(what));
    if info.chroma_format != 1 {
        return kind("H.264 that is not 4:2:0".into());
    }
    if info.bit_depth != 8 {
        return kind(format!("{}-bit H.264", info.bit_depth));
    }
    if info.mixed_interlace {
        return kind("interlaced H.264".into());
    }
    limits.check(info.width, info.height)?;
    if info.references > limits.held_frames(info.pixels(), limits::REFERENCES) {
        let StreamInfo { width, height, references, .. } = info;
        return kind(format!("H.264 with {references} references of {width} x {height} pixels"));
    }
    Ok(())
}

/// The parameter sets outside the pictures, each after a start code.
fn parameter_sets(avc: &Avc1Box) -> Result<Vec<u8>, String> {
    let sets = avc.avcc_box.sps_list.iter().chain(&avc.avcc_box.pps_list);
    let sets: Vec<u8> = sets.flat_map(|set| START_CODE.iter().chain(set)).copied().collect();
    if sets.len() > limits::PARAMETER_SET_BYTES {
        return Err(format!("{} bytes of parameter sets are not accepted", sets.len()));
    }
    Ok(sets)
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
