//! Runs the examples.

#[allow(dead_code)] // its `main`
#[path = "../examples/images.rs"]
mod images;

use patchlock_scene::Scene;

#[test]
fn the_example_with_images_follows_the_target() {
    let (scene, folder) = (Scene::simple(), tempfile::tempdir().unwrap());
    let file = |k: usize| folder.path().join(format!("{k}.png"));
    for k in 0..5 {
        let frame = scene.frame(k);
        let (width, height) = (frame.width as u32, frame.height as u32);
        let colour = image::ExtendedColorType::Rgb8;
        image::save_buffer(file(k), &frame.rgb, width, height, colour).unwrap();
    }
    let files = (0..5).map(|k| file(k).to_string_lossy().into_owned());
    let boxes = images::track(scene.truth(0).bbox.into(), files).unwrap();
    assert_eq!(boxes.len(), 5);
    for (k, bbox) in boxes.iter().enumerate() {
        assert!(bbox.overlap(&scene.truth(k).bbox.into()) > 0.7, "frame {k}: {bbox:?}");
    }
}
