//! Writes MP4 files with H.264 video: in pure Rust, or with pictures that ffmpeg has encoded.

use std::fmt::Display;
use std::io::{Seek, SeekFrom, Write};
use std::num::NonZeroU32;

use rusty_h264::{Encoder, EncoderConfig, Preset, YuvFrame};
use shiguredo_mp4::bitstream::h264::{
    H264NalUnitType, H264SampleEntryConfig, LengthSize, build_avc1_box_from_annexb,
    parse_annexb_nal_units,
};
use shiguredo_mp4::boxes::{SampleEntry, UnknownBox};
use shiguredo_mp4::mux::{
    Mp4FileMuxer, Mp4FileMuxerOptions, Sample, estimate_maximum_moov_box_size,
};
use shiguredo_mp4::{BoxSize, BoxType, TrackKind};

use crate::external_encoder::ExternalEncoder;
use crate::{Error, FrameRate, colour};

/// Fewest ticks per second in which the times of frames are written.
const TICKS: u32 = 60_000;
/// From this many pixels of all frames together, it is worth starting ffmpeg.
const LONG: usize = 30_000_000;
/// Largest distance between keyframes, which bounds how far off a player seeks.
const KEYFRAME_EVERY: u32 = 60;
/// `colr` box: BT.601 primaries, transfer and matrix in limited range, as written by `to_yuv420`.
const COLOUR_BOX: &[u8] = b"nclx\x00\x06\x00\x06\x00\x06\x00";
const COLOUR_BOX_SIZE: u32 = 8 + COLOUR_BOX.len() as u32;

/// Writes a video file frame by frame.
pub struct Mp4Writer<W: Write + Seek> {
    out: W,
    muxer: Mp4FileMuxer,
    encoder: Coder,
    rate: FrameRate,
    timescale: NonZeroU32,
    width: usize,
    height: usize,
    position: u64,
    frames: usize,
    /// The last frame, until the next one says how long it is shown.
    waiting: Option<(Sample, Option<f64>)>,
}

/// What encodes the pictures.
enum Coder {
    Own(Box<Encoder>),
    External(ExternalEncoder),
}

impl<W: Write + Seek> Mp4Writer<W> {
    /// The quantiser of [`Mp4Writer::new`], for video that is to be analysed: 20 loses little.
    pub const FINE: u8 = 20;

    /// Starts a video; all frames have this size in pixels. If the number of frames is known,
    /// `expected` reserves space for the index at the start of the file, so that players can start
    /// before they have loaded all of it.
    ///
    /// # Errors
    /// [`Error::Encode`] if the encoder does not support this size; [`Error::Write`].
    pub fn new(
        out: W,
        width: usize,
        height: usize,
        rate: FrameRate,
        expected: Option<usize>,
    ) -> Result<Self, Error> {
        Self::with_quantiser(out, width, height, rate, expected, Self::FINE)
    }

    /// Starts a video as [`Mp4Writer::new`] does, with a quantiser of 0 (best, largest) to 51. Six
    /// more make the file about half as large.
    ///
    /// # Errors
    /// As [`Mp4Writer::new`]; a larger quantiser is one of [`Error::Encode`].
    pub fn with_quantiser(
        out: W,
        width: usize,
        height: usize,
        rate: FrameRate,
        expected: Option<usize>,
        quantiser: u8,
    ) -> Result<Self, Error> {
        Self::start(out, [width, height], rate, expected, quantiser, None)
    }

    /// Starts a video as [`Mp4Writer::with_quantiser`] does. If it is long, and an ffmpeg with
    /// libx264 is installed, that encodes it, which is several times as fast.
    ///
    /// # Errors
    /// As [`Mp4Writer::with_quantiser`].
    pub fn fastest(
        out: W,
        width: usize,
        height: usize,
        rate: FrameRate,
        expected: Option<usize>,
        quantiser: u8,
    ) -> Result<Self, Error> {
        let pixels = width.saturating_mul(height).saturating_mul(expected.unwrap_or(usize::MAX));
        let even = [width, height].map(|side| side.next_multiple_of(2));
        let external = (pixels >= LONG && quantiser <= 51)
            .then(|| ExternalEncoder::start(even, quantiser, KEYFRAME_EVERY))
            .flatten();
        Self::start(out, [width, height], rate, expected, quantiser, external)
    }

    fn start(
        mut out: W,
        [width, height]: [usize; 2],
        rate: FrameRate,
        expected: Option<usize>,
        quantiser: u8,
        external: Option<ExternalEncoder>,
    ) -> Result<Self, Error> {
        if quantiser > 51 {
            return Err(Error::Encode(format!("the quantiser is {quantiser}; it must be 0 to 51")));
        }
        let mut config = EncoderConfig::new(width.next_multiple_of(2), height.next_multiple_of(2));
        config.preset = Preset::Fast;
        config.qp = quantiser;
        config.gop_size = KEYFRAME_EVERY;
        config.framerate = rate.frames as f32 / rate.seconds as f32;
        // Disable everything that delays output: each frame must come out as it goes in.
        config.scenecut = 0;
        config.lookahead = 0;
        config.mbtree = false;
        let encoder = match external {
            Some(external) => Coder::External(external),
            None => Coder::Own(Box::new(Encoder::new(config).map_err(|error| {
                Error::Encode(format!("cannot encode {width} x {height}: {error:?}"))
            })?)),
        };
        let options = Mp4FileMuxerOptions {
            reserved_moov_box_size: expected
                .map_or(0, |count| estimate_maximum_moov_box_size(&[count])),
            ..Mp4FileMuxerOptions::default()
        };
        let muxer =
            Mp4FileMuxer::with_options(options).map_err(cannot_encode("cannot start the MP4"))?;
        out.write_all(muxer.initial_boxes_bytes())?;
        let position = muxer.initial_boxes_bytes().len() as u64;
        // A multiple of the rate, so that frames at equal distances last equally many ticks.
        let timescale = rate.frames.saturating_mul(TICKS.div_ceil(rate.frames.max(1)));
        let timescale = NonZeroU32::new(timescale).unwrap_or(NonZeroU32::MIN);
        Ok(Self {
            out,
            muxer,
            encoder,
            rate,
            timescale,
            width,
            height,
            position,
            frames: 0,
            waiting: None,
        })
    }

    /// Appends a frame of RGB bytes (`width * height * 3`), which lasts as long as the frame rate
    /// says.
    ///
    /// # Errors
    /// [`Error::Encode`], [`Error::Write`].
    pub fn push(&mut self, rgb: &[u8]) -> Result<(), Error> {
        self.push_at(rgb, None)
    }

    /// Appends a frame as [`Mp4Writer::push`] does. If it and the next frame have a `time` in
    /// seconds, it lasts from one to the other; the times may also fall, as of a video that runs
    /// backwards.
    ///
    /// # Errors
    /// As [`Mp4Writer::push`].
    pub fn push_at(&mut self, rgb: &[u8], time: Option<f64>) -> Result<(), Error> {
        self.encode(&colour::rgb_to_yuv420(rgb, self.width, self.height), time)
    }

    /// Appends a frame as [`Mp4Writer::push_at`] does, of four bytes per pixel: red, green, blue
    /// and one that is not used.
    ///
    /// # Errors
    /// As [`Mp4Writer::push`].
    pub fn push_rgba_at(&mut self, rgba: &[u8], time: Option<f64>) -> Result<(), Error> {
        self.encode(&colour::rgba_to_yuv420(rgba, self.width, self.height), time)
    }

    fn encode(&mut self, frame: &YuvFrame, time: Option<f64>) -> Result<(), Error> {
        match &mut self.encoder {
            Coder::Own(encoder) => {
                let stream = encoder
                    .try_encode(frame)
                    .map_err(|error| Error::Encode(format!("cannot encode a frame: {error:?}")))?;
                self.store(&stream, time)
            }
            Coder::External(encoder) => {
                encoder.push(frame, time)?;
                let mut ready = encoder.ready().into_iter();
                ready.try_for_each(|(stream, time)| self.store(&stream, time))
            }
        }
    }

    /// Writes an encoded picture.
    fn store(&mut self, stream: &[u8], time: Option<f64>) -> Result<(), Error> {
        let units = parse_annexb_nal_units(stream)
            .map_err(cannot_encode("the encoder wrote no valid stream"))?;
        let mut data = Vec::with_capacity(stream.len());
        for unit in units.iter().filter(|unit| !is_parameter_set(unit.nal_unit_type)) {
            let length = u32::try_from(unit.data.len())
                .map_err(cannot_encode("the encoder wrote too much for a frame"))?;
            data.extend(length.to_be_bytes());
            data.extend(unit.data);
        }
        let keyframe = units.iter().any(|unit| unit.nal_unit_type == H264NalUnitType::IdrSlice);
        let sample_entry = if self.frames == 0 { Some(sample_entry(stream)?) } else { None };
        self.out.write_all(&data)?;
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry,
            keyframe,
            timescale: self.timescale,
            duration: self.usual_duration(),
            composition_time_offset: None,
            data_offset: self.position,
            data_size: data.len(),
        };
        self.position += data.len() as u64;
        self.frames += 1;
        let last = self.waiting.replace((sample, time));
        if let Some((sample, begin)) = last {
            self.append(sample, begin, time)?;
        }
        Ok(())
    }

    /// Ticks of a frame without a time. The last frame has them too.
    fn usual_duration(&self) -> u32 {
        let ticks = self.timescale.get() / self.rate.frames.max(1);
        ticks.saturating_mul(self.rate.seconds)
    }

    /// Adds a frame that is shown from `begin` to `end` to the index.
    fn append(
        &mut self,
        mut sample: Sample,
        begin: Option<f64>,
        end: Option<f64>,
    ) -> Result<(), Error> {
        if let (Some(begin), Some(end)) = (begin, end) {
            // Times are rounded, not durations, so that errors do not add up.
            let ticks = |time: f64| (time * f64::from(self.timescale.get())).round();
            sample.duration = (ticks(end) - ticks(begin)).abs().max(1.0) as u32;
        }
        self.muxer.append_sample(&sample).map_err(cannot_encode("cannot add a frame to the MP4"))
    }

    /// Writes the index and returns the writer. A video without frames stays without an index.
    ///
    /// # Errors
    /// [`Error::Encode`], [`Error::Write`].
    pub fn finish(mut self) -> Result<W, Error> {
        if let Coder::External(encoder) = &mut self.encoder {
            let mut rest = encoder.finish()?.into_iter();
            rest.try_for_each(|(stream, time)| self.store(&stream, time))?;
        }
        if let Some((sample, begin)) = self.waiting.take() {
            self.append(sample, begin, None)?;
            let boxes = self.muxer.finalize().map_err(cannot_encode("cannot complete the MP4"))?;
            for (offset, bytes) in boxes.offset_and_bytes_pairs() {
                self.out.seek(SeekFrom::Start(offset))?;
                self.out.write_all(bytes)?;
            }
        }
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Prefixes an error of the encoder or muxer with the operation that failed.
fn cannot_encode<E: Display>(what: &'static str) -> impl FnOnce(E) -> Error {
    move |reason| Error::Encode(format!("{what}: {reason}"))
}

/// Whether a unit belongs in the sample entry rather than in the frame data.
fn is_parameter_set(kind: H264NalUnitType) -> bool {
    matches!(kind, H264NalUnitType::Sps | H264NalUnitType::Pps | H264NalUnitType::Aud)
}

fn sample_entry(stream: &[u8]) -> Result<SampleEntry, Error> {
    let config = H264SampleEntryConfig { length_size: LengthSize::FourBytes };
    let mut entry = build_avc1_box_from_annexb(stream, &config)
        .map_err(cannot_encode("the encoder wrote no parameter sets"))?;
    entry.unknown_boxes.push(UnknownBox {
        box_type: BoxType::Normal(*b"colr"),
        box_size: BoxSize::U32(COLOUR_BOX_SIZE),
        payload: COLOUR_BOX.to_vec(),
    });
    Ok(SampleEntry::Avc1(entry))
}
