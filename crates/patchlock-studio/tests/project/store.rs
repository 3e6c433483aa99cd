//! The project file.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use patchlock::Status;
use patchlock_media::Limits;
use patchlock_studio::project::{
    Edit, Error, LABELS_FILE, SharedLabels, Store, TrackedBox, beside, in_folder,
};

use crate::support::{FRAMES, TestFolder, add, bbox, bmp, write_images};

/// Boxes of one target in these frames, no two alike.
fn track(target: u64, from: usize, to: usize) -> Edit {
    let tracked = |frame: usize| TrackedBox {
        bbox: bbox((frame * 37 % 1901) as f64 / 7.0, frame as f64 / 3.0 % 1000.0, 81.25, 60.125),
        score: (frame % 997) as f64 / 997.0,
        status: if frame % 100 > 90 { Status::Lost } else { Status::Tracked },
        visible: Some((frame % 13) as f64 / 13.0),
        agreement: frame.is_multiple_of(2).then_some(0.75),
    };
    let tracked: BTreeMap<_, _> = (from..=to).map(|frame| (frame, tracked(frame))).collect();
    Edit::SetTracked { target, from, to, tracked }
}

#[test]
fn what_is_saved_is_read_again() {
    let place = TestFolder::new();
    let mut store = place.store();
    assert!(!store.is_saved() && !place.file().exists());
    store.save().unwrap();
    let edits =
        vec![add(0), track(1, 2, 5), track(1, 8, 9), Edit::Hide { target: 1, from: 6, to: 7 }];
    store.apply(edits).unwrap();
    assert!(!store.is_saved());
    store.save().unwrap();
    let (project, revision) = (store.project().clone(), store.revision());
    drop(store);
    let store = Store::open(&place.file(), None, Limits::default()).unwrap();
    assert_eq!((store.project(), store.revision()), (&project, revision));
    assert!(store.is_saved() && store.history().text(false).is_none() && store.changed().is_none());
    assert_eq!(store.video().canonicalize().unwrap(), place.video().canonicalize().unwrap());
    assert_eq!(project.video.path, Path::new("frames"));
    assert_eq!((project.video.frames, project.video.width, project.video.height), (FRAMES, 64, 48));
    assert_eq!(project.video.bytes, (FRAMES * bmp(64, 48).len()) as u64);
    let text = fs::read_to_string(place.file()).unwrap();
    assert!(
        text.starts_with("{\n  \"format\": \"patchlock-project\",\n  \"version\": 1,\n"),
        "{text}"
    );
    drop(store);
    let left: Vec<_> =
        fs::read_dir(place.folder()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "only the video and its project: {left:?}");
}

#[test]
fn a_clip_is_marked_as_done_and_a_file_without_the_mark_is_not() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![Edit::SetDone { done: true }]).unwrap();
    store.save().unwrap();
    assert!(fs::read_to_string(place.file()).unwrap().contains("\n  \"done\": true,\n"));
    let read =
        || Store::open_shared(&place.file(), None, Limits::default()).unwrap().project().done;
    assert!(read());
    assert_eq!(store.history().text(false), Some("mark the clip as done"));
    store.step(false).unwrap();
    store.save().unwrap();
    // As version 1 wrote it before there was such a mark.
    assert!(!fs::read_to_string(place.file()).unwrap().contains("done"));
    assert!(!read());
    store.step(true).unwrap();
    assert!(store.project().done);
}

#[test]
fn the_file_is_beside_the_video() {
    let place = TestFolder::new();
    let beside = |video: &Path| beside(video, |_| false);
    assert_eq!(beside(&place.video()), place.file());
    assert_eq!(beside(Path::new("a/clip.mp4")), Path::new("a/clip.patchlock.json"));
    assert_eq!(beside(&place.video().join(".")), place.file());
}

#[test]
fn videos_that_differ_by_their_extension_have_files_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (first, second) = (path("clip.bmp"), path("clip.png"));
    for file in [&first, &second] {
        fs::write(file, bmp(64, 48)).unwrap();
    }
    let (short, long) = (path("clip.patchlock.json"), path("clip.png.patchlock.json"));
    assert_eq!(beside(&second, |_| false), short);
    assert_eq!(beside(&second, |file| file == short), long);
    Store::open(&short, Some(&first), Limits::default()).unwrap().save().unwrap();
    assert_eq!((beside(&first, |_| false), beside(&second, |_| false)), (short.clone(), long));
    // A video that was renamed keeps its project.
    fs::remove_file(&first).unwrap();
    assert_eq!(beside(&second, |_| false), short);
}

/// Videos of the same name, of several folders, with their projects in one.
#[test]
fn videos_of_one_name_have_projects_of_their_own_in_a_folder() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("projects");
    fs::create_dir(&folder).unwrap();
    let video = |name: &str, length: usize| {
        let file = place.path().join(name).join("clip.bmp");
        fs::create_dir(file.parent().unwrap()).unwrap();
        fs::write(&file, bmp(64, length)).unwrap();
        file
    };
    let (a, b, c) = (video("a", 48), video("b", 40), video("c", 32));
    let file = |video: &Path| in_folder(&folder, video, |_| false);
    let short = folder.join("clip.patchlock.json");
    assert_eq!([&a, &b].map(|video| file(video)), [short.clone(), short.clone()]);
    // The first has taken the name, though its file is not written yet.
    let of_b = in_folder(&folder, &b, |file| file == short);
    let name = of_b.file_name().unwrap().to_str().unwrap();
    assert!(of_b.parent() == Some(&*folder) && name.len() == "clip-01234567.patchlock.json".len());
    Store::open(&of_b, Some(&b), Limits::default()).unwrap().save().unwrap();
    assert_eq!(file(&b), of_b);
    Store::open(&short, Some(&a), Limits::default()).unwrap().save().unwrap();
    assert_eq!([file(&a), file(&b)], [short.clone(), of_b.clone()]);
    assert!(file(&c) != short && file(&c) != of_b);
    // A video that is away keeps its project from others, until it is found elsewhere.
    let moved = place.path().join("moved");
    fs::rename(a.parent().unwrap(), &moved).unwrap();
    assert_ne!(file(&c), short);
    assert_eq!(file(&moved.join("clip.bmp")), short);
    assert_eq!(file(place.path().join("b/../b/clip.bmp").as_path()), of_b);
    // A folder of images.
    assert_eq!(file(&moved), folder.join("moved.patchlock.json"));
}

#[test]
fn a_long_project_is_saved_and_read_fast() {
    let place = TestFolder::new();
    let frames = 18_000;
    let mut store = place.store_of(frames);
    for target in 1..=10 {
        store.apply(vec![add(0), track(target, 1, frames - 1)]).unwrap();
    }
    let begin = Instant::now();
    store.save().unwrap();
    let saving = begin.elapsed();
    let bytes = fs::metadata(place.file()).unwrap().len();
    let begin = Instant::now();
    let read = Store::open_shared(&place.file(), None, Limits::default()).unwrap();
    let reading = begin.elapsed();
    assert_eq!(read.project(), store.project());
    println!("{bytes} bytes, saved in {saving:?}, read in {reading:?}");
    assert!(bytes < 12_000_000, "{bytes} bytes");
    // Far above what it takes, since machines that test are busy.
    assert!(saving < Duration::from_secs(3) && reading < Duration::from_secs(3));
}

#[test]
fn a_project_has_one_writer() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(0)]).unwrap();
    store.save().unwrap();
    let error = Store::open(&place.file(), None, Limits::default()).unwrap_err();
    assert!(error.to_string().ends_with("is open in this process"), "{error}");
    assert!(matches!(error, Error::InUse { .. }));

    // Others may read, and write when nobody else has it open and nobody was faster.
    let mut other = Store::open_shared(&place.file(), None, Limits::default()).unwrap();
    let mut third = Store::open_shared(&place.file(), None, Limits::default()).unwrap();
    other.apply(vec![add(1)]).unwrap();
    assert!(matches!(other.save().unwrap_err(), Error::InUse { .. }));
    drop(store);
    other.save().unwrap();
    other.apply(vec![add(2)]).unwrap();
    other.save().unwrap();
    third.apply(vec![add(3)]).unwrap();
    let error = third.save().unwrap_err();
    assert!(error.to_string().contains("changed by another program"), "{error}");
    assert_eq!(
        Store::open(&place.file(), None, Limits::default()).unwrap().project().targets.len(),
        3
    );
}

#[test]
fn a_video_of_too_many_pixels_begins_no_project() {
    let place = TestFolder::new();
    let few = Limits { pixels: 64 * 48 - 1, ..Limits::default() };
    for open in [Store::open, Store::open_shared] {
        let error = open(&place.file(), Some(&place.video()), few).unwrap_err();
        assert!(error.to_string().contains("are more than the 3071"), "{error}");
    }
    assert!(!place.file().exists());

    let enough = Limits { pixels: 64 * 48, ..Limits::default() };
    let store = Store::open(&place.file(), Some(&place.video()), enough).unwrap();
    assert_eq!((store.project().video.width, store.limits()), (64, enough));
}

#[test]
fn a_change_of_the_video_is_noticed() {
    let place = TestFolder::new();
    let mut store = place.store();
    store.apply(vec![add(FRAMES - 1)]).unwrap();
    let image = place.video().join("0003.bmp");
    fs::write(&image, [bmp(64, 48), vec![0; 5]].concat()).unwrap();
    let change = store.changed().unwrap();
    assert!(change.starts_with("the video has changed: it had "), "{change}");
    fs::write(&image, bmp(64, 48)).unwrap();
    assert_eq!(store.changed(), None);
    fs::rename(&image, place.video().join("0003b.bmp")).unwrap();
    assert_eq!(
        store.changed().as_deref(),
        Some("the video has changed: it has the same size, but other content")
    );
    fs::remove_dir_all(place.video()).unwrap();
    let gone = store.changed().unwrap();
    assert!(gone.starts_with("the video cannot be read: "), "{gone}");
}

#[test]
fn a_change_inside_a_long_file_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let video = folder.path().join("clip.bmp");
    // An image with 70 MiB behind it.
    let mut bytes = bmp(64, 48);
    bytes.resize(70 << 20, 1);
    fs::write(&video, &bytes).unwrap();
    let store = Store::open(&beside(&video, |_| false), Some(&video), Limits::default()).unwrap();
    assert_eq!(store.changed(), None);
    let last = bytes.len() - 1;
    bytes[last] = 2;
    fs::write(&video, &bytes).unwrap();
    assert_eq!(
        store.changed().as_deref(),
        Some("the video has changed: it has the same size, but other content")
    );
}

#[test]
fn the_video_may_move_but_not_be_another() {
    let place = TestFolder::new();
    place.store().save().unwrap();
    let other = place.folder().join("other");
    write_images(&other, 3);
    let error = Store::open(&place.file(), Some(&other), Limits::default()).unwrap_err();
    assert!(matches!(&error, Error::OtherVideo { .. }), "{error}");
    assert!(error.to_string().contains("frames, not to "), "{error}");
    let moved = place.folder().join("moved");
    fs::rename(place.video(), &moved).unwrap();
    let store = Store::open(&place.file(), Some(&moved), Limits::default()).unwrap();
    assert_eq!((store.changed(), store.video()), (None, moved.as_path()));
    assert_eq!(store.project().video.path, Path::new("moved"));
}

#[test]
fn a_folder_between_is_part_of_the_path() {
    let place = TestFolder::new();
    let folder = place.folder().join("projects/deep");
    fs::create_dir_all(&folder).unwrap();
    let file = folder.join("a.json");
    let mut store = Store::open(&file, Some(&place.video()), Limits::default()).unwrap();
    assert_eq!(store.project().video.path, Path::new("../../frames"));
    store.save().unwrap();
    drop(store);
    assert_eq!(
        Store::open(&file, Some(&place.video()), Limits::default()).unwrap().changed(),
        None
    );
}

#[test]
fn a_video_that_only_the_file_names_is_read_in_its_folder_only() {
    let place = TestFolder::new();
    let file = place.folder().join("a.json");
    Store::open(&file, Some(&place.video()), Limits::default()).unwrap().save().unwrap();
    assert!(Store::open(&file, None, Limits::default()).unwrap().video_to_read().is_ok());
    let text = fs::read_to_string(&file).unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    fs::rename(place.video(), elsewhere.path().join("frames")).unwrap();
    let absolute = elsewhere.path().join("frames").to_string_lossy().replace('\\', "/");
    for path in [absolute.as_str(), "../../../../../../../../../../../.."] {
        let named = text.replace("\"path\":\"frames\"", &format!("\"path\":{path:?}"));
        assert_ne!(named, text);
        fs::write(&file, named).unwrap();
        let store = Store::open(&file, None, Limits::default()).unwrap();
        let error = store.video_to_read().unwrap_err();
        assert!(error.to_string().contains("names a video outside its folder"), "{error}");
        assert!(store.changed().is_some());
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(elsewhere.path().join("frames"), place.video()).unwrap();
        fs::write(&file, text).unwrap();
        assert!(Store::open(&file, None, Limits::default()).unwrap().video_to_read().is_err());
        let given = Store::open(&file, Some(&place.video()), Limits::default()).unwrap();
        assert_eq!((given.video_to_read().unwrap(), given.changed()), (&*place.video(), None));
    }
}

#[cfg(unix)]
#[test]
fn a_link_to_a_project_stays_a_link() {
    let place = TestFolder::new();
    place.store().save().unwrap();
    let link = place.folder().join("link.json");
    std::os::unix::fs::symlink(place.file(), &link).unwrap();
    let mut store = Store::open(&link, None, Limits::default()).unwrap();
    store.apply(vec![add(0)]).unwrap();
    store.save().unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(
        Store::open_shared(&place.file(), None, Limits::default()).unwrap().project().targets.len(),
        1
    );
}

/// A small valid file, with something replaced.
fn changed(from: &str, to: &str) -> String {
    let text = r##"{"format": "patchlock-project", "version": 1,
        "video": {"path": "frames", "bytes": 1, "hash": "HASH", "frames": 12, "width": 64, "height": 48},
        "labels": [{"name": "car", "colour": "#ff0000"}],
        "next_id": 3,
        "targets": [{"id": 2, "label": "car", "keys": {"0": {"box": {"x": 1, "y": 2, "w": 3, "h": 4}}},
            "hidden": [[8, 9]], "tracked": [{"from": 1, "x": [1, 2], "y": [1, 2], "w": [5, 5], "h": [5, 5],
            "score": [0.5, 1], "status": "tu", "visible": [null, 0.5]}]}]}"##;
    let text = text.replace("HASH", &"0".repeat(64));
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

#[test]
fn files_that_are_wrong_give_clear_errors() {
    let place = TestFolder::new();
    let error = |text: &str| {
        fs::write(place.file(), text).unwrap();
        let error = Store::open(&place.file(), None, Limits::default()).unwrap_err();
        error.to_string()
    };
    fs::write(place.file(), changed("", "")).unwrap();
    let target =
        Store::open(&place.file(), None, Limits::default()).unwrap().project().targets[0].clone();
    assert_eq!(
        (target.tracked[&2].status, target.tracked[&2].visible),
        (Status::Uncertain, Some(0.5))
    );
    let cases = [
        ("{\"format\"", "{{", "key must be a string at line 1"),
        ("\"version\": 1", "\"version\": 5", "version 5; this program reads versions up to 4"),
        ("\"version\": 1,", "", "no member `version`"),
        ("patchlock-project", "coco", "`format` is not \"patchlock-project\""),
        ("\"labels\"", "\"colours\"", "unknown field `colours`"),
        ("\"x\": 1,", "\"x\": NaN,", "expected value"),
        ("\"x\": 1,", "\"x\": 1e999,", "number out of range"),
        ("\"x\": 1,", "\"x\": null,", "expected f64"),
        ("\"x\": 1,", "\"x\": -500,", "target 2: frame 0: the box -500,2,3,4 is too far outside"),
        ("\"0\":", "\"12\":", "frame 12 is not one of the frames 0 to 11"),
        ("\"0\":", "\"1\":", "frame 1 has both a key and a tracked box"),
        ("\"0\":", "\"-1\":", "\"-1\" is not a frame"),
        ("\"frames\": 12", "\"frames\": 0", "the video has 0 frames"),
        ("\"frames\": 12", "\"frames\": 18446744073709551615", "allowed: 1 to 100000000"),
        ("\"frames\": 12", "\"frames\": 1e3", "invalid type: floating point"),
        ("\"width\": 64", "\"width\": 99999999", "allowed: 1 to 100000 for each side"),
        ("\"from\": 1", "\"from\": 11", "the 2 frames are not all in the video"),
        ("\"from\": 1", "\"from\": 18446744073709551615", "are not all in the video"),
        ("\"h\": [5, 5]", "\"h\": [5]", "`x` has 2 values and `h` has 1"),
        ("\"tu\"", "\"tx\"", "'x' is not a status"),
        ("[0.5, 1]", "[0.5, 1.5]", "score is 1.5; allowed: 0 to 1"),
        ("[[8, 9]]", "[[2, 9]]", "frame 2 is hidden and has a box"),
        ("[[8, 9]]", "[[8, 9], [10, 11]]", "not apart"),
        ("[[8, 9]]", "[[9, 8]]", "not in order"),
        ("[[8, 9]]", "[[8, 12]]", "frame 12 is not one of"),
        ("\"label\": \"car\"", "\"label\": \"bus\"", "there is no label \"bus\""),
        ("#ff0000", "red", "the colour \"red\" is not #rrggbb"),
        ("\"id\": 2", "\"id\": 0", "the id is 0"),
        ("\"next_id\": 3", "\"next_id\": 2", "next_id is 2; it must be above 2"),
        ("0000", "00", "not 64 hexadecimal digits"),
    ];
    for (from, to, expected) in cases {
        let message = error(&changed(from, to));
        assert!(message.contains(expected), "{from} -> {to}: {message}");
        assert!(message.contains("frames.patchlock.json"), "{message}");
    }
    assert!(error("").contains("EOF"));
    assert!(error("[]").contains("is not a valid project"));
    assert!(error(&"[".repeat(100_000)).contains("is not a valid project"));
    assert!(error("\u{feff}{}").contains("is not a valid project"));
    let missing =
        Store::open(&place.folder().join("none.json"), None, Limits::default()).unwrap_err();
    assert!(matches!(missing, Error::Track(patchlock_track::Error::Read { .. })), "{missing}");
    let no_folder =
        Store::open(&place.folder().join("a/b.json"), None, Limits::default()).unwrap_err();
    assert!(matches!(no_folder, Error::Track(patchlock_track::Error::Read { .. })), "{no_folder}");
}

#[test]
fn files_changed_anywhere_never_panic() {
    let place = TestFolder::new();
    let text = changed("", "").into_bytes();
    for at in 0..text.len() {
        for byte in [b'9', b'"', b'}', 0xff] {
            let mut text = text.clone();
            text[at] = byte;
            fs::write(place.file(), &text).unwrap();
            if let Ok(store) = Store::open_shared(&place.file(), None, Limits::default()) {
                assert!(store.project().video.frames > 0);
            }
        }
        fs::write(place.file(), &text[..at]).unwrap();
        assert!(Store::open_shared(&place.file(), None, Limits::default()).is_err());
    }
}

/// Runs only as a child of the next test: changes a project and saves it, again and again.
#[test]
fn child_that_is_killed() {
    let Some(file) = std::env::var_os("PATCHLOCK_TEST_KILLED") else { return };
    let mut store = Store::open(&PathBuf::from(file), None, Limits::default()).unwrap();
    loop {
        store.apply(vec![add(0), track(store.project().next_id, 1, 11)]).unwrap();
        store.save().unwrap();
        if store.project().targets.len() > 500 {
            while store.step(false).unwrap().is_some() {}
        }
    }
}

#[test]
fn a_killed_process_leaves_the_old_file_or_the_new() {
    let place = TestFolder::new();
    place.store().save().unwrap();
    let mut revision = 0;
    for round in 0..12u64 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "store::child_that_is_killed"])
            .env("PATCHLOCK_TEST_KILLED", place.file())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(150 + 17 * round));
        child.kill().unwrap();
        child.wait().unwrap();
        let store =
            Store::open(&place.file(), None, Limits::default()).expect("nobody has it open");
        assert!(store.revision() >= revision);
        revision = store.revision();
        let project = store.project();
        assert!(project.targets.iter().all(|target| target.tracked.len() == 11), "half a step");
        drop(store);
        let names = fs::read_dir(place.folder()).unwrap().map(|entry| entry.unwrap().file_name());
        let names: Vec<_> = names.map(|name| name.into_string().unwrap()).collect();
        assert_eq!(names.len(), 2, "{names:?}");
    }
    assert!(revision > 0, "the child saved nothing");
}

#[test]
fn the_example_of_the_guide_is_read_and_says_the_same_when_written() {
    let page = include_str!("../../../../docs/project-file.md");
    let example = page.split("```").nth(1).unwrap().strip_prefix("json\n").unwrap();
    let place = TestFolder::new();
    fs::write(place.file(), example).unwrap();
    let mut store = Store::open(&place.file(), None, Limits::default()).unwrap();
    let target = &store.project().targets[0];
    assert_eq!(target.tracked[&3].status, Status::Uncertain);
    assert_eq!((target.tracked[&2].visible, target.tracked[&2].agreement), (None, Some(0.9)));
    assert!(target.keys[&4].occluded && target.is_hidden(299));
    let before = store.project().clone();
    store.apply(vec![Edit::RemoveLabel { name: "none".into() }]).unwrap_err();
    let label = |colour: &str| Edit::SetLabel {
        name: "car".into(),
        new_name: None,
        colour: Some(colour.into()),
    };
    store.apply(vec![label("#000000"), label("#e69f00")]).unwrap();
    store.save().unwrap();
    assert_eq!(
        *Store::open_shared(&place.file(), None, Limits::default()).unwrap().project(),
        before
    );
    let block = |k: usize| page.split("```").nth(k).unwrap().strip_prefix("json\n").unwrap();
    let with_attributes = format!(
        "{{\"format\": \"patchlock-project\", \"version\": 3, \"video\": {}, \"labels\": [{}], \"targets\": [{}]}}",
        serde_json::to_string(&before.video).unwrap(),
        block(3),
        block(5)
    );
    let other = place.folder().join("other.json");
    fs::write(&other, with_attributes).unwrap();
    let other = Store::open_shared(&other, None, Limits::default()).unwrap();
    let values = other.project().values(&other.project().targets[0], 20);
    let values: Vec<&str> = values.values().map(String::as_str).collect();
    assert_eq!(values, ["2", "left", "false", ""], "doors, light, parked, plate");
    let labels = block(7);
    fs::write(place.folder().join(LABELS_FILE), labels).unwrap();
    let labels = SharedLabels::new(place.folder()).read().unwrap().labels();
    assert_eq!(labels, store.project().labels);
    store.apply(vec![serde_json::from_str(block(9)).unwrap()]).unwrap();
    store.step(false).unwrap();
    let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let numbers = |value: &serde_json::Value| value["targets"][0]["tracked"][0]["x"].clone();
    let written = json(&fs::read_to_string(place.file()).unwrap());
    assert_eq!(numbers(&written), numbers(&json(example)));
    assert_eq!(written["revision"], 18);
}

#[cfg(unix)]
#[test]
fn what_has_the_name_of_a_lock_is_left_alone() {
    use std::os::unix::fs::symlink;
    let place = TestFolder::new();
    let lock = place.folder().join("frames.patchlock.json.lock");
    let precious = place.folder().join("precious.txt");
    fs::write(&precious, "a year of work").unwrap();
    let refused = |words: &str| {
        let opened = Store::open(&place.file(), Some(&place.video()), Limits::default());
        let message = opened.unwrap_err().to_string();
        assert!(
            message.contains(words) && message.contains("not a lock of Patchlock"),
            "{message}"
        );
        assert_eq!(fs::read_to_string(&precious).unwrap(), "a year of work");
        assert!(lock.symlink_metadata().is_ok(), "it is still there");
    };
    symlink("precious.txt", &lock).unwrap();
    refused("it is a link");
    fs::remove_file(&lock).unwrap();
    symlink("nowhere.txt", &lock).unwrap();
    refused("it is a link");
    assert!(!place.folder().join("nowhere.txt").exists());
    fs::remove_file(&lock).unwrap();
    fs::hard_link(&precious, &lock).unwrap();
    refused("it is a file of its own");
    fs::remove_file(&lock).unwrap();
    fs::create_dir(&lock).unwrap();
    refused("it is not a file");
    fs::remove_dir(&lock).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&lock).status().unwrap().success());
    refused("it is not a file");
}

#[test]
fn a_lock_that_a_killed_process_left_is_taken_over() {
    let place = TestFolder::new();
    let lock = place.folder().join("frames.patchlock.json.lock");
    for left in ["", "process 4194999"] {
        fs::write(&lock, left).unwrap();
        let store = Store::open(&place.file(), Some(&place.video()), Limits::default()).unwrap();
        let second =
            Store::open(&place.file(), Some(&place.video()), Limits::default()).unwrap_err();
        assert!(matches!(second, Error::InUse { .. }), "{second}");
        drop(store);
    }
    assert!(cfg!(windows) || !lock.exists());
}
