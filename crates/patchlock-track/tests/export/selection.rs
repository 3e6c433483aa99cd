//! Which boxes of a track are exported.

use std::fs;

use patchlock::{BoundingBox, Status};
use patchlock_track::export::{
    self, Entry, ExportSummary, ManualFlags, Options, Selection, TargetMetadata, Track,
};
use serde_json::Value;

use crate::support::{Workspace, choosing, format_named, options, text};

/// A box of target 1, or one of target 2, in each of 12 frames: uncertain from 4 on, lost in 8 and 9;
/// a person has drawn that of frame 6. Target 2 is there in frames 2 to 4, where its score is low.
fn doubtful_track() -> Track {
    use Status::{Lost, Tracked, Uncertain};
    let bbox = Some(BoundingBox { x: 10.0, y: 5.0, w: 20.0, h: 10.0 });
    let entry = |frame: usize| {
        let status = match frame {
            0..4 => Tracked,
            8 | 9 => Lost,
            _ => Uncertain,
        };
        let (status, manual) =
            if frame == 6 { (None, Some(ManualFlags::default())) } else { (Some(status), None) };
        let score = manual.is_none().then_some(0.75);
        Entry { frame, id: 1, bbox, score, status, manual, ..Entry::default() }
    };
    let low = |frame| Entry { id: 2, score: Some(0.25), status: Some(Tracked), ..entry(frame) };
    Track::new((0..12).map(entry).chain((2..5).map(low)).collect()).unwrap()
}

fn chosen(format: &str, selection: Selection) -> (Workspace, ExportSummary) {
    let workspace = Workspace::new();
    let options = Options { selection, ..options(format_named(format)) };
    let written = export::write(&doubtful_track(), &options, &workspace.path("out"), false);
    (workspace, written.unwrap())
}

/// The numbers of the frames in a data set of YOLO.
fn frames_of_yolo(workspace: &Workspace) -> Vec<usize> {
    let files = fs::read_dir(workspace.path("out/labels/train")).unwrap();
    let number = |file: std::io::Result<fs::DirEntry>| {
        let name = file.unwrap().file_name().into_string().unwrap();
        name.strip_prefix("frame_").unwrap().strip_suffix(".txt").unwrap().parse().unwrap()
    };
    let mut numbers: Vec<usize> = files.map(number).collect();
    numbers.sort_unstable();
    numbers
}

#[test]
fn detectors_are_trained_with_tracked_boxes_and_those_of_people() {
    for format in ["yolo", "voc", "coco"] {
        let (workspace, written) = chosen(format, Selection::default());
        assert_eq!(written.boxes.boxes, 7, "{format}");
        assert_eq!(
            written.boxes.remarks(),
            [
                "left out 8 of 15 boxes: 5 uncertain, 2 lost, 1 beside one of these in the same frame"
            ],
            "{format}"
        );
        if format == "yolo" {
            assert_eq!(frames_of_yolo(&workspace), [0, 1, 2, 3, 6]);
        }
        if format == "coco" {
            let all: Value = serde_json::from_str(&text(workspace.path("out"))).unwrap();
            let images = all["images"].as_array().unwrap().iter();
            let frames: Vec<u64> = images.map(|it| it["frame_id"].as_u64().unwrap()).collect();
            assert_eq!(frames, [0, 1, 2, 3, 6]);
            assert_eq!(all["annotations"].as_array().unwrap().len(), 7);
        }
    }
}

#[test]
fn boxes_are_chosen_by_status_score_and_frame() {
    let statuses = |text| Some(Selection::statuses(text).unwrap());
    let all = Selection { status: statuses("tracked,uncertain"), ..Selection::default() };
    let (workspace, written) = chosen("yolo", all.clone());
    assert_eq!(frames_of_yolo(&workspace), [0, 1, 2, 3, 4, 5, 6, 7, 10, 11]);
    let doubtful = "doubtful among the 13 boxes written: 5 uncertain";
    assert_eq!(written.boxes.remarks(), ["left out 2 of 15 boxes: 2 lost", doubtful]);

    // A frame of which one box has a low score is left out with the other one.
    let (workspace, written) = chosen("yolo", Selection { min_score: Some(0.5), ..all.clone() });
    assert_eq!(frames_of_yolo(&workspace), [0, 1, 5, 6, 7, 10, 11]);
    assert_eq!((written.boxes.left_by_score, written.boxes.left_beside), (3, 3));

    let (workspace, written) = chosen("yolo", Selection { every: 4, ..all });
    assert_eq!(frames_of_yolo(&workspace), [0, 4]);
    assert_eq!(written.boxes.left_between, 11);

    // Boxes of tracks are left out singly, and the others are marked.
    let (workspace, written) = chosen("mot", Selection::default());
    assert_eq!(
        written.boxes.remarks(),
        ["doubtful among the 15 boxes written: 5 uncertain, 2 lost"]
    );
    assert!(text(workspace.path("out")).contains("\n5,1,11.0000,6.0000,20.0000,10.0000,0.7500,"));
    let (workspace, _) = chosen("mot", Selection { min_score: Some(0.5), ..Selection::default() });
    let lines = text(workspace.path("out"));
    assert_eq!((lines.lines().count(), lines.contains(",2,11.0000")), (12, false));
    let uncertain = Selection { status: statuses("uncertain"), ..Selection::default() };
    let (workspace, _) = chosen("mot", uncertain);
    let lines = text(workspace.path("out"));
    let frames: Vec<&str> = lines.lines().map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(frames, ["5", "6", "7", "8", "11", "12"]);
    // Of sequences, whole frames are left out: a target is not absent where its box is not chosen.
    let tracked = Selection { status: statuses("tracked"), ..Selection::default() };
    let (workspace, _) = chosen("got10k", tracked);
    assert_eq!(text(workspace.path("out/film_000001/absence.label")), "0\n".repeat(5));
}

/// The numbers of the classes are those of all targets.
#[test]
fn a_selection_of_nothing_is_refused_and_classes_stay() {
    let workspace = Workspace::new();
    let metadata =
        |label: &str| TargetMetadata { label: label.to_owned(), ..TargetMetadata::default() };
    let labels = [(1, metadata("boat")), (2, metadata("car"))].into();
    let first = doubtful_track().with_targets(labels);
    let only = Selection { min_score: Some(1.0), ..Selection::default() };
    let options = choosing(only, &options(format_named("yolo")));
    export::write(&first, &options, &workspace.path("a"), false).unwrap();
    assert!(text(workspace.path("a/data.yaml")).ends_with("names:\n  0: \"boat\"\n  1: \"car\"\n"));
    let entries = first.entries().iter().filter(|entry| entry.manual.is_none()).copied().collect();
    let out = workspace.path("b");
    let error = export::write(&Track::new(entries).unwrap(), &options, &out, false).unwrap_err();
    let expected = "no box is to be written: left out 14 of 14 boxes: 5 uncertain, 2 lost, 7 with a lower score";
    assert!(error.to_string().ends_with(expected), "{error}");
    assert!(!out.exists());
    let error = Selection::statuses("tracked,gone").unwrap_err().to_string();
    assert!(
        error.contains("there is no status \"gone\"; allowed: tracked, uncertain, lost"),
        "{error}"
    );
}
