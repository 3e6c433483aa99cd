//! Measures the target in rendered frames and compares it with the truth.

mod support;

use patchlock_scene::{KeyPose, Post, Scene, SceneConfig, SceneFrame, Truth};
use support::{box_centre, coverage, distance, rounding};

/// Area, centre and angle of the long axis of a coverage mask.
fn shape(mask: &[f64], width: usize) -> (f64, [f64; 2], f64) {
    let points = |i: usize| [(i % width) as f64, (i / width) as f64];
    let area: f64 = mask.iter().sum();
    let mean = |of: &dyn Fn([f64; 2]) -> f64| {
        let sum: f64 = mask.iter().enumerate().map(|(i, m)| m * of(points(i))).sum();
        sum / area
    };
    let centre = [mean(&|p| p[0]), mean(&|p| p[1])];
    let xx = mean(&|p| (p[0] - centre[0]).powi(2));
    let yy = mean(&|p| (p[1] - centre[1]).powi(2));
    let xy = mean(&|p| (p[0] - centre[0]) * (p[1] - centre[1]));
    (area, centre, 0.5 * (2.0 * xy).atan2(xx - yy))
}

fn mean_level(frame: &SceneFrame) -> f64 {
    frame.rgb.iter().map(|&v| f64::from(v)).sum::<f64>() / frame.rgb.len() as f64
}

#[test]
fn target_is_drawn_where_and_as_large_as_the_truth_says() {
    let config = SceneConfig { post: None, ..SceneConfig::demo() };
    let scene = Scene::new(config.clone());
    for k in [0, 13, 24, 36, 60, 97, 160, 209] {
        let truth = scene.truth(k);
        let (area, centre, angle) = shape(&coverage(&config, k), config.width);
        let off = distance(centre, box_centre(&truth));
        // The renderer places edges to a ninth of a pixel.
        assert!(off < 0.05, "frame {k}: centre off by {off}");
        let turned = (angle - truth.rotation).to_degrees();
        assert!(turned.abs() < 0.3, "frame {k}: rotation off by {turned}");
        let expected = truth.bbox[2] * truth.bbox[3] - rounding(&truth);
        assert!((area / expected - 1.0).abs() < 0.01, "frame {k}: {area}");
    }
}

#[test]
fn hidden_share_is_what_the_trunk_hides() {
    let config = SceneConfig::occluded();
    let open = SceneConfig { post: None, ..config.clone() };
    let scene = Scene::new(config.clone());
    for k in [0, 20, 26, 32, 40, 59] {
        let seen: f64 = coverage(&config, k).iter().sum();
        let whole: f64 = coverage(&open, k).iter().sum();
        let hidden = scene.truth(k).hidden;
        let measured = 1.0 - seen / whole;
        assert!((hidden - measured).abs() < 0.01, "frame {k}: {hidden} {measured}");
    }
}

#[test]
fn the_demo_target_is_hidden_completely_in_the_middle() {
    let scene = Scene::demo();
    let hidden: Vec<f64> = (0..scene.len()).map(|k| scene.truth(k).hidden).collect();
    assert!(hidden[..66].iter().all(|&h| h == 0.0));
    assert!(hidden[150..].iter().all(|&h| h == 0.0));
    let whole = hidden.iter().filter(|&&h| h == 1.0).count();
    assert!((20..=40).contains(&whole), "{whole} frames");
    assert!((96..120).all(|k| scene.truth(k).is_absent()));
}

#[test]
fn corners_agree_with_the_box() {
    let scene = Scene::demo();
    for k in 0..scene.len() {
        let truth = scene.truth(k);
        let [tl, tr, br, bl] = truth.corners;
        let mean = |axis: usize| (tl[axis] + tr[axis] + br[axis] + bl[axis]) / 4.0;
        assert!(distance([mean(0), mean(1)], box_centre(&truth)) < 1e-9);
        assert!((distance(tl, tr) - truth.bbox[2]).abs() < 1e-9);
        assert!((distance(tl, bl) - truth.bbox[3]).abs() < 1e-9);
        let rotation = (tr[1] - tl[1]).atan2(tr[0] - tl[0]);
        assert!((rotation - truth.rotation).abs() < 1e-9);
        assert!((truth.bbox[2] - 80.0 * truth.scale).abs() < 1e-9);
    }
}

#[test]
fn demo_motion_stays_within_its_limits() {
    let scene = Scene::demo();
    let truths: Vec<Truth> = (0..scene.len()).map(|k| scene.truth(k)).collect();
    for pair in truths.windows(2) {
        let moved = distance(box_centre(&pair[0]), box_centre(&pair[1]));
        assert!(moved > 0.1 && moved < 5.0, "{moved} pixels");
        assert!((pair[1].rotation - pair[0].rotation).to_degrees().abs() < 4.0);
        assert!((pair[1].scale / pair[0].scale - 1.0).abs() < 0.02);
    }
    let least = truths.iter().map(|t| t.scale).fold(f64::MAX, f64::min);
    let most = truths.iter().map(|t| t.scale).fold(f64::MIN, f64::max);
    assert!((least - 0.8).abs() + (most - 1.2).abs() < 1e-9, "{least} {most}");
    let inside = |p: [f64; 2]| p[0] > 0.0 && p[0] < 479.0 && p[1] > 0.0 && p[1] < 359.0;
    assert!(truths.iter().flat_map(|t| t.corners).all(inside));
}

#[test]
fn light_changes_the_mean_level_as_configured() {
    let lit = Scene::demo();
    let even = Scene::new(SceneConfig { light: Vec::new(), ..SceneConfig::demo() });
    assert_eq!(lit.frame(30), even.frame(30));
    assert_eq!(lit.light(172), (0.55, 6.0));
    assert_eq!(lit.light(194), (1.25, -4.0));
    for k in [164, 172, 183, 194] {
        let (gain, offset) = lit.light(k);
        let expected = gain * mean_level(&even.frame(k)) + offset;
        let level = mean_level(&lit.frame(k));
        // Bright pixels saturate when the gain is above 1.
        let room = if gain > 1.0 { 2.0 } else { 0.2 };
        assert!((level - expected).abs() < room, "frame {k}: {level} {expected}");
    }
}

#[test]
fn noise_has_the_configured_spread_and_changes_every_frame() {
    let still = SceneConfig {
        path: vec![KeyPose { frame: 0.0, centre: [100.0, 90.0], scale: 1.0, degrees: 0.0 }],
        ..SceneConfig::simple()
    };
    let noisy = Scene::new(still.clone());
    let clean = Scene::new(SceneConfig { sensor_noise: 0.0, ..still });
    assert_eq!(clean.frame(3), clean.frame(4));
    assert_ne!(noisy.frame(3), noisy.frame(4));
    let (noisy, clean) = (noisy.frame(3).rgb, clean.frame(3).rgb);
    let squares = noisy.iter().zip(&clean);
    let squares = squares.map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2));
    let spread = (squares.sum::<f64>() / noisy.len() as f64).sqrt();
    // Rounding to whole grey levels adds a little to the configured 2 levels.
    assert!((1.9..2.2).contains(&spread), "{spread}");
}

#[test]
fn same_configuration_gives_the_same_frames_in_any_order() {
    let (a, b) = (Scene::occluded(), Scene::occluded());
    let later = b.frame(30);
    assert_eq!(a.frame(5), b.frame(5));
    assert_eq!(a.frame(30), later);
    assert_eq!(a.truth(30), b.truth(30));
    let other = Scene::new(SceneConfig { seed: 8, ..SceneConfig::occluded() });
    assert_ne!(other.frame(5), a.frame(5));
    assert_eq!(other.truth(5).bbox, a.truth(5).bbox);
}

#[test]
fn simple_scene_only_moves_and_grows() {
    let scene = Scene::simple();
    assert_eq!(scene.len(), 40);
    assert!(!scene.is_empty());
    let frame = scene.frame(39);
    assert_eq!((frame.width, frame.height), (240, 180));
    assert_eq!(frame.rgb.len(), 240 * 180 * 3);
    for k in 0..scene.len() {
        let truth = scene.truth(k);
        assert_eq!((truth.rotation, truth.hidden), (0.0, 0.0));
        assert_eq!(scene.light(k), (1.0, 0.0));
        let [x, y, w, h] = truth.bbox;
        // The corners are on the outer edges, half a pixel beyond pixel centres.
        assert!(distance(truth.corners[0], [x - 0.5, y - 0.5]) < 1e-9);
        assert!(distance(truth.corners[2], [x + w - 0.5, y + h - 0.5]) < 1e-9);
    }
}

#[test]
fn target_and_trunk_may_leave_the_frame() {
    let scene = Scene::new(SceneConfig {
        path: vec![KeyPose { frame: 0.0, centre: [-400.0, 500.0], scale: 1.0, degrees: 45.0 }],
        post: Some(Post { centre_x: 240.0, width: 30.0 }),
        ..SceneConfig::simple()
    });
    assert_eq!(scene.frame(0).rgb.len(), 240 * 180 * 3);
    assert_eq!(scene.truth(0).hidden, 0.0);
}

#[test]
#[should_panic(expected = "frame 40 of a scene of 40")]
fn frames_after_the_last_are_refused() {
    Scene::simple().frame(40);
}

#[test]
#[should_panic(expected = "increasing order")]
fn poses_must_be_in_order() {
    let mut config = SceneConfig::simple();
    config.path.reverse();
    Scene::new(config);
}
