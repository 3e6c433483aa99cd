//! Compares names of targets, suggests similar names, and formats lists for messages.

/// The normal form of a target's name. Case and the separators `-`, `_`, ` ` and `.` are ignored:
/// `Jogging.2`, `jogging-2` and `Jogging_2` are the same target.
pub fn key(name: &str) -> String {
    name.chars()
        .map(|c| if matches!(c, '-' | '_' | ' ') { '.' } else { c.to_ascii_lowercase() })
        .collect()
}

/// Whether both names refer to the same target.
pub fn same(a: &str, b: &str) -> bool {
    key(a) == key(b)
}

/// Whether a name can be that of a folder of results: not empty, at most 200 bytes, no slashes or
/// control characters, no dot at the start; on Windows, nothing that Windows reads as something
/// else.
pub fn is_folder_name(name: &str) -> bool {
    const LONGEST: usize = 200;
    let forbidden = |c: char| c.is_control() || matches!(c, '/' | '\\');
    let is_plain = !name.starts_with('.') && !name.contains(forbidden);
    let is_refused = cfg!(windows) && is_reserved(name);
    (1..=LONGEST).contains(&name.len()) && is_plain && !is_refused
}

/// Whether a name is no plain one on Windows: `a:b` is a part of the file `a`, a dot at the end is
/// dropped, and `nul` is a device in every folder.
fn is_reserved(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().trim_end().to_ascii_lowercase();
    let numbered = |device: &str| {
        let number = stem.strip_prefix(device);
        number.is_some_and(|number| matches!(number.as_bytes(), [b'1'..=b'9']))
    };
    let device =
        ["con", "prn", "aux", "nul"].contains(&&*stem) || ["com", "lpt"].into_iter().any(numbered);
    device || name.contains(['<', '>', ':', '"', '|', '?', '*']) || name.ends_with(['.', ' '])
}

/// The first five of a list of names, for a message: `a, b, c, d, e and 4 more`.
pub fn some_of<S: AsRef<str>>(names: &[S]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<&str> = names.iter().take(SHOWN).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A text for one line of a message. Characters that a terminal would obey, and those that change
/// the order of text, are written as escapes.
pub fn plain(text: &str) -> String {
    let turns = |c| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c.is_control() || turns(c) {
            true => out.extend(c.escape_default()),
            false => out.push(c),
        }
    }
    out
}

/// The beginning of a text that somebody else has sent, for a message: plain, and not much longer
/// than 200 characters.
pub fn beginning(text: &str) -> String {
    const KEPT: usize = 200;
    match text.char_indices().nth(KEPT) {
        Some((end, _)) => plain(&text[..end]) + "...",
        None => plain(text),
    }
}

/// A count with a noun in the right number: `1 run`, `2 runs`.
pub fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// The names in alphabetical order, each once.
pub fn distinct(mut names: Vec<&str>) -> Vec<&str> {
    names.sort_unstable();
    names.dedup();
    names
}

/// Up to three known names that are similar to `name`, most similar first.
pub fn near_matches<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let limit = (name.len() / 3).max(2);
    let mut near: Vec<(usize, &str)> = known
        .map(|other| (strsim::levenshtein(name, other), other))
        .filter(|(steps, other)| *steps <= limit || (name.len() > 2 && other.contains(name)))
        .collect();
    near.sort_unstable();
    near.into_iter().take(3).map(|(_, other)| other).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_and_separators_are_ignored() {
        assert!(same("Jogging.2", "jogging-2") && same("FaceOcc1", "faceocc1"));
        assert!(!same("Jogging.2", "Jogging.1") && !same("Walking2", "Walking.2"));
    }

    #[test]
    fn names_of_folders_are_plain_on_windows() {
        let reserved =
            ["a:b", "<b>", "a?", "nul", "NUL.txt", "con .a", "Com1", "lpt9.x", "a.", "a "];
        assert!(reserved.into_iter().all(is_reserved));
        let plain = ["robust", "a b", "=1+1", "null", "com", "com10", "com0", "a.nul", "icon"];
        assert!(!plain.into_iter().any(is_reserved));
        assert_eq!(is_folder_name("a:b"), !cfg!(windows));
    }

    #[test]
    fn names_of_folders_hold_nothing_odd() {
        assert!(["robust", "a b", "=1+1", &"n".repeat(200)].into_iter().all(is_folder_name));
        let odd = ["", ".", "..", ".a", "a/b", "a\\b", "a\n", "a\u{1b}[31m", &"n".repeat(201)];
        assert!(!odd.into_iter().any(is_folder_name));
    }

    #[test]
    fn what_a_terminal_would_obey_is_escaped() {
        assert_eq!(plain("a\u{1b}[31m\n\r\tb \u{202e}é"), "a\\u{1b}[31m\\n\\r\\tb \\u{202e}é");
        assert_eq!(beginning("a\u{7}"), "a\\u{7}");
        assert_eq!(beginning(&"é".repeat(300)), "é".repeat(200) + "...");
    }

    #[test]
    fn long_lists_are_truncated() {
        assert_eq!(some_of(&["a", "b"]), "a, b");
        assert_eq!(some_of(&["a", "b", "c", "d", "e", "f", "g"]), "a, b, c, d, e and 2 more");
    }

    #[test]
    fn similar_names_are_found() {
        let known = ["particles", "particle_spread", "seed"];
        assert_eq!(near_matches("partcles", known.into_iter()), ["particles"]);
        assert_eq!(near_matches("particle", known.into_iter()), ["particles", "particle_spread"]);
        assert!(near_matches("zzzzzz", known.into_iter()).is_empty());
    }
}
