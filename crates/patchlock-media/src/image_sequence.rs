//! Frames from image files: a folder, a printf pattern, a glob or a single image.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::image_file::{self, LoadError, is_image};
use crate::limits::Limits;
use crate::{Error, FrameSource, Picture, SourceInfo, natural_order, plain_file};

/// A list of image files, one per frame.
pub struct ImageSequence {
    files: Vec<PathBuf>,
    /// Where the frames begin in the only file, if that is a TIFF of several pages.
    pages: Vec<u64>,
    limits: Limits,
}

impl ImageSequence {
    /// All images of a folder, in natural order. Two images of the same number are refused: one of
    /// them may be a mask.
    pub fn folder(folder: &Path) -> Result<Self, Error> {
        let files = visible_files(folder)?.into_iter().filter(|file| is_image(file)).collect();
        let images = Self::sorted(files, || {
            let inner = image_subfolder(folder).map(|inner| inner.display().to_string());
            Error::NoImages { folder: folder.display().to_string(), inner }
        })?;
        let Some((first, second)) = same_number(&images.files) else { return Ok(images) };
        let part = match first.extension() == second.extension() {
            true => numbered(&first),
            false => format!("*.{}", first.extension().unwrap_or_default().display()),
        };
        let reason = format!(
            "it has both {} and {}; name one kind, as in {}",
            name_of(&first),
            name_of(&second),
            folder.join(part).display()
        );
        Err(Error::unreadable(format!("the folder {}", folder.display()), reason))
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

    /// The pages of a TIFF, or a single image. What cannot be read is an error of the frame.
    pub fn single(file: &Path) -> Result<Self, Error> {
        let pages =
            image_file::pages(file).map_err(|error| Error::unreadable(file.display(), error))?;
        Ok(Self { files: vec![file.to_path_buf()], pages, limits: Limits::default() })
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
        Ok(Self { files, pages: Vec::new(), limits: Limits::default() })
    }
}

impl FrameSource for ImageSequence {
    fn info(&self) -> SourceInfo {
        SourceInfo { length: Some(self.files.len().max(self.pages.len())), ..SourceInfo::default() }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let (file, picture) = match (self.pages.get(index), self.files.first()) {
            (Some(&page), Some(file)) => (file, image_file::load_page(file, page, self.limits)),
            _ => {
                let Some(file) = self.files.get(index) else { return Ok(None) };
                let plain = plain_file::open(file).map_err(LoadError::from);
                (file, plain.and_then(|plain| image_file::load_from(plain, self.limits)))
            }
        };
        picture.map(Some).map_err(|reason| match reason {
            LoadError::TooLarge(size) => {
                Error::TooLarge { what: format!("frame {index}, {}", file.display()), size }
            }
            error => {
                let (file, reason) = (file.display().to_string(), error.to_string());
                Error::Image { index, file, reason }
            }
        })
    }
}

fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Two images of a folder whose names have the same numbers, such as `0001.jpg` and `0001_mask.png`,
/// or differ only in the extension. The shorter name is the first.
fn same_number(files: &[PathBuf]) -> Option<(PathBuf, PathBuf)> {
    let mut seen = HashMap::new();
    for file in files {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let is_number = |c: char| c.is_ascii_digit();
        let numbers: Vec<String> = stem
            .split(|c: char| !is_number(c))
            .filter(|n| !n.is_empty())
            .map(String::from)
            .collect();
        let key = if numbers.is_empty() { vec![stem] } else { numbers };
        if let Some(other) = seen.insert(key, file) {
            let mut both = [other, file];
            both.sort_by_key(|file| file.as_os_str().len());
            return Some((both[0].clone(), both[1].clone()));
        }
    }
    None
}

/// The name of an image as a pattern for its last number.
fn numbered(file: &Path) -> String {
    let name = name_of(file);
    let stem = file.file_stem().unwrap_or_default().len();
    let Some(end) = name[..stem].rfind(|c: char| c.is_ascii_digit()) else { return name };
    let before = name[..=end].trim_end_matches(|c: char| c.is_ascii_digit());
    let width = end + 1 - before.len();
    format!("{before}%0{width}d{}", &name[end + 1..])
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
    let inner = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    let has_images = |path: &PathBuf| {
        path.is_dir() && visible_files(path).is_ok_and(|files| files.iter().any(|f| is_image(f)))
    };
    inner.filter(has_images).min()
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
    fn images_of_the_same_number_in_a_folder_are_refused() {
        let refused = |names: &[&str]| {
            let folder = tempfile::tempdir().unwrap();
            names.iter().for_each(|name| fs::write(folder.path().join(name), "x").unwrap());
            let error = ImageSequence::folder(folder.path()).err()?.to_string();
            Some(error.replace(&format!("{}/", folder.path().display()), ""))
        };
        let both = |names: &[&str], words: &str| {
            let error = refused(names).unwrap();
            assert!(error.ends_with(words), "{error}");
        };
        both(
            &["0001.jpg", "0002.jpg", "0001.png"],
            "it has both 0001.jpg and 0001.png; name one kind, as in *.jpg",
        );
        both(
            &["a_7_mask.png", "a_7.png"],
            "it has both a_7.png and a_7_mask.png; name one kind, as in a_%01d.png",
        );
        both(&["x.png", "x.bmp"], "as in *.bmp");
        both(&["left012.png", "right012.png"], "as in left%03d.png");
        assert_eq!(refused(&["0001.jpg", "0002.png", "1.jpg", "b.png", "c.png", "1_2.png"]), None);
        // One that was named is not in question.
        let folder = tempfile::tempdir().unwrap();
        for name in ["1.jpg", "1.png", "2.jpg"] {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        let glob = |end: &str| folder.path().join(end).to_str().unwrap().to_string();
        assert_eq!(ImageSequence::glob(&glob("*.jpg")).ok().unwrap().into_files().len(), 2);
        assert_eq!(ImageSequence::glob(&glob("*")).ok().unwrap().into_files().len(), 3);
    }

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
