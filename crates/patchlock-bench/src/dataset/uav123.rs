//! Reads UAV123: `anno/<set>/<name>.txt`, `anno/<set>/att/<name>.txt` and
//! `data_seq/<set>/<name>/000001.jpg`. Several targets may be parts of one folder of images:
//! `bird1_2` is a part of `bird1`.

use std::path::{Path, PathBuf};

use super::frames::{Images, Range};
use super::{Builder, Dataset, Layout, truth};
use crate::Error;
use patchlock_track::{files, text};

/// Short names of the attributes, in the order of the attribute files.
const ATTRIBUTES: [&str; 12] =
    ["SV", "ARC", "LR", "FM", "FOC", "POC", "OV", "BC", "IV", "VC", "CM", "SOB"];
/// The numbers of the image files of each target that is a part of a folder.
const PARTS: &str = include_str!("uav123_parts.txt");

/// `None` unless the root has the folders `anno` and `data_seq`.
pub fn read(root: &Path) -> Result<Option<Dataset>, Error> {
    let (anno, images) = (root.join("anno"), root.join("data_seq"));
    if !anno.is_dir() || !images.is_dir() {
        return Ok(None);
    }
    let mut builder = Builder::new(Layout::Uav123, root);
    for set in files::entries(&anno)?.into_iter().filter(|path| path.is_dir()) {
        let images = images.join(files::name_of(&set));
        for file in files::entries(&set)?.into_iter().filter(|file| files::ends_with(file, "txt")) {
            let name = files::stem_of(&file);
            let truth = truth::read(&file, Layout::Uav123.origin());
            let attributes = attributes(&set.join("att").join(format!("{name}.txt")));
            builder.add(&name, truth, Some(images_of(&images, &name)?), attributes);
        }
    }
    Ok(Some(builder.dataset))
}

fn images_of(folder: &Path, name: &str) -> Result<Images, Error> {
    let own = folder.join(name);
    if own.is_dir() {
        return Ok(Images { files: files::images(&own)?, ranges: Vec::new() });
    }
    let whole = name.rsplit_once('_').map_or(name, |(whole, _)| whole);
    let files: Vec<PathBuf> = files::images(&folder.join(whole))?;
    Ok(Images { files, ranges: part(name).into_iter().collect() })
}

fn part(name: &str) -> Option<Range> {
    let rows = PARTS.lines().filter(|line| !line.starts_with('#'));
    let (_, range) =
        rows.filter_map(|line| line.split_once(' ')).find(|(part, _)| *part == name)?;
    Range::parse(range)
}

/// Reads one row of flags; a missing or different file gives none.
fn attributes(file: &Path) -> Vec<String> {
    let rows = text::read(file).map(|table| table.rows).unwrap_or_default();
    let flags: Vec<f64> = rows.into_iter().flatten().collect();
    let is_valid = flags.len() == ATTRIBUTES.len();
    let set = ATTRIBUTES.iter().zip(&flags).filter(|(_, flag)| is_valid && **flag > 0.0);
    set.map(|(name, _)| name.to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_has_a_range() {
        let names = PARTS
            .lines()
            .filter(|line| !line.starts_with('#'))
            .filter_map(|line| line.split(' ').next());
        let names: Vec<&str> = names.collect();
        assert_eq!(names.len(), 51);
        assert!(names.iter().all(|name| part(name).is_some()), "{names:?}");
        assert_eq!(part("bird1_2"), Some(Range { first: 775, last: 1477 }));
    }
}
