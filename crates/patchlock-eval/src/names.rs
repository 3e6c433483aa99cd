//! Names of targets: two that differ in case or in how a part is marked off are the same.

/// What is compared: `Jogging.2`, `jogging-2` and `Jogging_2` are one target.
pub fn key(name: &str) -> String {
    name.chars()
        .map(|c| if matches!(c, '-' | '_' | ' ') { '.' } else { c.to_ascii_lowercase() })
        .collect()
}

/// Whether both mean the same target.
pub fn same(a: &str, b: &str) -> bool {
    key(a) == key(b)
}

/// A few of many names, for a message: `a, b, c and 4 more`.
pub fn some_of<S: AsRef<str>>(names: &[S]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<&str> = names.iter().take(SHOWN).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// `1 run`, `2 runs`.
pub fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_and_marks_do_not_count() {
        assert!(same("Jogging.2", "jogging-2") && same("FaceOcc1", "faceocc1"));
        assert!(!same("Jogging.2", "Jogging.1") && !same("Walking2", "Walking.2"));
    }

    #[test]
    fn long_lists_are_cut() {
        assert_eq!(some_of(&["a", "b"]), "a, b");
        assert_eq!(some_of(&["a", "b", "c", "d", "e", "f", "g"]), "a, b, c, d, e and 2 more");
    }
}
