//! What holds for all formats: options, clips, files that exist, sizes.

use crate::support::*;
use patchlock::{BoundingBox, Status};
use patchlock_track::export::{
    self, Entry, Format, ImageUse, KeyFrames, Options, Purpose, Selection, TargetMetadata, Track,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The same track with an outline in each entry, as some formats need.
fn outlined(track: &Track) -> Track {
    let with_corners = |entry: &Entry| {
        let corners = entry.bbox.map(|BoundingBox { x, y, w, h }| {
            [[x, y], [x + w, y], [x + w, y + h], [x, y + h]].map(|[x, y]| [x - 0.5, y - 0.5])
        });
        Entry { corners, ..*entry }
    };
    Track::new(track.entries().iter().map(with_corners).collect()).unwrap()
}

/// The bytes of each file in a file or folder.
fn contents(place: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    if place.is_file() {
        return BTreeMap::from([(PathBuf::new(), fs::read(place).unwrap())]);
    }
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(place).unwrap().map(Result::unwrap) {
        let name = PathBuf::from(entry.file_name());
        let within = contents(&entry.path()).into_iter();
        all.extend(within.map(|(path, bytes)| (name.join(path), bytes)));
    }
    all
}

#[test]
fn every_format_keeps_what_it_declares() {
    let track = outlined(&track());
    for format in Format::ALL {
        let (workspace, name) = (Workspace::new(), format.name);
        let images = workspace.images();
        let plain = options(format);
        let write = |options: &Options, out: &str| {
            let out = workspace.path(out);
            export::write(&track, options, &out, false).map(|written| (written.files, out))
        };
        let (files, out) = write(&plain, "first").unwrap();
        assert_eq!((out.is_file(), out.is_dir()), (format.is_file(), !format.is_file()), "{name}");
        let first = contents(&out);
        assert_eq!(first.len(), files, "{name}");
        assert!(first.values().any(|bytes| !bytes.is_empty()), "{name}");
        let (_, again) = write(&plain, "second").unwrap();
        assert_eq!(contents(&again), first, "{name}");
        let unsized_options = Options { size: None, ..plain.clone() };
        assert_eq!(write(&unsized_options, "unsized").is_err(), format.needs_size, "{name}");
        let with_images = write(&Options { images: Some(images), ..plain }, "images");
        assert_eq!(with_images.is_err(), format.images == ImageUse::Unused, "{name}");
        let copies = with_images.is_ok_and(|(with_images, _)| with_images > files);
        assert_eq!(copies, format.holds_frames(), "{name}");
    }
}

#[test]
fn inconsistent_options_are_errors_and_nothing_is_written() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let short = workspace.path("short");
    fs::create_dir(&short).unwrap();
    fs::copy(images.join("0.jpg"), short.join("0.jpg")).unwrap();
    let coco = options(format_named("coco"));
    let with_key_frames = Format::ALL.into_iter().filter(|format| format.has_key_frames);
    let with_key_frames: Vec<&str> = with_key_frames.map(|format| format.name).collect();
    let rejected = [
        (Options { size: None, ..coco.clone() }, "coco needs the frame size"),
        (Options { size: Some((0, 30)), ..coco.clone() }, "the size is 0 x 30"),
        (
            Options { size: Some((41, 30)), images: Some(images), ..coco.clone() },
            "the size as given is 41 x 30, but of the images it is 40 x 30",
        ),
        (
            Options { images: Some(short), ..coco.clone() },
            "extends to frame 6, counted from 0, but",
        ),
        (
            Options { images: Some(workspace.path("no")), ..coco.clone() },
            "is neither a folder of images nor a video",
        ),
        (
            Options { key_frames: KeyFrames::Every(0), ..options(format_named("cvat")) },
            "every 0th frame",
        ),
        (
            Options { key_frames: KeyFrames::Overlap(1.0), ..options(format_named("cvat")) },
            "the least overlap of key frames is 1; it must be above 0 and below 1",
        ),
        (
            Options { key_frames: KeyFrames::Every(9), ..coco.clone() },
            &format!("coco has no key frames; {} have", with_key_frames.join(", ")),
        ),
        (choosing(Selection { every: 0, ..Selection::default() }, &coco), "every 0th frame"),
        (
            choosing(Selection { min_score: Some(2.0), ..Selection::default() }, &coco),
            "the least score is 2; allowed: 0 to 1",
        ),
        (
            choosing(Selection { min_score: Some(f64::NAN), ..Selection::default() }, &coco),
            "the least score is NaN",
        ),
        (
            choosing(Selection { status: Some(vec![]), ..Selection::default() }, &coco),
            "no status is given; allowed: tracked, uncertain, lost",
        ),
        (with_status("yolo", "tracked,lost"), "yolo cannot mark lost targets"),
        (
            choosing(
                Selection { every: 5, ..Selection::default() },
                &options(format_named("cvat")),
            ),
            "cvat cannot have every 5th frame",
        ),
        (
            Options { images: Some(workspace.path("x")), ..options(format_named("mot")) },
            "does not use images",
        ),
        (Options { label: "a/b".into(), ..coco.clone() }, "the label is \"a/b\""),
        (Options { name: "..".into(), ..coco }, "the name is \"..\""),
    ];
    for (options, message) in rejected {
        let error = workspace.export(&options).unwrap_err();
        assert!(error.contains(message), "{error}");
        assert_eq!(fs::read_dir(workspace.path("")).unwrap().count(), 2, "{message}");
    }
    let error = Format::named("vot", false).unwrap_err().to_string();
    let names = Format::ALL.into_iter().filter(|format| !format.is_of_project);
    let names: Vec<&str> = names.map(|format| format.name).collect();
    assert!(error.contains(&names.join(", ")), "{error}");
}

#[test]
fn a_size_that_is_not_needed_is_ignored() {
    let workspace = Workspace::new();
    let (_, out) =
        workspace.export(&Options { size: Some((4, 3)), ..options(format_named("mot")) }).unwrap();
    assert_eq!(text(out), exported_text(format_named("mot")));
}

/// The last frame of the clip has no frame after it in which the target could be outside.
#[test]
fn a_clip_has_the_frames_of_its_images_or_those_that_the_track_knows_of() {
    let workspace = Workspace::new();
    let images = workspace.images();
    let video = workspace.path("film.y4m");
    fs::write(&video, y4m(9)).unwrap();
    let known = |frames: usize| track().in_clip(frames);
    let cases = [
        ("images", track(), Some(images), 7),
        ("video", track(), Some(video), 9),
        ("track", known(7), None, 7),
        ("longer", known(20), None, 20),
        ("unknown", track(), None, 7),
    ];
    for (name, track, images, frames) in cases {
        let out = |format: Format| workspace.path(&format!("{name}.{}", format.name));
        for format in [format_named("cvat"), format_named("label-studio")] {
            let options = Options { images: images.clone(), ..options(format) };
            export::write(&track, &options, &out(format), false).unwrap();
        }
        let xml = text(out(format_named("cvat")));
        assert!(xml.contains(&format!("<size>{frames}</size>")), "{name}: {xml}");
        let outside = "<box frame=\"7\" keyframe=\"1\" outside=\"1\"";
        assert_eq!(xml.contains(outside), frames > 7, "{name}: {xml}");
        let tasks: Value = serde_json::from_str(&text(out(format_named("label-studio")))).unwrap();
        let value = &tasks[0]["predictions"][0]["result"][0]["value"];
        assert_eq!(value["framesCount"], frames, "{name}");
        let seconds = (frames as f64 / 30.0 * 1e4).round() / 1e4;
        assert_eq!(value["duration"], seconds, "{name}");
    }
    let out = workspace.path("short");
    let error = export::write(&known(6), &options(format_named("cvat")), &out, false).unwrap_err();
    let expected = "the track extends to frame 6, counted from 0, but the clip has 6 frames";
    assert!(error.to_string().contains(expected), "{error}");
}

/// CVAT and Label Studio cannot read a track without boxes.
#[test]
fn a_target_that_is_never_found_has_no_track() {
    let workspace = Workspace::new();
    let lost = |frame| Entry { frame, id: 2, status: Some(Status::Lost), ..track().entries()[0] };
    let entries = [track().entries(), &[lost(0), lost(1)]].concat();
    let with_lost = Track::new(entries).unwrap();
    for format in [format_named("cvat"), format_named("label-studio")] {
        let out = workspace.path(format.name);
        export::write(&with_lost, &options(format), &out, false).unwrap();
        assert_eq!(text(out), exported_text(format));
    }
}

#[test]
fn names_are_escaped() {
    let workspace = Workspace::new();
    let escaped = Options { label: "a<b> & \"c\"".into(), ..options(format_named("cvat")) };
    let xml = text(workspace.export(&escaped).unwrap().1);
    assert!(xml.contains("label=\"a&lt;b&gt; &amp; &quot;c&quot;\""));
    let workspace = Workspace::new();
    let escaped = Options { label: "a: \"b\"".into(), ..options(format_named("yolo")) };
    let yaml = text(workspace.export(&escaped).unwrap().1.join("data.yaml"));
    assert!(yaml.ends_with("names:\n  0: \"a: \\\"b\\\"\"\n"), "{yaml}");
}

#[test]
fn frames_of_a_video_are_saved_as_images() {
    let workspace = Workspace::new();
    let video = workspace.path("film.y4m");
    let bytes = y4m(7);
    fs::write(&video, &bytes).unwrap();
    let with_video =
        |format| Options { size: None, images: Some(video.clone()), ..options(format) };
    for (format, image) in [
        (format_named("yolo"), "images/train/frame_000004.jpg"),
        (format_named("voc"), "JPEGImages/frame_000004.jpg"),
        // The fourth frame of target 1 is frame 6; the frames of target 3, which come later, begin
        // before it.
        (format_named("got10k"), "film_000003/00000002.jpg"),
        (format_named("lasot"), "toy car/toy car-3/img/00000002.jpg"),
    ] {
        let out = workspace.path(format.name);
        export::write(&track(), &with_video(format), &out, false).unwrap();
        let red = image::open(out.join(image)).unwrap().to_rgb8().get_pixel(20, 15)[0];
        assert!(red.abs_diff(120) < 6, "{}: {red}", format.name);
    }
    fs::write(&video, &bytes[..bytes.len() - 1900]).unwrap();
    let out = workspace.path("short");
    let error =
        export::write(&track(), &with_video(format_named("yolo")), &out, false).unwrap_err();
    assert!(error.to_string().contains("frame 6"), "{error}");
    assert!(!out.exists());
}

#[test]
fn existing_files_are_kept() {
    let workspace = Workspace::new();
    let (_, out) = workspace.export(&options(format_named("mot"))).unwrap();
    assert!(
        workspace.export(&options(format_named("mot"))).unwrap_err().contains("exists already")
    );
    assert!(workspace.export(&options(format_named("lasot"))).unwrap_err().contains("is a file"));
    fs::write(&out, "old").unwrap();
    export::write(&track(), &options(format_named("mot")), &out, true).unwrap();
    assert!(text(&out).starts_with("1,1,11.0000"));

    let folder = workspace.path("folder");
    fs::create_dir(&folder).unwrap();
    let lasot = options(format_named("lasot"));
    export::write(&track(), &lasot, &folder, false).unwrap();
    let again = export::write(&track(), &lasot, &folder, true).unwrap_err().to_string();
    assert!(again.contains("never replaced"), "{again}");
    let nowhere = workspace.path("no/out");
    assert!(export::write(&track(), &lasot, &nowhere, true).is_err());
    // No temporary files are left beside the two results.
    assert_eq!(fs::read_dir(workspace.path("")).unwrap().count(), 2);
}

/// A target has two entries, and each begins a frame after the one before it and ends a frame
/// earlier.
fn nested(targets: usize) -> Track {
    let entry = |frame, id| Entry {
        frame,
        id: id as u64,
        bbox: Some(BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 }),
        score: None,
        corners: None,
        status: None,
        ..Entry::default()
    };
    let both = |id| [entry(id, id), entry(2 * targets - 1 - id, id)];
    Track::new((0..targets).flat_map(both).collect()).unwrap()
}

#[test]
fn a_short_track_does_not_become_a_huge_folder() {
    for format in [format_named("lasot"), format_named("got10k")] {
        let workspace = Workspace::new();
        let out = workspace.path("out");
        let error = export::write(&nested(5000), &options(format), &out, false).unwrap_err();
        let error = error.to_string();
        assert!(error.contains("25005000 for this track of 5000 targets"), "{error}");
        assert!(error.contains("at most 5000000 are written"), "{error}");
        assert!(!out.exists());
        export::write(&nested(20), &options(format), &out, false).unwrap();
    }
}

/// A track of targets with a label and an attribute of their own.
fn distinct_targets(count: u64) -> Track {
    let entry = |id: u64| Entry {
        frame: id as usize % 10,
        id,
        bbox: Some(BoundingBox { x: 1.0, y: 2.0, w: 3.0, h: 4.0 }),
        score: None,
        corners: None,
        status: None,
        ..Entry::default()
    };
    let metadata = |id: u64| {
        let attributes = [(format!("a{id}"), "b".to_owned())].into();
        let label = format!("label {id}");
        (id, TargetMetadata { label, attributes, ..TargetMetadata::default() })
    };
    let track = outlined(&Track::new((0..count).map(entry).collect()).unwrap());
    track.with_targets((0..count).map(metadata).collect())
}

/// Ten times the targets take some ten times as long, and a hundred times if a format looks at all
/// entries for each target, or at all labels. What other programs do meanwhile may hide that, so it is
/// tried again.
#[test]
fn the_time_of_an_export_follows_the_number_of_targets() {
    let [few, many] = [5_000, 50_000].map(distinct_targets);
    // Those for benchmarks have a folder for each target, tables a column for each name of an attribute.
    let is_quick = |format: &Format| format.is_file() || format.purpose != Purpose::Benchmark;
    for format in Format::all(false).filter(is_quick) {
        let name = format.name;
        let seconds = |track: &Track| {
            let (workspace, begun) = (Workspace::new(), std::time::Instant::now());
            export::write(track, &options(format), &workspace.path("out"), false).unwrap();
            let seconds = begun.elapsed().as_secs_f64();
            assert!(seconds < 60.0, "{name} took {seconds} s");
            seconds
        };
        let factors = || (0..4).map(|_| seconds(&many) / seconds(&few));
        assert!(factors().any(|factor| factor < 30.0), "{name}");
    }
}
