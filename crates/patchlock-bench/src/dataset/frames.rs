//! Matches image files with the rows of ground truth.

use std::path::PathBuf;

use patchlock_track::{files, names};

/// An inclusive range of numbers of image files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    pub first: u64,
    pub last: u64,
}

impl Range {
    /// Parses `1..354`; `None` for anything else.
    pub fn parse(text: &str) -> Option<Self> {
        let (first, last) = text.split_once("..")?;
        let range = Self { first: first.parse().ok()?, last: last.parse().ok()? };
        (range.first <= range.last).then_some(range)
    }

    pub fn len(self) -> usize {
        (self.last - self.first) as usize + 1
    }

    pub fn has(self, number: u64) -> bool {
        (self.first..=self.last).contains(&number)
    }
}

#[derive(Debug, Clone, Default)]
pub struct Images {
    /// All images of the folder, in natural order.
    pub files: Vec<PathBuf>,
    /// The range that counts, for each edition of the benchmark; empty if all images count.
    pub ranges: Vec<Range>,
}

/// The images that belong to `rows` rows of ground truth, and a note on anything unusual about
/// them.
///
/// # Errors
/// The reason why images and rows cannot be matched. Nothing is guessed.
pub fn fit(images: &Images, rows: usize) -> Result<(Vec<PathBuf>, Option<String>), String> {
    let files = &images.files;
    if files.is_empty() {
        return Err("there are no images".to_string());
    }
    if files.len() == rows {
        let gaps = gaps(files);
        let note = (!gaps.is_empty()).then(|| {
            format!(
                "there are as many images as rows of truth, but the numbering has gaps: no {}",
                names::some_of(&gaps)
            )
        });
        return Ok((files.clone(), note));
    }
    let fitting: Vec<Range> =
        images.ranges.iter().filter(|range| range.len() == rows).copied().collect();
    for &range in &fitting {
        let inside = inside(files, range);
        if inside.len() == rows {
            return Ok((inside, None));
        }
    }
    if let Some(range) = fitting.first() {
        let missing: Vec<u64> = (range.first..=range.last).filter(|n| !has(files, *n)).collect();
        return Err(missing_images(&missing));
    }
    let gaps = gaps(files);
    if files.len() + gaps.len() == rows {
        return Err(missing_images(&gaps));
    }
    Err(format!("{} images, but {rows} rows of truth", files.len()))
}

fn missing_images<T: ToString>(numbers: &[T]) -> String {
    let numbers: Vec<String> = numbers.iter().map(T::to_string).collect();
    match numbers.len() {
        1 => format!("image {} is missing", numbers[0]),
        count => format!("{count} images are missing: {}", names::some_of(&numbers)),
    }
}

fn inside(files: &[PathBuf], range: Range) -> Vec<PathBuf> {
    let is_inside =
        |file: &&PathBuf| files::number_of(file).is_some_and(|number| range.has(number));
    files.iter().filter(is_inside).cloned().collect()
}

fn has(files: &[PathBuf], number: u64) -> bool {
    files.iter().any(|file| files::number_of(file) == Some(number))
}

/// The numbers missing between the first and the last file. Empty if a file has no number, or if
/// there are more missing numbers than files.
fn gaps(files: &[PathBuf]) -> Vec<String> {
    let numbers: Option<Vec<u64>> = files.iter().map(|file| files::number_of(file)).collect();
    let Some(mut numbers) = numbers else { return Vec::new() };
    numbers.sort_unstable();
    let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else { return Vec::new() };
    // Numbering only every fifth frame, for example, is deliberate and not a gap.
    if last - first >= 2 * files.len() as u64 {
        return Vec::new();
    }
    (first..=last)
        .filter(|number| numbers.binary_search(number).is_err())
        .map(|n| n.to_string())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(numbers: impl IntoIterator<Item = u64>, ranges: &[(u64, u64)]) -> Images {
        let files = numbers.into_iter().map(|n| PathBuf::from(format!("img/{n:04}.jpg"))).collect();
        let ranges = ranges.iter().map(|&(first, last)| Range { first, last }).collect();
        Images { files, ranges }
    }

    #[test]
    fn all_images_or_those_of_the_range() {
        let (all, note) = fit(&images(300..=770, &[(300, 770)]), 471).unwrap();
        assert_eq!((all.len(), note), (471, None), "only the frames that count exist");
        let (part, note) = fit(&images(1..=770, &[(300, 770)]), 471).unwrap();
        assert_eq!((part.len(), note), (471, None), "all frames exist");
        assert_eq!(
            (part[0].as_path(), part[470].as_path()),
            ("img/0300.jpg".as_ref(), "img/0770.jpg".as_ref())
        );
        let (late, _) = fit(&images(1..=354, &[(1, 354), (6, 354)]), 349).unwrap();
        assert_eq!(late[0].as_path(), std::path::Path::new("img/0006.jpg"));
    }

    #[test]
    fn mismatches_are_reported() {
        let reason = |images: Images, rows| fit(&images, rows).unwrap_err();
        assert_eq!(reason(images([], &[]), 3), "there are no images");
        assert_eq!(reason(images([1, 2, 4], &[]), 4), "image 3 is missing");
        assert_eq!(reason(images(1..=9, &[]), 7), "9 images, but 7 rows of truth");
        let with_gap = (1..=770).filter(|n| !(400..=401).contains(n));
        assert_eq!(reason(images(with_gap, &[(300, 770)]), 471), "2 images are missing: 400, 401");
        let (_, note) = fit(&images([1, 2, 4], &[]), 3).unwrap();
        assert!(note.unwrap().ends_with("no 3"));
        assert_eq!(fit(&images([1, 6, 11, 16], &[]), 4).unwrap().1, None);
    }
}
