//! The table of the tracker benchmark's sequences: which frames count, and the attributes of each target.

use super::Dataset;
use crate::{Error, names};

/// Short names and meanings of the tracker benchmark's attributes, in its order.
pub const OTB_ATTRIBUTES: [(&str, &str); 11] = [
    ("IV", "illumination variation"),
    ("OPR", "out-of-plane rotation"),
    ("SV", "scale variation"),
    ("OCC", "occlusion"),
    ("DEF", "deformation"),
    ("MB", "motion blur"),
    ("FM", "fast motion"),
    ("IPR", "in-plane rotation"),
    ("OV", "out of view"),
    ("BC", "background clutter"),
    ("LR", "low resolution"),
];

/// One target a line: name, frames that count (`-` for all), attributes (`-` for none).
const ROWS: &str = include_str!("otb_sequences.txt");

fn rows() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    ROWS.lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
        let mut words = line.split_whitespace();
        Some((words.next()?, words.next()?, words.next()?))
    })
}

/// Numbers of image files, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// The first one.
    pub first: u64,
    /// The last one.
    pub last: u64,
}

impl Range {
    /// How many there are.
    pub fn len(self) -> usize {
        (self.last.saturating_sub(self.first) + 1) as usize
    }

    /// Whether the number is one of them.
    pub fn has(self, number: u64) -> bool {
        (self.first..=self.last).contains(&number)
    }
}

/// The ranges of file numbers that count, as the editions of the benchmark have them; empty where all do.
pub fn ranges(name: &str) -> Vec<Range> {
    let row = rows().find(|(target, ..)| names::same(target, name));
    let ranges = row.filter(|row| row.1 != "-").map_or("", |row| row.1);
    let range = |text: &str| {
        let (first, last) = text.split_once("..")?;
        Some(Range { first: first.parse().ok()?, last: last.parse().ok()? })
    };
    ranges.split('|').filter_map(range).collect()
}

/// Gives each target the attributes of the table.
pub fn add_attributes(dataset: &mut Dataset) -> Result<(), Error> {
    for sequence in &mut dataset.sequences {
        let row = rows().find(|(target, ..)| names::same(target, &sequence.name));
        let attributes = row.filter(|row| row.2 != "-").map_or("", |row| row.2);
        sequence.attributes =
            attributes.split(',').filter(|a| !a.is_empty()).map(str::to_string).collect();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_whole() {
        let lines = ROWS.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        assert_eq!(rows().count(), lines.count());
        for (name, frames, attributes) in rows() {
            assert!(frames == "-" || !ranges(name).is_empty(), "{name} {frames}");
            let known = |a: &str| OTB_ATTRIBUTES.iter().any(|(short, _)| *short == a);
            assert!(attributes == "-" || attributes.split(',').all(known), "{name} {attributes}");
            assert_eq!(rows().filter(|row| names::same(row.0, name)).count(), 1, "{name}");
        }
        assert_eq!(ranges("david"), [Range { first: 300, last: 770 }]);
        assert_eq!(ranges("Tiger1").iter().map(|r| r.len()).collect::<Vec<_>>(), [354, 349]);
        assert!(ranges("Deer").is_empty());
    }
}
