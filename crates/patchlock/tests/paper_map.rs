//! Checks PAPER.md against the code: every item and test that it names exists, and every equation
//! has an entry.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The numbers of the paper's equations.
const EQUATIONS: std::ops::RangeInclusive<u32> = 1..=24;

/// The parts below the heading of an entry, in this order.
const PARTS: [&str; 3] = ["where", "proved by", "reading"];

/// An entry of the map: a heading such as `### Sec. 2.1, Eq. 3-6: what it is`, followed by
/// [`PARTS`].
#[derive(Debug)]
struct Entry {
    section: String,
    equations: String,
    items: Vec<String>,
    tests: Vec<String>,
}

fn library() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn map() -> String {
    fs::read_to_string(library().join("../../PAPER.md")).unwrap()
}

/// The texts between backticks.
fn quoted(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The entries of the map: each third-level heading with its text up to the next heading.
fn entries(map: &str) -> Vec<Entry> {
    let mut entries: Vec<(&str, Vec<String>)> = Vec::new();
    let mut in_entry = false;
    for line in map.lines() {
        if line.starts_with('#') {
            in_entry = line.starts_with("### ");
            if in_entry {
                entries.push((&line[4..], Vec::new()));
            }
        } else if in_entry {
            let parts = &mut entries.last_mut().unwrap().1;
            match (line.strip_prefix("- "), line.trim()) {
                (Some(part), _) => parts.push(part.to_owned()),
                (None, "") => {}
                // A continuation line belongs to the part above it.
                (None, more) => {
                    let part =
                        parts.last_mut().unwrap_or_else(|| panic!("no part precedes: {line}"));
                    part.push(' ');
                    part.push_str(more);
                }
            }
        }
    }
    entries.iter().map(|(heading, parts)| entry(heading, parts)).collect()
}

/// An entry from its heading (without `###`) and its parts.
fn entry(heading: &str, parts: &[String]) -> Entry {
    let (source, _) =
        heading.split_once(": ").unwrap_or_else(|| panic!("no description: {heading}"));
    let (section, equations) = source.split_once(", Eq. ").unwrap_or((source, "-"));
    assert!(section.starts_with("Sec. ") || section.starts_with("Fig. "), "no section: {heading}");
    assert_eq!(parts.len(), PARTS.len(), "an entry must have {PARTS:?}: {heading}");
    let text = |k: usize| {
        let text = parts[k].strip_prefix(PARTS[k]).and_then(|text| text.strip_prefix(": "));
        text.unwrap_or_else(|| panic!("an entry must have {PARTS:?}: {heading}"))
    };
    assert!(!text(2).is_empty(), "an entry without a reading must say `none`: {heading}");
    Entry {
        section: section.to_owned(),
        equations: equations.to_owned(),
        items: quoted(text(0)),
        tests: quoted(text(1)),
    }
}

/// The numbers in a list such as `3-9, 12`.
fn numbers(equations: &str) -> BTreeSet<u32> {
    let mut all = BTreeSet::new();
    for part in equations
        .split(',')
        .map(str::trim)
        .filter(|part| part.starts_with(|c: char| c.is_ascii_digit()))
    {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        all.extend(first.parse::<u32>().unwrap()..=last.parse::<u32>().unwrap());
    }
    all
}

/// The file of a path in the map: below `src`, or in `tests/`.
fn file(path: &str) -> PathBuf {
    let base =
        if path.starts_with("tests/") { library().to_owned() } else { library().join("src") };
    base.join(path)
}

/// Whether the source declares this name as an item, a field or a row of the parameter table.
fn declares(source: &str, name: &str) -> bool {
    let keywords = ["fn", "const fn", "struct", "enum", "trait", "const", "type", "mod"];
    let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    let lines = source.lines().map(str::trim_start).filter(|line| !line.starts_with("//"));
    lines.map(|line| line.trim_start_matches("pub(crate) ").trim_start_matches("pub ")).any(
        |line| {
            let behind =
                |keyword: &str| line.strip_prefix(keyword)?.strip_prefix(' ')?.strip_prefix(name);
            let item = keywords.iter().any(|keyword| behind(keyword).is_some_and(ends));
            let field = line.strip_prefix(name).and_then(|rest| rest.strip_prefix(':'));
            item || field.is_some_and(|rest| !rest.starts_with(':'))
        },
    )
}

/// Whether the source has a test with this name.
fn tests(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    let start = format!("fn {name}(");
    let index = lines.iter().position(|line| line.starts_with(&start));
    index.is_some_and(|index| {
        // Attributes and docs come between `#[test]` and the function.
        let above = lines[..index].iter().rev();
        above
            .take_while(|line| line.starts_with("#[") || line.starts_with("//"))
            .any(|line| *line == "#[test]")
    })
}

/// Splits `file.rs::a::b` into the text of the file and the names.
fn look_up(reference: &str) -> Result<(String, Vec<String>), String> {
    let (path, names) = reference
        .split_once(".rs::")
        .ok_or_else(|| format!("`{reference}` is not `file.rs::name`"))?;
    let path = file(&format!("{path}.rs"));
    let source = fs::read_to_string(&path)
        .map_err(|error| format!("`{reference}`: {}: {error}", path.display()))?;
    Ok((source, names.split("::").map(str::to_owned).collect()))
}

#[test]
fn every_equation_has_an_entry() {
    let covered: BTreeSet<u32> =
        entries(&map()).iter().flat_map(|entry| numbers(&entry.equations)).collect();
    let missing: Vec<u32> = EQUATIONS.filter(|number| !covered.contains(number)).collect();
    assert!(missing.is_empty(), "PAPER.md has no entry for Eq. {missing:?}");
    let foreign: Vec<u32> =
        covered.into_iter().filter(|number| !EQUATIONS.contains(number)).collect();
    assert!(foreign.is_empty(), "the paper has no Eq. {foreign:?}");
}

#[test]
fn every_entry_names_its_code_and_its_tests() {
    let mut wrong = Vec::new();
    for entry in entries(&map()) {
        if entry.items.is_empty() || entry.tests.is_empty() {
            wrong.push(format!("an entry names no item or no test: {entry:?}"));
        }
        for test in &entry.tests {
            match look_up(test) {
                Ok((source, names)) if !tests(&source, names.last().unwrap()) => {
                    wrong.push(format!("`{test}` is not a test"));
                }
                Ok(_) => {}
                Err(error) => wrong.push(error),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_item_named_anywhere_exists() {
    let map = map();
    let references = quoted(&map).into_iter().filter(|text| text.contains(".rs::"));
    let entries = entries(&map).into_iter();
    let from_entries = entries.flat_map(|entry| entry.items.into_iter().chain(entry.tests));
    let mut wrong = BTreeSet::new();
    for reference in references.chain(from_entries) {
        match look_up(&reference) {
            Ok((source, names)) => {
                let missing = names.iter().filter(|name| !declares(&source, name));
                wrong.extend(missing.map(|name| format!("`{reference}`: there is no {name}")));
            }
            Err(error) => drop(wrong.insert(error)),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.into_iter().collect::<Vec<_>>().join("\n"));
}

/// For every parameter whose source is the paper, the map has an entry of the section that it
/// names.
#[test]
fn the_table_of_parameters_is_part_of_the_map() {
    let entries = entries(&map());
    for parameter in patchlock::PARAMETERS {
        let Some(source) = parameter.source.strip_prefix("paper ") else { continue };
        let section = source.split(',').next().unwrap();
        let found = entries.iter().any(|entry| entry.section == section);
        assert!(found, "PAPER.md has no entry for {section}");
    }
}

#[test]
fn the_parser_reads_entries() {
    let map = [
        "# Map",
        "### Sec. 2.1, Eq. 3-5, 9: codes: joint",
        "",
        "- where: `a.rs::b`,",
        "  `a.rs::c`",
        "- proved by: `t.rs::d`",
        "- reading: none",
        "",
        "### Fig. 1: the whole",
        "- where: `e.rs::f`",
        "- proved by: `g.rs::h`",
        "- reading: x `y`",
        "## Numbers",
        "- 4: `z.rs::n`",
    ];
    let entries = entries(&map.join("\n"));
    let [codes, whole] = &entries[..] else { panic!("expected two entries") };
    assert_eq!((codes.section.as_str(), codes.equations.as_str()), ("Sec. 2.1", "3-5, 9"));
    assert_eq!(codes.items, ["a.rs::b", "a.rs::c"]);
    assert_eq!(codes.tests, ["t.rs::d"]);
    assert_eq!((whole.section.as_str(), whole.equations.as_str()), ("Fig. 1", "-"));
    assert_eq!((whole.items.len(), whole.tests.len()), (1, 1));
    assert_eq!(numbers("3-5, 9"), BTreeSet::from([3, 4, 5, 9]));
    assert!(numbers("-").is_empty());
    let source = "pub struct A {\n    pub b: f64,\n}\n// fn comment\nconst C: u8 = 1;\n\
        fn abc() {}\npub const fn d() {}\n";
    for name in ["A", "b", "C", "abc", "d"] {
        assert!(declares(source, name), "{name}");
    }
    for name in ["ab", "comment", "B"] {
        assert!(!declares(source, name), "{name}");
    }
    assert!(tests("#[test]\n#[ignore]\nfn a() {}", "a") && !tests("fn a() {}", "a"));
}
