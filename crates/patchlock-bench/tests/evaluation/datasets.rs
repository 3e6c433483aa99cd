//! Reads a tiny example of every dataset layout.

use crate::support::{Folder, remarks, rows};
use patchlock::BoundingBox;
use patchlock_bench::dataset::{Dataset, Layout, Severity};

/// `3,4,5,6` in a file that counts from 1.
const FROM_ONE: BoundingBox = BoundingBox { x: 2.0, y: 3.0, w: 5.0, h: 6.0 };
/// The same row in a file that counts from 0.
const FROM_ZERO: BoundingBox = BoundingBox { x: 3.0, y: 4.0, w: 5.0, h: 6.0 };

fn names(dataset: &Dataset) -> Vec<&str> {
    dataset.sequences.iter().map(|sequence| sequence.name.as_str()).collect()
}

#[test]
fn otb() {
    let folder = Folder::new();
    folder.images("Deer/img", 1..=3, 4);
    folder.file("Deer/groundtruth_rect.txt", "3,4,5,6\n3\t4\t5\t6\n3 4 5 6\n");
    folder.images("Jogging/img", 1..=2, 4);
    folder.file("Jogging/groundtruth_rect.1.txt", rows(2));
    folder.file("Jogging/groundtruth_rect.2.txt", rows(2));
    // Only the frames from 300 on count; the ground truth starts there.
    folder.images("David/img", 1..=770, 4);
    folder.file("David/groundtruth_rect.txt", rows(471));
    let dataset = folder.dataset();
    assert_eq!(dataset.layout, Layout::Otb);
    assert_eq!(names(&dataset), ["David", "Deer", "Jogging.1", "Jogging.2"]);
    assert!(dataset.remarks.is_empty(), "{:?}", dataset.remarks);
    let deer = dataset.find("deer").unwrap();
    assert_eq!(deer.truth, [Some(FROM_ONE); 3]);
    assert!(deer.attributes.contains(&"FM".to_string()));
    let david = dataset.find("David").unwrap();
    assert_eq!((david.frames.len(), david.truth.len()), (471, 471));
    assert!(david.frames[0].ends_with("David/img/0300.png"));
    // The root may itself be a sequence.
    let one = Dataset::open(&folder.path().join("Deer")).unwrap();
    assert_eq!(names(&one), ["Deer"]);
}

#[test]
fn got10k() {
    let folder = Folder::new();
    folder.images("GOT-10k_Val_000001", 1..=3, 8);
    folder.file("GOT-10k_Val_000001/groundtruth.txt", rows(3));
    folder.file("GOT-10k_Val_000001/absence.label", "0\n1\n0\n");
    folder.file("GOT-10k_Val_000001/meta_info.ini", "[METAINFO]\n");
    // The test set has ground truth for the first frame only.
    folder.images("GOT-10k_Test_000001", 1..=3, 8);
    folder.file("GOT-10k_Test_000001/groundtruth.txt", rows(1));
    folder.file("list.txt", "GOT-10k_Val_000001\nGOT-10k_Test_000001\n");
    let dataset = folder.dataset();
    assert_eq!(dataset.layout, Layout::Got10k);
    let val = dataset.find("GOT-10k_Val_000001").unwrap();
    assert_eq!(
        val.truth,
        [Some(FROM_ZERO), None, Some(FROM_ZERO)],
        "not visible in the second frame"
    );
    assert_eq!(val.frames.len(), 3);
    let test = dataset.find("GOT-10k_Test_000001").unwrap();
    assert_eq!((test.truth.len(), test.frames.len()), (3, 3));
    assert!(!Dataset::can_be_scored(test) && Dataset::can_be_scored(val));
}

#[test]
fn lasot() {
    let folder = Folder::new();
    folder.images("airplane/airplane-1/img", 1..=4, 8);
    folder.file("airplane/airplane-1/groundtruth.txt", rows(4));
    folder.file("airplane/airplane-1/full_occlusion.txt", "0,1,0,0");
    folder.file("airplane/airplane-1/out_of_view.txt", "0,0,0,1");
    let dataset = folder.dataset();
    assert_eq!((dataset.layout, names(&dataset)), (Layout::Lasot, vec!["airplane-1"]));
    assert_eq!(dataset.sequences[0].truth, [Some(FROM_ONE), None, Some(FROM_ONE), None]);
    assert_eq!(remarks(&dataset, "airplane-1", Severity::Note).len(), 2);
}

#[test]
fn uav123() {
    let folder = Folder::new();
    folder.images("data_seq/UAV123/bike1", 1..=2, 6);
    folder.file("anno/UAV123/bike1.txt", "3,4,5,6\nNaN,NaN,NaN,NaN\n");
    folder.file("anno/UAV123/att/bike1.txt", "1,0,0,1,0,0,0,0,0,0,0,0\n");
    // The target is a part of a folder with more images.
    folder.images("data_seq/UAV123/car16", 410..=420, 6);
    folder.images("data_seq/UAV123/car16", 1..=409, 6);
    folder.file("anno/UAV123/car16_1.txt", rows(415));
    let dataset = folder.dataset();
    assert_eq!((dataset.layout, names(&dataset)), (Layout::Uav123, vec!["bike1", "car16_1"]));
    let bike = dataset.find("bike1").unwrap();
    assert_eq!(
        (bike.truth.as_slice(), bike.attributes.join(" ").as_str()),
        (&[Some(FROM_ONE), None][..], "SV FM")
    );
    let car = dataset.find("car16_1").unwrap();
    assert!(car.frames.len() == 415 && car.frames[414].ends_with("000415.png"));
}

#[test]
fn vot() {
    let folder = Folder::new();
    folder.images("bag/color", 1..=2, 8);
    folder.file("bag/groundtruth.txt", "3,4,8,4,8,10,3,10\n3,4,5,6\n");
    folder.file("bag/occlusion.tag", "0\n1\n");
    folder.file("bag/size_change.tag", "0\n0\n");
    folder.file("list.txt", "bag\n");
    let dataset = folder.dataset();
    assert_eq!((dataset.layout, names(&dataset)), (Layout::Vot, vec!["bag"]));
    assert_eq!(dataset.sequences[0].truth, [Some(FROM_ZERO); 2], "a polygon and a box");
    assert_eq!(dataset.sequences[0].attributes, ["occlusion"]);
    assert_eq!(dataset.sequences[0].frames.len(), 2);
}

#[test]
fn trackingnet() {
    let folder = Folder::new();
    folder.images("TEST/frames/abc_0", 0..=11, 1);
    folder.file("TEST/anno/abc_0.txt", rows(1));
    folder.images("TRAIN_0/frames/def_1", 0..=11, 1);
    folder.file("TRAIN_0/anno/def_1.txt", rows(12));
    let dataset = folder.dataset();
    assert_eq!((dataset.layout, names(&dataset)), (Layout::TrackingNet, vec!["abc_0", "def_1"]));
    let train = &dataset.sequences[1];
    assert_eq!(train.truth, [Some(FROM_ZERO); 12]);
    assert!(train.frames[2].ends_with("2.png") && train.frames[10].ends_with("10.png"));
    assert!(!Dataset::can_be_scored(&dataset.sequences[0]));
}

#[test]
fn truth_without_frames() {
    let folder = Folder::new();
    folder.file("deer.txt", rows(3));
    folder.file("jogging-2.txt", rows(2));
    folder.file("readme.txt", "Boxes of two targets.\n");
    let dataset = folder.dataset();
    assert_eq!((dataset.layout, dataset.sequences.len()), (Layout::TruthOnly, 2));
    assert!(dataset.find("Jogging.2").unwrap().frames.is_empty());
    assert_eq!(dataset.remarks.len(), 1, "the readme: {:?}", dataset.remarks);
}

#[test]
fn attributes_from_the_user() {
    let folder = Folder::new();
    folder.file("attributes.csv", "sequence,IV,OCC\nmine,0,1\ndeer,1,0\n");
    folder.file("data/mine.txt", rows(1));
    folder.file("data/Deer.txt", rows(1));
    let dataset = Dataset::open(&folder.path().join("data")).unwrap();
    assert_eq!(dataset.find("mine").unwrap().attributes, ["OCC"]);
    assert_eq!(
        dataset.find("Deer").unwrap().attributes,
        ["IV"],
        "the user's table takes precedence"
    );
    folder.file("attributes.csv", "sequence,IV,OCC\nmine,0,2\n");
    let error = Dataset::open(&folder.path().join("data")).unwrap_err().to_string();
    assert!(error.contains("attributes.csv, line 2"), "{error}");
}
