//! Parses the first box, from `--box` or from the first line of a truth file.

use std::fs;
use std::path::Path;

use patchlock::BoundingBox;
use patchlock_eval::start_box::SYNTAX;
use patchlock_eval::text;

use crate::failure::{Failure, failed, named, usage};

const FIRST_LINE: &str =
    "the first line must be X,Y,W,H, counted from 1, with commas, tabs or spaces";

/// Parses `X,Y,W,H`, 0-based.
pub fn parse(given: &str) -> Result<BoundingBox, Failure> {
    let bad = |message: String| usage(message).hint(SYNTAX);
    let numbers = Some(given).filter(|given| given.contains(',')).and_then(four_numbers);
    let numbers =
        numbers.ok_or_else(|| bad(format!("--box {} is not four numbers", named(given))))?;
    checked(numbers, &format!("--box {given}")).map_err(bad)
}

/// Reads the first line of a truth file, 1-based, with commas, tabs or spaces between the numbers.
pub fn from_file(file: &Path) -> Result<BoundingBox, Failure> {
    let name = format!("--box-from {}", file.display());
    let bad = |message: String| usage(message).hint(FIRST_LINE);
    let bytes = fs::read(file).map_err(|error| {
        failed(format!("{name}: cannot read it: {error}"))
            .hint("name a text file whose first line is X,Y,W,H, counted from 1")
    })?;
    let (text, _) = text::decode(&bytes);
    let line = text.lines().next().unwrap_or("").trim();
    let name = format!("{name}: its first line, \"{}\"", shortened(line));
    let [x, y, w, h] =
        four_numbers(line).ok_or_else(|| bad(format!("{name}, is not four numbers")))?;
    checked([x - 1.0, y - 1.0, w, h], &name).map_err(bad)
}

fn shortened(line: &str) -> String {
    line.chars().take(40).collect()
}

fn four_numbers(line: &str) -> Option<[f64; 4]> {
    text::numbers(line).ok()?.try_into().ok()
}

/// The box with these numbers, or why they are not a box. `name` tells the user where they come from.
pub fn checked([x, y, w, h]: [f64; 4], name: &str) -> Result<BoundingBox, String> {
    if ![x, y, w, h].iter().all(|value| value.is_finite()) {
        return Err(format!("{name}: all four numbers must be finite"));
    }
    if w < 1.0 || h < 1.0 {
        return Err(format!("{name}: width {w} and height {h} must be at least 1 pixel"));
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
        assert_eq!(parse("-5,0,10,10").expect("the tracker checks boxes partly outside").x, -5.0);
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
            "\u{feff}11,21,30,40",
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
