//! Reads one folder per target: `<target>/<target>_001.txt`, as written by the toolkits of GOT-10k
//! and VOT. Files 002 and so on are repetitions.

use std::path::{Path, PathBuf};

use patchlock::BoundingBox;

use super::{Results, boxes};
use crate::Error;
use crate::dataset::Dataset;
use patchlock_track::files::{ends_with, entries, name_of, stem_of};
use patchlock_track::text;

/// Names of the VOT toolkit's experiments: a folder between that of the tracker and those of the
/// targets.
const EXPERIMENTS: &[&str] = &["baseline", "supervised", "unsupervised", "realtime"];

/// `None` if no folder has files of its own name.
pub fn read(folder: &Path, truth: &Dataset) -> Result<Option<Results>, Error> {
    let mut results = Results::new(tracker_name(folder));
    let mut codes = 0;
    for inner in entries(folder)?.into_iter().filter(|path| path.is_dir()) {
        let target = name_of(&inner);
        for (number, file) in repetitions(&inner, &target)? {
            let table = match text::read(&file) {
                Ok(table) => table,
                Err(error) => {
                    results.faults.push(error.to_string());
                    continue;
                }
            };
            let given = if is_vot(&table) {
                let first = truth.find(&target).and_then(|sequence| *sequence.truth.first()?);
                vot_boxes(&file, &table, truth.origin(), first, &mut codes)
            } else {
                boxes(&file, &table, truth.origin())
            };
            let times = inner.join(format!("{target}_time.txt"));
            // With several repetitions the file of times has one column for each; these are not read.
            let times = (number == 0).then_some(times.as_path());
            results.add(target.clone(), number, &file, given, times);
        }
    }
    if codes > 0 {
        results.notes.push(format!(
            "{codes} lines are codes of VOT's supervised experiment, which restarts the tracker after a \
             failure: not comparable with one pass"
        ));
    }
    Ok((!results.is_empty()).then_some(results))
}

/// The name of the folder, preceded by that of the tracker if the folder is an experiment.
fn tracker_name(folder: &Path) -> String {
    let name = name_of(folder);
    match folder.parent().map(name_of) {
        Some(tracker) if EXPERIMENTS.contains(&name.as_str()) => format!("{tracker} {name}"),
        _ => name,
    }
}

/// The files `<target>_001.txt` and so on, numbered from 0.
fn repetitions(folder: &Path, target: &str) -> Result<Vec<(u64, PathBuf)>, Error> {
    let number = |file: PathBuf| {
        let stem = stem_of(&file);
        let digits = stem.strip_prefix(target)?.strip_prefix('_')?;
        let all_digits = !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit());
        let number: u64 = all_digits.then(|| digits.parse().ok()).flatten()?;
        Some((number.checked_sub(1)?, file))
    };
    let texts = entries(folder)?.into_iter().filter(|path| ends_with(path, "txt"));
    Ok(texts.filter_map(number).collect())
}

/// Whether any line is a code or a polygon.
fn is_vot(table: &text::Table) -> bool {
    table.rows.iter().any(|row| row.len() == 1 || row.len() >= 6)
}

/// The boxes of a VOT file. Code 1 in the first line means that the tracker was started there on
/// the true box, `first`. `codes` counts the codes after it.
fn vot_boxes(
    file: &Path,
    table: &text::Table,
    origin: f64,
    first: Option<BoundingBox>,
    codes: &mut usize,
) -> Result<Vec<Option<BoundingBox>>, Error> {
    let mut all = Vec::new();
    for (k, row) in table.rows.iter().enumerate() {
        let error = |reason| Error::line(file, k + 1, reason);
        all.push(match row[..] {
            [1.0] if k == 0 => first,
            [code] if [0.0, 1.0, 2.0].contains(&code) => {
                *codes += 1;
                None
            }
            [code] => return Err(error(format!("{code} is not one of the codes 0, 1 and 2"))),
            _ => text::region(row, origin).map_err(error)?,
        });
    }
    Ok(all)
}
