//! A network in every command that tracks. Those of the user are made up: they find nothing,
//! but have the inputs, outputs and operators of the real ones.

use std::fs;
use std::path::Path;

use crate::support::benchmark::Benchmark;
use crate::support::{BOX, Bench, patchlock};
use patchlock::KNOWN_MODELS;
use patchlock_bench::bench::job::{self, Job};
use patchlock_bench::bench::plan::{Options, TrackerSpec};
use patchlock_bench::bench::schemes::Scheme;
use patchlock_bench::trax::message::Message;
use patchlock_media::Limits;
use patchlock_studio::project::Store;
use patchlock_track::ModelPaths;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;

const MADE_UP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../patchlock/tests/golden/network");
const BACKBONE: &str = "nanotrack_backbone.onnx";
const HEAD: &str = "nanotrack_head.onnx";

/// Adds the folder `nano` with two files and the file `vit.onnx`.
fn add_networks(folder: &Path) {
    fs::create_dir(folder.join("nano")).unwrap();
    for name in [BACKBONE, HEAD] {
        fs::copy(Path::new(MADE_UP).join(name), folder.join("nano").join(name)).unwrap();
    }
    fs::copy(Path::new(MADE_UP).join("vittrack.onnx"), folder.join("vit.onnx")).unwrap();
}

/// Six frames in the folder `f`, and the networks.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.images("f", 6);
    add_networks(bench.folder.path());
    bench
}

/// `patchlock ARGUMENTS ...` in the folder of the test.
fn run(bench: &Bench, arguments: &[&str]) -> assert_cmd::assert::Assert {
    patchlock().current_dir(bench.folder.path()).args(arguments).assert()
}

/// `patchlock track f --box ... ARGUMENTS`.
fn track(bench: &Bench, arguments: &[&str]) -> assert_cmd::assert::Assert {
    run(bench, &[&["track", "f", "--box", BOX], arguments].concat())
}

fn stdout(result: &assert_cmd::assert::Assert) -> String {
    String::from_utf8(result.get_output().stdout.clone()).unwrap()
}

fn summary(bench: &Bench) -> Value {
    serde_json::from_slice(&fs::read(bench.path("s.json")).unwrap()).unwrap()
}

/// The boxes of a table without the times.
fn positions(bench: &Bench, table: &str) -> Vec<String> {
    let boxes = |line: &String| line.split(',').take(5).collect::<Vec<_>>().join(",");
    bench.lines(table).iter().map(boxes).collect()
}

#[test]
fn model_says_what_files_are() {
    let bench = bench();
    let text = stdout(&run(&bench, &["model", "nano"]).success());
    for said in [
        "nano/nanotrack_backbone.onnx\n  family     NanoTrack, backbone\n",
        "18478 bytes, 54 operators",
        "`input` [1, 3, 255, 255]",
        "SHA-256    49d56b893ecf85e8cfe66f307dd0540c91ce3f5f54e95937b362f25fed10386c\n",
        "  family     NanoTrack, head\n",
        "licence    unknown to Patchlock",
        "training   unknown to Patchlock",
        "  use        --model nano\n",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
    let text = stdout(&run(&bench, &["model", "vit.onnx"]).success());
    assert!(text.contains("VitTrack, network") && text.contains("--model vit.onnx"), "{text}");
    let text = stdout(&run(&bench, &["model", &format!("nano/{HEAD}")]).success());
    assert!(text.ends_with("needs the backbone. Put both files into a folder.\n"), "{text}");
    assert!(!text.contains("--model"), "{text}");
}

#[test]
fn files_that_are_no_network_are_refused() {
    let bench = bench();
    let refused = |path: &str, code: i32, said: [&str; 2]| {
        let said = || contains(said[0]).and(contains(said[1]));
        run(&bench, &["model", path]).code(code).stderr(said());
        track(&bench, &["--preset", "network", "--model", path]).code(code).stderr(said());
    };
    refused("nowhere", 1, ["cannot read nowhere", "hint: check that the path is right"]);
    refused("f", 2, ["f holds no file *.onnx", "hint: give the folder with the model's"]);
    refused("quick.toml", 2, ["quick.toml: it is not an ONNX file", ""]);
    fs::copy(bench.path("vit.onnx"), bench.path("nano/vit.onnx")).unwrap();
    refused("nano", 2, ["nano: the files are", "hint: patchlock model --help lists"]);
    fs::write(bench.path("nano/vit.onnx"), &fs::read(bench.path("vit.onnx")).unwrap()[..999])
        .unwrap();
    refused("nano", 2, ["nano/vit.onnx", ""]);
    // What was found before the fault is printed.
    let text = stdout(&run(&bench, &["model", "nano"]).code(2));
    assert!(text.contains("NanoTrack, head"), "{text}");
}

#[test]
fn wrong_options_have_advice() {
    let bench = bench();
    let refused = |arguments: &[&str], said: [&str; 2]| {
        track(&bench, arguments).code(2).stderr(contains(said[0]).and(contains(said[1])));
    };
    let none = ["--preset", "network", "--model", "none"];
    refused(&none, ["the method network needs a network", "leave out --model none"]);
    let unused = "hint: the presets robust and network use one";
    let paper = ["--preset", "paper", "--model", "nano"];
    refused(&paper, ["network nano has no effect with the method paper", unused]);
    let none = ["--model", "none", "--runtime", "x.so"];
    refused(&none, ["runtime x.so has no effect without a network", unused]);
    let head = format!("nano/{HEAD}");
    refused(
        &["--preset", "network", "--model", &head],
        ["only the head of NanoTrack; the backbone is missing", "folder with both files"],
    );
    refused(
        &["--preset", "network", "--model", "nano", "--runtime", "x.so"],
        ["x.so failed", "hint: --runtime takes the library of onnxruntime"],
    );
    let file = |text: &str| fs::write(bench.path("n.toml"), text).unwrap();
    file("model = 3\n[network]\n");
    refused(&["--config", "n.toml"], ["n.toml: the setting `model` is 3", "it takes a word"]);
    file("model = \"nano\"\n[paper]\n");
    refused(&["--config", "n.toml"], ["network nano has no effect", unused]);
}

#[test]
fn our_own_network_is_the_default() {
    let bench = bench();
    let boxes = |arguments: &[&str]| {
        let outputs = ["--overwrite", "--save", "a.csv", "--summary", "s.json"];
        track(&bench, &[arguments, &outputs].concat()).success();
        (summary(&bench)["model"].as_str().map(str::to_owned), positions(&bench, "a.csv"))
    };
    for preset in ["robust", "network"] {
        let by_default = boxes(&["--preset", preset]);
        assert_eq!(by_default.0.as_deref(), Some("PatchNet"));
        assert_eq!(boxes(&["--preset", preset, "--model", "patchnet"]), by_default);
        fs::write(bench.path("n.toml"), "model = \"none\"\n").unwrap();
        if preset == "robust" {
            let none = boxes(&["--model", "none"]);
            assert_eq!((none.0.as_ref(), none.1 == by_default.1), (None, false));
            assert_eq!(boxes(&["--config", "n.toml"]), none);
        }
    }
    assert_eq!(boxes(&["--preset", "paper", "--set", "particles=12"]).0, None);
}

#[test]
fn track_follows_one_target_or_many() {
    let bench = bench();
    let network = ["--preset", "network", "--model", "nano"];
    let outputs = ["--save", "one.csv", "--summary", "s.json"];
    track(&bench, &[&network[..], &outputs].concat()).success();
    let one = summary(&bench);
    assert_eq!(
        (&one["method"], &one["preset"], &one["model"], &one["runtime"], &one["frames"]),
        (
            &"network".into(),
            &"network".into(),
            &"NanoTrack v3".into(),
            &"built-in".into(),
            &6.into()
        )
    );
    assert_eq!(one["model_sha256"].as_str().map(str::len), Some(64));
    // Visible shares are empty: a network has no map of patches.
    assert!(bench.lines("one.csv")[2].contains(",,"), "{:?}", bench.lines("one.csv"));

    let more = ["--box", "40,20,20,20", "--save", "two.csv", "--video", "two.mp4"];
    track(&bench, &[&network[..], &more].concat()).success();
    let first: Vec<String> = positions(&bench, "two.csv").into_iter().collect();
    let first: Vec<_> = first.iter().filter_map(|line| line.split_once(",1,")).collect();
    let alone = positions(&bench, "one.csv");
    let same = |(frame, rest): &(&str, &str)| {
        alone.iter().any(|line| line.starts_with(&format!("{frame},{rest}")))
    };
    assert!(first.len() == 6 && first.iter().all(same), "{first:?} {alone:?}");
    for threads in ["1", "2"] {
        let save = format!("threads{threads}.csv");
        let arguments = ["--threads", threads, "--save", &save];
        track(&bench, &[&network[..], &arguments].concat()).success();
        assert_eq!(positions(&bench, &save), alone);
    }
}

#[test]
fn a_settings_file_names_the_network_beside_it() {
    let bench = bench();
    fs::create_dir(bench.path("settings")).unwrap();
    let printed = stdout(&run(&bench, &["config", "--preset", "network"]).success());
    assert!(
        printed.contains("# model = \"patchnet\"") && printed.contains("[network]"),
        "{printed}"
    );
    let text = printed.replace("# model = \"patchnet\"", "model = \"../nano\"");
    fs::write(bench.path("settings/n.toml"), text).unwrap();
    let outputs = ["--summary", "s.json", "--overwrite", "--save", "a.csv"];
    let configured = ["--config", "settings/n.toml"];
    track(&bench, &[&configured[..], &outputs].concat()).success();
    assert_eq!(summary(&bench)["model"], "NanoTrack v3");
    let other = ["--model", "vit.onnx"];
    track(&bench, &[&configured[..], &other, &outputs].concat()).success();
    assert_eq!(summary(&bench)["model"], "VitTrack");
}

#[test]
fn a_project_gets_the_boxes_of_a_network() {
    let bench = bench();
    let project = ["--preset", "network", "--model", "vit.onnx", "--project", "f.patchlock.json"];
    track(&bench, &project).success();
    let store =
        Store::open_shared(&bench.path("f.patchlock.json"), None, Limits::default()).unwrap();
    assert_eq!(store.project().targets[0].tracked.len(), 5);
}

/// Another network of the same structure: its file differs.
fn other(folder: &Path) {
    let mut bytes = fs::read(folder.join("vit.onnx")).unwrap();
    // The name of the program that wrote it.
    bytes.extend(b"\x12\x01x");
    fs::write(folder.join("other.onnx"), bytes).unwrap();
}

#[test]
fn benchmarks_keep_networks_apart() {
    let benchmark = Benchmark::new(2, 5);
    let folder = benchmark.bench.folder.path();
    add_networks(folder);
    other(folder);
    let bench = |model: &str, more: &[&str]| {
        let arguments = ["bench", "data", "--out", "out", "--preset", "network", "--model", model];
        benchmark.patchlock(&[&arguments, more].concat()).assert()
    };
    bench("vit.onnx", &[]).success().stdout(contains("2 runs done"));
    let manifest = fs::read(benchmark.path("out/network/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let network = &manifest["subject"]["network"];
    assert_eq!([&network["model"], &network["runtime"]], ["VitTrack", "built-in"]);
    let run = fs::read(benchmark.path("out/network/ope/A/0.json")).unwrap();
    let run: Value = serde_json::from_slice(&run).unwrap();
    assert_eq!(run["subject"]["network"], *network);
    bench("vit.onnx", &[]).success().stdout(contains("0 runs done, 2 already done"));
    let sha256 = network["model_sha256"].as_str().unwrap();
    let differs = format!("model_sha256 is \"{sha256}\" there and");
    bench("other.onnx", &[]).code(2).stderr(contains(differs).and(contains("--name")));
    bench("other.onnx", &["--name", "other"]).success().stdout(contains("2 runs done"));
    bench("nano", &[]).code(2).stderr(contains("model is \"VitTrack\" there"));
    bench("vit.onnx", &["--cmd", "x", "--name", "y"]).code(2).stderr(contains("--model"));
}

#[test]
fn a_job_finds_its_network_again() {
    let benchmark = Benchmark::new(1, 4);
    let folder = benchmark.bench.folder.path();
    add_networks(folder);
    other(folder);
    let network = ["--preset", "network", "--model", "vit.onnx"];
    benchmark
        .patchlock(&[&["bench", "data", "--out", "whole"], &network[..]].concat())
        .assert()
        .success();
    let options = Options {
        dataset: benchmark.path("data"),
        out: benchmark.path("parts"),
        tracker: TrackerSpec::Patchlock {
            preset: "network".into(),
            config: None,
            paths: ModelPaths { model: Some(benchmark.path("vit.onnx")), runtime: None },
            name: None,
        },
        scheme: Scheme::Ope,
        seeds: 1,
        sequences: Vec::new(),
        attributes: Vec::new(),
        shard: (1, 1),
    };
    let found = job::of_bench(&options, 1, 1).unwrap();
    let message = serde_json::to_string(&found.tasks[0]).unwrap();
    let job: Job = serde_json::from_str(&message).unwrap();
    found.store.keep(&job.run(), &job.track(None).unwrap()).unwrap();
    assert_eq!(benchmark.trajectories("parts"), benchmark.trajectories("whole"));
    // Where the message arrives, the file may be missing or another one.
    let at = |model: Option<&str>| {
        let model = model.map(|name| benchmark.path(name));
        let paths = ModelPaths { model, runtime: None };
        Job { paths, ..job.clone() }.track(None).unwrap_err().to_string()
    };
    assert!(at(Some("other.onnx")).contains("the runs need the network VitTrack"));
    assert!(at(Some("none.onnx")).contains("cannot read"));
    assert!(at(None).contains("given: PatchNet"));
}

#[test]
fn the_guide_lists_the_known_files() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/networks.md");
    let page = fs::read_to_string(page).unwrap();
    for known in KNOWN_MODELS {
        let line = format!("{}  {}\n", known.sha256, known.file);
        assert!(page.contains(&line), "{line}");
        let place = known.origin.rsplit(", ").next().unwrap();
        assert!(page.contains(place) && page.contains(known.licence), "{known:?}");
    }
}

#[test]
fn trax_names_the_network() {
    let bench = bench();
    let image = |k: usize| format!("file://{}", bench.path(&format!("f/{k}.png")).display());
    let messages = [
        Message::new("initialize", &[BOX]),
        Message::new("frame", &[&image(0)]),
        Message::new("frame", &[&image(1)]),
    ];
    let mut server = patchlock();
    server.args(["trax", "--preset", "network", "--model"]).arg(bench.path("vit.onnx"));
    server.write_stdin(messages.map(|message| message.to_string()).concat());
    let text = stdout(&server.assert().success());
    assert!(text.contains("\"trax.family=VitTrack, runtime built-in\""), "{text}");
    assert_eq!(text.matches("@@TRAX:state").count(), 2, "{text}");
}
