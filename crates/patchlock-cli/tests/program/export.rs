//! Tests of `patchlock export` with tables saved by `track`.

use std::fs;

use crate::support::{Bench, patchlock};
use patchlock_track::export::Format;
use predicates::prelude::*;
use predicates::str::contains;

fn export(bench: &Bench, args: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = patchlock();
    command.current_dir(bench.folder.path()).arg("export").args(args).assert()
}

#[test]
fn every_table_of_track_gives_the_same_export() {
    let bench = Bench::new();
    bench.images("f", 3);
    let saves = ["--save", "a.csv", "--save", "a.jsonl", "--save", "a.txt"];
    bench.track("f").args(saves).assert().success();
    for name in ["a.csv", "a.jsonl", "a.txt"] {
        export(&bench, &[name, "--format", "mot", "--out", &format!("{name}.mot")])
            .success()
            .stdout("")
            .stderr(predicate::str::contains("3 boxes of 1 target in 1 file"));
    }
    let lines = bench.lines("a.csv.mot");
    assert!(lines[0].starts_with("1,1,21.0000,19.0000,32.0000,28.0000,"), "{}", lines[0]);
    assert_eq!(lines, bench.lines("a.jsonl.mot"));
    // The text file has no scores, but is equal otherwise.
    let boxes = |name: &str| -> Vec<String> {
        let line = |line: String| line.split(',').take(6).collect::<Vec<_>>().join(",");
        bench.lines(name).into_iter().map(line).collect()
    };
    assert_eq!(boxes("a.txt.mot"), boxes("a.csv.mot"));
}

#[test]
fn lost_frames_of_a_table_are_marked() {
    let bench = Bench::new();
    let table = "frame,x,y,w,h,score,status\n0,10,5,20,10,1,tracked\n1,,,,,0.1,lost\n\
                 2,12,5,20,10,1,tracked\n";
    std::fs::write(bench.path("a.csv"), table).unwrap();
    let args = ["a.csv", "--format", "cvat", "--size", "96x72", "--out", "a.xml"];
    export(&bench, &args).success().stderr(predicate::str::contains("2 boxes of 1 target"));
    let outside = |line: &String| line.contains("outside=\"1\"");
    let lines = bench.lines("a.xml");
    let marked: Vec<_> = lines.iter().filter(|line| outside(line)).collect();
    assert!(marked.len() == 1 && marked[0].contains("frame=\"1\""), "{marked:?}");
}

#[test]
fn the_number_of_frames_is_that_of_the_images() {
    let bench = Bench::new();
    bench.images("f", 4);
    fs::write(bench.path("a.csv"), "frame,x,y,w,h\n0,10,5,20,10\n2,12,5,20,10\n").unwrap();
    let cvat = ["a.csv", "--format", "cvat", "--overwrite"];
    export(&bench, &[&cvat[..], &["--size", "96x72", "--out", "a.xml"]].concat()).success();
    export(&bench, &[&cvat[..], &["--images", "f", "--out", "b.xml"]].concat()).success();
    for (name, frames, outside) in [("a.xml", 3, &[1][..]), ("b.xml", 4, &[1, 3])] {
        let lines = bench.lines(name);
        assert!(
            lines.iter().any(|line| line.contains(&format!("<size>{frames}</size>"))),
            "{name}"
        );
        let marked: Vec<_> = lines.iter().filter(|line| line.contains("outside=\"1\"")).collect();
        assert_eq!(marked.len(), outside.len(), "{name}: {marked:?}");
        let is_in = |(line, frame): (&&String, &i32)| line.contains(&format!("frame=\"{frame}\""));
        assert!(marked.iter().zip(outside).all(is_in), "{name}: {marked:?}");
    }
}

#[test]
fn every_format_is_written() {
    let bench = Bench::new();
    bench.images("f", 2);
    bench.track("f").args(["--save", "a.csv"]).assert().success();
    for format in Format::all(false) {
        let (name, out) = (format.name, format!("out.{}", format.name));
        let mut args = vec!["a.csv", "--format", name, "--out", &out, "--label", "card"];
        // The size of the frames is in the table.
        if format.holds_frames() {
            args.extend(["--images", "f"]);
        }
        export(&bench, &args).success();
        assert_eq!(bench.path(&out).is_file(), format.is_file(), "{name}");
        // An existing file, or a folder that is not empty, is not replaced.
        export(&bench, &args).code(2).stderr(predicate::str::contains("already"));
    }
    export(&bench, &["a.csv", "--format", "mot", "--out", "out.mot", "--overwrite"]).success();
    assert!(bench.path("out.yolo/images/train/1.png").is_file());
    assert!(bench.path("out.lasot/card/card-1/img/00000002.jpg").is_file());
    assert!(bench.path("out.got10k/a_000001/groundtruth.txt").is_file());
}

#[test]
fn errors_name_their_cause() {
    let bench = Bench::new();
    bench.images("f", 2);
    bench.track("f").args(["--save", "a.csv"]).assert().success();
    std::fs::write(bench.path("b.txt"), "1,2,3,4\n").unwrap();
    let cases: [(&[&str], i32, &str); 8] = [
        (
            &["a.csv", "--format", "csv", "--out", "x"],
            2,
            "there is no format \"csv\"; the formats are mot, ",
        ),
        (&["b.txt", "--format", "coco", "--out", "x"], 2, "needs the frame size"),
        (
            &["a.csv", "--format", "coco", "--out", "x", "--size", "4x3"],
            2,
            "the size as given is 4 x 3, but in the file of the track it is 96 x 72",
        ),
        (&["a.csv", "--format", "mot", "--out", "x", "--key-frames", "5"], 2, "no key frames"),
        (&["a.csv", "--format", "coco", "--out", "x", "--size", "4by3"], 2, "4by3 is not a size"),
        (&["a.xls", "--format", "mot", "--out", "x"], 2, ".csv, .jsonl or .txt"),
        (&["no.csv", "--format", "mot", "--out", "x"], 1, "cannot read no.csv"),
        (&["a.csv", "--format", "mot", "--out", "no/x"], 2, "there is no folder no"),
    ];
    for (args, code, words) in cases {
        export(&bench, args)
            .code(code)
            .stderr(predicate::str::contains(words).and(predicate::str::contains("hint: ")));
    }
    assert!(!bench.path("x").exists());
}

#[test]
fn large_images_need_the_option() {
    let bench = Bench::new();
    bench.images("f", 2);
    bench.mp4("v.mp4", 2);
    fs::write(bench.path("a.csv"), "frame,x,y,w,h\n0,1,2,3,4\n1,1,2,3,4\n").unwrap();
    for images in ["f", "v.mp4"] {
        let run = |most: &str, out: &str| {
            let lasot = ["a.csv", "--format", "lasot", "--images", images, "--out", out];
            export(&bench, &[&lasot[..], &["--max-pixels", most]].concat())
        };
        run("6911", "small").code(1).stderr(contains("pixels are more than the 6911"));
        assert!(!bench.path("small").exists());
        run("7680", &format!("{images}.out")).success();
    }
}

#[test]
fn a_huge_frame_number_is_an_error_with_its_line() {
    let bench = Bench::new();
    fs::write(bench.path("a.csv"), "frame,x,y,w,h\n0,1,2,3,4\n18446744073709551615,1,2,3,4\n")
        .unwrap();
    for format in Format::all(false) {
        let args = ["a.csv", "--format", format.name, "--size", "9x9", "--out", "out"];
        let expected = "a.csv, line 3: 18446744073709551615 is not a frame number";
        export(&bench, &args).code(1).stderr(contains(expected));
        assert!(!bench.path("out").exists());
    }
}

#[test]
fn what_is_left_out_or_doubtful_is_counted() {
    let bench = Bench::new();
    let rows = "frame,x,y,w,h,score,status,frame_w,frame_h\n0,1,1,9,9,0.9,tracked,96,72\n\
                1,1,1,9,9,0.3,lost,96,72\n2,1,1,9,9,0.6,uncertain,96,72\n3,1,1,9,9,0.7,tracked,96,72\n";
    fs::write(bench.path("t.csv"), rows).unwrap();
    let said = |format: &str, more: &[&str], out: &str, said: &'static str| {
        let args = ["t.csv", "--format", format, "--out", out];
        export(&bench, &[&args, more].concat()).success().stderr(predicate::str::contains(said));
    };
    let two = "2 boxes of 1 target in 3 files\nleft out 2 of 4 boxes: 1 uncertain, 1 lost\n";
    said("yolo", &[], "a", two);
    said("coco", &[], "b", "left out 2 of 4 boxes: 1 uncertain, 1 lost\n");
    said("mot", &[], "c", "in 1 file\ndoubtful among the 4 boxes written: 1 uncertain, 1 lost\n");
    let chosen = ["--status", "tracked,uncertain", "--min-score", "0.65", "--every", "3"];
    said("yolo", &chosen, "d", "left out 2 of 4 boxes: 2 in the frames between\n");
    said("mot", &["--min-score", "0.65"], "e", "left out 2 of 4 boxes: 2 with a lower score\n");
    let refused = |more: &[&str], words: &'static str| {
        let args = ["t.csv", "--format", "yolo", "--out", "x"];
        export(&bench, &[&args, more].concat()).code(2).stderr(predicate::str::contains(words));
    };
    refused(
        &["--status", "gone"],
        "there is no status \"gone\"; allowed: tracked, uncertain, lost",
    );
    refused(&["--min-score", "7"], "the least score is 7; allowed: 0 to 1");
    refused(&["--every", "0"], "every 0th frame cannot be written");
    refused(&["--status", "uncertain", "--min-score", "0.9"], "no box is to be written");
}

#[test]
fn images_of_another_video_than_that_of_the_project_are_a_warning() {
    let bench = Bench::new();
    bench.mp4("v.mp4", 4);
    bench.mp4("other.mp4", 5);
    bench.track("v.mp4").args(["--project", "p.json"]).assert().success();
    fs::copy(bench.path("v.mp4"), bench.path("copy.mp4")).unwrap();
    bench.images("f", 4);
    let run = |images: &str| {
        let out = format!("{images}.xml");
        let args = ["p.json", "--format", "cvat", "--images", images, "--out", &out];
        export(&bench, &args).success()
    };
    let words = "warning: other.mp4 is not the video of";
    run("other.mp4").stderr(contains(words).and(contains("v.mp4: check that the boxes fit")));
    for same in ["v.mp4", "copy.mp4", "f"] {
        run(same).stderr(contains("warning").not());
    }
}
