//! Undo and redo while tracking runs, waits or has ended, and the queue of jobs.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::{Value, json};

use crate::support::{FRAMES, TestServer};

/// Makes an edit, as the page does: again if tracking has ended in between. Returns the revision.
fn edit(server: &TestServer, edit: &Value) -> Value {
    loop {
        let revision = server.clip()["revision"].clone();
        let edits = json!({ "revision": revision, "edits": [edit] });
        let answer = server.post("/api/clips/1/edits", &edits);
        if answer.status != 409 {
            assert_eq!(answer.status, 200, "{}", answer.text());
            return answer.json()["revision"].clone();
        }
    }
}

/// Corrects a frame, and tracks what follows from it. Returns the revision of the correction.
fn correct(server: &TestServer, target: u64, frame: usize) -> Value {
    let bbox = server.truth[frame];
    let set = json!({ "edit": "set_key", "target": target, "frame": frame, "box": bbox });
    let since = edit(server, &set);
    let request = json!({ "target": target, "around": frame, "since": since });
    // Between two neighbours there is nothing to track.
    assert!([200, 400].contains(&server.post("/api/clips/1/track", &request).status));
    since
}

fn step(server: &TestServer, verb: &str) -> Value {
    let answer = server.post(&format!("/api/clips/1/{verb}"), &json!({}));
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.json()["text"].clone()
}

/// The targets, and whether the clip is done.
fn content(clip: &Value) -> [Value; 2] {
    [clip["project"]["targets"].clone(), clip["project"]["done"].clone()]
}

/// The key frames of each target.
fn keys(clip: &Value) -> BTreeMap<u64, Vec<usize>> {
    let targets = clip["project"]["targets"].as_array().expect("a list").iter();
    let of = |target: &Value| {
        let keys = target["keys"].as_object().expect("an object").keys();
        let mut keys: Vec<usize> = keys.map(|key| key.parse().expect("a frame")).collect();
        keys.sort_unstable();
        (target["id"].as_u64().expect("an id"), keys)
    };
    targets.map(of).collect()
}

#[test]
fn a_correction_is_taken_back_with_the_tracking_that_runs() {
    let server = TestServer::new();
    server.add_target(0);
    let before = server.clip();
    correct(&server, 1, 20);
    let text = step(&server, "undo");
    assert!(text.as_str().expect("a text").starts_with("correct target 1 in frame 20"), "{text}");
    let after = server.clip();
    assert!(after["job"].is_null() && content(&after) == content(&before), "{after}");
    // It is done again with what had been tracked, and is one step then, too.
    let again = step(&server, "redo");
    assert_eq!(keys(&server.clip())[&1], [0, 20]);
    assert_eq!(step(&server, "undo"), again);
    assert_eq!(content(&server.clip()), content(&before));
    // What follows from a change that was undone is not tracked.
    let since = correct(&server, 1, 30);
    step(&server, "undo");
    let request = json!({ "target": 1, "around": 0, "since": since });
    assert_eq!(server.post("/api/clips/1/track", &request).json()["job"], Value::Null);
}

#[test]
fn a_change_of_another_target_leaves_tracking_alone() {
    let server = TestServer::new();
    server.add_target(0);
    server.add_target(0);
    let since = correct(&server, 1, FRAMES - 1);
    edit(&server, &json!({ "edit": "set_done", "done": true }));
    assert_eq!(step(&server, "undo"), "mark the clip as done");
    let clip = server.wait();
    let tracked = clip["project"]["targets"][0]["tracked"].as_object().expect("an object");
    assert_eq!(tracked.len(), FRAMES - 2);
    assert!(since.is_u64() && clip["redo"] == "mark the clip as done", "{}", clip["redo"]);
    assert!(clip["undo"].as_str().expect("a text").contains("and track target 1 in 38 frames"));
}

#[test]
fn the_queue_says_who_waits_and_who_was_dropped() {
    let server = TestServer::new();
    for _ in 0..3 {
        server.add_target(0);
    }
    for target in 1..=3 {
        let request = json!({ "target": target, "from": 0, "direction": "forward" });
        assert_eq!(server.post("/api/clips/1/track", &request).status, 200);
    }
    let suggestions = server.get("/api/clips/1/doubts").json();
    let untracked = |suggestions: &Value| {
        let suggestions = suggestions["doubts"].as_array().expect("a list").iter();
        suggestions
            .filter(|it| it["untracked"] == true)
            .map(|it| it["target"].clone())
            .collect::<Vec<_>>()
    };
    // Those that wait will be tracked.
    assert_eq!(untracked(&suggestions), [] as [Value; 0]);
    let stopped = server.post("/api/clips/1/stop", &json!({})).json();
    // On a busy machine the first job may have found nothing yet, or jobs may have ended meanwhile.
    let dropped = stopped["dropped"].as_array().expect("a list").clone();
    assert!([json!(1), json!(2), json!(3)].ends_with(&dropped), "{stopped}");
    let suggestions = server.get("/api/clips/1/doubts").json();
    assert!(dropped.iter().all(|id| untracked(&suggestions).contains(id)), "{suggestions}");
    let unknown = suggestions["left"]["unknown"].as_u64().expect("a number");
    assert!(unknown >= (dropped.len() * (FRAMES - 1)) as u64, "{suggestions}");
    let info = &server.get("/api/clips").json()["clips"][0];
    assert_eq!(info["unknown"], suggestions["left"]["unknown"]);
    assert!(info["unknown_targets"].as_u64().expect("a number") >= dropped.len() as u64);
    // What found nothing is no step: the last one is that of a job that ran, or the last target.
    let undo = server.clip()["undo"].clone();
    assert!(!undo.as_str().expect("a text").contains("in no frame"), "{undo}");
}

/// A plain model: what was done, in order. Undo takes the last of it back, whatever runs.
#[test]
fn undo_and_redo_at_any_moment_are_those_of_a_plain_model() {
    for seed in 1..=3_u64 {
        let mut random = seed;
        let mut draw = |below: usize| {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) as usize % below
        };
        let mut server = TestServer::new();
        server.add_target(0);
        server.add_target(0);
        let (first, steps) = (server.clip(), 2);
        let (mut done, mut undone): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
        for _ in 0..14 {
            match draw(8) {
                0..=3 => {
                    let (target, frame) = (1 + draw(2) as u64, 1 + draw(FRAMES - 1));
                    correct(&server, target, frame);
                    done.push(format!("correct target {target} in frame {frame}"));
                    undone.clear();
                }
                4 => {
                    let is_done = server.clip()["project"]["done"] == true;
                    edit(&server, &json!({ "edit": "set_done", "done": !is_done }));
                    let not = if is_done { "not " } else { "" };
                    done.push(format!("mark the clip as {not}done"));
                    undone.clear();
                }
                5 | 6 => {
                    if let Some(expected) = done.pop() {
                        let text = step(&server, "undo");
                        assert!(text.as_str().expect("a text").starts_with(&expected), "{text}");
                        undone.push(expected);
                    }
                }
                _ => {
                    let text = step(&server, "redo");
                    match undone.pop() {
                        Some(expected) => {
                            assert!(text.as_str().expect("a text").starts_with(&expected));
                            done.push(expected);
                        }
                        None => assert!(text.is_null(), "{text}"),
                    }
                }
            }
            let mut expected = BTreeMap::from([(1, vec![0]), (2, vec![0])]);
            for words in done.iter().map(|text| text.split(' ').collect::<Vec<_>>()) {
                if let ["correct", "target", target, "in", "frame", frame] = words[..] {
                    let keys = expected.get_mut(&target.parse().expect("an id")).expect("is there");
                    keys.push(frame.parse().expect("a frame"));
                }
            }
            expected.values_mut().for_each(|keys| {
                keys.sort_unstable();
                keys.dedup();
            });
            assert_eq!(keys(&server.clip()), expected, "seed {seed}: {done:?}");
            std::thread::sleep(Duration::from_millis(draw(120) as u64));
        }
        let last = server.wait();
        // The history survives the end of the program.
        server.restart();
        assert_eq!(content(&server.clip()), content(&last));
        for expected in done.iter().rev() {
            let text = step(&server, "undo");
            assert!(text.as_str().expect("a text").starts_with(expected), "{text}, not {expected}");
        }
        assert_eq!(content(&server.clip()), content(&first), "seed {seed}");
        for _ in &done {
            step(&server, "redo");
        }
        assert_eq!(content(&server.clip()), content(&last), "seed {seed}");
        for _ in 0..done.len() + steps {
            assert!(step(&server, "undo").is_string());
        }
        assert_eq!(step(&server, "undo"), Value::Null);
    }
}
