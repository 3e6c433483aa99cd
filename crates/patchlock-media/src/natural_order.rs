//! Natural order of file names: `2.jpg` before `10.jpg`.
//!
//! The crate `natord` is not used, because it puts `a0100` before `a099` and takes `a 1` and `a1`
//! for equal.

use std::cmp::Ordering;
use std::iter;

/// Compares names, with runs of digits compared as numbers.
pub fn compare(a: &str, b: &str) -> Ordering {
    // The names themselves differ in equal numbers, such as `01` and `1`.
    parts(a).cmp(parts(b)).then(a.cmp(b))
}

/// The characters of a name; for a run of digits, a digit, and how many there are and which after
/// leading zeros.
fn parts(name: &str) -> impl Iterator<Item = (char, usize, &str)> {
    let mut rest = name;
    iter::from_fn(move || {
        let mut after = rest.chars();
        let first = after.next()?;
        if !first.is_ascii_digit() {
            rest = after.as_str();
            return Some((first, 0, ""));
        }
        let (run, after) =
            rest.split_at(rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len()));
        let number = run.trim_start_matches('0');
        rest = after;
        Some(('0', number.len(), number))
    })
}

#[cfg(test)]
mod tests {
    use super::compare;

    #[test]
    fn digits_are_compared_as_numbers() {
        let mut names =
            ["b1.png", "a10.png", "a2.png", "a02.png", "a1b3.png", "a1b20.png", "a.png"];
        names.sort_by(|a, b| compare(a, b));
        assert_eq!(
            names,
            ["a.png", "a1b3.png", "a1b20.png", "a02.png", "a2.png", "a10.png", "b1.png"]
        );
    }

    #[test]
    fn numbers_larger_than_any_integer_type_are_compared() {
        let small = format!("f{}8.png", "1".repeat(40));
        let large = format!("f{}9.png", "1".repeat(40));
        assert!(compare(&small, &large).is_lt());
    }
}
