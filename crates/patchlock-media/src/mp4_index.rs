//! Reads the index (`moov` box) of an MP4 file: where the pictures of the video track are, and when
//! each is shown. No count is believed before the bytes behind it were seen.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use image::metadata::Orientation;
use shiguredo_mp4::boxes::{
    HdlrBox, MdiaBox, MoovBox, MvexBox, MvhdBox, SampleEntry, StblBox, StcoBox, StszBox, TrakBox,
};
use shiguredo_mp4::{BoxHeader, BoxType, Decode, Either};

use crate::mp4_edits::EditList;
use crate::{limits, orientation};

/// The reason if one table of the index has fewer entries than another.
const TABLES_DISAGREE: &str = "the index is damaged: its tables do not fit each other";

/// One stored picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample {
    /// Where its data begin in the file.
    pub offset: u64,
    /// Bytes of data.
    pub size: u32,
    /// Whether a decoder can start here.
    pub keyframe: bool,
    /// When it is shown, in ticks of the track.
    pub time: i64,
}

/// The video track of a file.
pub struct Track {
    /// How the pictures are encoded; `None` if they are encoded in several ways, or there is none.
    pub entry: Option<SampleEntry>,
    /// The pictures as they are stored, which is the order of decoding.
    pub samples: Vec<Sample>,
    /// Whether further pictures are in fragments, which this index does not list.
    pub fragmented: bool,
    /// Ticks per second.
    pub timescale: u32,
    /// Ticks that all pictures take together.
    pub duration: u64,
    /// How the pictures are turned before they are shown.
    pub orientation: Orientation,
    /// Which part of the track is shown when.
    pub edits: EditList,
    /// Whether the file also has a track of sound.
    pub sound: bool,
}

/// Reads the first video track of a file of `bytes` bytes; `None` if it has none. The error is the
/// reason why the index cannot be read.
pub fn read(file: &mut File, bytes: u64) -> Result<Option<Track>, String> {
    let moov = find_index(file, bytes)?;
    let (mut video, mut movie) = (None, None);
    let (mut fragmented, mut sound) = (false, false);
    for found in Boxes(&moov) {
        let (kind, whole) = found?;
        match kind {
            TrakBox::TYPE => match handler(whole) {
                Some(HdlrBox::HANDLER_TYPE_VIDE) => video = video.or(Some(whole)),
                Some(HdlrBox::HANDLER_TYPE_SOUN) => sound = true,
                _ => {}
            },
            MvexBox::TYPE => fragmented = true,
            MvhdBox::TYPE => movie = Some(MvhdBox::decode(whole).map_err(damaged)?.0),
            _ => {}
        }
    }
    let Some(movie) = movie else {
        return Err("the index is damaged: it has no header (mvhd box)".to_string());
    };
    let Some(video) = video else { return Ok(None) };
    let (video, _) = TrakBox::decode(video).map_err(damaged)?;
    let track = Track::new(video, &movie, bytes)?;
    Ok(Some(Track { fragmented, sound, ..track }))
}

/// What a track holds, from its `mdia` and `hdlr` boxes. The other boxes of tracks that are not
/// read may be of any kind.
fn handler(track: &[u8]) -> Option<[u8; 4]> {
    let media = inner(track, MdiaBox::TYPE)?;
    HdlrBox::decode(inner(media, HdlrBox::TYPE)?).ok().map(|(handler, _)| handler.handler_type)
}

/// The first box of a type within a box.
fn inner(whole: &[u8], kind: BoxType) -> Option<&[u8]> {
    let (_, content) = BoxHeader::decode_header_and_payload(whole).ok()?;
    Boxes(content).map_while(Result::ok).find(|(found, _)| *found == kind).map(|(_, whole)| whole)
}

fn damaged(error: shiguredo_mp4::Error) -> String {
    let place = error.box_type.map_or(String::new(), |kind| format!(" (in the box {kind})"));
    format!("the index is damaged: {}{place}", error.reason)
}

/// The content of the `moov` box.
fn find_index(file: &mut File, bytes: u64) -> Result<Vec<u8>, String> {
    let mut at = 0;
    while at < bytes {
        let head = read_at(file, at, BoxHeader::MAX_SIZE as u64)?;
        let (header, header_bytes) = BoxHeader::decode(&head).map_err(damaged)?;
        let size = match header.box_size.get() {
            0 => bytes - at, // the last box may leave its size open
            size => size,
        };
        if header.box_type == MoovBox::TYPE {
            if size > bytes - at {
                return Err("the file is truncated within its index (moov box)".to_string());
            }
            if size > limits::INDEX_BYTES {
                return Err(format!("an index (moov box) of {size} bytes is not accepted"));
            }
            let header_bytes = header_bytes as u64;
            return read_at(file, at + header_bytes, size.saturating_sub(header_bytes));
        }
        at = at.saturating_add(size.max(header_bytes as u64));
    }
    Err("the file has no index (moov box)".to_string())
}

/// The bytes from this place on, at most `most`.
fn read_at(file: &mut File, at: u64, most: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let sought = file.seek(SeekFrom::Start(at));
    sought.and_then(|_| file.take(most).read_to_end(&mut bytes)).map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// Iterates over the boxes in some data: the type and all bytes of each.
struct Boxes<'a>(&'a [u8]);

impl<'a> Iterator for Boxes<'a> {
    type Item = Result<(BoxType, &'a [u8]), String>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let data = std::mem::take(&mut self.0);
        Some(BoxHeader::decode_header_and_payload(data).map_err(damaged).map(|(header, _)| {
            let size = match header.box_size.get() {
                0 => data.len(),
                size => size as usize, // at most the length of the data, as was just checked
            };
            let (whole, rest) = data.split_at(size);
            self.0 = rest;
            (header.box_type, whole)
        }))
    }
}

impl Track {
    fn new(track: TrakBox, movie: &MvhdBox, bytes: u64) -> Result<Self, String> {
        let orientation = orientation::of_matrices(&track.tkhd_box.matrix, &movie.matrix);
        let edits = track.edts_box.and_then(|edits| edits.elst_box);
        let edits = edits.map_or_else(Vec::new, |edits| edits.entries);
        let timescale = track.mdia_box.mdhd_box.timescale.get();
        let mut table = track.mdia_box.minf_box.stbl_box;
        let (mut samples, entry) = places(&table, bytes)?;
        let duration = times(&table, &mut samples)?;
        mark_keyframes(&table, &mut samples);
        let entry = entry.filter(|&entry| entry < table.stsd_box.entries.len());
        let entry = entry.map(|entry| table.stsd_box.entries.swap_remove(entry));
        Ok(Self {
            entry,
            samples,
            fragmented: false,
            timescale,
            duration,
            orientation,
            edits: EditList { edits, timescale: movie.timescale.get() },
            sound: false,
        })
    }
}

/// The places of all samples in the file, and which sample entry describes them, if it is one for
/// all.
fn places(table: &StblBox, bytes: u64) -> Result<(Vec<Sample>, Option<usize>), String> {
    let count = match &table.stsz_box {
        StszBox::Fixed { sample_count, .. } => *sample_count as usize,
        StszBox::Variable { entry_sizes } => entry_sizes.len(),
    };
    if count as u64 > limits::frames(bytes) {
        return Err(format!(
            "the index is damaged: it claims {count} frames, which a file of {bytes} bytes cannot hold"
        ));
    }
    let size = |k: usize| match &table.stsz_box {
        StszBox::Fixed { sample_size, .. } => sample_size.get(),
        StszBox::Variable { entry_sizes } => entry_sizes[k],
    };
    let mut samples = Vec::with_capacity(count);
    let mut runs = table.stsc_box.entries.iter().peekable();
    let (mut run, mut entries) = (None, (None, false));
    for (chunk, start) in (1..).zip(chunk_offsets(table)) {
        while let Some(next) = runs.next_if(|next| next.first_chunk.get() <= chunk) {
            run = Some(next);
        }
        let Some(run) = run.filter(|_| samples.len() < count) else { break };
        let entry = run.sample_description_index.get() as usize - 1;
        entries = (entries.0.or(Some(entry)), entries.1 || entries.0.is_some_and(|e| e != entry));
        let mut offset = start;
        for _ in 0..(run.sample_per_chunk as usize).min(count - samples.len()) {
            let size = size(samples.len());
            samples.push(Sample { offset, size, keyframe: false, time: 0 });
            offset = offset.saturating_add(u64::from(size));
        }
    }
    if samples.len() < count {
        return Err(TABLES_DISAGREE.to_string());
    }
    check_overlap(&samples, bytes)?;
    Ok((samples, entries.0.filter(|_| !entries.1)))
}

fn chunk_offsets(table: &StblBox) -> Box<dyn Iterator<Item = u64> + '_> {
    match &table.stco_or_co64_box {
        Either::A(StcoBox { chunk_offsets }) => {
            Box::new(chunk_offsets.iter().map(|&at| u64::from(at)))
        }
        Either::B(long) => Box::new(long.chunk_offsets.iter().copied()),
    }
}

/// Samples have their own bytes: otherwise a small file could claim any amount of data. Those
/// beyond the end of a truncated file do not count.
fn check_overlap(samples: &[Sample], bytes: u64) -> Result<(), String> {
    let inside = samples.iter().filter(|s| s.offset.saturating_add(u64::from(s.size)) <= bytes);
    if inside.map(|sample| u64::from(sample.size)).sum::<u64>() > bytes {
        return Err("the index is damaged: its frames overlap in the file".to_string());
    }
    Ok(())
}

/// Fills in when the samples are shown, and returns the ticks that they take together.
fn times(table: &StblBox, samples: &mut [Sample]) -> Result<u64, String> {
    let mut rest = samples.iter_mut();
    let mut decoded = 0_u64;
    for run in &table.stts_box.entries {
        for sample in rest.by_ref().take(run.sample_count as usize) {
            sample.time = i64::try_from(decoded).map_err(|_| TABLES_DISAGREE)?;
            decoded += u64::from(run.sample_delta);
        }
    }
    if rest.next().is_some() {
        return Err(TABLES_DISAGREE.to_string());
    }
    if let Some(offsets) = &table.ctts_box {
        let mut rest = samples.iter_mut();
        for run in &offsets.entries {
            for sample in rest.by_ref().take(run.sample_count as usize) {
                sample.time = sample.time.saturating_add(run.sample_offset);
            }
        }
        if rest.next().is_some() {
            return Err(TABLES_DISAGREE.to_string());
        }
    }
    Ok(decoded)
}

/// Without a table of keyframes, all samples are keyframes.
fn mark_keyframes(table: &StblBox, samples: &mut [Sample]) {
    let Some(keyframes) = &table.stss_box else {
        samples.iter_mut().for_each(|sample| sample.keyframe = true);
        return;
    };
    for number in &keyframes.sample_numbers {
        if let Some(sample) = samples.get_mut(number.get() as usize - 1) {
            sample.keyframe = true;
        }
    }
}
