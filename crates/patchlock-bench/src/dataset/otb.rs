//! Reads the layout of OTB: `<Name>/img/0001.jpg` and `<Name>/groundtruth_rect.txt`, or
//! `groundtruth_rect.1.txt` and so on for sequences with several targets.

use std::path::Path;

use super::frames::Images;
use super::{Builder, Dataset, Layout, table, truth};
use crate::Error;
use patchlock_track::files;

/// `None` if no folder holds such a file. The root may itself be a sequence.
pub fn read(root: &Path) -> Result<Option<Dataset>, Error> {
    let mut builder = Builder::new(Layout::Otb, root);
    let mut folders = vec![root.to_path_buf()];
    folders.extend(files::entries(root)?.into_iter().filter(|path| path.is_dir()));
    for folder in folders {
        read_sequence(&folder, &mut builder)?;
    }
    let found = !builder.dataset.sequences.is_empty() || !builder.dataset.remarks.is_empty();
    Ok(found.then_some(builder.dataset))
}

fn read_sequence(folder: &Path, builder: &mut Builder) -> Result<(), Error> {
    for file in files::entries(folder)? {
        let file_name = files::name_of(&file);
        let Some(part) = part_of(&file_name) else { continue };
        let sequence = files::name_of(folder);
        let name = if part.is_empty() { sequence } else { format!("{sequence}.{part}") };
        let truth = truth::read(&file, Layout::Otb.origin());
        let files = files::images(&folder.join("img"))?;
        let images = Images { files, ranges: table::ranges(&name) };
        builder.add(&name, truth, Some(images), Vec::new());
    }
    Ok(())
}

/// The part between `groundtruth_rect` and `.txt`: empty, or the number of the target.
fn part_of(file: &str) -> Option<&str> {
    let part = file.strip_prefix("groundtruth_rect")?.strip_suffix(".txt")?;
    part.is_empty()
        .then_some(part)
        .or_else(|| part.strip_prefix('.').filter(|part| !part.is_empty()))
}
