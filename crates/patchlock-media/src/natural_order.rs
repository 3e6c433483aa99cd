//! Natural order of file names: `2.jpg` before `10.jpg`.
//!
//! The crate `natord` is not used, because it puts `a0100` before `a099` and takes `a 1` and `a1`
//! for equal.

use std::cmp::Ordering;

/// Compares names, with runs of digits compared as numbers.
pub fn compare(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        match (left.chars().next(), right.chars().next()) {
            (None, None) => return a.cmp(b), // equal as numbers, such as `01` and `1`
            (None, _) => return Ordering::Less,
            (_, None) => return Ordering::Greater,
            (Some(x), Some(y)) if x.is_ascii_digit() && y.is_ascii_digit() => {
                let (number_left, rest_left) = take_number(left);
                let (number_right, rest_right) = take_number(right);
                let by_value =
                    number_left.len().cmp(&number_right.len()).then(number_left.cmp(number_right));
                if by_value.is_ne() {
                    return by_value;
                }
                (left, right) = (rest_left, rest_right);
            }
            (Some(x), Some(y)) if x == y => {
                (left, right) = (&left[x.len_utf8()..], &right[y.len_utf8()..]);
            }
            (Some(x), Some(y)) => return x.cmp(&y),
        }
    }
}

/// Splits off leading digits, without their leading zeros.
fn take_number(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    (text[..end].trim_start_matches('0'), &text[end..])
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
