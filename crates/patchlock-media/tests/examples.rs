//! Runs the example.

#[allow(dead_code)] // its `main`
#[path = "../examples/video.rs"]
mod video;

use patchlock_media::{FrameRate, Mp4Writer};
use patchlock_scene::Scene;
use std::fs::File;

#[test]
fn the_example_follows_the_target_of_a_video() {
    let (scene, folder) = (Scene::simple(), tempfile::tempdir().unwrap());
    let file = folder.path().join("video.mp4");
    let (first, out) = (scene.frame(0), File::create(&file).unwrap());
    let rate = FrameRate::DEFAULT;
    let mut writer = Mp4Writer::new(out, first.width, first.height, rate, None).unwrap();
    (0..5).for_each(|k| writer.push(&scene.frame(k).rgb).unwrap());
    writer.finish().unwrap();
    let mut found = Vec::new();
    let truth = |k: usize| scene.truth(k).bbox;
    video::track(&file.to_string_lossy(), truth(0), |k, estimate| found.push((k, estimate.bbox)))
        .unwrap();
    assert_eq!(found.iter().map(|(k, _)| *k).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    for (k, bbox) in found {
        assert!(bbox.overlap(&truth(k).into()) > 0.7, "frame {k}: {bbox:?}");
    }
}
