//! Frames from image files: a folder, a printf pattern, a glob or a single image.

use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::image_file::{self, LoadError, is_image};
use crate::limits::Limits;
use crate::{Error, FrameRate, FrameSource, Picture, natural_order};

/// A list of image files, one per frame.
pub struct ImageSequence {
    files: Vec<PathBuf>,
    limits: Limits,
}

impl ImageSequence {
    /// All images of a folder, in natural order.
    pub fn folder(folder: &Path) -> Result<Self, Error> {
        let files = visible_files(folder)?.into_iter().filter(|file| is_image(file)).collect();
        Self::sorted(files, || {
            let inner = image_subfolder(folder);
            Error::NoImages { folder: folder.to_path_buf(), inner }
        })
    }

    /// The files that match a pattern such as `img/%04d.jpg`, ordered by number. The numbers may
    /// start anywhere and have gaps.
    pub fn pattern(text: &str, pattern: &Pattern) -> Result<Self, Error> {
        let names = visible_files(&pattern.folder)?;
        let files = names.into_iter().filter(|file| pattern.matches(file)).collect();
        Self::sorted(files, || Error::NoMatch { pattern: text.to_string(), is_glob: false })
    }

    /// The files that match a glob, in natural order.
    pub fn glob(text: &str) -> Result<Self, Error> {
        let paths = glob::glob(text)
            .map_err(|error| Error::unreadable(text, format!("not a valid glob: {error}")))?;
        let files =
            paths.collect::<Result<Vec<_>, _>>().map_err(|error| Error::unreadable(text, error))?;
        let files = files.into_iter().filter(|file| is_image(file) && !file.is_dir()).collect();
        Self::sorted(files, || Error::NoMatch { pattern: text.to_string(), is_glob: true })
    }

    /// A sequence of a single image.
    pub fn single(file: &Path) -> Self {
        Self { files: vec![file.to_path_buf()], limits: Limits::default() }
    }

    /// The same sequence with other limits.
    pub fn within(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// The files, in the order of the frames.
    pub fn into_files(self) -> Vec<PathBuf> {
        self.files
    }

    fn sorted(mut files: Vec<PathBuf>, none: impl Fn() -> Error) -> Result<Self, Error> {
        if files.is_empty() {
            return Err(none());
        }
        files.sort_by(|a, b| natural_order::compare(&a.to_string_lossy(), &b.to_string_lossy()));
        Ok(Self { files, limits: Limits::default() })
    }
}

impl FrameSource for ImageSequence {
    fn length(&self) -> Option<usize> {
        Some(self.files.len())
    }

    fn rate(&self) -> Option<FrameRate> {
        None
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let Some(file) = self.files.get(index) else { return Ok(None) };
        image_file::load_within(file, self.limits).map(Some).map_err(|reason| match reason {
            LoadError::TooLarge(size) => {
                Error::TooLarge { what: format!("frame {index}, {}", file.display()), size }
            }
            reason => Error::Image { index, file: file.clone(), reason },
        })
    }
}

/// All entries but folders and hidden files. Entries that cannot be read, such as a dangling link,
/// are kept as frames: reading them reports their name, and the frames after them keep their
/// numbers.
fn visible_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let cannot =
        |error: io::Error| Error::unreadable(format!("the folder {}", folder.display()), error);
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if !hidden && !path.is_dir() {
            files.push(path);
        }
    }
    Ok(files)
}

/// The first subfolder with images: benchmarks often store frames one level deeper.
fn image_subfolder(folder: &Path) -> Option<PathBuf> {
    let inner =
        fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path()).filter(|path| path.is_dir());
    let mut inner: Vec<_> = inner
        .filter(|path| visible_files(path).is_ok_and(|f| f.iter().any(|f| is_image(f))))
        .collect();
    inner.sort();
    inner.into_iter().next()
}

/// A printf pattern with one number: `%d` or `%0Nd`.
#[derive(Debug, PartialEq)]
pub struct Pattern {
    folder: PathBuf,
    before: String,
    after: String,
    width: usize,
}

impl Pattern {
    /// Parses a path. `None` if its last part has no number placeholder.
    pub fn parse(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (before, rest) = name.split_once('%')?;
        let (digits, after) = rest.split_once('d')?;
        if !digits.chars().all(|c| c.is_ascii_digit()) {
            return None;
        }
        let width = if digits.is_empty() { 1 } else { digits.parse().ok()? };
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(Self {
            folder: folder.to_path_buf(),
            before: before.into(),
            after: after.into(),
            width,
        })
    }

    fn matches(&self, file: &Path) -> bool {
        let name = file.file_name().and_then(|name| name.to_str()).unwrap_or("");
        let number =
            name.strip_prefix(&self.before).and_then(|rest| rest.strip_suffix(&self.after));
        number.is_some_and(|digits| {
            let all_digits = !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit());
            let padding = digits.len() > self.width && digits.starts_with('0');
            all_digits && digits.len() >= self.width && !padding
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_as_printf_writes() {
        let parse = |text: &str| Pattern::parse(Path::new(text));
        let four = parse("img/a%04d.jpg").expect("a pattern");
        assert_eq!(four.folder, Path::new("img"));
        let hits = |p: &Pattern, name: &str| p.matches(Path::new(name));
        assert!(hits(&four, "a0001.jpg") && hits(&four, "a12345.jpg"));
        assert!(!hits(&four, "a1.jpg") && !hits(&four, "a00001.jpg") && !hits(&four, "a0001.png"));
        let free = parse("%d.png").expect("a pattern");
        assert!(
            hits(&free, "7.png")
                && hits(&free, "70.png")
                && !hits(&free, "07.png")
                && !hits(&free, "x.png")
        );
        assert_eq!(parse("100%.png"), None);
        assert_eq!(parse("a%sd.png"), None);
    }
}
