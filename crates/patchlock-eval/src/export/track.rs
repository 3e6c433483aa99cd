//! A track: the boxes of all targets in all frames. It is read from files saved by `patchlock track`, or from
//! text with one box per line.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use patchlock::BoundingBox;
use serde::Deserialize;

use crate::files::ends_with;
use crate::{Error, text};

/// One target in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Index of the frame in the source, from 0.
    pub frame: usize,
    /// Id of the target.
    pub id: u64,
    /// The box, in pixels counted from 0.
    pub bbox: BoundingBox,
    /// Visibility of the target, 0 to 1, if known.
    pub score: Option<f64>,
    /// Corners of the rotated outline, if known, with pixel centres at integer coordinates.
    pub corners: Option<[[f64; 2]; 4]>,
}

/// Entries ordered by frame, then by target.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    entries: Vec<Entry>,
}

/// A row of a table, read by column names. Other columns are ignored.
#[derive(Deserialize)]
struct Row {
    frame: usize,
    id: Option<u64>,
    x: f64,
    y: f64,
    w: f64,
    h: f64,
    score: Option<f64>,
    x1: Option<f64>,
    y1: Option<f64>,
    x2: Option<f64>,
    y2: Option<f64>,
    x3: Option<f64>,
    y3: Option<f64>,
    x4: Option<f64>,
    y4: Option<f64>,
}

impl Row {
    fn entry(&self) -> Entry {
        let point = |x: Option<f64>, y: Option<f64>| Some([x?, y?]);
        let corners = || {
            Some([
                point(self.x1, self.y1)?,
                point(self.x2, self.y2)?,
                point(self.x3, self.y3)?,
                point(self.x4, self.y4)?,
            ])
        };
        Entry {
            frame: self.frame,
            id: self.id.unwrap_or(1),
            bbox: BoundingBox { x: self.x, y: self.y, w: self.w, h: self.h },
            score: self.score,
            corners: corners(),
        }
    }
}

impl Track {
    /// A track of these entries, given in any order.
    ///
    /// # Errors
    /// [`Error::Export`] if there are no entries, a target has two entries in one frame, or an entry is
    /// invalid.
    pub fn new(mut entries: Vec<Entry>) -> Result<Self, Error> {
        if entries.is_empty() {
            return Err(Error::Export("the track has no boxes".to_string()));
        }
        entries.sort_by_key(|entry| (entry.frame, entry.id));
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
            _ => Ok(Self { entries }),
        }
    }

    /// Reads a file by its extension: `.csv` or `.jsonl` with at least the columns `frame`, `x`, `y`, `w` and
    /// `h` as written by `patchlock track`, counted from 0; or `.txt` with one `x,y,w,h` per line and frame,
    /// counted from 1. Without a column `id`, all boxes are of target 1.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::Line`]; as [`Track::new`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let entries = if ends_with(path, "csv") {
            read_csv(path)?
        } else if ends_with(path, "jsonl") {
            read_jsonl(path)?
        } else if ends_with(path, "txt") {
            read_txt(path)?
        } else {
            return Err(Error::Export(format!(
                "{}: unknown extension; use .csv, .jsonl or .txt",
                path.display()
            )));
        };
        Self::new(entries)
    }

    /// All entries, ordered by frame, then by target.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The ids of all targets, in increasing order.
    pub fn ids(&self) -> BTreeSet<u64> {
        self.entries.iter().map(|entry| entry.id).collect()
    }

    /// The frames with at least one target, in increasing order.
    pub fn frames(&self) -> BTreeSet<usize> {
        self.entries.iter().map(|entry| entry.frame).collect()
    }
}

/// Checks an entry; the error says what is wrong.
fn check(entry: &Entry) -> Result<(), String> {
    let BoundingBox { x, y, w, h } = entry.bbox;
    if ![x, y, w, h].iter().all(|value| value.is_finite()) || w <= 0.0 || h <= 0.0 {
        return Err(format!(
            "the box is {x},{y},{w},{h}; all values must be finite, width and height greater than 0"
        ));
    }
    if let Some(score) = entry.score.filter(|score| !(0.0..=1.0).contains(score)) {
        return Err(format!("the score is {score}; it must be from 0 to 1"));
    }
    match entry.corners {
        Some(corners) if !corners.as_flattened().iter().all(|value| value.is_finite()) => {
            Err(format!("the corners are {corners:?}; all values must be finite"))
        }
        _ => Ok(()),
    }
}

fn line(path: &Path, line: usize, reason: impl ToString) -> Error {
    Error::Line { path: path.to_path_buf(), line, reason: reason.to_string() }
}

fn read_csv(path: &Path) -> Result<Vec<Entry>, Error> {
    let bytes = fs::read(path).map_err(|error| Error::read(path, error))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
    let mut entries = Vec::new();
    for row in reader.deserialize() {
        let row: Row = row.map_err(|error| {
            let number = error.position().map_or(1, |position| position.line() as usize);
            line(path, number, csv_reason(&error))
        })?;
        entries.push(row.entry());
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

fn read_jsonl(path: &Path) -> Result<Vec<Entry>, Error> {
    let text = fs::read_to_string(path).map_err(|error| Error::read(path, error))?;
    let rows = text.lines().enumerate().filter(|(_, text)| !text.trim().is_empty());
    let entry = |(k, text): (usize, &str)| match serde_json::from_str::<Row>(text) {
        Ok(row) => Ok(row.entry()),
        Err(error) => Err(line(path, k + 1, error)),
    };
    rows.map(entry).collect()
}

fn read_txt(path: &Path) -> Result<Vec<Entry>, Error> {
    let mut entries = Vec::new();
    for (frame, row) in text::read(path)?.rows.iter().enumerate() {
        let bbox = text::region(row, 1.0).map_err(|reason| line(path, frame + 1, reason))?;
        // A row of NaN is a frame without a box.
        entries.extend(bbox.map(|bbox| Entry { frame, id: 1, bbox, score: None, corners: None }));
    }
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(csv.frames().into_iter().collect::<Vec<_>>(), [2, 4]);
        let jsonl = "{\"frame\":2,\"x\":9,\"y\":1,\"w\":30,\"h\":20,\"score\":1.0}\n\
                     {\"frame\":4,\"x\":10.5,\"y\":0,\"w\":30,\"h\":20,\"score\":0.5,\"ms\":3}\n";
        assert_eq!(read("a.jsonl", jsonl).unwrap(), csv);
        let txt = read("a.txt", "10,2,30,20\nNaN,NaN,NaN,NaN\n11.5,1,30,20\n").unwrap();
        let boxes = |track: &Track| track.entries().iter().map(|e| e.bbox).collect::<Vec<_>>();
        assert_eq!(boxes(&txt), boxes(&csv));
        assert_eq!(txt.frames().into_iter().collect::<Vec<_>>(), [0, 2]);
        let many = read(
            "a.csv",
            "frame,id,x,y,w,h,x1,y1,x2,y2,x3,y3,x4,y4\n\
             0,7,1,2,3,4,1,2,3,4,5,6,7,8\n0,3,1,2,3,4,,,,,,,,\n",
        );
        let many = many.unwrap();
        assert_eq!(many.ids().into_iter().collect::<Vec<_>>(), [3, 7]);
        assert_eq!(many.entries()[0].corners, None);
        assert_eq!(
            many.entries()[1].corners,
            Some([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]])
        );
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
        let twice = error("a.csv", "frame,id,x,y,w,h\n5,2,1,2,3,4\n5,2,1,2,3,4\n");
        assert_eq!(twice, "cannot export: target 2 appears twice in frame 5");
        assert!(error("a.csv", "frame,x,y,w,h\n0,1,2,0,4\n").contains("the box is 1,2,0,4"));
        assert!(error("a.csv", "frame,x,y,w,h,score\n0,1,2,3,4,7\n").contains("the score is 7"));
    }
}
