//! The box to begin with, from `--box` or from the first line of a truth file.

use std::fs;
use std::path::Path;

use patchlock::BoundingBox;

use crate::complaint::{Complaint, failed, usage};

const SYNTAX: &str = "a box is X,Y,W,H: left and upper side counted from 0, width and height, in pixels, as 120,80,64,48";

/// Reads `X,Y,W,H`, 0-based.
pub fn parse(text: &str) -> Result<BoundingBox, Complaint> {
    let numbers = numbers(text, |c| c == ',')
        .ok_or_else(|| bad_box(&format!("--box {text}: these are not four numbers")))?;
    sensible(numbers, &format!("--box {text}"))
}

/// Reads the first line of a truth file, 1-based; commas, tabs or spaces between the numbers.
pub fn from_file(file: &Path) -> Result<BoundingBox, Complaint> {
    let name = format!("--box-from {}", file.display());
    let text = fs::read(file).map_err(|error| {
        failed(format!("{name}: cannot read it: {error}"))
            .hint("name a text file whose first line is X,Y,W,H, counted from 1")
    })?;
    let text = String::from_utf8_lossy(&text);
    let line = text.lines().next().unwrap_or("").trim();
    let [x, y, w, h] = numbers(line, |c: char| c == ',' || c.is_whitespace()).ok_or_else(|| {
        usage(format!("{name}: its first line, \"{}\", is not four numbers", shortened(line)))
            .hint("the first line must be X,Y,W,H, counted from 1, with commas, tabs or spaces")
    })?;
    sensible([x - 1.0, y - 1.0, w, h], &name)
}

/// Checks the box against the frame it is in.
pub fn check(
    bbox: &BoundingBox,
    index: usize,
    width: usize,
    height: usize,
) -> Result<(), Complaint> {
    bbox.check_in(width, height).map_err(|_| {
        usage(format!(
            "the box {},{},{},{} does not fit to frame {index}, which is {width} x {height} pixels: no part of the box is in it",
            bbox.x, bbox.y, bbox.w, bbox.h
        ))
        .hint("the box holds for the first frame that is tracked; with --reverse that is the last of the range")
    })
}

fn bad_box(message: &str) -> Complaint {
    usage(message).hint(SYNTAX)
}

fn shortened(line: &str) -> String {
    line.chars().take(40).collect()
}

fn numbers(text: &str, is_separator: impl Fn(char) -> bool) -> Option<[f64; 4]> {
    // With commas every field counts, also an empty one; blanks alone may be doubled.
    let words: Vec<&str> = if text.contains(',') {
        text.split(',').map(str::trim).collect()
    } else {
        text.split(is_separator).filter(|word| !word.is_empty()).collect()
    };
    let numbers: Vec<f64> =
        words.into_iter().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// The box of these numbers, if they are one; `name` says where they come from.
pub fn sensible([x, y, w, h]: [f64; 4], name: &str) -> Result<BoundingBox, Complaint> {
    if ![x, y, w, h].iter().all(|value| value.is_finite()) {
        return Err(bad_box(&format!("{name}: all four numbers must be finite")));
    }
    if w < 1.0 || h < 1.0 {
        return Err(bad_box(&format!("{name}: width {w} and height {h} must be at least 1 pixel")));
    }
    Ok(BoundingBox { x, y, w, h })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_read() {
        assert_eq!(
            parse("1, 2.5,30,4e1").expect("good"),
            BoundingBox { x: 1.0, y: 2.5, w: 30.0, h: 40.0 }
        );
        assert_eq!(parse("-5,0,10,10").expect("partly outside is for the tracker to say").x, -5.0);
        for bad in [
            "",
            "1,2,3",
            "1,2,3,4,5",
            "1 2 3 4",
            "a,b,c,d",
            "1,2,0,4",
            "1,2,3,-4",
            "NaN,2,3,4",
            "1,2,inf,4",
            "1,,3,4",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn truth_files_count_from_one() {
        let folder = tempfile::tempdir().expect("a folder");
        for line in [
            "11,21,30,40",
            "11\t21\t30\t40",
            " 11  21 30 40 ",
            "11, 21, 30, 40\r",
            "11,\t21,\t30,\t40",
        ] {
            let file = folder.path().join("truth.txt");
            fs::write(&file, format!("{line}\n99,99,99,99\n")).expect("writes");
            assert_eq!(
                from_file(&file).expect(line),
                BoundingBox { x: 10.0, y: 20.0, w: 30.0, h: 40.0 }
            );
        }
    }
}
