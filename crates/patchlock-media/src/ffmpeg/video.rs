//! The frames of a video that ffmpeg decodes, by their numbers.

use std::collections::BTreeMap;
use std::ops::Range;

use super::About;
use super::heard::Complaint;
use super::process::{Frames, Packets, Part, Task};
use crate::source::count_by_reading;
use crate::y4m::Header;
use crate::{Error, FrameFault, FrameRate, FrameSource, Note, Picture};

/// Frames kept when reading backwards, if they are not too large.
const BACKWARD_WINDOW: usize = 32;
/// To reach a frame that is not farther ahead, ffmpeg is not started again.
const NEAR: usize = 48;
/// Frames before the last one from which on the last one that can be decoded is looked for.
const TAIL: usize = 64;

/// A video that ffmpeg decodes.
pub(super) struct Video {
    task: Task,
    about: About,
    /// How frames are stored that come from the beginning.
    header: Header,
    part: Part,
    /// The frame that the part gives next, if none is missing there.
    next: usize,
    /// How many frames the part has given.
    given: usize,
    /// When the last one of these is shown.
    last: Option<i64>,
    /// When frame 0 is shown.
    start: Option<i64>,
    places: Places,
    /// Whether ffmpeg can begin at a place.
    jumps: bool,
    /// Frames that cannot be decoded, between others.
    missing: Vec<Missing>,
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
enum Places {
    /// The packets of the file have not been read yet. The file may have told the times of all
    /// frames.
    NotRead(Option<Vec<i64>>),
    Known(Vec<i64>),
    /// All frames before a frame have to be decoded.
    Unknown,
}

/// Frames that cannot be decoded, although the file has their data.
struct Missing {
    frames: Range<usize>,
    reason: String,
}

/// The end of one run of ffmpeg.
struct End {
    /// The frame with which it began.
    start: usize,
    /// When its last frame is shown.
    time: i64,
    /// What it complained of first.
    complaint: Option<Complaint>,
}

/// A frame as ffmpeg gives it.
struct Raw {
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
        about: About,
        times: Option<Vec<i64>>,
        reverse: bool,
    ) -> Result<Self, Error> {
        let part = task.start(None, false)?;
        let header = part.header();
        let places = match times.is_some() || about.is_countable {
            true => Places::NotRead(times),
            false => Places::Unknown,
        };
        let mut video = Self {
            task,
            about,
            header,
            part,
            next: 0,
            given: 0,
            last: None,
            start: None,
            places,
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
        self.places();
        self.length = self.find_end();
        if self.length.is_some() {
            return Ok(());
        }
        self.reverse = false;
        let whole = self.task.start(None, true)?;
        self.begin_part(whole, 0);
        self.length = self.part.length();
        self.note_damage();
        Ok(())
    }

    fn begin_part(&mut self, part: Part, first: usize) {
        (self.part, self.next, self.given, self.last) = (part, first, 0, None);
    }

    /// When all frames are shown that can be, if that is certain.
    fn places(&mut self) -> Option<&[i64]> {
        if let Places::NotRead(_) = self.places {
            if self.start.is_none() && self.next == 0 {
                let first = self.advance().ok()??;
                let picture = self.picture(&first);
                self.kept.insert(first.number, picture);
            }
            // The first frame may have asked for the places itself.
            if let Places::NotRead(told) = &mut self.places {
                let told = told.take().map(|times| Packets { times, key: None });
                let packets = told.or_else(|| self.task.packet_times());
                self.places = packets.map_or(Places::Unknown, |packets| self.places_of(packets));
            }
        }
        match &self.places {
            Places::Known(times) => Some(times),
            Places::NotRead(_) | Places::Unknown => None,
        }
    }

    /// The places from frame 0 on, which is the first one that can be decoded: a video that was cut
    /// may begin with frames that need others before them. Frames that are shown twice, or at the
    /// same time, have no certain place.
    fn places_of(&mut self, Packets { mut times, key }: Packets) -> Places {
        let all = times.len();
        let Some(start) = self.start else { return Places::Unknown };
        let Some(before) = times.iter().position(|&time| is_same(time, start)) else {
            return Places::Unknown;
        };
        times.drain(..before);
        // Before the first key frame, any may be missing.
        if let Some(key) = key.filter(|&key| start + 1 < key) {
            let seen = self.task.shown_until(key);
            let is_shown = |time: i64| seen.iter().any(|&seen| is_same(seen, time));
            times.retain(|&time| time + 1 >= key || is_shown(time));
        }
        if !times.is_sorted_by(|a, b| a < b) {
            return Places::Unknown;
        }
        let frames = all - times.len();
        if frames > 0 && self.part.heard.first().is_some() {
            self.notes.push(Note::NoBeginning { name: self.task.name(), frames });
        }
        Places::Known(times)
    }

    /// The next frame of the part; `None` at its end.
    fn advance(&mut self) -> Result<Option<Raw>, Error> {
        let Frames::Stream(stream) = &mut self.part.frames else { return Ok(None) };
        let read = stream.read_next().map_err(|error| numbered(error, self.next))?;
        let Some(samples) = read else {
            self.end_of_part();
            return Ok(None);
        };
        let time = self.part.heard.time(self.given);
        if self.start.is_none() && self.next == 0 {
            self.start = time;
        }
        let number = time.map_or(self.next, |time| self.number(time));
        self.note_damage();
        self.note_change(number);
        self.given += 1;
        self.next = number + 1;
        self.last = time;
        Ok(Some(Raw { number, samples, time }))
    }

    /// The number of the next frame of the part, which is shown at this time. It is not the number
    /// after the last one if ffmpeg has complained and left out frames.
    fn number(&mut self, time: i64) -> usize {
        let is_odd = || self.is_late(time) || self.part.heard.first().is_some();
        if matches!(&self.places, Places::NotRead(told) if told.is_some() || is_odd()) {
            self.places();
        }
        let Places::Known(times) = &self.places else { return self.next };
        if times.get(self.next).is_some_and(|&next| is_same(next, time)) {
            return self.next;
        }
        let later = times.partition_point(|&before| before < time - 1);
        let is_there = times.get(later).is_some_and(|&there| is_same(there, time));
        if let Some(complaint) = self.part.heard.near(self.given)
            && is_there
            && later > self.next
        {
            let reason = format!("ffmpeg: {}; the next good frame is {later}", complaint.text);
            self.missing.push(Missing { frames: self.next..later, reason });
            self.jumps = true;
            return later;
        }
        // A frame that comes at another time than the packets say has another number.
        self.places = Places::Unknown;
        self.next
    }

    /// Whether a frame comes later than it should, so that others may be missing before it.
    fn is_late(&self, time: i64) -> bool {
        let Some((last, rate)) = self.last.zip(self.rate()) else { return false };
        (time - last) as f64 / 1e6 > 1.5 * rate.time(1)
    }

    /// Frames of which ffmpeg complains at the end of the file do not count.
    fn end_of_part(&mut self) {
        self.note_damage();
        if self.is_damage_noted && self.next > 0 {
            self.places();
        }
        let is_damaged = self.part.heard.near(self.given).is_some();
        if let Places::Known(times) = &mut self.places
            && self.next < times.len()
            && is_damaged
        {
            let frames = times.len() - self.next;
            times.truncate(self.next);
            self.notes.push(Note::NoEnd { name: self.task.name(), frames });
        }
    }

    fn note_damage(&mut self) {
        if let Some(first) = self.part.heard.first().filter(|_| !self.is_damage_noted) {
            self.is_damage_noted = true;
            let frame = (self.next + first.at).saturating_sub(self.given);
            let (name, complaint) = (self.task.name(), first.text);
            self.notes.push(Note::Damage { name, frame, complaint });
        }
    }

    fn note_change(&mut self, frame: usize) {
        if !self.is_change_noted && self.part.heard.change() == Some(self.given) {
            self.is_change_noted = true;
            let (name, size) = (self.task.name(), self.header.size());
            self.notes.push(Note::Scaled { name, frame, size });
        }
    }

    /// The number of frames up to the last one that can be decoded. Frames after it are forgotten.
    fn find_end(&mut self) -> Option<usize> {
        let Places::Known(times) = &self.places else { return None };
        let last = times.len() - 1;
        let starts = [last, last.saturating_sub(TAIL), 0];
        let end = starts.into_iter().find_map(|start| self.end_from(times, start))?;
        let length = times.partition_point(|&time| time <= end.time + 1);
        if let Some(Complaint { at, text: complaint }) = end.complaint
            && !self.is_damage_noted
        {
            self.is_damage_noted = true;
            let (name, frame) = (self.task.name(), end.start + at);
            self.notes.push(Note::Damage { name, frame, complaint });
        }
        if length <= last {
            let frames = last + 1 - length;
            self.notes.push(Note::NoEnd { name: self.task.name(), frames });
        }
        if let Places::Known(times) = &mut self.places {
            times.truncate(length);
        }
        Some(length)
    }

    /// The end of what ffmpeg gives if it begins with this frame.
    fn end_from(&self, times: &[i64], start: usize) -> Option<End> {
        let mut part = self.task.start(before(times, start), false).ok()?;
        let Frames::Stream(stream) = &mut part.frames else { return None };
        let mut last = None;
        for given in 0.. {
            match stream.read_next() {
                Ok(Some(_)) => last = part.heard.time(given).or(last),
                Ok(None) | Err(_) => break,
            }
        }
        // The first frames may be of before the start, if ffmpeg cannot begin there.
        let time = last.filter(|&last| last + 1 >= times[start])?;
        Some(End { start, time, complaint: part.heard.first() })
    }

    /// Sees to it that the part gives this frame next, or one not far before it.
    fn approach(&mut self, index: usize) -> Result<(), Error> {
        let is_near = (self.next..=self.next + NEAR).contains(&index);
        let is_known = self.kept.contains_key(&index) || self.missing_at(index).is_some();
        if is_near || is_known || matches!(self.part.frames, Frames::Whole(_)) {
            return Ok(());
        }
        if self.jumps && self.start_at(index).is_some() {
            return Ok(());
        }
        // The frame cannot be decoded, or ffmpeg cannot begin there.
        self.jumps = false;
        if index < self.next {
            let part = self.task.start(None, false)?;
            self.begin_part(part, 0);
        }
        Ok(())
    }

    /// Starts with this frame, if it is certain that ffmpeg then begins with that one.
    fn start_at(&mut self, index: usize) -> Option<()> {
        let times = self.places()?;
        let (wanted, from) = (*times.get(index)?, before(times, index));
        if self.kept.contains_key(&index) {
            return Some(());
        }
        let mut part = self.task.start(from, false).ok()?;
        // Frames of another size than the first one are scaled only from the beginning on.
        let header = part.header();
        if (header.size(), header.frame_bytes()) != (self.header.size(), self.header.frame_bytes())
        {
            return None;
        }
        let Frames::Stream(stream) = &mut part.frames else { return None };
        let samples = stream.read_next().ok()??;
        let time = part.heard.time(0).filter(|&time| is_same(time, wanted))?;
        self.begin_part(part, index + 1);
        (self.given, self.last) = (1, Some(time));
        self.note_damage();
        let picture = self.picture(&Raw { number: index, samples, time: Some(time) });
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
        if let Frames::Whole(file) = &mut self.part.frames {
            let picture = file.frame(index)?;
            let [time, start] = [index, 0].map(|at| self.part.heard.time(at));
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

    fn picture(&self, raw: &Raw) -> Picture {
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
        let held = self.task.limits.held_frames(self.about.pixels, BACKWARD_WINDOW);
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
    fn length(&self) -> Option<usize> {
        self.length
    }

    /// ffmpeg counts the shortest distance of two frames, as 100 per second in an uneven GIF. If the
    /// average differs from that, it counts.
    fn rate(&self) -> Option<FrameRate> {
        let told = self.header.rate;
        let is_far = |mean: &FrameRate| told.is_none_or(|told| mean.time(100) > told.time(101));
        self.about.mean_rate.filter(is_far).or(told)
    }

    fn has_sound(&self) -> bool {
        self.about.sound
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
        self.places();
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
