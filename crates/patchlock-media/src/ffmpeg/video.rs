//! The frames of a video that ffmpeg decodes, by their numbers.

use std::collections::BTreeMap;
use std::ops::Range;

use super::VideoInfo;
use super::decoder_log::LogMessage;
use super::process::{DecodeRun, Frames, Packets, Task};
use crate::source::count_by_reading;
use crate::y4m::Header;
use crate::{Error, FrameFault, FrameRate, FrameSource, Note, Picture, SourceInfo};

/// Frames kept when reading backwards, if they are not too large.
const BACKWARD_WINDOW: usize = 32;
/// To reach a frame that is not farther ahead, ffmpeg is not started again.
const NEAR: usize = 48;
/// Frames before the last one from which on the last one that can be decoded is looked for.
const TAIL: usize = 64;

/// A video that ffmpeg decodes.
pub(super) struct Video {
    task: Task,
    info: VideoInfo,
    /// How frames are stored that come from the beginning.
    header: Header,
    run: DecodeRun,
    /// The frame that the part gives next, if none is missing there.
    next: usize,
    /// How many frames the part has given.
    given: usize,
    /// When the last one of these is shown.
    last: Option<i64>,
    /// When frame 0 is shown.
    start: Option<i64>,
    frame_times: FrameTimes,
    /// Whether ffmpeg can begin at a place.
    jumps: bool,
    /// Frames that cannot be decoded, between others.
    missing: Vec<MissingFrames>,
    /// Frames that were read in advance.
    kept: BTreeMap<usize, Picture>,
    /// Whether frames before the wanted one are kept, since they may be wanted next.
    reverse: bool,
    /// The number of frames, if it had to be known.
    length: Option<usize>,
    notes: Vec<Note>,
    is_damage_noted: bool,
    is_change_noted: bool,
}

/// When each frame is shown, in millionths of a second: where ffmpeg has to begin to start with
/// that frame, and by which its number is known.
enum FrameTimes {
    /// The packets of the file have not been read yet. The file may have told the times of all
    /// frames.
    NotRead(Option<Vec<i64>>),
    Known(Vec<i64>),
    /// All frames before a frame have to be decoded.
    Unknown,
}

/// Frames that cannot be decoded, although the file has their data.
struct MissingFrames {
    frames: Range<usize>,
    reason: String,
}

/// A frame as ffmpeg gives it.
struct RawFrame {
    number: usize,
    samples: Vec<u8>,
    time: Option<i64>,
}

/// Whether two times are those of the same frame.
fn is_same(a: i64, b: i64) -> bool {
    a.abs_diff(b) <= 1
}

impl Video {
    /// Starts ffmpeg. `times` are those of all frames, if the file tells them.
    pub fn open(
        task: Task,
        info: VideoInfo,
        times: Option<Vec<i64>>,
        reverse: bool,
    ) -> Result<Self, Error> {
        let run = task.start(None, false)?;
        let header = run.header();
        let frame_times = match times.is_some() || info.is_countable {
            true => FrameTimes::NotRead(times),
            false => FrameTimes::Unknown,
        };
        let mut video = Self {
            task,
            info,
            header,
            run,
            next: 0,
            given: 0,
            last: None,
            start: None,
            frame_times,
            jumps: true,
            missing: Vec::new(),
            kept: BTreeMap::new(),
            reverse,
            length: None,
            notes: Vec::new(),
            is_damage_noted: false,
            is_change_noted: false,
        };
        if reverse {
            video.prepare_reverse()?;
        }
        Ok(video)
    }

    /// Reading backwards takes places of the frames, or else a copy of the decoded video.
    fn prepare_reverse(&mut self) -> Result<(), Error> {
        self.frame_times();
        self.length = self.find_end();
        if self.length.is_some() {
            return Ok(());
        }
        self.reverse = false;
        let whole = self.task.start(None, true)?;
        self.begin_run(whole, 0);
        self.length = self.run.length();
        self.note_damage();
        Ok(())
    }

    fn begin_run(&mut self, run: DecodeRun, first: usize) {
        (self.run, self.next, self.given, self.last) = (run, first, 0, None);
    }

    /// When all frames are shown that can be, if that is certain.
    fn frame_times(&mut self) -> Option<&[i64]> {
        if let FrameTimes::NotRead(_) = self.frame_times {
            if self.start.is_none() && self.next == 0 {
                let first = self.advance().ok()??;
                let picture = self.picture(&first);
                self.kept.insert(first.number, picture);
            }
            // The first frame may have asked for the places itself.
            if let FrameTimes::NotRead(told) = &mut self.frame_times {
                let told = told.take().map(|times| Packets { times, key: None });
                let packets = told.or_else(|| self.task.packet_times());
                self.frame_times =
                    packets.map_or(FrameTimes::Unknown, |packets| self.frame_times_of(packets));
            }
        }
        match &self.frame_times {
            FrameTimes::Known(times) => Some(times),
            FrameTimes::NotRead(_) | FrameTimes::Unknown => None,
        }
    }

    /// The places from frame 0 on, which is the first one that can be decoded: a video that was cut
    /// may begin with frames that need others before them. Frames that are shown twice, or at the
    /// same time, have no certain place.
    fn frame_times_of(&mut self, Packets { mut times, key }: Packets) -> FrameTimes {
        let all = times.len();
        let Some(start) = self.start else { return FrameTimes::Unknown };
        let Some(before) = times.iter().position(|&time| is_same(time, start)) else {
            return FrameTimes::Unknown;
        };
        times.drain(..before);
        // Before the first key frame, any may be missing.
        if let Some(key) = key.filter(|&key| start + 1 < key) {
            let seen = self.task.shown_until(key);
            let is_shown = |time: i64| seen.iter().any(|&seen| is_same(seen, time));
            times.retain(|&time| time + 1 >= key || is_shown(time));
        }
        if !times.is_sorted_by(|a, b| a < b) {
            return FrameTimes::Unknown;
        }
        let frames = all - times.len();
        if frames > 0 && self.run.log.first().is_some() {
            self.notes.push(Note::NoBeginning { name: self.task.name(), frames });
        }
        FrameTimes::Known(times)
    }

    /// The next frame of the part; `None` at its end.
    fn advance(&mut self) -> Result<Option<RawFrame>, Error> {
        let Frames::Stream(stream) = &mut self.run.frames else { return Ok(None) };
        let read = stream.read_next().map_err(|error| numbered(error, self.next))?;
        let Some(samples) = read else {
            self.end_of_run();
            return Ok(None);
        };
        let time = self.run.log.time(self.given);
        if self.start.is_none() && self.next == 0 {
            self.start = time;
        }
        let number = time.map_or(self.next, |time| self.number(time));
        self.note_damage();
        self.note_change(number);
        self.given += 1;
        self.next = number + 1;
        self.last = time;
        Ok(Some(RawFrame { number, samples, time }))
    }

    /// The number of the next frame of the part, which is shown at this time. It is not the number
    /// after the last one if ffmpeg has reported an error and left out frames.
    fn number(&mut self, time: i64) -> usize {
        let is_odd = || self.is_late(time) || self.run.log.first().is_some();
        if matches!(&self.frame_times, FrameTimes::NotRead(told) if told.is_some() || is_odd()) {
            self.frame_times();
        }
        let FrameTimes::Known(times) = &self.frame_times else { return self.next };
        if times.get(self.next).is_some_and(|&next| is_same(next, time)) {
            return self.next;
        }
        let later = times.partition_point(|&before| before < time - 1);
        let is_there = times.get(later).is_some_and(|&there| is_same(there, time));
        if let Some(message) = self.run.log.near(self.given)
            && is_there
            && later > self.next
        {
            let reason = format!("ffmpeg: {}; the next good frame is {later}", message.text);
            self.missing.push(MissingFrames { frames: self.next..later, reason });
            self.jumps = true;
            return later;
        }
        // A frame that comes at another time than the packets say has another number.
        self.frame_times = FrameTimes::Unknown;
        self.next
    }

    /// Whether a frame comes later than it should, so that others may be missing before it.
    fn is_late(&self, time: i64) -> bool {
        let Some((last, rate)) = self.last.zip(self.rate()) else { return false };
        (time - last) as f64 / 1e6 > 1.5 * rate.time(1)
    }

    /// Frames for which ffmpeg reports an error at the end of the file do not count.
    fn end_of_run(&mut self) {
        self.note_damage();
        if self.is_damage_noted && self.next > 0 {
            self.frame_times();
        }
        if self.run.log.near(self.given).is_some() {
            self.forget_from(self.next);
        }
    }

    /// Frames from this one on, if there are any, do not count.
    fn forget_from(&mut self, end: usize) {
        if let FrameTimes::Known(times) = &mut self.frame_times
            && end < times.len()
        {
            let frames = times.len() - end;
            times.truncate(end);
            self.notes.push(Note::NoEnd { name: self.task.name(), frames });
        }
    }

    fn note_damage(&mut self) {
        if let Some(first) = self.run.log.first().filter(|_| !self.is_damage_noted) {
            self.is_damage_noted = true;
            let frame = (self.next + first.at).saturating_sub(self.given);
            let (name, message) = (self.task.name(), first.text);
            self.notes.push(Note::Damage { name, frame, message });
        }
    }

    fn note_change(&mut self, frame: usize) {
        if !self.is_change_noted && self.run.log.change() == Some(self.given) {
            self.is_change_noted = true;
            let (name, size) = (self.task.name(), self.header.size());
            self.notes.push(Note::Scaled { name, frame, size });
        }
    }

    /// The number of frames up to the last one that can be decoded. Frames after it are forgotten.
    fn find_end(&mut self) -> Option<usize> {
        let FrameTimes::Known(times) = &self.frame_times else { return None };
        let last = times.len() - 1;
        let starts = [last, last.saturating_sub(TAIL), 0];
        let (end, error) = starts.into_iter().find_map(|start| self.end_from(times, start))?;
        let length = times.partition_point(|&time| time <= end + 1);
        if let Some(LogMessage { at: frame, text: message }) = error
            && !self.is_damage_noted
        {
            self.is_damage_noted = true;
            self.notes.push(Note::Damage { name: self.task.name(), frame, message });
        }
        self.forget_from(length);
        Some(length)
    }

    /// When the last frame is shown that ffmpeg gives if it begins with this frame, and its first
    /// error with the number of the frame there.
    fn end_from(&self, times: &[i64], start: usize) -> Option<(i64, Option<LogMessage>)> {
        let mut run = self.task.start(before(times, start), false).ok()?;
        let Frames::Stream(stream) = &mut run.frames else { return None };
        let mut last = None;
        for given in 0.. {
            match stream.read_next() {
                Ok(Some(_)) => last = run.log.time(given).or(last),
                Ok(None) | Err(_) => break,
            }
        }
        // The first frames may be of before the start, if ffmpeg cannot begin there.
        let time = last.filter(|&last| last + 1 >= times[start])?;
        let error = run.log.first();
        Some((time, error.map(|error| LogMessage { at: start + error.at, ..error })))
    }

    /// Sees to it that the part gives this frame next, or one not far before it.
    fn approach(&mut self, index: usize) -> Result<(), Error> {
        let is_near = (self.next..=self.next + NEAR).contains(&index);
        let is_known = self.kept.contains_key(&index) || self.missing_at(index).is_some();
        if is_near || is_known || matches!(self.run.frames, Frames::Whole(_)) {
            return Ok(());
        }
        if self.jumps && self.start_at(index).is_some() {
            return Ok(());
        }
        // The frame cannot be decoded, or ffmpeg cannot begin there.
        self.jumps = false;
        if index < self.next {
            let run = self.task.start(None, false)?;
            self.begin_run(run, 0);
        }
        Ok(())
    }

    /// Starts with this frame, if it is certain that ffmpeg then begins with that one.
    fn start_at(&mut self, index: usize) -> Option<()> {
        let times = self.frame_times()?;
        let (wanted, from) = (*times.get(index)?, before(times, index));
        if self.kept.contains_key(&index) {
            return Some(());
        }
        let mut run = self.task.start(from, false).ok()?;
        // Frames of another size than the first one are scaled only from the beginning on.
        let header = run.header();
        if (header.size(), header.frame_bytes()) != (self.header.size(), self.header.frame_bytes())
        {
            return None;
        }
        let Frames::Stream(stream) = &mut run.frames else { return None };
        let samples = stream.read_next().ok()??;
        let time = run.log.time(0).filter(|&time| is_same(time, wanted))?;
        self.begin_run(run, index + 1);
        (self.given, self.last) = (1, Some(time));
        self.note_damage();
        let picture = self.picture(&RawFrame { number: index, samples, time: Some(time) });
        self.kept.insert(index, picture);
        Some(())
    }

    /// The error of a frame that is known to be missing.
    fn missing_at(&self, index: usize) -> Option<Error> {
        let missing = self.missing.iter().find(|missing| missing.frames.contains(&index))?;
        let (name, reason) = (self.task.name(), missing.reason.clone());
        Some(Error::Frame { index, name, fault: FrameFault::Damaged, reason })
    }

    /// Reads a frame that is kept, or one at or after the next one of the part.
    fn read(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if let Frames::Whole(file) = &mut self.run.frames {
            let picture = file.frame(index)?;
            let [time, start] = [index, 0].map(|at| self.run.log.time(at));
            self.start = start;
            return Ok(picture.map(|picture| self.timed(picture, time)));
        }
        loop {
            if let Some(picture) = self.kept.remove(&index) {
                return Ok(Some(picture));
            }
            if let Some(error) = self.missing_at(index) {
                return Err(error);
            }
            let Some(raw) = self.advance()? else { return Ok(None) };
            if raw.number >= index {
                let picture = self.picture(&raw);
                self.kept.insert(raw.number, picture);
            }
        }
    }

    fn picture(&self, raw: &RawFrame) -> Picture {
        self.timed(self.header.picture(&raw.samples, raw.number), raw.time)
    }

    /// Gives a picture its time. One without a time has that of an even rate.
    fn timed(&self, picture: Picture, time: Option<i64>) -> Picture {
        let time = time.zip(self.start).map(|(time, start)| (time - start) as f64 / 1e6);
        let time = time.or(picture.time);
        picture.at(time)
    }

    /// The first frame to read for this one.
    fn window(&self, index: usize) -> usize {
        let held = self.task.limits.held_frames(self.info.pixels, BACKWARD_WINDOW);
        (index + 1).saturating_sub(if self.reverse { held } else { 1 })
    }
}

/// Where ffmpeg begins to start with this frame: between it and the one before.
fn before(times: &[i64], index: usize) -> Option<i64> {
    let earlier = index.checked_sub(1).map(|before| times[before])?;
    Some(earlier + (times[index] - earlier) / 2)
}

/// The error with the number that the frame has in the video.
fn numbered(error: Error, index: usize) -> Error {
    match error {
        Error::Frame { name, fault, reason, .. } => Error::Frame { index, name, fault, reason },
        error => error,
    }
}

impl FrameSource for Video {
    /// ffmpeg counts the shortest distance of two frames, as 100 per second in an uneven GIF. If the
    /// average differs from that, it counts.
    fn info(&self) -> SourceInfo {
        let told = self.header.rate;
        let is_far = |mean: &FrameRate| told.is_none_or(|told| mean.time(100) > told.time(101));
        let rate = self.info.mean_rate.filter(is_far).or(told);
        SourceInfo { length: self.length, rate, sound: self.info.sound }
    }

    fn notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    fn count(&mut self) -> Result<usize, Error> {
        if let Some(length) = self.length {
            return Ok(length);
        }
        let first = self.frame(0)?;
        self.kept.extend(first.map(|picture| (0, picture)));
        self.frame_times();
        if let Some(length) = self.find_end() {
            return Ok(length);
        }
        count_by_reading(self, 1)
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if self.length.is_some_and(|length| index >= length) {
            return Ok(None);
        }
        if !self.kept.contains_key(&index) {
            self.kept.clear();
            let first = self.window(index);
            self.approach(first)?;
            for before in first..index {
                // One that is missing is an error when it is wanted.
                if let Ok(Some(picture)) = self.read(before) {
                    self.kept.insert(before, picture);
                }
            }
        }
        self.read(index)
    }
}
