//! Tests of `track --project`, and of `export` with a project.

use std::fs;

use crate::support::{BOX, Bench, patchlock};
use patchlock::BoundingBox;
use patchlock_media::Limits;
use patchlock_studio::project::{Edit, Project, Store};
use predicates::prelude::*;

const PROJECT: [&str; 2] = ["--project", "f.patchlock.json"];

fn project(bench: &Bench) -> Project {
    Store::open_shared(&bench.path("f.patchlock.json"), None, Limits::default())
        .unwrap()
        .project()
        .clone()
}

fn frames<V>(map: &std::collections::BTreeMap<usize, V>) -> Vec<usize> {
    map.keys().copied().collect()
}

#[test]
fn a_box_begins_a_project_and_another_adds_to_it() {
    let bench = Bench::new();
    bench.images("f", 5);
    bench.track("f").args(PROJECT).assert().success().stdout("");
    let first = project(&bench);
    let target = &first.targets[0];
    assert_eq!((first.targets.len(), target.id, target.label.as_str()), (1, 1, "target"));
    assert_eq!((frames(&target.keys), frames(&target.tracked)), (vec![0], vec![1, 2, 3, 4]));
    assert_eq!(target.keys[&0].bbox, BoundingBox { x: 20.0, y: 18.0, w: 32.0, h: 28.0 });
    // The same boxes as in a table.
    bench.track("f").args(["--save", "a.csv"]).assert().success();
    let row = &bench.lines("a.csv")[4];
    let x: f64 = row.split(',').nth(1).unwrap().parse().unwrap();
    assert!((x - target.tracked[&3].bbox.x).abs() < 1e-3);

    let table = "frame,id,x,y,w,h\n1,9,20,18,32,28\n3,9,22,18,32,28\n2,4,5,5,20,20\n";
    fs::write(bench.path("starts.csv"), table).unwrap();
    bench
        .bare("f")
        .args(["--boxes", "starts.csv", "--save", "b.csv"])
        .args(PROJECT)
        .assert()
        .success();
    let second = project(&bench);
    assert_eq!(second.targets[0], *target);
    // In the order of the ids in the table: 4, then 9.
    assert_eq!(frames(&second.targets[1].keys), [2]);
    assert_eq!(frames(&second.targets[2].keys), [1, 3]);
    assert_eq!(frames(&second.targets[2].tracked), [2, 4]);
    assert!(bench.lines("b.csv").len() > 5);
}

#[test]
fn targets_of_a_project_are_tracked_from_their_keys() {
    let bench = Bench::new();
    bench.images("f", 8);
    let mut store =
        Store::open(&bench.path("f.patchlock.json"), Some(&bench.path("f")), Limits::default())
            .unwrap();
    let bbox = BoundingBox { x: 20.0, y: 18.0, w: 32.0, h: 28.0 };
    let key = |frame| Edit::SetKey {
        target: 1,
        frame,
        bbox,
        outline: None,
        occluded: false,
        truncated: false,
    };
    let begin = Edit::AddTarget { label: "target".into(), frame: 1, bbox, outline: None };
    store.apply(vec![begin, Edit::Hide { target: 1, from: 3, to: 4 }, key(5)]).unwrap();
    store.save().unwrap();
    bench
        .bare("f")
        .args(PROJECT)
        .assert()
        .code(1)
        .stderr(predicate::str::contains("is open in another process, number"));
    drop(store);

    bench.bare("f").args(PROJECT).assert().success();
    let target = &project(&bench).targets[0];
    assert_eq!(frames(&target.tracked), [2, 6, 7]);
    assert_eq!((frames(&target.keys), target.hidden.as_slice()), (vec![1, 5], &[[3, 4]][..]));
    bench.bare("f").args(PROJECT).arg("--reverse").assert().success();
    // The run backwards adds frame 0. It does not pass the others, so their boxes stay.
    assert_eq!(frames(&project(&bench).targets[0].tracked), [0, 2, 6, 7]);
    bench
        .bare("f")
        .args(PROJECT)
        .args(["--start", "6"])
        .assert()
        .code(2)
        .stderr(predicate::str::contains("no key frame to start from"));
}

#[test]
fn wrong_projects_and_sources_are_refused() {
    let bench = Bench::new();
    bench.images("f", 3);
    bench.bare("f").assert().code(2).stderr(predicate::str::contains("--project"));
    bench.track("-").args(PROJECT).assert().code(2).stderr(predicate::str::contains(
        "--project needs a video file or a folder of images, not -",
    ));
    bench.track("f").args(PROJECT).assert().success();
    bench
        .track("f")
        .args(PROJECT)
        .args(["--save", "f.patchlock.json", "--overwrite"])
        .assert()
        .code(2);
    bench.images("g", 3);
    bench.track("g").args(PROJECT).assert().code(2).stderr(predicate::str::contains("belongs to"));
    let image = fs::read_dir(bench.path("f")).unwrap().next().unwrap().unwrap().path();
    fs::remove_file(image).unwrap();
    bench
        .track("f")
        .args(PROJECT)
        .assert()
        .code(1)
        .stderr(predicate::str::contains("the video has changed: it had"));
    fs::write(bench.path("f.patchlock.json"), "{}").unwrap();
    bench
        .track("f")
        .args(PROJECT)
        .assert()
        .code(1)
        .stderr(predicate::str::contains("not a valid project"));
}

#[test]
fn a_project_is_exported() {
    let bench = Bench::new();
    bench.images("f", 3);
    bench.track("f").args(["--box", "5,5,20,20"]).args(PROJECT).assert().success();
    let export = |args: &[&str]| {
        let mut command = patchlock();
        command
            .current_dir(bench.folder.path())
            .args(["export", "f.patchlock.json"])
            .args(args)
            .assert()
    };
    export(&["--format", "coco", "--out", "a.json"])
        .success()
        .stderr(predicate::str::contains("6 boxes of 2 targets in 1 file"));
    let coco = fs::read_to_string(bench.path("a.json")).unwrap();
    assert!(coco.contains("\"keyframe\": true") && coco.contains("\"name\": \"f\""), "{coco}");
    export(&["--format", "csv", "--out", "a.csv"]).success();
    let lines = bench.lines("a.csv");
    assert!(lines[0].starts_with("frame,id,label,x,y,w,h,") && lines.len() == 7, "{lines:?}");
    assert!(
        lines[1].starts_with(&format!("0,1,target,{}", BOX.replace(',', ".0,"))),
        "{}",
        lines[1]
    );
    // Another table format reads it.
    let mut again = patchlock();
    again
        .current_dir(bench.folder.path())
        .args(["export", "a.csv", "--format", "mot", "--out", "a.txt"]);
    again.assert().success();
    export(&["--format", "yolo", "--images", "f", "--out", "y"]).success();
    assert_eq!(fs::read_dir(bench.path("y/images/train")).unwrap().count(), 3);
    export(&["--format", "mot", "--out", "b.txt", "--label", "car"])
        .code(2)
        .stderr(predicate::str::contains("--label is not for the project"));
    export(&["--format", "yolo-obb", "--out", "b"])
        .code(2)
        .stderr(predicate::str::contains("no box has an outline"));
    export(&["--format", "cvat-obb", "--out", "b.xml"])
        .code(2)
        .stderr(predicate::str::contains("csv, mot"));
    export(&["--format", "csv", "--out", "a.csv"])
        .code(2)
        .stderr(predicate::str::contains("exists already"));
}

#[test]
fn all_projects_of_a_folder_are_one_data_set() {
    let bench = Bench::new();
    for name in ["a", "b", "c"] {
        bench.images(name, 3);
        let project = format!("{name}.patchlock.json");
        bench.track(name).args(["--project", &project]).assert().success();
    }
    let export = |args: &[&str]| {
        let mut command = patchlock();
        command.current_dir(bench.folder.path()).args(["export", "."]).args(args).assert()
    };
    let yolo = ["--all", "--format", "yolo", "--out", "set"];
    export(&yolo)
        .success()
        .stderr(predicate::str::contains("9 boxes of 3 targets in 3 clips, 19 files"));
    let yaml = fs::read_to_string(bench.path("set/data.yaml")).unwrap();
    assert!(yaml.contains("train: images/train\n") && !yaml.contains("path:"), "{yaml}");
    let coco = ["--all", "--format", "coco", "--out", "coco", "--val", "b"];
    export(&coco).success().stderr(predicate::str::contains("for validation: b"));
    let count = |part: &str| fs::read_dir(bench.path("coco/images").join(part)).unwrap().count();
    assert_eq!((count("train"), count("val")), (6, 3));
    let boxes = ["--all", "--format", "coco", "--out", "boxes", "--no-frames", "--val", "0.4"];
    export(&boxes).success();
    assert!(!bench.path("boxes/images").exists() && bench.path("boxes/annotations").exists());
    // A folder is never replaced.
    export(&yolo).code(2).stderr(predicate::str::contains("already has files"));
    export(&["--format", "yolo", "--out", "x", "--val", "b"])
        .code(2)
        .stderr(predicate::str::contains("--all"));
    let mut of_file = patchlock();
    of_file
        .current_dir(bench.folder.path())
        .args(["export", "a.patchlock.json", "--all", "--format", "yolo", "--out", "x"])
        .assert()
        .code(2)
        .stderr(predicate::str::contains("a.patchlock.json is not a folder"));
    // Only what is in the folder is read.
    let text = fs::read_to_string(bench.path("c.patchlock.json")).unwrap();
    let outside = text.replace("\"path\":\"c\"", "\"path\":\"../c\"");
    assert_ne!(text, outside);
    fs::write(bench.path("c.patchlock.json"), outside).unwrap();
    export(&["--all", "--format", "yolo", "--out", "x"])
        .code(1)
        .stderr(predicate::str::contains("the video of c, ../c, cannot be read in its folder"));
    assert!(!bench.path("x").exists());
}
