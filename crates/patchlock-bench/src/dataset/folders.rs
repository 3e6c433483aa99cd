//! Reads the layouts with one folder per sequence and a `groundtruth.txt` in it: GOT-10k, LaSOT and
//! VOT. The other files in the folder tell them apart.

use std::path::{Path, PathBuf};

use super::frames::Images;
use super::{Builder, Dataset, Layout, truth};
use crate::Error;
use patchlock_track::{files, text};

const TRUTH: &str = "groundtruth.txt";
/// Depth below the root at which sequences are searched: LaSOT has a folder for each class, GOT-10k
/// for each subset.
const DEPTH: usize = 2;

/// `None` if no folder holds such a file. The root may itself be a sequence.
pub fn read(root: &Path) -> Result<Option<Dataset>, Error> {
    let mut folders = Vec::new();
    find(root, DEPTH, &mut folders)?;
    let Some(layout) = folders.first().map(|folder| layout_of(folder)) else { return Ok(None) };
    let mut builder = Builder::new(layout, root);
    for folder in &folders {
        let own = layout_of(folder);
        if own != layout {
            let text = format!(
                "{} is left out: its layout is {own}, that of the others {layout}",
                folder.display()
            );
            builder.remark_all(text);
            continue;
        }
        read_sequence(folder, layout, &mut builder)?;
    }
    Ok(Some(builder.dataset))
}

fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), Error> {
    if folder.join(TRUTH).is_file() {
        found.push(folder.to_path_buf());
        return Ok(());
    }
    if depth > 0 {
        for inner in files::entries(folder)?.into_iter().filter(|path| path.is_dir()) {
            find(&inner, depth - 1, found)?;
        }
    }
    Ok(())
}

fn layout_of(folder: &Path) -> Layout {
    let has = |name: &str| folder.join(name).exists();
    let is_got10k = files::name_of(folder).starts_with("GOT-10k");
    if is_got10k || has("meta_info.ini") || has("absence.label") {
        Layout::Got10k
    } else if has("img") {
        Layout::Lasot
    } else {
        Layout::Vot
    }
}

fn read_sequence(folder: &Path, layout: Layout, builder: &mut Builder) -> Result<(), Error> {
    let images = match layout {
        Layout::Lasot => folder.join("img"),
        Layout::Vot if folder.join("color").is_dir() => folder.join("color"),
        _ => folder.to_path_buf(),
    };
    let images = Images { files: files::images(&images)?, ranges: Vec::new() };
    let name = files::name_of(folder);
    let mut truth = truth::read(&folder.join(TRUTH), layout.origin());
    let absent: &[&str] = match layout {
        Layout::Got10k => &["absence.label"],
        Layout::Lasot => &["full_occlusion.txt", "out_of_view.txt"],
        _ => &[],
    };
    for flags in absent.iter().map(|name| folder.join(name)).filter(|file| file.is_file()) {
        truth = truth.and_then(|mut truth| truth.without(&flags).map(|()| truth));
    }
    let attributes = if layout == Layout::Vot { tags(folder)? } else { Vec::new() };
    builder.add(&name, truth, Some(images), attributes);
    Ok(())
}

/// VOT's tags: one file per tag, with one flag per frame. A sequence has the tags that any of its
/// frames has.
fn tags(folder: &Path) -> Result<Vec<String>, Error> {
    let is_tag = |path: &PathBuf| files::ends_with(path, "tag") || files::ends_with(path, "label");
    let mut tags = Vec::new();
    for file in files::entries(folder)?.into_iter().filter(is_tag) {
        let rows = text::read(&file).map(|table| table.rows).unwrap_or_default();
        if rows.iter().flatten().any(|flag| *flag > 0.0) {
            tags.push(files::stem_of(&file));
        }
    }
    Ok(tags)
}
