//! Invalid ground truth and results are reported; nothing is guessed.

use crate::support::{Folder, remarks, rows};
use patchlock_bench::dataset::{Dataset, Severity};
use patchlock_bench::score::{self, Scoreboard};
use patchlock_bench::{Error, results};

/// Everything that prevents the use of a target's frames or ground truth.
fn faults(folder: &Folder, target: &str) -> String {
    let dataset = folder.dataset();
    let mut faults = remarks(&dataset, target, Severity::NoFrames);
    faults.extend(remarks(&dataset, target, Severity::NoTruth));
    faults.join("; ")
}

fn otb(images: impl IntoIterator<Item = usize>, truth: impl AsRef<[u8]>) -> Folder {
    let folder = Folder::new();
    folder.images("A/img", images, 4);
    folder.file("A/groundtruth_rect.txt", truth);
    folder
}

#[test]
fn missing_frames() {
    assert_eq!(faults(&otb([1, 2, 4], rows(4)), "A"), "image 3 is missing");
    assert_eq!(faults(&otb([], rows(4)), "A"), "there are no images");
    let david = Folder::new();
    david.images("David/img", (1..=770).filter(|n| *n != 500), 4);
    david.file("David/groundtruth_rect.txt", rows(471));
    assert_eq!(faults(&david, "David"), "image 500 is missing");
    // The ground truth is still usable: results can be scored.
    assert_eq!(david.dataset().sequences[0].truth.len(), 471);
}

#[test]
fn unequal_lengths() {
    assert_eq!(faults(&otb(1..=5, rows(3)), "A"), "5 images, but 3 rows of truth");
    assert_eq!(faults(&otb(1..=3, rows(5)), "A"), "3 images, but 5 rows of truth");
}

#[test]
fn invalid_lines() {
    for (line, message) in [
        ("", "line 2: the line is empty"),
        ("3,4,5", "line 2: 3 numbers, where a box has 4"),
        ("3,4,,6", "line 2: field 3 is empty"),
        ("3,4,five,6", "line 2: \"five\" is not a number"),
        ("3,4,inf,6", "line 2: inf is not a coordinate; allowed: -1e9 to 1e9"),
        ("3;4;5;6", "line 2: \"3;4;5;6\" is not a number"),
    ] {
        let folder = otb(1..=3, format!("3,4,5,6\n{line}\n3,4,5,6\n"));
        let got = faults(&folder, "A");
        assert!(got.contains(message), "{line:?}: {got}");
        assert!(folder.dataset().sequences.is_empty());
    }
    assert!(faults(&otb(1..=3, ""), "A").contains("the file is empty"));
    let none = faults(&otb(1..=2, "NaN,NaN,NaN,NaN\n0,0,0,0\n"), "A");
    assert!(none.contains("no frame has a box"), "{none}");
}

#[test]
fn unusual_truth_is_noted() {
    let truth = "3,4,5,6\nNaN,NaN,NaN,NaN\n3,4,0,6\n3,4,5,-6\n";
    let dataset = otb(1..=4, truth).dataset();
    let boxes: Vec<bool> = dataset.sequences[0].truth.iter().map(Option::is_some).collect();
    assert_eq!(boxes, [true, false, false, false]);
    let notes = remarks(&dataset, "A", Severity::Note);
    assert!(notes[0].contains("1 of 4 frames is NaN") && notes[1].contains("2 of 4"), "{notes:?}");
}

#[test]
fn other_encodings() {
    let text = rows(3);
    let wide = |unit: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(unit).collect::<Vec<u8>>();
    let files = [
        [b"\xef\xbb\xbf", text.as_bytes()].concat(),
        [b"\xff\xfe".to_vec(), wide(u16::to_le_bytes)].concat(),
        [b"\xfe\xff".to_vec(), wide(u16::to_be_bytes)].concat(),
        text.replace('\n', "\r\n").into_bytes(),
    ];
    let plain = otb(1..=3, &text).dataset().sequences[0].truth.clone();
    for (k, file) in files.iter().enumerate() {
        let dataset = otb(1..=3, file).dataset();
        assert_eq!(dataset.sequences[0].truth, plain, "file {k}");
        let is_noted = !remarks(&dataset, "A", Severity::Note).is_empty();
        assert_eq!(is_noted, k < 3, "all but Windows line ends, which are common, are noted");
    }
}

#[test]
fn boxes_outside_the_frame() {
    // The frame is 16 x 12.
    let folder = otb(1..=3, "3,4,5,6\n100,4,5,6\n14,4,9,6\n");
    let findings = folder.dataset().inspect();
    assert_eq!(findings.sizes, [Some((16, 12))]);
    let texts: Vec<&str> = findings.remarks.iter().map(|remark| remark.text.as_str()).collect();
    assert!(texts[0].starts_with("1 of 3 boxes lie entirely outside"), "{texts:?}");
    assert!(texts[1].starts_with("1 of 3 boxes reach beyond"), "{texts:?}");
    let broken = otb(1..=3, rows(3));
    broken.file("A/img/0001.png", "not an image");
    assert_eq!(broken.dataset().inspect().remarks[0].severity, Severity::NoFrames);
}

#[test]
fn folders_without_a_dataset() {
    let empty = Folder::new();
    assert!(matches!(Dataset::open(empty.path()), Err(Error::NoDataset { .. })));
    let file = empty.file("a.csv", "x");
    assert!(matches!(Dataset::open(&file), Err(Error::NoDataset { .. })));
    assert!(matches!(
        Dataset::open(&empty.path().join("no")),
        Err(Error::Track(patchlock_track::Error::Read(..)))
    ));
}

/// Scores files of a tracker against a truth of two targets with 3 and 4 frames.
fn scored(files: &[(&str, String)]) -> Scoreboard {
    let folder = Folder::new();
    folder.file("truth/one.txt", rows(3));
    folder.file("truth/two.txt", rows(4));
    for (name, content) in files {
        folder.file(&format!("tracker/{name}"), content);
    }
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let results = results::read(&folder.path().join("tracker"), &truth).unwrap();
    score::scoreboard(&results, &truth)
}

fn rejection(files: &[(&str, String)]) -> String {
    let board = scored(files);
    assert!(board.trackers.is_empty(), "it must not be scored");
    board.refused[0].reasons.join("; ")
}

#[test]
fn results_of_the_wrong_length() {
    let message = rejection(&[("one.txt", rows(2)), ("two.txt", rows(4))]);
    assert!(message.contains("2 boxes, but the truth of one has 3 frames"), "{message}");
    let message = rejection(&[("one.txt", rows(3)), ("two.txt", rows(5))]);
    assert!(message.contains("5 boxes, but the truth of two has 4 frames"), "{message}");
}

#[test]
fn results_for_all_frames_where_only_a_part_counts() {
    let folder = Folder::new();
    folder.file("truth/david.txt", rows(471));
    folder.file("tracker/david.txt", rows(770));
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let results = results::read(&folder.path().join("tracker"), &truth).unwrap();
    let message = score::tracker(&results[0], &truth).unwrap_err().join("; ");
    assert!(message.contains("counts frames 300 to 770"), "{message}");
}

#[test]
fn results_with_bad_lines() {
    let message =
        rejection(&[("one.txt", "3,4,5,6\n\n3,4,5,6\n".to_string()), ("two.txt", rows(4))]);
    assert!(message.contains("one.txt, line 2: the line is empty"), "{message}");
    let message = rejection(&[("one.txt", "3,4,5,6\nlost\n3,4,5,6\n".to_string())]);
    assert!(message.contains("one.txt, line 2: \"lost\" is not a number"), "{message}");
}

#[test]
fn a_missing_box_is_replaced_by_the_last_one() {
    let board = scored(&[("one.txt", "3,4,5,6\nNaN,NaN,NaN,NaN\nNaN,NaN,NaN,NaN\n".to_string())]);
    let tracker = &board.trackers[0];
    assert_eq!(tracker.overall.dp20.mean, 1.0);
    assert!(
        (tracker.overall.auc.mean - 20.0 / 21.0).abs() < 1e-12,
        "an overlap of 1 is not more than 1"
    );
    assert!(
        tracker.notes.iter().any(|note| note.contains("no results for 1 of the 2 targets: two"))
    );
}

#[test]
fn results_of_another_dataset() {
    let message = rejection(&[("three.txt", rows(3)), ("four.txt", rows(3))]);
    assert!(message.contains("another dataset"), "{message}");
    // Name and length match, but not the position.
    let board = scored(&[("one.txt", "300,400,5,6\n".repeat(3))]);
    let notes = board.trackers[0].notes.join("; ");
    assert!(
        notes.contains("its first box differs from the truth on 1 of the targets (one)"),
        "{notes}"
    );
}

#[test]
fn one_target_twice() {
    let message = rejection(&[("one.txt", rows(3)), ("ONE.txt", rows(3))]);
    assert!(message.contains("same run"), "{message}");
}

#[test]
fn seeds_missing_on_some_targets() {
    let folder = Folder::new();
    folder.file("truth/one.txt", rows(3));
    folder.file("truth/two.txt", rows(3));
    for name in ["one/one_001", "one/one_002", "two/two_001"] {
        folder.file(&format!("tracker/{name}.txt"), rows(3));
    }
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let results = results::read(&folder.path().join("tracker"), &truth).unwrap();
    let score = score::tracker(&results[0], &truth).unwrap();
    assert_eq!(score.seeds, [0]);
    assert!(score.notes[0].contains("seed 1 has only 1 of 2 targets"), "{:?}", score.notes);
}

#[test]
fn paths_without_results() {
    let folder = Folder::new();
    folder.file("truth/one.txt", rows(3));
    folder.file("empty/readme.md", "nothing");
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let read = |name: &str| results::read(&folder.path().join(name), &truth);
    assert!(matches!(read("empty"), Err(Error::NoResults { .. })));
    assert!(matches!(read("truth/one.txt"), Err(Error::NoResults { .. })));
    assert!(matches!(read("nowhere"), Err(Error::Track(patchlock_track::Error::Read(..)))));
}
