//! The table of the OTB sequences: which frames count, and the attributes of each target.

use std::path::Path;

use super::Dataset;
use super::frames::Range;
use crate::Error;
use patchlock_track::{files, names, text};

/// Short names and meanings of the attributes of OTB, in its order.
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

/// One target per line: name, frames that count (`-` for all), attributes (`-` for none).
const ROWS: &str = include_str!("otb_sequences.txt");

fn rows() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    ROWS.lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
        let mut words = line.split_whitespace();
        Some((words.next()?, words.next()?, words.next()?))
    })
}

/// If results with `rows` boxes cover all frames of a sequence of which only a part counts: a note
/// on that part.
pub fn counted_part(name: &str, rows: usize) -> Option<String> {
    let range = ranges(name).into_iter().find(|range| range.len() == rows)?;
    Some(format!("the benchmark counts frames {} to {} of this sequence", range.first, range.last))
}

/// The ranges of file numbers that count, one for each edition of the benchmark; empty if all
/// frames count.
pub fn ranges(name: &str) -> Vec<Range> {
    let row = rows().find(|(target, ..)| names::same(target, name));
    let ranges = row.filter(|row| row.1 != "-").map_or("", |row| row.1);
    ranges.split('|').filter_map(Range::parse).collect()
}

/// Name of an optional table of attributes in or beside a dataset. Its header is `sequence` and
/// short names of attributes; each further line has the name of a target and 0 or 1 for each
/// attribute.
const USER_TABLE: &str = "attributes.csv";

/// Adds attributes to the targets that have none, from the user's table or else from that of OTB.
///
/// # Errors
/// [`Error::Track`] if the user's table is invalid.
pub fn add_attributes(dataset: &mut Dataset) -> Result<(), Error> {
    let user_rows = user_table(&dataset.root)?;
    for sequence in dataset.sequences.iter_mut().filter(|sequence| sequence.attributes.is_empty()) {
        let name = &sequence.name;
        let listed = user_rows.iter().find(|(target, _)| names::same(target, name));
        sequence.attributes = match listed {
            Some((_, attributes)) => attributes.clone(),
            None => otb_attributes(name),
        };
    }
    Ok(())
}

fn otb_attributes(name: &str) -> Vec<String> {
    let row = rows().find(|(target, ..)| names::same(target, name));
    let attributes = row.filter(|row| row.2 != "-").map_or("", |row| row.2);
    attributes.split(',').filter(|a| !a.is_empty()).map(str::to_string).collect()
}

/// The targets of the user's table with their attributes; empty if there is no such table.
fn user_table(root: &Path) -> Result<Vec<(String, Vec<String>)>, Error> {
    let beside = root.canonicalize().ok().and_then(|root| Some(root.parent()?.join(USER_TABLE)));
    let candidates = [Some(root.join(USER_TABLE)), beside];
    let Some(path) = candidates.into_iter().flatten().find(|path| path.is_file()) else {
        return Ok(Vec::new());
    };
    let bytes = files::read(&path).map_err(|error| Error::read(&path, error))?;
    let (text, _) = text::decode(&bytes);
    let mut lines = text.lines().map(|line| line.split(',').map(str::trim).collect::<Vec<_>>());
    let header = lines.next().unwrap_or_default();
    let mut table = Vec::new();
    for (k, row) in lines.enumerate().filter(|(_, row)| row.len() > 1) {
        let flags: Vec<&str> = row[1..].to_vec();
        if row.len() != header.len() || flags.iter().any(|flag| !matches!(*flag, "0" | "1")) {
            let reason =
                format!("expected the name of a target and {} flags, 0 or 1", header.len() - 1);
            return Err(Error::line(&path, k + 2, reason));
        }
        let set = header[1..].iter().zip(flags).filter(|(_, flag)| *flag == "1");
        table.push((row[0].to_string(), set.map(|(name, _)| name.to_string()).collect()));
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_valid() {
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
