//! Scenes in which the target disappears and returns, compared with their truth.

mod support;

use patchlock_scene::{Absences, Scene, SceneConfig, Truth};
use std::ops::Range;
use std::sync::LazyLock;
use support::{box_centre, coverage, distance, rounding};

const SEEDS: [u64; 4] = [1, 2, 3, 4];
const FRAMES: usize = 3000;
const TURN: f64 = 25.0;

/// The truth of every frame behind the post and outside the frame, for each seed.
static BEHIND: LazyLock<Vec<Vec<Truth>>> = LazyLock::new(|| all(Absences::BehindPost));
static OUTSIDE: LazyLock<Vec<Vec<Truth>>> = LazyLock::new(|| all(Absences::OutsideFrame));

fn all(absences: Absences) -> Vec<Vec<Truth>> {
    SEEDS.map(|seed| truths(absences, seed)).to_vec()
}

fn truths(absences: Absences, seed: u64) -> Vec<Truth> {
    let scene = Scene::new(SceneConfig::long(FRAMES, absences, TURN, seed));
    (0..FRAMES).map(|k| scene.truth(k)).collect()
}

/// The scenes of both kinds with their seeds.
fn scenes() -> impl Iterator<Item = (String, &'static [Truth])> {
    let named = |kind: &'static str, all: &'static [Vec<Truth>]| {
        let seeds = SEEDS.into_iter().zip(all);
        seeds.map(move |(seed, truths)| (format!("{kind}, seed {seed}"), truths.as_slice()))
    };
    named("behind the post", &BEHIND).chain(named("outside the frame", &OUTSIDE))
}

/// The stretches of frames in which the target is absent, without one that the scene ends in.
fn absent(truths: &[Truth]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut begin = None;
    for (k, truth) in truths.iter().enumerate() {
        match (begin, truth.is_absent()) {
            (None, true) => begin = Some(k),
            (Some(first), false) => {
                found.push(first..k);
                begin = None;
            }
            _ => {}
        }
    }
    found
}

/// The edge of the frame beyond which the target is.
fn edge(truth: &Truth) -> usize {
    let [x, y] = box_centre(truth);
    let beyond = [-x, -y, x - 399.0, y - 239.0];
    (0..4).max_by(|&a, &b| beyond[a].total_cmp(&beyond[b])).unwrap()
}

#[test]
fn the_visible_share_is_what_the_frames_show() {
    for absences in [Absences::BehindPost, Absences::OutsideFrame] {
        let config = SceneConfig::long(400, absences, TURN, 3);
        let scene = Scene::new(config.clone());
        let partly = |k: &usize| (0.1..0.9).contains(&scene.truth(*k).visible);
        let partly: Vec<usize> = (0..400).filter(partly).step_by(7).collect();
        assert!(partly.len() > 2, "{absences:?}: {partly:?}");
        let gone = (0..400).find(|&k| scene.truth(k).is_absent()).unwrap();
        for k in [&partly[..], &[0, gone]].concat() {
            let truth = scene.truth(k);
            let area = truth.bbox[2] * truth.bbox[3] - rounding(&truth);
            let seen: f64 = coverage(&config, k).iter().sum();
            let off = seen / area - truth.visible;
            assert!(off.abs() < 0.01, "{absences:?}, frame {k}: off by {off}");
            // The edges of trunk and target are exact to a ninth of a pixel.
            assert!(!truth.is_absent() || seen < 1.0, "{absences:?}, frame {k}: {seen} pixels");
        }
    }
}

#[test]
fn shares_add_up_where_the_post_is_inside_the_frame() {
    for (name, truths) in scenes() {
        for truth in truths {
            let sum = truth.hidden + truth.outside + truth.visible;
            assert!((sum - 1.0).abs() < 1e-9, "{name}: {truth:?}");
            assert!(truth.hidden == 0.0 || truth.outside == 0.0, "{name}: {truth:?}");
        }
        let most = |of: fn(&Truth) -> f64| truths.iter().map(of).fold(0.0, f64::max);
        assert_eq!(most(|t| t.hidden) + most(|t| t.outside), 1.0, "{name}");
    }
}

#[test]
fn the_target_disappears_again_and_again() {
    for (name, truths) in scenes() {
        let found = absent(truths);
        assert!((5..20).contains(&found.len()), "{name}: {} absences", found.len());
        assert!(truths[..20].iter().all(|truth| truth.visible == 1.0), "{name}");
        for gone in &found {
            assert!(gone.len() >= 24, "{name}: {gone:?}");
            let first = truths[gone.start];
            let same = |truth: &Truth| {
                (truth.scale - first.scale).abs() + (truth.rotation - first.rotation).abs() < 1e-9
            };
            assert!(truths[gone.clone()].iter().all(same), "{name}: {gone:?}");
        }
        for pair in found.windows(2) {
            let between = &truths[pair[0].end..pair[1].start];
            let whole = between.iter().filter(|truth| truth.visible == 1.0).count();
            assert!(whole >= 30, "{name}: {whole} frames before {:?}", pair[1]);
        }
    }
}

#[test]
fn the_target_never_disappears_unless_asked_to() {
    assert!(truths(Absences::Never, 1).iter().all(|truth| truth.visible == 1.0));
}

#[test]
fn the_target_comes_out_elsewhere_behind_the_post() {
    let mut sides = [0; 2];
    for truths in BEHIND.iter() {
        for gone in absent(truths) {
            let [from, to] = [gone.start - 1, gone.end].map(|k| box_centre(&truths[k]));
            assert!((from[1] - to[1]).abs() > 20.0, "{gone:?}: {from:?} {to:?}");
            sides[usize::from((from[0] < 200.0) != (to[0] < 200.0))] += 1;
        }
    }
    assert!(sides.iter().all(|&count| count > 5), "same and other side: {sides:?}");
}

#[test]
fn the_target_returns_over_another_edge() {
    let mut edges = [0; 4];
    for truths in OUTSIDE.iter() {
        for gone in absent(truths) {
            let [from, to] = [gone.start, gone.end - 1].map(|k| edge(&truths[k]));
            assert_ne!(from, to, "{gone:?}");
            edges[to] += 1;
        }
    }
    assert!(edges.iter().all(|&count| count > 0), "{edges:?}");
}

#[test]
fn the_target_turns_and_moves_within_its_limits() {
    for (name, truths) in scenes() {
        let most = truths.iter().map(|t| t.rotation.to_degrees().abs()).fold(0.0, f64::max);
        assert!(most > 0.8 * TURN && most <= TURN, "{name}: {most} degrees");
        for pair in truths.windows(2).filter(|pair| pair[0].visible > 0.0) {
            let moved = distance(box_centre(&pair[0]), box_centre(&pair[1]));
            assert!(moved < 5.0, "{name}: {moved} pixels");
            let turned = (pair[1].rotation - pair[0].rotation).to_degrees().abs();
            assert!(turned < 1.6, "{name}: {turned} degrees");
        }
    }
}

#[test]
fn a_scene_begins_with_the_frames_of_a_shorter_one() {
    for absences in [Absences::Never, Absences::BehindPost, Absences::OutsideFrame] {
        for frames in [1, 137, 401] {
            let [short, long] = [frames, FRAMES]
                .map(|frames| Scene::new(SceneConfig::long(frames, absences, TURN, 5)));
            assert!((0..frames).all(|k| short.truth(k) == long.truth(k)), "{absences:?} {frames}");
            assert_eq!(short.frame(frames - 1), long.frame(frames - 1));
        }
    }
}

#[test]
fn the_seed_changes_the_way() {
    let [a, b] = [1, 2].map(|seed| SceneConfig::long(300, Absences::OutsideFrame, TURN, seed));
    assert_ne!(a.path, b.path);
}
