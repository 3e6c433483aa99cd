//! Tables of boxes, by the end of the file's name: `.csv`, `.jsonl`, `.txt`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::pending::PendingFile;
use super::printed::cannot_print;
use super::row::Row;
use super::{Sink, Tracked};
use crate::complaint::{Complaint, usage};

/// The kinds of table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Named columns, 0-based.
    Csv,
    /// One JSON object a line with the same names, 0-based.
    Jsonl,
    /// The benchmark's own: `x,y,w,h` a line, 1-based, no header.
    Txt,
}

impl Format {
    /// The format that a file's name asks for.
    pub fn of(path: &Path) -> Result<Self, Complaint> {
        let extension =
            path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        match extension.as_str() {
            "csv" => Ok(Self::Csv),
            "jsonl" => Ok(Self::Jsonl),
            "txt" => Ok(Self::Txt),
            _ => Err(usage(format!("--save {}: the end of the name is none of .csv, .jsonl, .txt", path.display()))
                .hint(".csv and .jsonl have all columns (0-based), .txt is the benchmark's x,y,w,h (1-based)")),
        }
    }
}

/// Writes rows to anything.
pub struct Table<W: Write> {
    format: Format,
    writer: W,
    begun: bool,
}

impl<W: Write> Table<W> {
    /// An empty table.
    pub fn new(format: Format, writer: W) -> Self {
        Self { format, writer, begun: false }
    }

    /// Adds a row and passes it on at once, so that a full disk is noticed now and a reader of a pipe need not wait.
    pub fn row(&mut self, row: &Row) -> io::Result<()> {
        let first = !std::mem::replace(&mut self.begun, true);
        match self.format {
            Format::Csv => {
                let mut writer =
                    csv::WriterBuilder::new().has_headers(first).from_writer(&mut self.writer);
                writer.serialize(row).map_err(io::Error::from)?;
                writer.flush()?;
            }
            Format::Jsonl => {
                serde_json::to_writer(&mut self.writer, row)?;
                self.writer.write_all(b"\n")?;
            }
            // Pixel centres at integers: the benchmark counts the first pixel as 1.
            Format::Txt => writeln!(
                self.writer,
                "{:.4},{:.4},{:.4},{:.4}",
                row.x + 1.0,
                row.y + 1.0,
                row.w,
                row.h
            )?,
        }
        self.writer.flush()
    }

    /// The writer, with everything in it.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

impl Sink for Table<PendingFile> {
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()> {
        // All targets of a frame or none.
        let _whole = self.writer.hold();
        for seen in tracked.targets {
            self.row(&seen.row).map_err(|error| self.writer.complain(&error))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        Ok(Some(self.into_inner().commit()?))
    }
}

/// The CSV on standard output.
pub struct Stdout {
    table: Table<io::Stdout>,
}

impl Stdout {
    /// A CSV on standard output.
    pub fn new() -> Self {
        Self { table: Table::new(Format::Csv, io::stdout()) }
    }
}

impl Default for Stdout {
    fn default() -> Self {
        Self::new()
    }
}

/// Whoever read standard output has read enough, as `head` does: the end, but no error.
#[derive(Debug)]
pub struct ReaderLeft;

impl std::fmt::Display for ReaderLeft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the reader of standard output left")
    }
}

impl std::error::Error for ReaderLeft {}

impl Sink for Stdout {
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()> {
        for seen in tracked.targets {
            self.table.row(&seen.row).map_err(|error| match error.kind() {
                io::ErrorKind::BrokenPipe => anyhow::Error::new(ReaderLeft),
                _ => cannot_print(&error).into(),
            })?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(format: Format) -> String {
        let mut table = Table::new(format, Vec::new());
        for frame in [4, 6] {
            let row = Row {
                frame,
                id: None,
                x: 10.5,
                y: 0.0,
                w: 30.0,
                h: 20.25,
                score: 0.5,
                visible_large: Some(1.0),
                visible_small: Some(0.25),
                x1: 1.0,
                y1: 2.0,
                x2: 3.0,
                y2: 4.0,
                x3: 5.0,
                y3: 6.0,
                x4: 7.0,
                y4: 8.0,
                ms: 12.5,
            };
            table.row(&row).expect("memory takes all");
        }
        String::from_utf8(table.into_inner()).expect("text")
    }

    #[test]
    fn csv_has_exactly_these_columns() {
        assert_eq!(
            written(Format::Csv),
            "frame,x,y,w,h,score,visible_large,visible_small,x1,y1,x2,y2,x3,y3,x4,y4,ms\n\
             4,10.5,0.0,30.0,20.25,0.5,1.0,0.25,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,12.5\n\
             6,10.5,0.0,30.0,20.25,0.5,1.0,0.25,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,12.5\n"
        );
    }

    #[test]
    fn jsonl_has_an_object_a_line() {
        let text = written(Format::Jsonl);
        let rows: Vec<serde_json::Value> =
            text.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
        assert_eq!(rows[1]["frame"], 6);
        assert_eq!(rows[0]["h"], 20.25);
        assert!(text.starts_with("{\"frame\":4,\"x\":10.5,"));
    }

    #[test]
    fn txt_counts_from_one() {
        assert_eq!(written(Format::Txt), "11.5000,1.0000,30.0000,20.2500\n".repeat(2));
    }

    #[test]
    fn unknown_ends_list_the_known_ones() {
        let complaint = Format::of(Path::new("a.xlsx")).expect_err("unknown");
        assert!(complaint.to_string().contains(".csv, .jsonl, .txt"));
        assert_eq!(Format::of(Path::new("A.CSV")).expect("known"), Format::Csv);
    }
}
