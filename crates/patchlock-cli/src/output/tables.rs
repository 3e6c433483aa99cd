//! Tables of boxes. The extension of the file selects the format: `.csv`, `.jsonl`, `.txt`.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::pending::PendingFile;
use super::printed::cannot_print;
use super::row::Row;
use super::{Sink, Tracked};
use crate::failure::{Failure, usage};

/// The formats of tables.
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
                "--save {}: the name must end in one of .csv, .jsonl, .txt",
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
    writer: W,
    started: bool,
}

impl<W: Write> Table<W> {
    /// An empty table.
    pub fn new(format: Format, writer: W) -> Self {
        Self { format, writer, started: false }
    }

    /// Adds a row and flushes, so that a full disk is noticed immediately and the reader of a pipe need not
    /// wait.
    pub fn row(&mut self, row: &Row) -> io::Result<()> {
        let first = !std::mem::replace(&mut self.started, true);
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
            // OTB counts pixels from 1.
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

    /// The writer, with all rows written.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

impl Sink for Table<PendingFile> {
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()> {
        // An immediate exit must keep all targets of a frame or none.
        let _hold = self.writer.hold();
        for seen in tracked.targets {
            let row = Row::new(tracked.frame, tracked.ms, seen);
            self.row(&row).map_err(|error| self.writer.write_error(&error))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
        Ok(Some(self.into_inner().commit()?))
    }
}

/// A CSV table on standard output.
pub struct Stdout {
    table: Table<io::Stdout>,
}

impl Stdout {
    /// A table that is still empty.
    pub fn new() -> Self {
        Self { table: Table::new(Format::Csv, io::stdout()) }
    }
}

impl Default for Stdout {
    fn default() -> Self {
        Self::new()
    }
}

/// The reader of standard output has closed the pipe, as `head` does. This ends the run, but is not an error.
#[derive(Debug)]
pub struct PipeClosed;

impl std::fmt::Display for PipeClosed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the reader of standard output has closed the pipe")
    }
}

impl std::error::Error for PipeClosed {}

impl Sink for Stdout {
    fn write(&mut self, tracked: &Tracked<'_>) -> Result<()> {
        for seen in tracked.targets {
            let row = Row::new(tracked.frame, tracked.ms, seen);
            self.table.row(&row).map_err(|error| match error.kind() {
                io::ErrorKind::BrokenPipe => anyhow::Error::new(PipeClosed),
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
            table.row(&row).expect("writes to memory");
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
    fn jsonl_has_one_object_per_line() {
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
    fn unknown_extensions_are_refused_with_the_known_ones() {
        let error = Format::of(Path::new("a.xlsx")).expect_err("unknown");
        assert!(error.to_string().contains(".csv, .jsonl, .txt"));
        assert_eq!(Format::of(Path::new("A.CSV")).expect("known"), Format::Csv);
    }
}
