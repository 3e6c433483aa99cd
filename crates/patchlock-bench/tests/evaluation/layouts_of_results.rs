//! Reads a tiny example of every layout of results.

use crate::support::{Folder, rows};
use patchlock::BoundingBox;
use patchlock_bench::dataset::Dataset;
use patchlock_bench::results::{self, Results};

const BOX: Option<BoundingBox> = Some(BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 });

fn folder() -> Folder {
    let folder = Folder::new();
    folder.file("truth/one.txt", rows(3));
    folder
}

fn read(folder: &Folder, path: &str) -> Vec<Results> {
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    results::read(&folder.path().join(path), &truth).unwrap()
}

#[test]
fn otb_text() {
    let folder = folder();
    folder.file("KCF/One.txt", "3,4,5,6\nNaN,NaN,NaN,NaN\n3\t4\t5\t6\n");
    let [results] = &read(&folder, "KCF")[..] else { panic!("one tracker") };
    assert_eq!(results.name, "KCF");
    assert_eq!(results.runs[0].boxes, [BOX, None, BOX]);
}

#[test]
fn got10k() {
    let folder = folder();
    folder.file("SiamFC/one/one_001.txt", rows(3));
    folder.file("SiamFC/one/one_002.txt", rows(3));
    folder.file("SiamFC/one/one_time.txt", "0.5\n0.25\n0.25\n");
    let [results] = &read(&folder, "SiamFC")[..] else { panic!("one tracker") };
    assert_eq!(results.runs.len(), 2);
    assert_eq!((results.runs[0].seed, results.runs[1].seed), (0, 1));
    assert_eq!(results.runs[0].seconds, Some(vec![0.5, 0.25, 0.25]));
    // Results of got10k on OTB are in one folder, with the times in a folder beside them.
    folder.file("other/one.txt", rows(3));
    folder.file("other/times/one_time.txt", "1\n1\n1\n");
    let other = read(&folder, "other");
    assert_eq!(other[0].runs.len(), 1);
    assert_eq!(other[0].runs[0].seconds, Some(vec![1.0; 3]));
}

#[test]
fn vot() {
    let folder = folder();
    folder.file("CSRT/baseline/one/one_001.txt", "1\n3,4,8,4,8,10,3,10\n2\n");
    let [results] = &read(&folder, "CSRT")[..] else { panic!("one tracker") };
    assert_eq!(results.name, "CSRT baseline");
    assert_eq!(
        results.runs[0].boxes,
        [BOX, BOX, None],
        "started on the truth, a polygon, a failure"
    );
    assert!(
        results.notes[0].contains("restarts the tracker after a failure"),
        "{:?}",
        results.notes
    );
    folder.file("bad/one/one_001.txt", "1\n7\n3,4,5,6\n");
    assert!(read(&folder, "bad")[0].faults[0].contains("line 2: 7 is not one of the codes"));
}

#[test]
fn mot() {
    let folder = folder();
    folder.file("SORT/one.txt", "1,1,3,4,5,6,1,-1,-1,-1\n3,1,3,4,5,6,1,-1,-1,-1\n");
    let [results] = &read(&folder, "SORT")[..] else { panic!("one tracker") };
    assert_eq!(results.runs[0].boxes, [BOX, None, BOX]);
    for (rows, message) in [
        ("1,1,3,4,5,6,1,-1,-1,-1\n1,2,3,4,5,6,1,-1,-1,-1\n", "a file holds one target"),
        ("2,1,3,4,5,6,1,-1,-1,-1\n2,1,3,4,5,6,1,-1,-1,-1\n", "frame 2 appears twice"),
        ("0,1,3,4,5,6,1,-1,-1,-1\n", "frames count from 1"),
        ("2,1,NaN,4,5,6,1,-1,-1,-1\n2,1,3,4,5,6,1,-1,-1,-1\n", "frame 2 appears twice"),
        ("1,1,3,4,5,6,1,-1,-1,-1\n9999999,1,3,4,5,6,1,-1,-1,-1\n", "line 2: frame 9999999"),
        ("4,1,3,4,5,6,1,-1,-1,-1\n", "count from 1 to 3, the number of frames in the truth"),
        ("1e300,1,3,4,5,6,1,-1,-1,-1\n", "line 1: frame 1"),
    ] {
        folder.file("SORT/one.txt", rows);
        let faults = &read(&folder, "SORT")[0].faults;
        assert!(faults[0].contains(message), "{faults:?}");
    }
}

/// A line of 30 bytes for a target without truth does not take memory by its frame number.
#[test]
fn mot_without_truth_takes_memory_by_its_lines() {
    let folder = folder();
    let lines = "1,1,3,4,5,6,1,-1,-1,-1\n100000000,1,3,4,5,6,1,-1,-1,-1\n";
    folder.file("SORT/other.txt", lines);
    let results = read(&folder, "SORT");
    assert_eq!(results[0].runs[0].boxes, [BOX, BOX]);
    folder.file("SORT/other.txt", lines.replace("100000000", "100000001"));
    let faults = &read(&folder, "SORT")[0].faults;
    assert!(faults[0].contains("line 2: frame 100000001: frames count from 1 to 100000000"));
}

#[test]
fn a_folder_of_trackers() {
    let folder = folder();
    folder.file("all/A/one.txt", rows(3));
    folder.file("all/B/one/one_001.txt", rows(3));
    folder.file("all/notes.md", "not a tracker");
    let names = |found: Vec<Results>| found.into_iter().map(|r| r.name).collect::<Vec<_>>();
    assert_eq!(names(read(&folder, "all")), ["A", "B"]);
    assert_eq!(
        names(read(&folder, ".")),
        ["A", "B"],
        "the ground truth is not taken for a tracker"
    );
    folder.file("more/A/one.txt", rows(3));
    let truth = Dataset::open(&folder.path().join("truth")).unwrap();
    let paths = [folder.path().join("all"), folder.path().join("more")];
    let found = names(results::read_all(&paths, &truth).unwrap());
    assert!(
        found[0].starts_with("A (") && found[2].starts_with("A (") && found[0] != found[2],
        "{found:?}"
    );
}
