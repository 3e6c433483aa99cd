//! Which targets a run follows, and when each starts, restarts or ends: from `--box`, `--box-from`
//! or `--boxes`.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use patchlock::{BoundingBox, Method};
use patchlock_media::{Order, Picture};
use patchlock_track::{files, start_box, text};
use serde::Deserialize;

use crate::advice;
use crate::failure::{Failure, failed, usage};
use crate::target;

const TABLE: &str = "the columns are frame,id,x,y,w,h, counted from 0; a target starts at its first line, \
                     restarts at a later one, and ends at a line without x, y, w and h";

/// The start, restart or end of a target on a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Number of the frame; `None` for the first tracked frame.
    pub frame: Option<usize>,
    /// The target's id, as given by the user.
    pub id: u64,
    /// The box on which the target starts; `None` if it ends.
    pub bbox: Option<BoundingBox>,
}

/// All starts, restarts and ends of targets in a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Targets {
    /// Ordered by frame; those of the first tracked frame have none.
    events: Vec<Event>,
    /// The names of targets, if their ids were no numbers.
    pub names: Names,
    /// Whether the output contains ids: not for a single box from `--box` or `--box-from`.
    pub many: bool,
}

/// The names that the user has given to targets, by their ids.
pub type Names = BTreeMap<u64, Arc<str>>;

/// A line of the table.
#[derive(Deserialize)]
struct Line {
    frame: usize,
    id: String,
    x: Option<f64>,
    y: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
}

impl Targets {
    /// Targets with these boxes in the first tracked frame and the ids 1, 2 and so on.
    pub fn in_first_frame(boxes: &[BoundingBox]) -> Self {
        let event = |(id, &bbox)| Event { frame: None, id, bbox: Some(bbox) };
        Self { many: boxes.len() > 1, ..Self::at_frames((1..).zip(boxes).map(event).collect()) }
    }

    /// Targets that start and end at the frames of these events.
    pub fn at_frames(mut events: Vec<Event>) -> Self {
        events.sort_by_key(|event| event.frame);
        Self { events, names: Names::new(), many: true }
    }

    /// The places of the events of a frame.
    fn places(&self, frame: Option<usize>) -> Range<usize> {
        let first = self.events.partition_point(|event| event.frame < frame);
        first..self.events.partition_point(|event| event.frame <= frame)
    }

    /// Frame and id of each start and restart; no frame for the first tracked one.
    pub fn starts(&self) -> impl Iterator<Item = (Option<usize>, u64)> {
        let starts = self.events.iter().filter(|event| event.bbox.is_some());
        starts.map(|event| (event.frame, event.id))
    }

    /// Reads a CSV file of targets that start and end at any frame.
    pub fn from_table(file: &Path) -> Result<Self, Failure> {
        let name = format!("--boxes {}", file.display());
        let bytes = files::read(file)
            .map_err(|error| failed(format!("{name}: cannot read it: {error}")).hint(TABLE))?;
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
        let mut lines = Vec::new();
        let wrong = |error: csv::Error| usage(format!("{name}: {error}")).hint(TABLE);
        let headers = reader.headers().cloned().map_err(wrong)?;
        for record in reader.into_records() {
            let record = record.map_err(wrong)?;
            let number = record.position().map_or(1, csv::Position::line);
            let line: Line = record.deserialize(Some(&headers)).map_err(wrong)?;
            if line.id.is_empty() {
                let message = format!("{name}, line {number}: the id is empty");
                return Err(usage(message).hint(TABLE));
            }
            lines.push((line, number));
        }
        let numbers = numbered(&lines);
        let mut events = Vec::new();
        let mut seen = BTreeSet::new();
        for (line, number) in &lines {
            let id = numbers.get(&*line.id).copied();
            let id = id.or_else(|| line.id.parse().ok()).unwrap_or(0);
            if !seen.insert((line.frame, id)) {
                let twice =
                    format!("{name}: target {} is given twice in frame {}", line.id, line.frame);
                return Err(usage(twice).hint(TABLE));
            }
            events.push(event(line, id, &format!("{name}, line {number}"))?);
        }
        if events.is_empty() {
            return Err(usage(format!("{name}: the file has no target")).hint(TABLE));
        }
        let names = numbers.into_iter().map(|(name, id)| (id, name.into())).collect();
        Ok(Self { names, ..Self::at_frames(events) })
    }

    /// The same targets in the first frame that a live source gives, whichever that is.
    pub fn in_first_of_live(self) -> Result<Self, Failure> {
        let later = self.events.iter().find(|event| event.frame.unwrap_or(0) > 0);
        if let Some(Event { frame, id, .. }) = later {
            let frame = frame.unwrap_or(0);
            return Err(usage(format!(
                "--boxes: target {id} has a line for frame {frame}; of a live source only the first \
                 frame is known"
            ))
            .hint("give the boxes of frame 0"));
        }
        let events = self.events.into_iter();
        let first = events.map(|event| Event { frame: None, ..event }).collect();
        Ok(Self { many: self.many, names: self.names, ..Self::at_frames(first) })
    }

    /// Fails if an event belongs to a frame that will not be tracked.
    pub fn check(&self, order: &Order, length: Option<usize>) -> Result<(), Failure> {
        let frames = self.events.iter().filter_map(|event| Some((event.frame?, event.id)));
        match { frames }.find(|(frame, _)| !order.holds(*frame, length)) {
            Some((frame, id)) => Err(untracked(frame, id)),
            None => Ok(()),
        }
    }

    /// Fails if more targets are followed at once than this. Each has a memory of its own, whether
    /// it is lost or not.
    pub fn check_number(&self, most: usize, order: &Order, method: &Method) -> Result<(), Failure> {
        let mut followed = BTreeSet::new();
        // The events without a frame come first in both orders.
        let (first, rest) = self.events.split_at(self.places(None).end);
        let mut frames: Vec<&[Event]> = rest.chunk_by(|a, b| a.frame == b.frame).collect();
        if order.reverse {
            frames.reverse();
        }
        for event in first.iter().chain(frames.into_iter().flatten()) {
            match event.bbox {
                Some(_) => followed.insert(event.id),
                None => followed.remove(&event.id),
            };
            if followed.len() > most {
                let all: BTreeSet<u64> = self.starts().map(|(_, id)| id).collect();
                return Err(too_many(most, all.len(), method.info().megabytes));
            }
        }
        Ok(())
    }

    /// Fails if a target starts in this frame on a box that does not fit the frame.
    pub fn check_boxes(&self, frame: usize, picture: &Picture) -> Result<(), Failure> {
        let due = [None, Some(frame)].map(|frame| &self.events[self.places(frame)]);
        for bbox in due.into_iter().flatten().filter_map(|event| event.bbox) {
            start_box::check(&bbox, frame, picture.width, picture.height)?;
        }
        Ok(())
    }

    /// Removes and returns the events of this frame, in the order of the ids. Frames must be passed
    /// in the order of tracking.
    pub fn due(&mut self, frame: usize) -> Vec<Event> {
        let mut due = Vec::new();
        for frame in [None, Some(frame)] {
            due.extend(self.events.drain(self.places(frame)));
        }
        due.sort_by_key(|event| event.id);
        due
    }

    /// Fails if the source ended before the frame of an event.
    pub fn check_all_done(&self) -> Result<(), Failure> {
        match self.events.first() {
            Some(event) => Err(untracked(event.frame.unwrap_or(0), event.id)),
            None => Ok(()),
        }
    }
}

/// The error for more targets at once than `most`, of `count` in all.
fn too_many(most: usize, count: usize, megabytes: usize) -> Failure {
    let gigabytes = (count * megabytes) as f64 / 1000.0;
    usage(format!(
        "more than {most} targets would be tracked at once, each in about {megabytes} MB of memory"
    ))
    .hint(format!(
        "--max-targets {count} allows all {count} targets, which take {gigabytes:.1} GB at once; or \
         track them in several runs"
    ))
}

fn untracked(frame: usize, id: u64) -> Failure {
    usage(format!(
        "--boxes: target {id} has a line for frame {frame}, which is not among the tracked frames"
    ))
    .hint("frames count from 0; --start, --end and --stride select which are tracked")
}

/// Numbers from 1 for ids that are no numbers, in the order in which they come; none if all ids are
/// numbers.
fn numbered(lines: &[(Line, u64)]) -> BTreeMap<&str, u64> {
    let mut numbers = BTreeMap::new();
    if lines.iter().any(|(line, _)| line.id.parse::<u64>().is_err()) {
        for (line, _) in lines {
            let next = numbers.len() as u64 + 1;
            numbers.entry(line.id.as_str()).or_insert(next);
        }
    }
    numbers
}

fn event(line: &Line, id: u64, name: &str) -> Result<Event, Failure> {
    let Line { frame, id: ref called, .. } = *line;
    text::frame(frame)
        .map_err(|reason| usage(format!("{name}: target {called}: {reason}")).hint(TABLE))?;
    let bbox = match (line.x, line.y, line.w, line.h) {
        (None, None, None, None) => None,
        (Some(x), Some(y), Some(w), Some(h)) => {
            let place = format!("{name}: target {called} in frame {frame}");
            let bbox = target::checked([x, y, w, h], &place);
            Some(bbox.map_err(|message| usage(message).hint(advice::BOX))?)
        }
        _ => {
            let part = format!("{name}: target {called} in frame {frame} has an incomplete box");
            return Err(usage(part).hint(TABLE));
        }
    };
    Ok(Event { frame: Some(frame), id, bbox })
}

#[cfg(test)]
mod tests {
    use super::*;
    use patchlock::PaperConfig;
    use std::fs;

    fn table(text: &str) -> Result<Targets, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("t.csv");
        fs::write(&file, text).unwrap();
        Targets::from_table(&file).map_err(|error| error.to_string())
    }

    #[test]
    fn events_are_returned_once_at_their_frame() {
        let mut targets =
            table("frame,id,x,y,w,h,note\n4,7,1,2,3,4,a\n9,7,,,,,b\n4,2,5,5,5,5,\n").unwrap();
        assert_eq!(targets.due(0), []);
        let due = targets.due(4);
        assert_eq!(due.iter().map(|event| event.id).collect::<Vec<_>>(), [2, 7]);
        assert_eq!(due[1].bbox, Some(BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 }));
        assert_eq!(targets.due(4), []);
        let left = targets.check_all_done().unwrap_err().to_string();
        assert!(left.contains("target 7 has a line for frame 9"), "{left}");
        assert_eq!(targets.due(9)[0].bbox, None);
        assert!(targets.check_all_done().is_ok());
    }

    #[test]
    fn ids_may_be_names() {
        let text = "frame,id,x,y,w,h\n4,car,1,2,3,4\n4,7,5,5,5,5\n9,car,,,,\n";
        let mut targets = table(text).unwrap();
        let names: Vec<(u64, &str)> =
            targets.names.iter().map(|(id, name)| (*id, &**name)).collect();
        assert_eq!(names, [(1, "car"), (2, "7")]);
        assert_eq!(targets.due(4).iter().map(|event| event.id).collect::<Vec<_>>(), [1, 2]);
        assert_eq!((targets.due(9)[0].id, targets.due(9).len()), (1, 0));
        assert!(table("frame,id,x,y,w,h\n4,7,5,5,5,5\n").unwrap().names.is_empty());
        let error = |text: &str| table(&format!("frame,id,x,y,w,h\n{text}")).unwrap_err();
        assert!(error("4,,1,2,3,4").contains("line 2: the id is empty"));
        assert!(error("4,a,1,2,3,4\n4,a,1,2,3,4").contains("target a is given twice in frame 4"));
    }

    #[test]
    fn targets_of_a_live_source_start_in_its_first_frame() {
        let text = "frame,id,x,y,w,h\n0,7,1,2,3,4\n0,2,5,5,5,5\n";
        let mut targets = table(text).unwrap().in_first_of_live().unwrap();
        assert_eq!(targets.due(3).iter().map(|event| event.id).collect::<Vec<_>>(), [2, 7]);
        assert!(targets.many && targets.check_all_done().is_ok());
        let later = table(&format!("{text}4,7,,,,\n")).unwrap().in_first_of_live();
        let error = later.unwrap_err().to_string();
        assert!(error.contains("target 7 has a line for frame 4"), "{error}");
    }

    #[test]
    fn boxes_start_at_the_first_tracked_frame() {
        let bbox = BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 };
        let mut targets = Targets::in_first_frame(&[bbox, bbox]);
        assert!(targets.many && !Targets::in_first_frame(&[bbox]).many);
        assert_eq!(targets.due(30).iter().map(|event| event.id).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(targets.due(31), []);
    }

    #[test]
    fn errors_name_the_invalid_line() {
        let said = |text: &str| table(text).unwrap_err();
        assert!(said("frame,id,x,y,w,h\n").contains("no target"));
        assert!(said("frame,x,y,w,h\n0,1,2,3,4\n").contains("missing field `id`"));
        assert!(said("frame,id,x,y,w,h\n0,1,1,2,x,4\n").contains("line: 2"));
        assert!(said("frame,id,x,y,w,h\n0,1,1,2,,4\n").contains("an incomplete box"));
        assert!(said("frame,id,x,y,w,h\n0,1,1,2,0,4\n").contains("at least 1 pixel"));
        let far = said("frame,id,x,y,w,h\n0,1,1,2,3,4\n9,1,1,1e308,3,4\n");
        assert!(far.contains("line 3: target 1 in frame 9: 1e308 is not a coordinate"), "{far}");
        assert!(said("frame,id,x,y,w,h\n3,1,1,2,3,4\n3,1,1,2,3,4\n").contains("twice in frame 3"));
        let huge = said("frame,id,x,y,w,h\n0,1,1,2,3,4\n18446744073709551615,2,1,2,3,4\n");
        assert!(huge.contains("line 3: target 2: 18446744073709551615 is not a frame"), "{huge}");
    }

    #[test]
    fn the_number_of_targets_at_once_has_a_limit() {
        let text = "frame,id,x,y,w,h\n0,1,1,2,3,4\n5,1,,,,\n6,2,1,2,3,4\n7,3,1,2,3,4\n7,2,,,,\n";
        let targets = table(text).unwrap();
        let check = |targets: &Targets, most, reverse| {
            let order = Order { start: 0, end: None, stride: 1, reverse };
            targets.check_number(most, &order, &Method::Paper(PaperConfig::default()))
        };
        assert!(check(&targets, 2, false).is_ok() && check(&targets, 1, false).is_err());
        // Backwards, the first target starts last.
        assert!(check(&targets, 3, true).is_ok() && check(&targets, 2, true).is_err());
        let bbox = BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 };
        let error = check(&Targets::in_first_frame(&[bbox; 7]), 6, false).unwrap_err().to_string();
        let words = "more than 6 targets would be tracked at once, each in about 20 MB of memory";
        assert!(error.contains(words), "{error}");
    }

    #[test]
    fn events_on_untracked_frames_are_refused() {
        let targets = table("frame,id,x,y,w,h\n5,1,1,2,3,4\n").unwrap();
        let order = |start, end, stride| Order { start, end, stride, reverse: false };
        for (order, length) in [
            (order(6, None, 1), None),
            (order(0, Some(5), 1), None),
            (order(0, None, 2), None),
            (order(0, None, 1), Some(5)),
        ] {
            assert!(targets.check(&order, length).is_err(), "{order:?}");
        }
        assert!(targets.check(&order(1, Some(6), 2), Some(6)).is_ok());
    }
}
