//! LaSOT and GOT-10k. That they are read back is tested with the reader, in `patchlock-bench`.

use crate::support::*;
use patchlock_track::export::Options;
use std::fs;

#[test]
fn lasot_counts_from_one_and_flags_absence() {
    let workspace = Workspace::new();
    let options = Options { images: Some(workspace.images()), ..options(format_named("lasot")) };
    let out = workspace.export(&options).unwrap().1;
    let first = out.join("toy car/toy car-1");
    assert_eq!(
        text(first.join("groundtruth.txt")),
        "11.0000,6.0000,20.0000,10.0000\n12.0000,6.0000,20.0000,10.0000\n0,0,0,0\n\
         15.0000,6.0000,20.0000,10.0000\n"
    );
    assert_eq!(text(first.join("full_occlusion.txt")), "0,0,1,0\n");
    assert_eq!(text(first.join("out_of_view.txt")), "0,0,0,0\n");
}

#[test]
fn got10k_has_images_and_flags() {
    let workspace = Workspace::new();
    let options = Options { images: Some(workspace.images()), ..options(format_named("got10k")) };
    let out = workspace.export(&options).unwrap().1;
    assert_eq!(text(out.join("list.txt")), "film_000001\nfilm_000003\n");
    let (first, third) = (out.join("film_000001"), out.join("film_000003"));
    assert_eq!(text(first.join("absence.label")), "0\n0\n1\n0\n");
    assert_eq!(text(first.join("cover.label")), "8\n2\n0\n6\n");
    assert_eq!(text(third.join("cut_by_image.label")), "0\n1\n");
    assert!(
        text(first.join("meta_info.ini")).contains("object_class: toy car\nresolution: (40, 30)")
    );
    // The first image is a JPEG and is copied; the others are converted.
    let (one, four) = (first.join("00000001.jpg"), first.join("00000004.jpg"));
    assert_eq!(fs::read(one).unwrap(), fs::read(workspace.path("frames/0.jpg")).unwrap());
    let red = image::open(four).unwrap().to_rgb8().get_pixel(20, 15)[0];
    assert!(red.abs_diff(180) < 4, "{red}");
}

#[test]
fn benchmarks_flag_a_lost_target() {
    let boxes = |first: u32| {
        let line = |x: u32| format!("{x}.0000,{first}.0000,20.0000,10.0000\n");
        let offset = first + 5;
        [line(offset), line(offset + 1), "0,0,0,0\n".repeat(2), line(offset + 4), line(offset + 5)]
            .concat()
            + "0,0,0,0\n"
    };
    for out in lost_exports(format_named("lasot"), |out| {
        let folder = out.join("toy car/toy car-1");
        ["groundtruth.txt", "full_occlusion.txt"].map(|name| text(folder.join(name)))
    }) {
        assert_eq!(out, [boxes(6), "0,0,1,1,0,0,1\n".to_string()]);
    }
    for out in lost_exports(format_named("got10k"), |out| {
        let folder = out.join("film_000001");
        ["groundtruth.txt", "absence.label", "cover.label"].map(|name| text(folder.join(name)))
    }) {
        let lines =
            |digits: &str| digits.chars().map(|digit| format!("{digit}\n")).collect::<String>();
        assert_eq!(out, [boxes(5), lines("0011001"), lines("6600660")]);
    }
}
