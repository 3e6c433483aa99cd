//! Tests of `patchlock trax`, with our own client and message by message.

use std::fs;

use crate::support::benchmark::Benchmark;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use patchlock_bench::trax::message::Message;
use patchlock_bench::trax::region::Region;
use predicates::prelude::*;
use predicates::str::contains;

/// The box in the first frame of the film.
const BOX: &str = "20,18,32,28";

/// A benchmark of one target.
struct Session(Benchmark);

impl Session {
    fn new() -> Self {
        Self(Benchmark::new(1, 5))
    }

    /// A frame of the film as an argument of a message.
    fn image(&self, k: usize) -> String {
        format!("file://{}", self.0.path(&format!("data/A/img/{k}.png")).display())
    }

    fn server(&self, protocol: u32, messages: &[Message]) -> assert_cmd::Command {
        let protocol = protocol.to_string();
        let mut command =
            self.0.patchlock(&["trax", "--config", "quick.toml", "--protocol", &protocol]);
        command.write_stdin(messages.iter().map(Message::to_string).collect::<String>());
        command
    }

    /// The answers after the greeting; the server must not fail.
    fn answers(&self, protocol: u32, messages: &[Message]) -> Vec<Message> {
        let assert = self.server(protocol, messages).assert().success().stderr("");
        let text = String::from_utf8(assert.get_output().stdout.clone()).unwrap();
        let all: Vec<Message> =
            text.lines().map(|line| Message::parse(line).unwrap().unwrap()).collect();
        assert_eq!(all[0].name, "hello");
        all[1..].to_vec()
    }

    /// The states of a target that starts on this region, through the whole film.
    fn track(&self, region: &str) -> Vec<Message> {
        let begin = Message::new("initialize", &[&self.image(0), region]);
        let frames = (1..5).map(|k| frame(&self.image(k)));
        self.answers(3, &[begin].into_iter().chain(frames).collect::<Vec<_>>())
    }
}

fn initialize(region: &str) -> Message {
    Message::new("initialize", &[region])
}

fn frame(image: &str) -> Message {
    Message::new("frame", &[image])
}

fn region(state: &Message) -> Region {
    assert_eq!((state.name.as_str(), state.arguments.len()), ("state", 1), "{state}");
    Region::parse(&state.arguments[0]).unwrap()
}

#[test]
fn bench_gets_the_same_boxes_with_and_without_trax() {
    let benchmark = Benchmark::new(2, 6);
    benchmark.bench("out", &["--seeds", "2", "--name", "own"]).assert().success();
    let program = assert_cmd::cargo::cargo_bin("patchlock");
    for protocol in ["3", "4"] {
        let command =
            format!("'{}' trax --config quick.toml --protocol {protocol}", program.display());
        benchmark
            .patchlock(&["bench", "data", "--out", "out", "--seeds", "2"])
            .args(["--name", protocol, "--cmd", &command])
            .assert()
            .success();
    }
    let boxes = benchmark.trajectories("out");
    let of = |name: &str| -> Vec<&String> {
        let runs = boxes.iter().filter(|(path, _)| path.split('/').next() == Some(name));
        runs.map(|(_, boxes)| boxes).collect()
    };
    assert_eq!(of("own").len(), 4);
    assert_ne!(of("own")[0], of("own")[1], "the seed matters");
    assert_eq!(of("own"), of("3"));
    assert_eq!(of("own"), of("4"));
}

#[test]
fn the_greeting_names_the_family_of_the_method() {
    let robust = "correlation filters, PatchNet, runtime built-in";
    for (preset, family) in [("robust", robust), ("paper", "sparse appearance")] {
        let mut server = crate::support::patchlock();
        let output = server.args(["trax", "--preset", preset]).write_stdin("").output().unwrap();
        let hello = Message::parse(&String::from_utf8(output.stdout).unwrap()).unwrap().unwrap();
        assert_eq!(hello.get("trax.family"), Some(family), "{preset}");
    }
}

#[test]
fn the_greeting_lists_what_is_supported() {
    let session = Session::new();
    for (protocol, many) in [(3, None), (4, Some("1"))] {
        let output = session.server(protocol, &[]).assert().success().get_output().stdout.clone();
        let hello = Message::parse(&String::from_utf8(output).unwrap()).unwrap().unwrap();
        let get = |key: &str| hello.get(key);
        assert_eq!((hello.name.as_str(), get("trax.name")), ("hello", Some("Patchlock")));
        assert_eq!(get("trax.version"), Some(protocol.to_string().as_str()));
        assert_eq!(get("trax.identifier"), Some("patchlock"));
        assert!(get("trax.description").is_some_and(|text| text.contains("tracker")));
        assert_eq!(get("trax.image"), Some("path;memory;buffer;"));
        assert_eq!(get("trax.region"), Some("rectangle;polygon;"));
        assert_eq!((get("trax.channels"), get("trax.multiobject")), (Some("color;"), many));
    }
}

#[test]
fn targets_are_reported_in_the_form_in_which_they_were_given() {
    let session = Session::new();
    let boxes = session.track(BOX);
    // A polygon with the same bounding box.
    let given = "36,18,52,32,36,46,20,32";
    let polygons = session.track(given);
    assert_eq!((boxes.len(), polygons.len()), (5, 5));
    assert_eq!(boxes[0].arguments, [BOX]);
    assert_eq!(polygons[0].arguments, [given]);
    for (in_box, in_polygon) in boxes.iter().zip(&polygons).skip(1) {
        assert!(matches!(region(in_box), Region::Rectangle(_)), "{in_box}");
        let Region::Polygon(corners) = region(in_polygon) else { panic!("{in_polygon}") };
        assert_eq!(corners.len(), 4);
        assert_eq!(in_box.named, in_polygon.named, "the track is the same");
        assert_eq!(in_polygon.get("region"), Some(in_polygon.arguments[0].as_str()));
        // The outline and the box have the same centre.
        let bbox = region(in_box).bbox().unwrap();
        let middle = |axis: usize| corners.iter().map(|point| point[axis]).sum::<f64>() / 4.0;
        assert!((middle(0) - (bbox.x + bbox.w / 2.0)).abs() < 1e-9, "{in_box} {in_polygon}");
        assert!((middle(1) - (bbox.y + bbox.h / 2.0)).abs() < 1e-9, "{in_box} {in_polygon}");
        let confidence: f64 = in_box.get("confidence").unwrap().parse().unwrap();
        assert!((0.0..=1.0).contains(&confidence));
        assert_eq!(in_box.get("status"), Some("tracked"));
    }
}

/// With this setting the paper's tracker is never certain.
#[test]
fn the_status_is_a_property_in_both_protocols() {
    let session = Session::new();
    fs::write(session.0.path("quick.toml"), "delta = 1.0\n[paper]\nparticles = 12\n").unwrap();
    let statuses = |states: Vec<Message>| -> Vec<String> {
        states.iter().map(|state| state.get("status").unwrap().to_string()).collect()
    };
    assert_eq!(statuses(session.track(BOX)), ["uncertain"; 5]);
    let messages = [initialize(BOX), initialize("30,24,20,18"), frame(&session.image(0))];
    assert_eq!(statuses(session.answers(4, &messages)), ["uncertain"; 2]);
}

#[test]
fn a_client_may_restart_at_any_time() {
    let session = Session::new();
    let (first, second) = (session.image(0), session.image(1));
    let begin = || Message::new("initialize", &[&first, BOX]);
    let three = session.answers(3, &[begin(), frame(&second), begin(), frame(&second)]);
    assert_eq!(three.len(), 4);
    assert_eq!(three[..2], three[2..]);
    let clear = Message::new("initialize", &[]);
    let begin = || [initialize(BOX), frame(&first), frame(&second)];
    let messages: Vec<_> = begin()
        .into_iter()
        .chain([clear])
        .chain(begin())
        .chain([Message::new("quit", &[])])
        .collect();
    assert_eq!(session.answers(4, &messages), three);
}

#[test]
fn many_targets_give_the_tracks_of_single_runs() {
    let session = Session::new();
    let other = "10,10,24,20";
    let (alone, beside) = (session.track(BOX), session.track(other));
    let images: Vec<Message> = (0..5).map(|k| frame(&session.image(k))).collect();
    let mut messages = vec![initialize(BOX), initialize(other)];
    messages.extend_from_slice(&images);
    let both = session.answers(4, &messages);
    let expected: Vec<_> =
        alone.iter().zip(&beside).flat_map(|(a, b)| [a.clone(), b.clone()]).collect();
    assert_eq!(both, expected);
    // The second target is added later.
    let late = [
        initialize(BOX),
        images[0].clone(),
        initialize(other),
        images[0].clone(),
        images[1].clone(),
    ];
    let states = session.answers(4, &late);
    assert_eq!(states.len(), 1 + 2 + 2);
    assert_eq!((&states[2], &states[4]), (&beside[0], &beside[1]));
}

#[test]
fn images_may_be_sent_as_pixels_or_files() {
    let session = Session::new();
    let expected = session.track(BOX);
    let bytes = |k: usize| fs::read(session.0.path(&format!("data/A/img/{k}.png"))).unwrap();
    let buffer = |k: usize| format!("data:image/png;{}", BASE64_STANDARD.encode(bytes(k)));
    let memory = |k: usize| {
        let (width, height) = (crate::support::WIDTH, crate::support::HEIGHT);
        let data = BASE64_STANDARD.encode(crate::support::film(k, width, height));
        format!("image:{width};{height};rgb;{data}")
    };
    for image in [&buffer as &dyn Fn(usize) -> String, &memory] {
        let begin = Message::new("initialize", &[&image(0), BOX]);
        let messages: Vec<_> =
            [begin].into_iter().chain((1..5).map(|k| frame(&image(k)))).collect();
        assert_eq!(session.answers(3, &messages), expected);
    }
}

#[test]
fn errors_reach_the_client_and_standard_error() {
    let session = Session::new();
    let image = session.image(0);
    let begin = |region: &str| Message::new("initialize", &[&image, region]);
    let missing = Message::new("initialize", &["file:///no/such.png", BOX]);
    for (messages, why) in [
        (vec![frame(&image)], "there is no target yet: send initialize before frame"),
        (vec![missing], "cannot read the image /no/such.png"),
        (vec![begin("500,500,10,10")], "lies outside the frame of 96x72 pixels"),
        (vec![begin("1,1,0,5")], "width and height at least 1 pixel"),
        (vec![begin("1,1,5")], "the region \"1,1,5\": 3 numbers"),
        (vec![begin(BOX), frame("image:1;1;rgb;AQID")], "frames of one size"),
        (vec![begin(BOX), Message::new("hello", &[])], "the message hello is unknown"),
    ] {
        let answer = session
            .server(3, &messages)
            .assert()
            .code(1)
            .stderr(contains(why))
            .get_output()
            .stdout
            .clone();
        let text = String::from_utf8(answer).unwrap();
        let last = Message::parse(text.lines().last().unwrap()).unwrap().unwrap();
        assert_eq!(last.name, "quit", "{text}");
        assert!(last.get("trax.reason").is_some_and(|reason| reason.contains(why)), "{text}");
        assert_eq!(text.lines().count(), 1 + messages.len(), "hello, an answer each, quit last");
    }
    let server = |arguments: &[&str]| session.0.patchlock(arguments).assert().code(2).stdout("");
    server(&["trax", "--protocol", "2"]).stderr(contains("must be 3 or 4"));
    server(&["trax", "--preset", "none"]).stderr(contains("unknown preset none"));
    server(&["trax", "--threads", "0"])
        .stderr(contains("'0' for '--threads <1..=1024>': 0 is not in 1..=1024"));
    session
        .0
        .patchlock(&["trax"])
        .env("PATCHLOCK_SEED", "x")
        .assert()
        .code(2)
        .stderr(contains("--seed").and(contains("x")));
}
