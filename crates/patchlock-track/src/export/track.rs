//! A track: the boxes of all targets in all frames. It is read from files saved by `patchlock
//! track`, or from text with one box per line.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

use patchlock::{BoundingBox, Status};
use serde::{Deserialize, Deserializer};

use super::TargetMetadata;
use crate::attributes::Attribute;
use crate::files::{self, ends_with};
use crate::outline::Outline;
use crate::{Error, text};

/// One target in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Entry {
    /// Index of the frame in the source, from 0.
    pub frame: usize,
    /// Id of the target.
    pub id: u64,
    /// The box, in pixels counted from 0; `None` if the target has no box in this frame.
    pub bbox: Option<BoundingBox>,
    /// How sure the tracker is, from 0 to 1, if known.
    pub score: Option<f64>,
    /// Corners of the rotated outline, if known, with pixel centres at integer coordinates.
    pub corners: Option<[[f64; 2]; 4]>,
    /// Whether the target is followed, if known. The box of a lost target is what is still followed,
    /// or the last known one.
    pub status: Option<Status>,
    /// The visible share of the target, from 0 to 1, if known.
    pub visible: Option<f64>,
    /// Overlap of the boxes tracked forward and backward, from 0 to 1, if it was tracked both ways.
    pub agreement: Option<f64>,
    /// What a person has said of this frame; `None` if nobody has.
    pub manual: Option<ManualFlags>,
}

/// What a person has said of a target in one frame. With a box, the box is the person's too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ManualFlags {
    /// The target is not visible; then there is no box.
    pub hidden: bool,
    /// Part of the target is hidden by something else.
    pub occluded: bool,
    /// Part of the target is outside the frame.
    pub truncated: bool,
}

impl Entry {
    /// The box, unless the target is lost.
    pub fn found(&self) -> Option<BoundingBox> {
        self.bbox.filter(|_| self.status != Some(Status::Lost))
    }

    /// Whether the target is occluded: as a person has said, or if the score is below 0.5.
    pub(super) fn is_occluded(&self) -> bool {
        let unsure = || self.score.is_some_and(|score| score < OCCLUDED);
        self.manual.map_or_else(unsure, |manual| manual.occluded)
    }
}

/// A target with a score below this is marked as occluded.
const OCCLUDED: f64 = 0.5;

/// Frames per second of a source that has no times, as in videos of its track.
const DEFAULT_RATE: f64 = 30.0;

/// Entries ordered by frame, then by target. What belongs to them is shared by the tracks with some of
/// them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Track {
    entries: Vec<Entry>,
    size: Option<(usize, usize)>,
    /// The number of frames of the clip.
    clip_frames: Option<usize>,
    /// Seconds from the first frame of the source, by frame.
    times: Arc<HashMap<usize, f64>>,
    /// Milliseconds that the tracker took, by frame.
    ms: Arc<HashMap<usize, f64>>,
    metadata: Arc<BTreeMap<u64, TargetMetadata>>,
    declared: Arc<BTreeMap<String, Vec<Attribute>>>,
    /// Outlines that a person has drawn, by frame and target.
    outlines: Arc<BTreeMap<(usize, u64), Outline>>,
}

/// A row of a table, read by column names. Other columns are ignored. Position cells may be empty,
/// but the columns must be there.
#[derive(Deserialize)]
struct Row {
    frame: usize,
    id: Option<u64>,
    #[serde(deserialize_with = "cell")]
    x: Option<f64>,
    #[serde(deserialize_with = "cell")]
    y: Option<f64>,
    #[serde(deserialize_with = "cell")]
    w: Option<f64>,
    #[serde(deserialize_with = "cell")]
    h: Option<f64>,
    score: Option<f64>,
    x1: Option<f64>,
    y1: Option<f64>,
    x2: Option<f64>,
    y2: Option<f64>,
    x3: Option<f64>,
    y3: Option<f64>,
    x4: Option<f64>,
    y4: Option<f64>,
    status: Option<Status>,
    frame_w: Option<usize>,
    frame_h: Option<usize>,
    time: Option<f64>,
    ms: Option<f64>,
}

/// An entry and, if the table has them, size and time of its frame, and what the tracker took for it.
#[derive(Deserialize)]
#[serde(try_from = "Row")]
struct Line {
    entry: Entry,
    size: Option<(usize, usize)>,
    time: Option<f64>,
    ms: Option<f64>,
}

impl TryFrom<Row> for Line {
    type Error = &'static str;

    fn try_from(row: Row) -> Result<Self, Self::Error> {
        let Row { frame, score, status, time, ms, .. } = row;
        let is_wrong = |number: f64| !(0.0..=1e9).contains(&number);
        if time.is_some_and(is_wrong) {
            return Err("the time is not a number of seconds; allowed: 0 to 1e9");
        }
        if ms.is_some_and(is_wrong) {
            return Err("ms is not a number of milliseconds; allowed: 0 to 1e9");
        }
        let point = |x: Option<f64>, y: Option<f64>| Some([x?, y?]);
        let corners = || {
            Some([
                point(row.x1, row.y1)?,
                point(row.x2, row.y2)?,
                point(row.x3, row.y3)?,
                point(row.x4, row.y4)?,
            ])
        };
        let bbox = match (row.x, row.y, row.w, row.h) {
            (Some(x), Some(y), Some(w), Some(h)) => Some(BoundingBox { x, y, w, h }),
            (None, None, None, None) => None,
            _ => return Err("the box is incomplete: give all of x, y, w and h, or none"),
        };
        let (id, corners) = (row.id.unwrap_or(1), corners());
        let entry = Entry { frame, id, bbox, score, corners, status, ..Entry::default() };
        Ok(Self { entry, size: row.frame_w.zip(row.frame_h), time, ms })
    }
}

/// A cell that may be empty, of a column that may not be missing.
fn cell<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    Option::deserialize(deserializer)
}

impl Track {
    /// A track of these entries, given in any order.
    ///
    /// # Errors
    /// [`Error::Export`] if there are no boxes, a target has two entries in one frame, or an entry
    /// is invalid.
    pub fn new(mut entries: Vec<Entry>) -> Result<Self, Error> {
        if entries.iter().all(|entry| entry.bbox.is_none()) {
            return Err(Error::Export("the track has no boxes".to_string()));
        }
        entries.sort_unstable_by_key(|entry| (entry.frame, entry.id));
        for entry in &entries {
            check(entry).map_err(|what| {
                Error::Export(format!("target {} in frame {}: {what}", entry.id, entry.frame))
            })?;
        }
        let duplicate = entries
            .windows(2)
            .find(|pair| (pair[0].frame, pair[0].id) == (pair[1].frame, pair[1].id));
        match duplicate {
            Some([entry, _]) => Err(Error::Export(format!(
                "target {} appears twice in frame {}",
                entry.id, entry.frame
            ))),
            _ => Ok(Self { entries, ..Self::default() }),
        }
    }

    /// Reads a file by its extension: `.csv` or `.jsonl` with at least the columns `frame`, `x`,
    /// `y`, `w` and `h` as written by `patchlock track`, counted from 0; or `.txt` with one
    /// `x,y,w,h` per line and frame, counted from 1. Without a column `id`, all boxes are of target
    /// 1. A target has no box in a frame if these cells are empty, or NaN in `.txt`.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::Line`]; as [`Track::new`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let lines = if ends_with(path, "csv") {
            read_csv(path)?
        } else if ends_with(path, "jsonl") {
            read_jsonl(path)?
        } else if ends_with(path, "txt") {
            return Self::new(read_txt(path)?);
        } else {
            return Err(Error::Export(format!(
                "{}: unknown extension; use .csv, .jsonl or .txt",
                path.display()
            )));
        };
        let size = one_size(lines.iter().map(|line| line.size), path)?;
        let by_frame = |value: fn(&Line) -> Option<f64>| {
            let known = lines.iter().filter_map(|line| Some((line.entry.frame, value(line)?)));
            Arc::new(known.collect())
        };
        let (times, ms) = (by_frame(|line| line.time), by_frame(|line| line.ms));
        let entries = lines.into_iter().map(|line| line.entry).collect();
        Ok(Self { size, times, ms, ..Self::new(entries)? })
    }

    /// Seconds from the first frame of the source to this one; by 30 frames per second if the file
    /// has no times.
    pub(super) fn time(&self, frame: usize) -> f64 {
        self.known_time(frame).unwrap_or(frame as f64 / DEFAULT_RATE)
    }

    /// Seconds from the first frame of the source to this one, if the file has them.
    pub(super) fn known_time(&self, frame: usize) -> Option<f64> {
        self.times.get(&frame).copied()
    }

    /// Milliseconds that the tracker took for a frame, all targets together, if the file has them.
    pub fn ms(&self, frame: usize) -> Option<f64> {
        self.ms.get(&frame).copied()
    }

    /// Width and height of the frames in pixels, if the file has them.
    pub fn size(&self) -> Option<(usize, usize)> {
        self.size
    }

    /// The same track with the size of its frames, in pixels.
    #[must_use]
    pub fn sized(self, width: usize, height: usize) -> Self {
        Self { size: Some((width, height)), ..self }
    }

    /// The number of frames of the clip, if it is known. The track may end before it.
    pub fn clip_frames(&self) -> Option<usize> {
        self.clip_frames
    }

    /// The same track with the number of frames of its clip.
    #[must_use]
    pub fn in_clip(self, frames: usize) -> Self {
        Self { clip_frames: Some(frames), ..self }
    }

    /// The same track with what is known of its targets, by id. A target that is not in it has the
    /// label of the [`Options`](super::Options).
    #[must_use]
    pub fn with_targets(self, metadata: BTreeMap<u64, TargetMetadata>) -> Self {
        Self { metadata: metadata.into(), ..self }
    }

    /// The same track with the attributes that labels declare, by label.
    #[must_use]
    pub fn with_declared(self, declared: BTreeMap<String, Vec<Attribute>>) -> Self {
        Self { declared: declared.into(), ..self }
    }

    /// The attributes that a label declares.
    pub fn declared(&self, label: &str) -> &[Attribute] {
        self.declared.get(label).map_or(&[], Vec::as_slice)
    }

    /// The same track with outlines that a person has drawn, by frame and target. The boxes of their
    /// entries are the upright ones around them.
    #[must_use]
    pub fn with_outlines(self, outlines: BTreeMap<(usize, u64), Outline>) -> Self {
        Self { outlines: outlines.into(), ..self }
    }

    /// The outline of an entry that a person has drawn.
    pub(super) fn outline(&self, entry: &Entry) -> Option<&Outline> {
        self.outlines.get(&(entry.frame, entry.id))
    }

    /// Whether any box has an outline, drawn or tracked.
    pub(super) fn has_outlines(&self) -> bool {
        !self.outlines.is_empty() || self.entries.iter().any(|entry| entry.corners.is_some())
    }

    /// A box without an outline in a track of the tracker, which gives one to each box.
    pub(super) fn without_outline(&self) -> Option<&Entry> {
        let lacks = |entry: &&Entry| entry.corners.is_none() && entry.found().is_some();
        self.entries.iter().find(lacks).filter(|_| self.outlines.is_empty())
    }

    /// What is known of a target besides its boxes.
    pub fn metadata(&self, id: u64) -> Option<&TargetMetadata> {
        self.metadata.get(&id)
    }

    /// The names of the attributes of all targets, also of those without an entry.
    pub(super) fn attributes(&self) -> BTreeSet<&str> {
        let all = self.metadata.values();
        let names = all.flat_map(|it| it.attributes.keys().chain(it.changes.keys()));
        names.map(String::as_str).collect()
    }

    /// All entries, ordered by frame, then by target.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The same track with only these of its entries.
    pub(super) fn with_entries(&self, entries: Vec<Entry>) -> Self {
        Self { entries, ..self.clone() }
    }

    /// The number of targets that have a box.
    pub(super) fn targets_with_boxes(&self) -> usize {
        let has_box = |own: &&Vec<&Entry>| own.iter().any(|entry| entry.bbox.is_some());
        self.by_target().values().filter(has_box).count()
    }

    /// The ids of all targets, in increasing order.
    pub fn ids(&self) -> Vec<u64> {
        let ids: BTreeSet<u64> = self.entries.iter().map(|entry| entry.id).collect();
        ids.into_iter().collect()
    }

    /// The entries of each target by its id, ordered by frame.
    pub(super) fn by_target(&self) -> BTreeMap<u64, Vec<&Entry>> {
        let mut targets = BTreeMap::<u64, Vec<&Entry>>::new();
        for entry in &self.entries {
            targets.entry(entry.id).or_default().push(entry);
        }
        targets
    }

    /// The frames with an entry, in increasing order.
    pub fn frames(&self) -> Vec<usize> {
        let mut frames: Vec<usize> = self.entries.iter().map(|entry| entry.frame).collect();
        frames.dedup();
        frames
    }
}

/// The size that all lines have; `None` if they have none.
fn one_size(
    mut sizes: impl Iterator<Item = Option<(usize, usize)>>,
    path: &Path,
) -> Result<Option<(usize, usize)>, Error> {
    let Some(first) = sizes.next() else { return Ok(None) };
    match sizes.find(|size| *size != first) {
        Some(_) => Err(Error::Export(format!(
            "{}: the lines differ in frame_w and frame_h, the size of the frame",
            path.display()
        ))),
        None => Ok(first),
    }
}

/// Checks an entry; the error says what is wrong.
fn check(entry: &Entry) -> Result<(), String> {
    text::frame(entry.frame)?;
    if let Some(BoundingBox { x, y, w, h }) = entry.bbox {
        [x, y, w, h].into_iter().try_for_each(text::coordinate)?;
        if w <= 0.0 || h <= 0.0 {
            return Err(format!(
                "the box is {x},{y},{w},{h}; width and height must be greater than 0"
            ));
        }
    }
    if let Some(score) = entry.score.filter(|score| !(0.0..=1.0).contains(score)) {
        return Err(format!("the score is {score}; it must be from 0 to 1"));
    }
    entry.corners.iter().flatten().flatten().try_for_each(|value| text::coordinate(*value))
}

fn read_csv(path: &Path) -> Result<Vec<Line>, Error> {
    let bytes = files::read(path).map_err(|error| Error::read(path, error))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
    let mut entries = Vec::new();
    let headers =
        reader.headers().cloned().map_err(|error| Error::line(path, 1, csv_reason(&error)))?;
    let number_of = |place: Option<&csv::Position>| place.map_or(1, |place| place.line() as usize);
    let wrong =
        |error: csv::Error| Error::line(path, number_of(error.position()), csv_reason(&error));
    for record in reader.into_records() {
        let record = record.map_err(wrong)?;
        let read: Line = record.deserialize(Some(&headers)).map_err(wrong)?;
        let number = number_of(record.position());
        check(&read.entry).map_err(|reason| Error::line(path, number, reason))?;
        entries.push(read);
    }
    Ok(entries)
}

/// The reason why a row is invalid, without its position, which the error names.
fn csv_reason(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.kind().to_string(),
        _ => error.to_string(),
    }
}

fn read_jsonl(path: &Path) -> Result<Vec<Line>, Error> {
    let bytes = files::read(path).map_err(|error| Error::read(path, error))?;
    let (text, _) = text::decode(&bytes);
    let rows = text.lines().enumerate().filter(|(_, text)| !text.trim().is_empty());
    let entry = |(k, text): (usize, &str)| {
        let wrong = |reason| Error::line(path, k + 1, reason);
        let read: Line = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        check(&read.entry).map_err(wrong)?;
        Ok(read)
    };
    rows.map(entry).collect()
}

fn read_txt(path: &Path) -> Result<Vec<Entry>, Error> {
    let entry = |(frame, row): (usize, &Vec<f64>)| {
        let bbox = text::region(row, 1.0).map_err(|reason| Error::line(path, frame + 1, reason))?;
        Ok(Entry { frame, id: 1, bbox, ..Entry::default() })
    };
    text::read(path)?.rows.iter().enumerate().map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn read(name: &str, text: &str) -> Result<Track, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        Track::read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn all_file_types_are_read() {
        let csv =
            read("a.csv", "frame,x,y,w,h,score\n4,10.5,0,30,20,0.5\n2,9,1,30,20,1\n").unwrap();
        assert_eq!(csv.frames(), [2, 4]);
        let jsonl = "{\"frame\":2,\"x\":9,\"y\":1,\"w\":30,\"h\":20,\"score\":1.0}\n\
                     {\"frame\":4,\"x\":10.5,\"y\":0,\"w\":30,\"h\":20,\"score\":0.5,\"note\":3}\n";
        assert_eq!(read("a.jsonl", jsonl).unwrap(), csv);
        let txt = read("a.txt", "10,2,30,20\nNaN,NaN,NaN,NaN\n11.5,1,30,20\n").unwrap();
        let boxes =
            |track: &Track| track.entries().iter().filter_map(Entry::found).collect::<Vec<_>>();
        assert_eq!(boxes(&txt), boxes(&csv));
        assert_eq!(txt.frames(), [0, 1, 2]);
        let many = read(
            "a.csv",
            "frame,id,x,y,w,h,x1,y1,x2,y2,x3,y3,x4,y4\n\
             0,7,1,2,3,4,1,2,3,4,5,6,7,8\n0,3,1,2,3,4,,,,,,,,\n",
        );
        let many = many.unwrap();
        assert_eq!(many.ids(), [3, 7]);
        assert_eq!(many.entries()[0].corners, None);
        assert_eq!(
            many.entries()[1].corners,
            Some([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]])
        );
    }

    #[test]
    fn lost_targets_have_their_last_box_or_none() {
        let kept = "frame,x,y,w,h,status\n0,9,1,30,20,tracked\n1,9,1,30,20,lost\n2,9,1,30,20,\n";
        let track = read("a.csv", kept).unwrap();
        let [first, second, third] = track.entries() else { panic!("three entries") };
        assert_eq!((first.status, third.status), (Some(Status::Tracked), None));
        assert_eq!((second.found(), second.bbox), (None, first.found()));
        let blank = read("a.csv", &kept.replace("1,9,1,30,20,lost", "1,,,,,lost")).unwrap();
        assert_eq!((blank.entries()[1].bbox, blank.entries()[1].status), (None, second.status));
        assert_eq!(blank.entries()[2], *third);
        let json = "{\"frame\":0,\"x\":9,\"y\":1,\"w\":30,\"h\":20,\"status\":\"tracked\"}\n\
                    {\"frame\":1,\"x\":null,\"y\":null,\"w\":null,\"h\":null,\"status\":\"lost\"}\n\
                    {\"frame\":2,\"x\":9,\"y\":1,\"w\":30,\"h\":20,\"status\":null}\n";
        assert_eq!(read("a.jsonl", json).unwrap(), blank);
    }

    #[test]
    fn the_size_of_the_frames_is_read() {
        let csv = "frame,x,y,w,h,frame_w,frame_h\n0,1,2,3,4,64,48\n1,1,2,3,4,64,48\n";
        assert_eq!(read("a.csv", csv).unwrap().size(), Some((64, 48)));
        let json = "{\"frame\":0,\"x\":1,\"y\":1,\"w\":3,\"h\":2,\"frame_w\":64,\"frame_h\":48}\n";
        assert_eq!(read("a.jsonl", json).unwrap().size(), Some((64, 48)));
        assert_eq!(read("a.csv", "frame,x,y,w,h\n0,1,2,3,4\n").unwrap().size(), None);
        assert_eq!(read("a.txt", "1,2,3,4\n").unwrap().size(), None);
        let error = read("a.csv", &csv.replace("1,1,2,3,4,64", "1,1,2,3,4,65")).unwrap_err();
        assert!(error.contains("the lines differ in frame_w and frame_h"), "{error}");
    }

    #[test]
    fn the_times_of_the_frames_are_read() {
        let csv = "frame,x,y,w,h,time\n0,1,2,3,4,0\n3,1,2,3,4,0.25\n4,1,2,3,4,\n";
        let track = read("a.csv", csv).unwrap();
        assert_eq!([0, 3, 4].map(|frame| track.time(frame)), [0.0, 0.25, 4.0 / 30.0]);
        for wrong in ["-1", "nan", "1e10"] {
            let error = read("a.csv", &csv.replace("0.25", wrong)).unwrap_err();
            assert!(error.contains("line 3: the time is not a number of seconds"), "{error}");
        }
    }

    #[test]
    fn the_milliseconds_of_the_frames_are_read() {
        let csv = "frame,x,y,w,h,ms\n0,1,2,3,4,1.5\n3,1,2,3,4,\n";
        let track = read("a.csv", csv).unwrap();
        assert_eq!([0, 3].map(|frame| track.ms(frame)), [Some(1.5), None]);
        let error = read("a.csv", &csv.replace("1.5", "nan")).unwrap_err();
        assert!(error.contains("line 2: ms is not a number of milliseconds"), "{error}");
    }

    #[test]
    fn errors_name_the_file_and_line() {
        let error = |name: &str, text: &str| read(name, text).unwrap_err();
        assert!(error("a.csv", "frame,x,y,w,h\n0,1,2,3,4\n1,1,2,x,4\n").contains("a.csv, line 3"));
        assert!(error("a.csv", "frame,x,y,w\n0,1,2,3\n").contains("missing field `h`"));
        assert!(error("a.jsonl", "{\"frame\":1}\n").contains("a.jsonl, line 1"));
        assert!(error("a.txt", "1,2,3,4\n1,2,3\n").contains("a.txt, line 2"));
        assert!(error("a.xml", "").contains(".csv, .jsonl or .txt"));
        assert!(error("a.csv", "frame,x,y,w,h\n").contains("no boxes"));
        assert!(error("a.csv", "frame,x,y,w,h\n0,,,,\n").contains("no boxes"));
        let part = error("a.csv", "frame,x,y,w,h\n0,1,2,3,4\n1,1,2,,4\n");
        assert!(part.contains("a.csv, line 3") && part.contains("the box is incomplete"), "{part}");
        let status = error("a.csv", "frame,x,y,w,h,status\n0,1,2,3,4,gone\n");
        assert!(status.contains("`gone`") && status.contains("`uncertain`, `lost`"), "{status}");
        assert!(error("a.jsonl", "{\"frame\":1,\"x\":null}\n").contains("missing field `y`"));
        let twice = error("a.csv", "frame,id,x,y,w,h\n5,2,1,2,3,4\n5,2,1,2,3,4\n");
        assert_eq!(twice, "cannot export: target 2 appears twice in frame 5");
        assert!(error("a.csv", "frame,x,y,w,h\n0,1,2,0,4\n").contains("the box is 1,2,0,4"));
        let too_far = [
            ("a.csv", "frame,id,x,y,w,h,score\n0,,1,10,16,12,0.5\n1,,-1e308,10,16,12,0.5\n"),
            ("a.csv", "frame,x,y,w,h\n0,1,2,3,4\n1,1e308,10,16,12\n"),
            ("a.txt", "1,2,3,4\n10,1e308,16,12\n"),
            (
                "a.jsonl",
                "{\"frame\":0,\"x\":1,\"y\":1,\"w\":3,\"h\":2}\n\
                         {\"frame\":1,\"x\":1,\"y\":1,\"w\":1e308,\"h\":2}\n",
            ),
        ];
        for (name, text) in too_far {
            let error = error(name, text);
            let line = 2 + usize::from(name == "a.csv");
            assert!(error.contains(&format!("{name}, line {line}: ")), "{error}");
            assert!(error.contains("is not a coordinate; allowed: -1e9 to 1e9"), "{error}");
        }
        assert!(error("a.csv", "frame,x,y,w,h,score\n0,1,2,3,4,7\n").contains("the score is 7"));
    }

    #[test]
    fn frame_numbers_have_a_limit() {
        let csv = |frame: &str| format!("frame,x,y,w,h\n0,1,2,3,4\n{frame},1,2,3,4\n");
        assert!(read("a.csv", &csv("99999999")).is_ok());
        for frame in ["100000000", "18446744073709551615"] {
            let wanted = format!("line 3: {frame} is not a frame number; allowed: 0 to 99999999");
            let error = read("a.csv", &csv(frame)).unwrap_err();
            assert!(error.ends_with(&wanted), "{error}");
            let json = format!("\n\n{{\"frame\":{frame},\"x\":1,\"y\":1,\"w\":3,\"h\":2}}\n");
            let error = read("a.jsonl", &json).unwrap_err();
            assert!(error.ends_with(&wanted), "{error}");
        }
        let error = read("a.csv", &csv("18446744073709551616")).unwrap_err();
        assert!(error.contains("a.csv, line 3: "), "{error}");
        let entry = Entry { frame: usize::MAX, ..read("a.csv", &csv("1")).unwrap().entries[0] };
        let error = Track::new(vec![entry]).unwrap_err().to_string();
        assert!(error.contains("18446744073709551615 is not a frame number"), "{error}");
    }
}
