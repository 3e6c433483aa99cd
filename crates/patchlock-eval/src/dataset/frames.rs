//! Which image files belong to which rows of truth.

use std::path::PathBuf;

use crate::{files, names};

/// Numbers of image files, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// The first one.
    pub first: u64,
    /// The last one.
    pub last: u64,
}

impl Range {
    /// `1..354`; `None` for anything else.
    pub fn parse(text: &str) -> Option<Self> {
        let (first, last) = text.split_once("..")?;
        let range = Self { first: first.parse().ok()?, last: last.parse().ok()? };
        (range.first <= range.last).then_some(range)
    }

    /// How many there are.
    pub fn len(self) -> usize {
        (self.last - self.first) as usize + 1
    }

    /// Whether the number is one of them.
    pub fn has(self, number: u64) -> bool {
        (self.first..=self.last).contains(&number)
    }
}

/// The images of a target.
#[derive(Debug, Clone, Default)]
pub struct Images {
    /// All that lie in its folder, in natural order.
    pub files: Vec<PathBuf>,
    /// The parts of them that count, one for each edition of the benchmark; empty where all count.
    pub ranges: Vec<Range>,
}

/// The images that belong to so many rows of truth, and what is odd about them.
///
/// # Errors
/// Why they can't be told: nothing is guessed.
pub fn fit(images: &Images, rows: usize) -> Result<(Vec<PathBuf>, Option<String>), String> {
    let files = &images.files;
    if files.is_empty() {
        return Err("there are no images".to_string());
    }
    if files.len() == rows {
        let gaps = gaps(files);
        let odd = (!gaps.is_empty()).then(|| {
            format!(
                "there are as many images as rows of truth, but their numbers jump: there is no {}",
                names::some_of(&gaps)
            )
        });
        return Ok((files.clone(), odd));
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
        1 => format!("the image with number {} is missing", numbers[0]),
        count => format!("{count} images are missing: numbers {}", names::some_of(&numbers)),
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

/// The numbers that are left out between the first and the last file; none where the files have no numbers, or far more is left out than there is.
fn gaps(files: &[PathBuf]) -> Vec<String> {
    let numbers: Option<Vec<u64>> = files.iter().map(|file| files::number_of(file)).collect();
    let Some(mut numbers) = numbers else { return Vec::new() };
    numbers.sort_unstable();
    let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else { return Vec::new() };
    // Every fifth frame, say, is a way to number and no gap.
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
        let (all, odd) = fit(&images(300..=770, &[(300, 770)]), 471).unwrap();
        assert_eq!((all.len(), odd), (471, None), "only the frames that count are there");
        let (part, odd) = fit(&images(1..=770, &[(300, 770)]), 471).unwrap();
        assert_eq!((part.len(), odd), (471, None), "all are there");
        assert_eq!(
            (part[0].as_path(), part[470].as_path()),
            ("img/0300.jpg".as_ref(), "img/0770.jpg".as_ref())
        );
        let (late, _) = fit(&images(1..=354, &[(1, 354), (6, 354)]), 349).unwrap();
        assert_eq!(late[0].as_path(), std::path::Path::new("img/0006.jpg"));
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let said = |images: Images, rows| fit(&images, rows).unwrap_err();
        assert_eq!(said(images([], &[]), 3), "there are no images");
        assert_eq!(said(images([1, 2, 4], &[]), 4), "the image with number 3 is missing");
        assert_eq!(said(images(1..=9, &[]), 7), "9 images, but 7 rows of truth");
        let holed = (1..=770).filter(|n| !(400..=401).contains(n));
        assert_eq!(
            said(images(holed, &[(300, 770)]), 471),
            "2 images are missing: numbers 400, 401"
        );
        let (_, odd) = fit(&images([1, 2, 4], &[]), 3).unwrap();
        assert!(odd.unwrap().ends_with("there is no 3"));
        assert_eq!(fit(&images([1, 6, 11, 16], &[]), 4).unwrap().1, None);
    }
}
