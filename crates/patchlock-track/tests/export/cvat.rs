//! CVAT, upright and rotated.

use crate::support::*;
use patchlock::{BoundingBox, Status};
use patchlock_track::export::{self, Entry, KeyFrames, Options, Track};

#[test]
fn cvat_marks_the_frames_without_a_target() {
    let xml = exported_text(format_named("cvat"));
    let track = |id: u64, boxes: &[(usize, u8, u8, [&str; 4])]| {
        let line = |(frame, outside, occluded, [l, t, r, b]): &(usize, u8, u8, [&str; 4])| {
            format!(
                "    <box frame=\"{frame}\" keyframe=\"1\" outside=\"{outside}\" occluded=\"{occluded}\" \
                 xtl=\"{l}\" ytl=\"{t}\" xbr=\"{r}\" ybr=\"{b}\" z_order=\"0\"></box>\n"
            )
        };
        let boxes: String = boxes.iter().map(line).collect();
        format!("  <track id=\"{id}\" label=\"toy car\" source=\"auto\">\n{boxes}  </track>\n")
    };
    let first = [
        (0, 0, 0, ["10", "5", "30", "15"]),
        (1, 1, 0, ["10", "5", "30", "15"]),
        (2, 0, 1, ["11", "5", "31", "15"]),
        (3, 1, 1, ["11", "5", "31", "15"]),
        (6, 0, 0, ["14", "5", "34", "15"]),
    ];
    let third = [
        (2, 0, 0, ["30", "20", "38", "26"]),
        (3, 1, 0, ["30", "20", "38", "26"]),
        (4, 0, 0, ["-4", "27", "4", "33.1235"]),
        (5, 1, 0, ["-4", "27", "4", "33.1235"]),
    ];
    let (_, tracks) = xml.split_once("</meta>\n").unwrap();
    assert_eq!(tracks, track(1, &first) + &track(3, &third) + "</annotations>\n");
    assert!(xml.contains("<size>7</size>") && xml.contains("<width>40</width>"));
}

#[test]
fn a_lost_target_is_outside_in_cvat() {
    let exports = lost_exports(format_named("cvat"), |out| {
        let xml = text(out);
        let boxes = xml.lines().filter(|line| line.contains("<box "));
        let value = |line: &str, name: &str| {
            line.split_once(&format!(" {name}=\""))
                .unwrap()
                .1
                .split('"')
                .next()
                .unwrap()
                .to_string()
        };
        boxes
            .map(|line| {
                ["frame", "outside", "occluded", "xtl"].map(|name| value(line, name)).join(" ")
            })
            .collect::<Vec<_>>()
    });
    let expected =
        ["0 0 0 10", "1 0 0 11", "2 1 0 11", "4 0 1 14", "5 0 0 15", "6 1 0 15"].map(String::from);
    for boxes in exports {
        assert_eq!(boxes, expected);
    }
}

/// A square that stands on a corner, one that is turned by a right angle, and an upright one.
#[test]
fn rotated_boxes_of_cvat_have_the_sides_before_they_are_turned() {
    let workspace = Workspace::new();
    let error = workspace.export(&options(format_named("cvat-obb"))).unwrap_err().to_string();
    assert!(error.contains("target 1 has no outline in frame 2, which cvat-obb needs"), "{error}");
    let entry = |frame, corners, status| Entry {
        frame,
        id: 1,
        bbox: Some(BoundingBox { x: 10.0, y: 5.0, w: 20.0, h: 20.0 }),
        score: None,
        corners,
        status: Some(status),
        ..Entry::default()
    };
    let diamond = [[19.5, 4.5], [29.5, 14.5], [19.5, 24.5], [9.5, 14.5]];
    let right = [[29.5, 4.5], [29.5, 24.5], [9.5, 24.5], [9.5, 4.5]];
    let upright = [[9.5, 4.5], [29.5, 4.5], [29.5, 24.5], [9.5, 24.5]];
    let track = Track::new(vec![
        entry(0, Some(diamond), Status::Tracked),
        entry(1, Some(right), Status::Tracked),
        entry(2, Some(upright), Status::Tracked),
        entry(3, None, Status::Lost),
    ]);
    let out = workspace.path("rotated.xml");
    export::write(&track.unwrap(), &options(format_named("cvat-obb")), &out, false).unwrap();
    let boxes = text(&out);
    let boxes: Vec<&str> = boxes.lines().filter(|line| line.contains("<box ")).collect();
    let has = |k: usize, words: &str| assert!(boxes[k].contains(words), "{words}: {}", boxes[k]);
    has(0, "xtl=\"10\" ytl=\"5\" xbr=\"30\" ybr=\"25\"");
    has(0, " rotation=\"45\"");
    has(1, "xtl=\"10\" ytl=\"5\" xbr=\"30\" ybr=\"25\"");
    has(1, " rotation=\"90\"");
    has(2, "ybr=\"25\" z_order=\"0\">");
    has(3, "frame=\"3\" keyframe=\"1\" outside=\"1\"");
}

#[test]
fn key_frames_are_sparse_and_keep_every_change() {
    let workspace = Workspace::new();
    let out = workspace.path("a.xml");
    let sparse = Options { key_frames: KeyFrames::Every(10), ..options(format_named("cvat")) };
    export::write(&long_track(), &sparse, &out, false).unwrap();
    let written = text(&out);
    let value = |line: &str, name: &str| -> usize {
        let (_, rest) = line.split_once(&format!(" {name}=\"")).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    };
    let boxes: Vec<[usize; 3]> = written
        .lines()
        .filter(|line| line.contains("<box "))
        .map(|line| ["frame", "outside", "occluded"].map(|name| value(line, name)))
        .collect();
    let expected = [
        [0, 0, 0],
        [10, 0, 0],
        [12, 0, 1],
        [15, 0, 0],
        [20, 0, 0],
        [21, 1, 0],
        [25, 0, 0],
        [30, 0, 0],
    ];
    assert_eq!(boxes, expected);
}
