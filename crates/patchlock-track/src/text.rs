//! Text files of boxes: one line per frame, with numbers separated by commas, tabs or spaces.
//!
//! The files come from many sources, so several encodings are supported: UTF-8 with or without a
//! byte-order mark, UTF-16, and any kind of line end. Anything unusual is recorded. A line that is
//! not understood is an error that names the line; lines are never skipped.

use std::borrow::Cow;
use std::path::Path;

use patchlock::BoundingBox;
use patchlock_media::MOST_FRAMES;

use crate::{Error, files};

/// The largest distance of a coordinate from the frame's first pixel, and the longest side of a
/// box, in pixels.
pub const MAX_COORDINATE: f64 = 1e9;

/// The numbers of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// One row per line; empty lines at the end are ignored.
    pub rows: Vec<Vec<f64>>,
    /// Unusual properties of the file that do not change its meaning, such as its encoding.
    pub notes: Vec<String>,
}

/// Reads a file of numbers.
///
/// # Errors
/// [`Error::Read`]; [`Error::Line`] for a line that is empty or has something other than numbers.
pub fn read(path: &Path) -> Result<Table, Error> {
    let bytes = files::read(path).map_err(|error| Error::read(path, error))?;
    let (text, notes) = decode(&bytes);
    let lines = text.trim_end().lines().enumerate();
    let row = |(k, line)| numbers(line).map_err(|reason| Error::line(path, k + 1, reason));
    Ok(Table { rows: lines.map(row).collect::<Result<_, _>>()?, notes })
}

/// Decodes a text in any supported encoding. Also returns what is unusual about it.
pub fn decode(bytes: &[u8]) -> (String, Vec<String>) {
    let narrow = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let wide = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
        String::from_utf16_lossy(&units)
    };
    // In UTF-16 text of ASCII characters, every other byte is zero.
    let zeros_at = |offset: usize| {
        bytes.len() > 3 && bytes.iter().skip(offset).step_by(2).all(|&byte| byte == 0)
    };
    const UNMARKED: &str = "is in UTF-16 without a byte-order mark";
    let (note, text) = match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => (Some("starts with a byte-order mark"), narrow(rest)),
        [0xff, 0xfe, rest @ ..] => (Some("is in UTF-16"), wide(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => (Some("is in UTF-16"), wide(rest, u16::from_be_bytes)),
        _ if zeros_at(1) => (Some(UNMARKED), wide(bytes, u16::from_le_bytes)),
        _ if zeros_at(0) => (Some(UNMARKED), wide(bytes, u16::from_be_bytes)),
        _ => (None, narrow(bytes)),
    };
    let mut notes: Vec<String> = note.into_iter().map(str::to_owned).collect();
    // Classic Mac OS ended lines with a lone carriage return.
    if text.contains('\r') {
        let text = text.replace("\r\n", "\n");
        if text.contains('\r') {
            notes.push("ends lines with a carriage return only".to_owned());
        }
        return (text.replace('\r', "\n"), notes);
    }
    (text, notes)
}

/// Parses the numbers of a line.
///
/// # Errors
/// What is wrong with the line.
pub fn numbers(line: &str) -> Result<Vec<f64>, String> {
    let line = line.trim();
    if line.is_empty() {
        return Err("the line is empty".to_string());
    }
    // Commas delimit fields, which may be empty; runs of whitespace count as one separator.
    let words: Vec<&str> = if line.contains(',') {
        line.split(',').map(str::trim).collect()
    } else {
        line.split_whitespace().collect()
    };
    words.into_iter().enumerate().map(|(k, word)| number(word, k)).collect()
}

fn number(word: &str, index: usize) -> Result<f64, String> {
    if word.is_empty() {
        return Err(format!("field {} is empty", index + 1));
    }
    // Older C libraries on Windows print NaN as 1.#QNAN or -1.#IND.
    if word.contains("#QNAN") || word.contains("#IND") {
        return Ok(f64::NAN);
    }
    let shown: String = word.chars().take(24).collect();
    word.parse().map_err(|_| format!("\"{shown}\" is not a number"))
}

/// The box of a row `x,y,w,h`, or the bounding box of a polygon `x1,y1,x2,y2,..`. `None` for a row
/// with NaN. `origin` is the coordinate of the first pixel in the file, 0 or 1.
///
/// # Errors
/// What is wrong with the row.
pub fn region(row: &[f64], origin: f64) -> Result<Option<BoundingBox>, String> {
    if row.iter().any(|value| value.is_nan()) {
        return match row.len() {
            1 | 4 | 6 | 8 => Ok(None),
            count => Err(format!("{count} numbers, where a box has 4")),
        };
    }
    row.iter().try_for_each(|value| coordinate(*value))?;
    match row {
        [x, y, w, h] => Ok(Some(BoundingBox { x: x - origin, y: y - origin, w: *w, h: *h })),
        points if points.len() >= 6 && points.len().is_multiple_of(2) => {
            let bbox = bounding_box(points, origin);
            // Points may be twice as far from each other as from the frame.
            [bbox.w, bbox.h].into_iter().try_for_each(coordinate)?;
            Ok(Some(bbox))
        }
        _ => Err(format!("{} numbers, where a box has 4 and a polygon 6, 8 or more", row.len())),
    }
}

/// Checks the number of a frame, counted from 0.
///
/// # Errors
/// What is wrong with it: it must be below [`MOST_FRAMES`].
pub fn frame(frame: usize) -> Result<(), String> {
    match frame < MOST_FRAMES {
        true => Ok(()),
        false => Err(format!("{frame} is not a frame number; allowed: 0 to {}", MOST_FRAMES - 1)),
    }
}

/// Checks one number of a box.
///
/// # Errors
/// What is wrong with it: it must be finite and at most [`MAX_COORDINATE`], positive or negative.
pub fn coordinate(value: f64) -> Result<(), String> {
    match value.abs() <= MAX_COORDINATE {
        true => Ok(()),
        false => Err(format!(
            "{value:e} is not a coordinate; allowed: -{MAX_COORDINATE:e} to {MAX_COORDINATE:e}"
        )),
    }
}

/// The bounding box of points given as x, y, x, y, ..
pub fn bounding_box(points: &[f64], origin: f64) -> BoundingBox {
    let span = |first: usize| {
        let values = || points.iter().skip(first).step_by(2).copied();
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
    };
    let ((left, right), (top, bottom)) = (span(0), span(1));
    BoundingBox { x: left - origin, y: top - origin, w: right - left, h: bottom - top }
}

/// A text as a cell of a CSV table. What a spreadsheet would take for a formula has an apostrophe
/// before it; a number is none. [`of_cell`] takes it off again.
pub fn as_cell(text: &str) -> Cow<'_, str> {
    match is_formula(text.trim_start_matches('\'')) {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// The text of a cell that [`as_cell`] made.
pub fn of_cell(cell: &str) -> &str {
    let text = cell.strip_prefix('\'').filter(|rest| is_formula(rest.trim_start_matches('\'')));
    text.unwrap_or(cell)
}

fn is_formula(text: &str) -> bool {
    text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_separated_by_commas_tabs_or_spaces() {
        for line in ["1,2,3.5,4", "1\t2\t3.5\t4", " 1  2 3.5 4 ", "1, 2, 3.5,\t4"] {
            assert_eq!(numbers(line), Ok(vec![1.0, 2.0, 3.5, 4.0]), "{line}");
        }
        assert_eq!(numbers("1,,3,4"), Err("field 2 is empty".to_string()));
        assert_eq!(numbers("1,2,x,4"), Err("\"x\" is not a number".to_string()));
        assert_eq!(numbers(" "), Err("the line is empty".to_string()));
        assert!(numbers("NaN -nan 1.#QNAN -1.#IND").unwrap().iter().all(|v| v.is_nan()));
    }

    #[test]
    fn every_encoding_gives_the_same_text() {
        let text = "1,2,3,4\n5,6,7,8\n";
        let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let files = [
            (text.as_bytes().to_vec(), 0),
            ([b"\xef\xbb\xbf", text.as_bytes()].concat(), 1),
            ([b"\xff\xfe".to_vec(), wide.clone()].concat(), 1),
            ([b"\xfe\xff".to_vec(), big.clone()].concat(), 1),
            (wide, 1),
            (big, 1),
            (text.replace('\n', "\r\n").into_bytes(), 0),
            (text.replace('\n', "\r").into_bytes(), 1),
        ];
        for (bytes, note_count) in files {
            let (decoded, notes) = decode(&bytes);
            assert_eq!((decoded.as_str(), notes.len()), (text, note_count), "{notes:?}");
        }
        assert_eq!(decode(b"").0, "");
    }

    #[test]
    fn rows_are_boxes_or_polygons() {
        let bbox = BoundingBox { x: 9.0, y: 19.0, w: 30.0, h: 40.0 };
        assert_eq!(region(&[10.0, 20.0, 30.0, 40.0], 1.0), Ok(Some(bbox)));
        let polygon = [10.0, 60.0, 40.0, 20.0, 25.0, 20.0, 12.0, 30.0];
        assert_eq!(region(&polygon, 1.0), Ok(Some(bbox)));
        assert_eq!(region(&[f64::NAN, 1.0, 2.0, 3.0], 1.0), Ok(None));
        assert!(region(&[-1e9, 1e9, 1e9, 1e9], 1.0).is_ok());
        let error = region(&[1.0, -1e308, 3.0, 4.0], 1.0).unwrap_err();
        assert_eq!(error, "-1e308 is not a coordinate; allowed: -1e9 to 1e9");
        let wide = region(&[-1e9, 0.0, 1e9, 0.0, 1.0, 5.0], 1.0).unwrap_err();
        assert_eq!(wide, "2e9 is not a coordinate; allowed: -1e9 to 1e9");
        for bad in [&[1.0, 2.0, 3.0][..], &[1.0; 5], &[1.0, 2.0, f64::INFINITY, 4.0], &[]] {
            assert!(region(bad, 1.0).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn formulas_are_texts_in_cells() {
        for (text, cell) in [
            ("=1+1", "'=1+1"),
            ("+a", "'+a"),
            ("-a", "'-a"),
            ("@A1", "'@A1"),
            ("'=1", "''=1"),
            ("-0.5", "-0.5"),
            ("'t Hooft", "'t Hooft"),
            ("car", "car"),
            ("", ""),
        ] {
            assert_eq!((as_cell(text).as_ref(), of_cell(cell)), (cell, text));
        }
    }
}
