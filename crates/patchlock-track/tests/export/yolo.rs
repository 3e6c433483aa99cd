//! YOLO, upright and rotated.

use crate::support::*;
use patchlock::{BoundingBox, Status};
use patchlock_track::export::{self, Entry, Options, Track};
use std::fs;

#[test]
fn yolo_is_relative_and_clipped() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let (files, out) = workspace
        .export(&Options { images: Some(images.clone()), ..options(format_named("yolo")) })
        .unwrap();
    assert_eq!(files, 1 + 2 * 4);
    assert!(text(out.join("data.yaml")).contains("train: images/train\n"));
    let label = |name: &str| text(out.join("labels/train").join(name));
    assert_eq!(label("0.txt"), "0 0.500000 0.333333 0.500000 0.333333\n");
    assert_eq!(
        label("2.txt"),
        "0 0.525000 0.333333 0.500000 0.333333\n0 0.850000 0.766667 0.200000 0.200000\n"
    );
    // The box covers -4..4 and 27..33.1, of which 0..4 and 27..30 are in the frame.
    assert_eq!(label("4.txt"), "0 0.050000 0.950000 0.100000 0.100000\n");
    assert_eq!(
        fs::read(out.join("images/train/4.png")).unwrap(),
        fs::read(images.join("4.png")).unwrap()
    );
    assert!(!out.join("images/train/3.png").exists(), "frame 3 was not tracked");
}

/// With six decimal places each, centre and length of this box would end at 1.0000005.
#[test]
fn boxes_of_yolo_end_in_the_frame_when_they_are_rounded() {
    let workspace = Workspace::new();
    let bbox = BoundingBox { x: 32.000048, y: 5.0, w: 7.999952, h: 10.0 };
    let entry = Entry { bbox: Some(bbox), ..track().entries()[0] };
    // Less than half a millionth of the frame is in it.
    let sliver = BoundingBox { x: 40.0 - 1e-6, y: 5.0, w: 7.0, h: 10.0 };
    let sliver = Entry { id: 2, bbox: Some(sliver), ..entry };
    let out = workspace.path("yolo");
    let track = Track::new(vec![entry, sliver]).unwrap();
    export::write(&track, &options(format_named("yolo")), &out, false).unwrap();
    let lines = text(out.join("labels/train/frame_000000.txt"));
    assert_eq!(lines, "0 0.900001 0.333333 0.199998 0.333333\n");
}

#[test]
fn yolo_leaves_out_frames_with_a_lost_or_uncertain_target() {
    for names in lost_exports(format_named("yolo"), |out| {
        let entries = fs::read_dir(out.join("labels/train")).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }) {
        assert_eq!(names, [0, 1, 5].map(|k| format!("frame_{k:06}.txt")));
    }
}

/// The corners of the outline, clipped to the frame; a track without outlines is refused.
#[test]
fn rotated_boxes_of_yolo_are_the_outlines() {
    let workspace = Workspace::new();
    let error = workspace.export(&options(format_named("yolo-obb"))).unwrap_err().to_string();
    assert!(error.contains("target 1 has no outline in frame 2, which yolo-obb needs"), "{error}");
    let entry = |frame, corners, status| Entry {
        frame,
        id: 1,
        bbox: Some(BoundingBox { x: 10.0, y: 5.0, w: 20.0, h: 10.0 }),
        score: None,
        corners,
        status: Some(status),
        ..Entry::default()
    };
    let turned = [[19.5, -4.5], [29.5, 9.5], [19.5, 14.5], [9.5, 9.5]];
    let track = Track::new(vec![
        entry(0, Some(turned), Status::Tracked),
        entry(1, None, Status::Lost),
        entry(2, Some(turned), Status::Uncertain),
    ]);
    let out = workspace.path("rotated");
    let options = with_status("yolo-obb", "tracked,uncertain");
    export::write(&track.unwrap(), &options, &out, false).unwrap();
    let line = "0 0.500000 0.000000 0.750000 0.333333 0.500000 0.500000 0.250000 0.333333\n";
    for frame in [0, 2] {
        assert_eq!(text(out.join(format!("labels/train/frame_{frame:06}.txt"))), line);
    }
    assert!(!out.join("labels/train/frame_000001.txt").exists());
    assert!(text(out.join("data.yaml")).contains("train: images/train"));
}
