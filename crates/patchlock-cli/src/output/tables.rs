//! Tables of boxes. The extension of the file selects the format: `.csv`, `.jsonl`, `.txt`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serializer as _;
use serde_json::Value;

use super::pending::PendingFile;
use super::printed::cannot_print;
use super::row::{LostPosition, row};
use super::{Sink, TrackedFrame};
use crate::failure::{Failure, usage};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Named columns, 0-based.
    Csv,
    /// One JSON object per line with the same names, 0-based.
    Jsonl,
    /// The format of OTB: `x,y,w,h` per line, 1-based, no header.
    Txt,
}

impl Format {
    /// The format for the extension of a file.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let extension =
            path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        match extension.as_str() {
            "csv" => Ok(Self::Csv),
            "jsonl" => Ok(Self::Jsonl),
            "txt" => Ok(Self::Txt),
            _ => Err(usage(format!(
                "--save {}: unknown extension; use .csv, .jsonl or .txt",
                path.display()
            ))
            .hint(
                ".csv and .jsonl have all columns (0-based), .txt has x,y,w,h as in OTB (1-based)",
            )),
        }
    }
}

/// Writes rows to a writer.
pub struct Table<W: Write> {
    format: Format,
    lost: LostPosition,
    writer: W,
    started: bool,
}

impl<W: Write> Table<W> {
    pub fn new(format: Format, lost: LostPosition, writer: W) -> Self {
        Self { format, lost, writer, started: false }
    }

    /// Adds the rows of a frame and flushes each, so that a full disk is noticed immediately and
    /// the reader of a pipe need not wait.
    pub fn add(&mut self, tracked: &TrackedFrame<'_>) -> io::Result<()> {
        let lost = self.lost;
        tracked.targets.iter().try_for_each(|target| self.add_row(row(tracked, target, lost)))
    }

    fn add_row(&mut self, row: Vec<(&str, Value)>) -> io::Result<()> {
        let first = !std::mem::replace(&mut self.started, true);
        let out: &mut dyn Write = &mut self.writer;
        match self.format {
            Format::Csv => {
                let (header, record): (Vec<_>, Vec<_>) = row.into_iter().unzip();
                let mut writer = csv::Writer::from_writer(&mut *out);
                if first {
                    writer.write_record(header).map_err(io::Error::from)?;
                }
                writer.serialize(record).map_err(io::Error::from)?;
                writer.flush()?;
            }
            Format::Jsonl => {
                serde_json::Serializer::new(&mut *out).collect_map(row)?;
                out.write_all(b"\n")?;
            }
            Format::Txt => writeln!(out, "{}", otb(&row))?,
        }
        out.flush()
    }

    /// The writer, with all rows written.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// The box as in OTB, where pixels count from 1.
fn otb(row: &[(&str, Value)]) -> String {
    let number = |name| row.iter().find(|(column, _)| *column == name)?.1.as_f64();
    match ["x", "y", "w", "h"].map(number) {
        [Some(x), Some(y), Some(w), Some(h)] => {
            format!("{:.4},{:.4},{w:.4},{h:.4}", x + 1.0, y + 1.0)
        }
        _ => "NaN,NaN,NaN,NaN".to_string(),
    }
}

impl Sink for Table<PendingFile> {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        // An immediate exit must keep all targets of a frame or none.
        let _delay = self.writer.delay_exit();
        self.add(tracked).map_err(|error| self.writer.write_error(&error).into())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        Ok(Some(self.into_inner().commit()?))
    }
}

impl Sink for Table<io::Stdout> {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        self.add(tracked).map_err(|error| match error.kind() {
            // As it is: it ends the run, but is not an error.
            io::ErrorKind::BrokenPipe => error.into(),
            _ => cannot_print(&error).into(),
        })
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;
    use patchlock::Status;
    use patchlock_media::Picture;
    use std::sync::Arc;

    /// A table of frames 4 and 6, in which the target has these statuses.
    fn written(format: Format, lost: LostPosition, statuses: [Status; 2]) -> String {
        let mut table = Table::new(format, lost, Vec::new());
        for (frame, status) in [4, 6].into_iter().zip(statuses) {
            let targets = [example::target(status)];
            table.add(&example::tracked(frame, &targets)).expect("writes to memory");
        }
        String::from_utf8(table.into_inner()).expect("text")
    }

    const FOUND: [Status; 2] = [Status::Tracked, Status::Uncertain];
    const LOST: [Status; 2] = [Status::Tracked, Status::Lost];

    #[test]
    fn csv_has_exactly_these_columns() {
        assert_eq!(
            written(Format::Csv, LostPosition::Keep, FOUND),
            "frame,x,y,w,h,score,visible_large,visible_small,x1,y1,x2,y2,x3,y3,x4,y4,ms,status,\
             frame_w,frame_h\n\
             4,10.5,0.0,30.0,20.25,0.5,1.0,0.25,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,12.5,tracked,1280,960\n\
             6,10.5,0.0,30.0,20.25,0.5,1.0,0.25,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,12.5,uncertain,1280,960\n"
        );
    }

    #[test]
    fn frames_with_a_time_have_a_column_for_it() {
        let picture = Picture { time: Some(1.0 / 30.0), ..Picture::rgb(4, 4, vec![0; 48]) };
        let picture = Arc::new(picture);
        let targets = [example::target(Status::Tracked)];
        let last_cell = |format| {
            let mut table = Table::new(format, LostPosition::Keep, Vec::new());
            let tracked = TrackedFrame { picture: &picture, ..example::tracked(1, &targets) };
            table.add(&tracked).expect("writes to memory");
            String::from_utf8(table.into_inner()).expect("text")
        };
        let csv = last_cell(Format::Csv);
        let (header, row) = csv.trim_end().split_once('\n').expect("two lines");
        assert!(header.ends_with(",status,frame_w,frame_h,time"), "{header}");
        assert!(row.ends_with(",tracked,4,4,0.033333"), "{row}");
        let json = last_cell(Format::Jsonl);
        assert!(json.ends_with(",\"frame_h\":4,\"time\":0.033333}\n"), "{json}");
    }

    #[test]
    fn jsonl_has_one_object_per_line() {
        let text = written(Format::Jsonl, LostPosition::Keep, FOUND);
        let rows: Vec<serde_json::Value> =
            text.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
        assert_eq!(rows[1]["frame"], 6);
        assert_eq!(rows[0]["h"], 20.25);
        assert_eq!(rows[1]["status"], "uncertain");
        assert!(text.starts_with("{\"frame\":4,\"x\":10.5,"));
    }

    #[test]
    fn txt_counts_from_one() {
        let text = written(Format::Txt, LostPosition::Keep, FOUND);
        assert_eq!(text, "11.5000,1.0000,30.0000,20.2500\n".repeat(2));
    }

    #[test]
    fn a_lost_target_keeps_its_position_or_has_none() {
        let last = |format, lost, statuses| {
            let text = written(format, lost, statuses);
            text.lines().last().expect("rows").to_string()
        };
        let kept =
            "6,10.5,0.0,30.0,20.25,0.5,1.0,0.25,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,12.5,lost,1280,960";
        assert_eq!(last(Format::Csv, LostPosition::Keep, LOST), kept);
        assert_eq!(
            last(Format::Csv, LostPosition::Blank, LOST),
            "6,,,,,0.5,1.0,0.25,,,,,,,,,12.5,lost,1280,960"
        );
        assert_eq!(last(Format::Txt, LostPosition::Blank, LOST), "NaN,NaN,NaN,NaN");
        let row = last(Format::Jsonl, LostPosition::Blank, LOST);
        assert!(
            row.starts_with("{\"frame\":6,\"x\":null,") && row.contains("\"y4\":null,"),
            "{row}"
        );
        assert!(row.ends_with("\"status\":\"lost\",\"frame_w\":1280,\"frame_h\":960}"), "{row}");
        for format in [Format::Csv, Format::Jsonl, Format::Txt] {
            let blank = written(format, LostPosition::Blank, FOUND);
            assert_eq!(blank, written(format, LostPosition::Keep, FOUND), "none is lost");
        }
    }

    #[test]
    fn unknown_extensions_are_refused_with_the_known_ones() {
        let error = Format::of(Path::new("a.xlsx")).expect_err("unknown");
        assert!(error.to_string().contains(".csv, .jsonl or .txt"));
        assert_eq!(Format::of(Path::new("A.CSV")).expect("known"), Format::Csv);
    }
}
