//! Reads TrackingNet: `anno/<name>.txt` and `frames/<name>/0.jpg`, in the root or in its subsets
//! (`TEST`, `TRAIN_0` and so on).

use std::path::Path;

use super::frames::Images;
use super::{Builder, Dataset, Layout, truth};
use crate::Error;
use patchlock_track::files;

/// `None` if neither the root nor a folder in it has these two folders.
pub fn read(root: &Path) -> Result<Option<Dataset>, Error> {
    let is_part = |path: &Path| path.join("anno").is_dir() && path.join("frames").is_dir();
    let mut parts = vec![root.to_path_buf()];
    parts.extend(files::entries(root)?.into_iter().filter(|path| path.is_dir()));
    parts.retain(|path| is_part(path));
    if parts.is_empty() {
        return Ok(None);
    }
    let mut builder = Builder::new(Layout::TrackingNet, root);
    for part in parts {
        for file in
            files::entries(&part.join("anno"))?.into_iter().filter(|f| files::ends_with(f, "txt"))
        {
            let name = files::stem_of(&file);
            let files = files::images(&part.join("frames").join(&name))?;
            let truth = truth::read(&file, Layout::TrackingNet.origin());
            builder.add(&name, truth, Some(Images { files, ranges: Vec::new() }), Vec::new());
        }
    }
    Ok(Some(builder.dataset))
}
