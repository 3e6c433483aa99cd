//! KITTI.

use crate::support::*;

/// Frames and pixels count from 0, and sides are those of the box, as the development kit reads them.
#[test]
fn kitti_has_the_placeholders_of_its_development_kit() {
    let line = |place: &str, occluded: i8, sides: &str, score: &str| {
        format!(
            "{place} toy_car -1 {occluded} -10 {sides} -1 -1 -1 -1000 -1000 -1000 -10 {score}\n"
        )
    };
    let expected = [
        line("0 1", -1, "10.0000 5.0000 30.0000 15.0000", "1.0000"),
        line("2 1", 1, "11.0000 5.0000 31.0000 15.0000", "0.2500"),
        line("2 3", -1, "30.0000 20.0000 38.0000 26.0000", "1.0000"),
        line("4 3", -1, "-4.0000 27.0000 4.0000 33.1235", "0.5000"),
        line("6 1", -1, "14.0000 5.0000 34.0000 15.0000", "0.7500"),
    ];
    let text_of_track = exported_text(format_named("kitti"));
    assert_eq!(text_of_track, expected.concat());
    assert!(text_of_track.lines().all(|line| line.split(' ').count() == 18));
    for text in lost_exports(format_named("kitti"), |out| text(out)) {
        let frames: Vec<&str> = text.lines().map(|line| line.split(' ').next().unwrap()).collect();
        assert_eq!(frames, ["0", "1", "4", "5"]);
    }
}
