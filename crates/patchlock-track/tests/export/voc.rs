//! Pascal VOC.

use crate::support::*;
use image::RgbImage;
use patchlock_track::export::Options;
use std::fs;

#[test]
fn voc_counts_from_one_and_clips() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let (files, out) = workspace
        .export(&Options { images: Some(images), ..options(format_named("voc")) })
        .unwrap();
    assert_eq!(files, 2 + 2 * 4);
    assert_eq!(text(out.join("ImageSets/Main/trainval.txt")), "0\n2\n4\n6\n");
    assert_eq!(text(out.join("labelmap.txt")), "# label:color_rgb:parts:actions\ntoy car:::\n");
    let first = text(out.join("Annotations/0.xml"));
    for part in [
        "<filename>0.jpg</filename>",
        "<width>40</width>\n    <height>30</height>",
        "<name>toy car</name>",
        "<xmin>11</xmin>\n      <ymin>6</ymin>\n      <xmax>30</xmax>\n      <ymax>15</ymax>",
        "<truncated>0</truncated>\n    <occluded>0</occluded>",
    ] {
        assert!(first.contains(part), "{part}: {first}");
    }
    let second = text(out.join("Annotations/2.xml"));
    assert_eq!(second.matches("<object>").count(), 2);
    assert!(second.contains("<occluded>1</occluded>"));
    // The box covers -4..4 and 27..33.1 of a frame of 40 x 30.
    let third = text(out.join("Annotations/4.xml"));
    let sides =
        "<xmin>1</xmin>\n      <ymin>28</ymin>\n      <xmax>4</xmax>\n      <ymax>30</ymax>";
    assert!(third.contains(sides) && third.contains("<truncated>1</truncated>"), "{third}");
    assert!(image::open(out.join("JPEGImages/6.jpg")).is_ok());
    for names in
        lost_exports(format_named("voc"), |out| text(out.join("ImageSets/Main/trainval.txt")))
    {
        assert_eq!(names, [0, 1, 5].map(|k| format!("frame_{k:06}\n")).concat());
    }
}

#[test]
fn file_names_with_control_characters_make_valid_xml() {
    let workspace = Workspace::new();
    let frames = workspace.path("frames");
    fs::create_dir(&frames).unwrap();
    for k in 0..7 {
        let name = format!("<&\u{1b}[31m\n\u{7}{k}.jpg");
        RgbImage::new(40, 30).save(frames.join(name)).unwrap();
    }
    let (_, out) = workspace
        .export(&Options { images: Some(frames), ..options(format_named("voc")) })
        .unwrap();
    let annotations = fs::read_dir(out.join("Annotations")).unwrap();
    let mut count = 0;
    for file in annotations {
        let xml = fs::read_to_string(file.unwrap().path()).unwrap();
        let name = xml.split(['<', '>']).skip_while(|tag| *tag != "filename").nth(1).unwrap();
        assert!(name.starts_with("&lt;&amp;\u{fffd}[31m&#10;\u{fffd}"), "{name:?}");
        count += 1;
    }
    assert_eq!(count, 4);
}
