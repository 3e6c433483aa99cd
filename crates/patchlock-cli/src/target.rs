//! Parses the first box, from `--box` or from a truth file.

use std::path::Path;

use patchlock::BoundingBox;
use patchlock_track::{files, text};

use crate::advice::BOX;
use crate::failure::{Failure, failed, named, usage};

const LINE: &str = "the line of the first tracked frame must be X,Y,W,H, counted from 1, with commas, tabs \
                    or spaces";

/// Parses `X,Y,W,H`, 0-based.
pub fn parse(given: &str) -> Result<BoundingBox, Failure> {
    let bad = |message: String| usage(message).hint(BOX);
    let numbers = Some(given).filter(|given| given.contains(',')).and_then(four_numbers);
    let numbers =
        numbers.ok_or_else(|| bad(format!("--box {} is not four numbers", named(given))))?;
    checked(numbers, &format!("--box {given}")).map_err(bad)
}

/// A truth file: one line for each frame of the source, 1-based, with commas, tabs or spaces
/// between the numbers.
pub struct Truth {
    name: String,
    text: String,
}

impl Truth {
    /// Reads the file.
    pub fn read(file: &Path) -> Result<Self, Failure> {
        let name = format!("--box-from {}", file.display());
        let bytes = files::read(file).map_err(|error| {
            failed(format!("{name}: cannot read it: {error}"))
                .hint("name a text file with a line X,Y,W,H for each frame, counted from 1")
        })?;
        Ok(Self { name, text: text::decode(&bytes).0 })
    }

    /// The box in this frame. If the file has only one line, that is the box, whatever the frame.
    pub fn at(&self, frame: usize) -> Result<BoundingBox, Failure> {
        let lines: Vec<&str> = self.text.trim_end().lines().collect();
        let k = if lines.len() == 1 { 0 } else { frame };
        let Some(line) = lines.get(k).map(|line| line.trim()) else {
            return Err(usage(format!(
                "{}: there is no line for frame {frame}: it has {} lines",
                self.name,
                lines.len()
            ))
            .hint("the file needs one line for each frame of the source, or a single one"));
        };
        let name = format!("{}, line {}: \"{}\"", self.name, k + 1, shortened(line));
        let bad = |message: String| usage(message).hint(LINE);
        let row = text::numbers(line).map_err(|reason| bad(format!("{name}: {reason}")))?;
        match text::region(&row, 1.0).map_err(|reason| bad(format!("{name}: {reason}")))? {
            Some(BoundingBox { x, y, w, h }) => checked([x, y, w, h], &name).map_err(bad),
            None => Err(bad(format!("{name}: there is no box in frame {frame}"))),
        }
    }
}

fn shortened(line: &str) -> String {
    line.chars().take(40).collect()
}

fn four_numbers(given: &str) -> Option<[f64; 4]> {
    text::numbers(given).ok()?.try_into().ok()
}

/// The box with these numbers, or why they are not a box. `name` tells the user where they come
/// from.
pub fn checked([x, y, w, h]: [f64; 4], name: &str) -> Result<BoundingBox, String> {
    let numbers = [x, y, w, h].into_iter();
    { numbers }.try_for_each(text::coordinate).map_err(|reason| format!("{name}: {reason}"))?;
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
            std::fs::write(&file, format!("{line}\n5,6,7,8\nNaN,NaN,NaN,NaN\n")).expect("writes");
            let truth = Truth::read(&file).expect("reads");
            let bbox = BoundingBox { x: 10.0, y: 20.0, w: 30.0, h: 40.0 };
            assert_eq!(truth.at(0).expect(line), bbox);
            assert_eq!(truth.at(1).expect("the line of the frame").w, 7.0);
            let error = |frame| truth.at(frame).expect_err("no box").to_string();
            assert!(error(2).contains("line 3") && error(2).contains("no box in frame 2"));
            assert!(error(3).contains("no line for frame 3: it has 3 lines"), "{}", error(3));
            std::fs::write(&file, line).expect("writes");
            let single = Truth::read(&file).expect("reads");
            assert_eq!(single.at(100).expect("the only line"), bbox);
        }
    }
}
