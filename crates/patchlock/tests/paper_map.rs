//! PAPER.md is a map; this holds it to the ground: what it names exists, and no equation is missing.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The paper's equations.
const EQUATIONS: std::ops::RangeInclusive<u32> = 1..=24;

/// The columns of the table.
#[derive(Debug)]
struct Row {
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

/// Everything between backticks.
fn quoted(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The rows of the tables that have a column of equations: section, equations, meaning, where, proved by, departure.
fn rows(map: &str) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut is_map = false;
    for line in map.lines().map(str::trim) {
        if !line.starts_with('|') {
            is_map = false;
            continue;
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if cells.len() > 1 && cells[1] == "eq." {
            is_map = true;
        } else if is_map && !cells[0].starts_with("---") {
            assert_eq!(cells.len(), 6, "a row has six cells: {line}");
            rows.push(Row {
                equations: cells[1].to_owned(),
                items: quoted(cells[3]),
                tests: quoted(cells[4]),
            });
        }
    }
    rows
}

/// The numbers in `3-9, 12`.
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

/// The file of a path as the map writes it: below `src`, or `tests/..`.
fn file(path: &str) -> PathBuf {
    let base =
        if path.starts_with("tests/") { library().to_owned() } else { library().join("src") };
    base.join(path)
}

/// Whether the source declares this name: as an item, a field or a row of the table of parameters.
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

/// Whether the source has a test of this name.
fn tests(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    let start = format!("fn {name}(");
    let place = lines.iter().position(|line| line.starts_with(&start));
    place.is_some_and(|place| {
        // Attributes and docs stand between `#[test]` and the function.
        let above = lines[..place].iter().rev();
        above
            .take_while(|line| line.starts_with("#[") || line.starts_with("//"))
            .any(|line| *line == "#[test]")
    })
}

/// Splits `file.rs::a::b` into the file's text and the names.
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
fn every_equation_has_a_row() {
    let covered: BTreeSet<u32> =
        rows(&map()).iter().flat_map(|row| numbers(&row.equations)).collect();
    let missing: Vec<u32> = EQUATIONS.filter(|number| !covered.contains(number)).collect();
    assert!(missing.is_empty(), "PAPER.md has no row for Eq. {missing:?}");
    let foreign: Vec<u32> =
        covered.into_iter().filter(|number| !EQUATIONS.contains(number)).collect();
    assert!(foreign.is_empty(), "the paper has no Eq. {foreign:?}");
}

#[test]
fn every_row_names_what_does_it_and_what_proves_it() {
    let mut wrong = Vec::new();
    for row in rows(&map()) {
        if row.items.is_empty() || row.tests.is_empty() {
            wrong.push(format!("a row names no item or no test: {row:?}"));
        }
        for test in &row.tests {
            match look_up(test) {
                Ok((source, names)) if !tests(&source, names.last().unwrap()) => {
                    wrong.push(format!("`{test}` is no test"));
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
    let from_rows = rows(&map).into_iter().flat_map(|row| row.items.into_iter().chain(row.tests));
    let mut wrong = BTreeSet::new();
    for reference in references.chain(from_rows) {
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

/// Every parameter of the configuration has its place in the paper, and the map names each section that the table does.
#[test]
fn the_table_of_parameters_is_part_of_the_map() {
    let map = map();
    for parameter in patchlock::PARAMETERS {
        let section = parameter.section.split(',').next().unwrap();
        assert!(map.contains(&format!("| {section} |")), "PAPER.md has no row of {section}");
    }
}

#[test]
fn the_reader_reads() {
    assert_eq!(numbers("3-5, 9"), BTreeSet::from([3, 4, 5, 9]));
    assert!(numbers("-").is_empty());
    let source = "pub struct A {\n    pub b: f64,\n}\n// fn comment\nconst C: u8 = 1;\nfn abc() {}\npub const fn d() {}\n";
    for name in ["A", "b", "C", "abc", "d"] {
        assert!(declares(source, name), "{name}");
    }
    for name in ["ab", "comment", "B"] {
        assert!(!declares(source, name), "{name}");
    }
    assert!(tests("#[test]\n#[ignore]\nfn a() {}", "a") && !tests("fn a() {}", "a"));
}
