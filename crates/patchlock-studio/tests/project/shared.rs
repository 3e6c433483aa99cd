//! Labels of all clips of a folder, and their export as one data set.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use patchlock_media::Limits;
use patchlock_studio::export::{self, CombinedExport, Val, of_folder, write_all};
use patchlock_studio::import;
use patchlock_studio::project::{Attribute, Edit, Error, Kind, LABELS_FILE, SharedLabels, Store};
use patchlock_track::export::{Format, Options, Part, split};
use serde_json::Value;

use crate::support::{bbox, format_named, write_images};

/// A folder with clips, each with a target of these labels in frames 0 and 1.
fn clips(all: &[(&str, &[&str])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, labels) in all {
        let video = folder.path().join(name);
        write_images(&video, 4);
        let mut store =
            Store::open(&file(folder.path(), name), Some(&video), Limits::default()).unwrap();
        for label in *labels {
            if !store.project().labels.iter().any(|known| known.name == **label) {
                let add = Edit::AddLabel { name: (*label).into(), colour: None, at: None };
                store.apply(vec![add]).unwrap();
            }
            let target = store.project().next_id;
            let (label, bbox) = ((*label).to_owned(), bbox(10.0, 10.0, 8.0, 6.0));
            let add = Edit::AddTarget { label, frame: 0, bbox, outline: None };
            let key = Edit::SetKey {
                target,
                frame: 1,
                bbox,
                outline: None,
                occluded: false,
                truncated: false,
            };
            store.apply(vec![add, key]).unwrap();
        }
        store.save().unwrap();
    }
    folder
}

fn file(folder: &Path, name: &str) -> std::path::PathBuf {
    folder.join(format!("{name}.patchlock.json"))
}

fn names(labels: &[patchlock_studio::project::Label]) -> Vec<&str> {
    labels.iter().map(|label| label.name.as_str()).collect()
}

fn exported(
    folder: &Path,
    format: Format,
    val: Option<&Val>,
) -> (tempfile::TempDir, CombinedExport) {
    let (clips, labels) = of_folder(folder).unwrap();
    let out = tempfile::tempdir().unwrap();
    let options = Options::new(format, "set");
    let written = write_all(&clips, &labels, &options, val, &out.path().join("set"), &|| false);
    (out, written.unwrap())
}

fn text(folder: &tempfile::TempDir, path: &str) -> String {
    let path = folder.path().join("set").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn projects_that_had_labels_of_their_own_get_those_of_all() {
    let folder = clips(&[("a", &["car"]), ("b", &["person", "car"])]);
    let (clips, labels) = of_folder(folder.path()).unwrap();
    assert_eq!(names(&labels), ["target", "car", "person"]);
    assert!(clips.iter().all(|clip| clip.project.labels == labels));
    // Nothing is written by reading.
    assert!(!folder.path().join(LABELS_FILE).exists());

    let mut shared = SharedLabels::new(folder.path());
    for name in ["a", "b"] {
        let store = Store::open(&file(folder.path(), name), None, Limits::default()).unwrap();
        shared.update(|vocabulary| vocabulary.absorb(store.project())).unwrap();
    }
    assert_eq!(shared.read().unwrap().labels(), labels);
    assert_eq!(SharedLabels::new(folder.path()).read().unwrap().labels(), labels);
}

#[test]
fn a_label_that_was_renamed_has_its_new_name_in_projects_that_were_closed() {
    let folder = clips(&[("a", &["car"]), ("b", &["car"])]);
    let mut shared = SharedLabels::new(folder.path());
    let edit = Edit::SetLabel { name: "car".into(), new_name: Some("van".into()), colour: None };
    let mut store = Store::open(&file(folder.path(), "a"), None, Limits::default()).unwrap();
    shared.update(|vocabulary| vocabulary.absorb(store.project())).unwrap();
    let renamed = shared.update(|vocabulary| vocabulary.apply(&edit, |_| true)).unwrap();
    let labels = shared.read().unwrap().labels();
    assert!(store.set_labels(&labels, renamed.as_slice()));
    assert_eq!(store.project().targets[0].label, "van");
    store.save().unwrap();
    drop(store);

    let (clips, labels) = of_folder(folder.path()).unwrap();
    assert_eq!(names(&labels), ["target", "van"]);
    assert_eq!(clips[1].project.targets[0].label, "van");
    // The old name may be that of another label from now on.
    let add = Edit::AddLabel { name: "car".into(), colour: None, at: None };
    shared.update(|vocabulary| vocabulary.apply(&add, |_| false)).unwrap();
    let store = Store::open(&file(folder.path(), "b"), None, Limits::default()).unwrap();
    let renamed = shared.update(|vocabulary| vocabulary.absorb(store.project())).unwrap();
    assert_eq!(renamed, []);
}

#[test]
fn steps_before_a_label_got_another_name_can_be_undone() {
    let folder = clips(&[("a", &["car"])]);
    let mut store = Store::open(&file(folder.path(), "a"), None, Limits::default()).unwrap();
    store.apply(vec![Edit::DeleteTarget { target: 1 }]).unwrap();
    let mut labels = store.project().labels.clone();
    labels[1].name = "van".into();
    store.set_labels(&labels, &[("car".into(), "van".into())]);
    assert_eq!(store.history().labels(false), ["van"]);
    store.step(false).unwrap().unwrap();
    assert_eq!(store.project().targets[0].label, "van");
}

#[test]
fn a_file_of_labels_that_is_wrong_is_an_error_that_names_it() {
    let folder = clips(&[("a", &["car"])]);
    let label = r##"{"name": "car", "colour": "#000000"}"##;
    let cases = [
        ("{}".to_owned(), "missing field"),
        (r#"{"format": "x", "version": 1, "labels": []}"#.to_owned(), "`format` is not"),
        (r#"{"format": "patchlock-labels", "version": 7, "labels": []}"#.to_owned(), "version 7"),
        (
            format!(
                r#"{{"format": "patchlock-labels", "version": 1, "labels": [{label}, {label}]}}"#
            ),
            "appears twice",
        ),
    ];
    for (text, reason) in cases {
        fs::write(folder.path().join(LABELS_FILE), text).unwrap();
        let error = of_folder(folder.path()).unwrap_err();
        assert!(matches!(error, Error::Labels { .. }), "{error}");
        let error = error.to_string();
        assert!(error.contains(LABELS_FILE) && error.contains(reason), "{error}");
    }
}

/// The classes of the boxes by format: `(class, name)` of each clip's first frame.
#[test]
fn classes_agree_in_all_formats_and_clips() {
    let folder = clips(&[("a", &["person"]), ("b", &["car"]), ("c", &["car", "person"])]);
    let (out, written) = exported(folder.path(), format_named("yolo"), None);
    let counts = &written.written;
    assert_eq!((counts.boxes.boxes, counts.targets, written.train.len()), (8, 4, 3));
    // The label with which each project begins is none of the classes: nothing has it.
    let yaml = text(&out, "data.yaml");
    assert!(yaml.contains("nc: 2\nnames:\n  0: \"person\"\n  1: \"car\"\n"), "{yaml}");
    assert!(!yaml.contains("path:") && yaml.contains("val: images/train"), "{yaml}");
    let classes = |name: &str| {
        let text = text(&out, &format!("labels/train/{name}_0000.txt"));
        text.lines().map(|line| line.split(' ').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!([classes("a"), classes("b"), classes("c")], [vec!["0"], vec!["1"], vec!["1", "0"]]);
    assert!(out.path().join("set/images/train/c_0001.bmp").is_file());

    let (out, _) = exported(folder.path(), format_named("coco"), None);
    let coco: Value =
        serde_json::from_str(&text(&out, "annotations/instances_train.json")).unwrap();
    let ids: BTreeMap<&str, u64> = (coco["categories"].as_array().unwrap().iter())
        .map(|category| (category["name"].as_str().unwrap(), category["id"].as_u64().unwrap()))
        .collect();
    assert_eq!(ids, BTreeMap::from([("person", 1), ("car", 2)]));
    let list = |name: &str| coco[name].as_array().unwrap().len();
    assert_eq!((list("videos"), list("images"), list("annotations"), list("tracks")), (3, 6, 8, 4));
    for (name, count) in [("images", 6), ("annotations", 8), ("tracks", 4)] {
        let mut ids: Vec<u64> =
            coco[name].as_array().unwrap().iter().map(|it| it["id"].as_u64().unwrap()).collect();
        ids.dedup();
        assert_eq!(ids.len(), count, "{name}");
    }
    for image in coco["images"].as_array().unwrap() {
        let name = image["file_name"].as_str().unwrap();
        assert!(out.path().join("set/images/train").join(name).is_file(), "{name}");
    }

    let (out, _) = exported(folder.path(), format_named("voc"), None);
    let map = text(&out, "labelmap.txt");
    assert!(map.contains("\nperson:::\ncar:::\n"), "{map}");
    let (out, _) = exported(folder.path(), format_named("cvat"), None);
    let xml = text(&out, "b.xml");
    let at = |name: &str| xml.find(&format!("<name>{name}</name>")).unwrap();
    assert!(at("person") < at("car"), "{xml}");
}

#[test]
fn every_format_writes_all_clips_in_two_parts() {
    let folder = clips(&[("a", &["car"]), ("b", &["car"]), ("c", &["car"])]);
    let val = Val::Clips(vec!["b.mp4".into()]);
    let expected: [(Format, &[&str]); 8] = [
        (format_named("mot"), &["train/a.txt", "val/b.txt"]),
        (format_named("coco"), &["annotations/instances_val.json", "images/val/b_0000.bmp"]),
        (format_named("cvat"), &["train/c.xml", "val/b.xml"]),
        (format_named("yolo"), &["images/val/b_0000.bmp", "labels/train/a_0001.txt"]),
        (format_named("voc"), &["ImageSets/Main/val.txt", "Annotations/c_0000.xml"]),
        (format_named("label-studio"), &["train/a.json", "val/b.json"]),
        (format_named("lasot"), &["val/car/car-b_1/groundtruth.txt", "train/car/car-a_1/img"]),
        (format_named("got10k"), &["train/list.txt", "val/b_000001/groundtruth.txt"]),
    ];
    for (format, files) in expected {
        let (out, written) = exported(folder.path(), format, Some(&val));
        assert_eq!(
            (written.train.as_slice(), written.val.as_slice()),
            (["a".to_owned(), "c".to_owned()].as_slice(), ["b".to_owned()].as_slice(),)
        );
        for file in files {
            assert!(out.path().join("set").join(file).exists(), "{}: {file}", format.name);
        }
    }
    let (out, written) = exported(folder.path(), format_named("got10k"), Some(&val));
    assert!(written.written.notes.is_empty(), "{:?}", written.written.notes);
    assert_eq!(text(&out, "train/list.txt"), "a_000001\nc_000001\n");
    let (out, _) = exported(folder.path(), format_named("voc"), Some(&val));
    assert_eq!(text(&out, "ImageSets/Main/val.txt"), "b_0000\nb_0001\n");
    assert_eq!(text(&out, "ImageSets/Main/trainval.txt").lines().count(), 6);
}

#[test]
fn labels_that_are_missing_in_a_part_are_named() {
    let folder = clips(&[("a", &["car", "bus"]), ("b", &["car", "dog"]), ("c", &["cat", "bus"])]);
    let val = Val::Clips(vec!["b".into()]);
    for format in ["yolo", "coco"] {
        let (_, written) = exported(folder.path(), format_named(format), Some(&val));
        let says = |part: &str, labels: &str| {
            format!(
                "no clip in {part} has a target of these labels: {labels}; choose the clips for validation \
                 by their names"
            )
        };
        assert_eq!(written.written.notes, [says("train", "dog"), says("val", "bus, cat")]);
        let (_, written) = exported(folder.path(), format_named(format), None);
        assert!(written.written.notes.is_empty());
    }
}

/// The attributes of a label are in the file of each clip, and boxes, labels and values come back.
#[test]
fn all_clips_in_cvat_can_be_imported() {
    let folder = clips(&[("a", &["car"]), ("b", &["person", "car"]), ("c", &["person"])]);
    let (all, _) = of_folder(folder.path()).unwrap();
    let mut a = Store::open(&file(folder.path(), "a"), None, Limits::default()).unwrap();
    let kind = Kind::Select { values: vec!["off".into(), "on".into()] };
    let light = Attribute { name: "light".into(), kind, default: "off".into(), mutable: true };
    let (name, value) = ("light".to_owned(), Some("on".to_owned()));
    a.apply(vec![
        Edit::Declare { label: "car".into(), attributes: vec![light.clone()] },
        Edit::SetValue { target: 1, name, frame: Some(1), value },
    ])
    .unwrap();
    a.save().unwrap();
    drop(a);
    let (out, _) = exported(folder.path(), format_named("cvat"), None);
    for clip in all {
        let xml = text(&out, &format!("{}.xml", clip.name));
        let imported =
            import::read(import::Format::Cvat, xml.as_bytes(), &clip.project, &[]).unwrap();
        let has_car = clip.name != "c";
        let declared = imported.declared.get("car").map(Vec::as_slice);
        assert_eq!(declared, has_car.then_some(&[light.clone()][..]), "{}", clip.name);
        assert_eq!(imported.targets.len(), clip.project.targets.len());
        for (read, target) in imported.targets.iter().zip(&clip.project.targets) {
            assert_eq!((&read.label, &read.keys), (&target.label, &target.keys));
        }
        let values = [0, 1].map(|frame| imported.targets[0].value(&light, frame).to_owned());
        let last = if clip.name == "a" { "on" } else { "off" };
        assert_eq!(values, ["off", last], "{}", clip.name);
    }
}

#[test]
fn a_share_of_clips_is_the_same_each_time_and_in_any_order() {
    let names: Vec<String> = (0..20).map(|k| format!("clip{k}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let chosen = |names: &[&str], share| {
        let parts = split(names, share).unwrap();
        let mut chosen: Vec<String> = names
            .iter()
            .zip(parts)
            .filter(|(_, part)| *part == Part::Val)
            .map(|(name, _)| (*name).to_owned())
            .collect();
        chosen.sort();
        chosen
    };
    let five = chosen(&names, 0.25);
    assert_eq!(five.len(), 5);
    let reversed: Vec<&str> = names.iter().rev().copied().collect();
    assert_eq!(chosen(&reversed, 0.25), five);
    // They are not simply the first ones, and a larger share has them, too.
    assert_ne!(five, ["clip0", "clip1", "clip10", "clip11", "clip12"]);
    let ten = chosen(&names, 0.5);
    assert!(ten.len() == 10 && five.iter().all(|name| ten.contains(name)));
    assert_eq!(chosen(&names[..2], 0.01).len(), 1);
    for (names, share, reason) in [
        (&names[..], 1.0, "above 0 and below 1"),
        (&names[..], f64::NAN, "above 0 and below 1"),
        (&names[..1], 0.5, "both parts need a clip"),
    ] {
        let error = split(names, share).unwrap_err().to_string();
        assert!(error.contains(reason), "{error}");
    }
}

/// They are what each clip gives by itself.
#[test]
fn all_clips_are_written_as_tables() {
    let folder = clips(&[("a", &["car"]), ("b", &[]), ("c", &["car", "bus"])]);
    let (all, labels) = of_folder(folder.path()).unwrap();
    let options = Options::new(format_named("csv"), "set");
    let table = |clip: usize| {
        let out = folder.path().join("one.csv");
        export::write(&all[clip].project, &options, &out, true).unwrap();
        fs::read_to_string(out).unwrap()
    };
    let whole = folder.path().join("whole");
    let written = write_all(&all, &labels, &options, None, &whole, &|| false).unwrap();
    let counts = &written.written;
    assert_eq!((counts.files, counts.targets, &written.empty[..]), (2, 3, &["b".to_owned()][..]));
    let read = |path: &str| fs::read_to_string(folder.path().join(path)).unwrap();
    assert_eq!([read("whole/a.csv"), read("whole/c.csv")], [table(0), table(2)]);
    assert_eq!(fs::read_dir(&whole).unwrap().count(), 2);
    let (val, out) = (Val::Clips(vec!["c".into()]), folder.path().join("parts"));
    write_all(&all, &labels, &options, Some(&val), &out, &|| false).unwrap();
    assert_eq!([read("parts/train/a.csv"), read("parts/val/c.csv")], [table(0), table(2)]);
    let again = write_all(&all, &labels, &options, None, &out, &|| false).unwrap_err();
    assert!(again.to_string().contains("already has files"), "{again}");
}

#[test]
fn what_cannot_be_one_data_set_is_refused() {
    let folder = clips(&[("a", &["car"]), ("b", &[])]);
    let (clips, labels) = of_folder(folder.path()).unwrap();
    let refused = |format, val: Option<&Val>| {
        let out = folder.path().join("set");
        let options = Options::new(format, "set");
        let error = write_all(&clips, &labels, &options, val, &out, &|| false).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    let yolo = format_named("yolo");
    // A clip without boxes is left out, so nothing would be left for one of the parts.
    assert!(refused(yolo, Some(&Val::Share(0.5))).contains("both parts need a clip"));
    let unknown = Val::Clips(vec!["z".into()]);
    assert!(refused(yolo, Some(&unknown)).contains("no clip \"z\" with boxes; the clips are a"));
    let empty = tempfile::tempdir().unwrap();
    let error = of_folder(empty.path()).unwrap_err().to_string();
    assert!(error.contains("there is no project in"), "{error}");
    assert_eq!(export::Val::named(" "), None);
}

#[cfg(unix)]
#[test]
fn a_project_outside_the_folder_is_not_read() {
    use std::os::unix::fs::symlink;
    let (folder, elsewhere) = (clips(&[("a", &["car"])]), clips(&[("b", &["cat"])]));
    let (link, target) = (file(folder.path(), "b"), file(elsewhere.path(), "b"));
    symlink(&target, &link).unwrap();
    let Err(error) = of_folder(folder.path()) else { panic!("is refused") };
    let error = error.to_string();
    let named = [link.display().to_string(), target.canonicalize().unwrap().display().to_string()];
    assert!(named.iter().all(|path| error.contains(path)), "{error}");
    // One within the folder is the same project under another name.
    fs::remove_file(&link).unwrap();
    symlink("a.patchlock.json", &link).unwrap();
    assert_eq!(of_folder(folder.path()).unwrap().0.len(), 2);
}

#[test]
fn a_video_outside_the_folder_is_not_read() {
    let folder = clips(&[("a", &["car"])]);
    let elsewhere = tempfile::tempdir().unwrap();
    write_images(&elsewhere.path().join("a"), 4);
    let file = file(folder.path(), "a");
    let text = fs::read_to_string(&file).unwrap();
    let outside = elsewhere.path().join("a").display().to_string();
    fs::write(&file, text.replace("\"path\":\"a\"", &format!("\"path\":{outside:?}"))).unwrap();
    let (clips, _) = of_folder(folder.path()).unwrap();
    assert_eq!(clips[0].video, None);
}
