//! Tests of `patchlock report` with synthetic trackers and truth.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

/// Writes the truth of two targets, the boxes of two trackers, `near` and `far`, and a tracker with
/// too few boxes.
fn write_input(root: &Path) {
    let rows = |shift: usize, count: usize| -> String {
        (0..count).map(|frame| format!("{},20,30,40\n", 10 + frame + shift)).collect()
    };
    for (folder, shift, count) in
        [("truth", 0, 8), ("results/near", 1, 8), ("results/far", 12, 8), ("results/short", 0, 5)]
    {
        fs::create_dir_all(root.join(folder)).unwrap();
        for target in ["one", "two"] {
            fs::write(root.join(folder).join(format!("{target}.txt")), rows(shift, count)).unwrap();
        }
    }
}

fn report(root: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("patchlock").unwrap();
    command
        .current_dir(root)
        .args(["report", "results", "--truth", "truth", "--quiet"])
        .args(more)
        .assert()
}

/// The files of a folder with their content.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entry = |entry: fs::DirEntry| {
        (entry.file_name().to_string_lossy().into_owned(), fs::read(entry.path()).unwrap())
    };
    fs::read_dir(folder).unwrap().map(|found| entry(found.unwrap())).collect()
}

#[test]
fn a_page_and_its_figures_are_written() {
    let folder = tempfile::tempdir().unwrap();
    write_input(folder.path());
    report(folder.path(), &["--out", "page.html"])
        .success()
        .stdout(contains("page.html: 2 trackers").and(contains("page_plots: 5 figures")))
        .stderr(
            contains("note: short is left out: ")
                .and(contains("5 boxes, but the truth of one has 8 frames")),
        );
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("<h1>near") && page.contains("short is left out"));
    let plots = files(&folder.path().join("page_plots"));
    for name in ["precision", "success", "normalised_precision", "overlap_one", "overlap_two"] {
        for end in ["svg", "png", "csv"] {
            assert!(plots.contains_key(&format!("{name}.{end}")), "{name}.{end}");
        }
    }
    for table in ["trackers.csv", "targets.csv", "attributes.csv", "pairs.csv", "status.csv"] {
        assert!(plots.contains_key(table), "{table}");
    }
    assert_eq!(plots.len(), 5 * 3 + 5, "nothing else, and no partial files");
}

#[test]
fn the_same_input_gives_the_same_files() {
    let folder = tempfile::tempdir().unwrap();
    write_input(folder.path());
    report(folder.path(), &["--out", "a.html", "--show", "far"]).success();
    report(folder.path(), &["--out", "b.html", "--show", "far", "--plots", "other"]).success();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("a.html"), read("b.html"));
    assert_eq!(files(&folder.path().join("a_plots")), files(&folder.path().join("other")));
}

#[test]
fn existing_files_are_replaced_only_with_overwrite() {
    let folder = tempfile::tempdir().unwrap();
    write_input(folder.path());
    report(folder.path(), &["--out", "page.html"]).success();
    let before = fs::read(folder.path().join("page.html")).unwrap();
    report(folder.path(), &["--out", "page.html"])
        .code(2)
        .stderr(contains("page.html already exists").and(contains("--overwrite")));
    report(folder.path(), &["--out", "new.html", "--plots", "page_plots"])
        .code(2)
        .stderr(contains("page_plots is not empty").and(contains("--plots chooses another")));
    assert!(!folder.path().join("new.html").exists());
    report(folder.path(), &["--out", "page.html", "--overwrite", "--show", "far"]).success();
    assert_ne!(before, fs::read(folder.path().join("page.html")).unwrap());
}

#[test]
fn usage_errors_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    write_input(folder.path());
    report(folder.path(), &["--out", "page.html", "--show", "near,nobody"])
        .code(2)
        .stderr(contains("--show nobody").and(contains("the names are: far, near")));
    report(folder.path(), &["--out", "no/page.html"])
        .code(1)
        .stderr(contains("there is no folder no"));
    report(folder.path(), &["--out", "page.html", "--best", "99"])
        .code(2)
        .stderr(contains("'99' for '--best <0..=40>': 99 is not in 0..=40"));
    fs::remove_dir_all(folder.path().join("results/near")).unwrap();
    fs::remove_dir_all(folder.path().join("results/far")).unwrap();
    report(folder.path(), &["--out", "page.html"])
        .code(1)
        .stderr(contains("no tracker could be scored").and(contains("patchlock score")));
    assert!(
        !folder.path().join("page.html").exists() && !folder.path().join("page_plots").exists()
    );
}
