//! Writes the frames from which `tools/oracles` makes golden files: `oracle_frames FOLDER`.

use patchlock_scene::{Scene, SceneConfig};
use std::{fs, path::Path};

fn dump(scene: &Scene, folder: &Path) -> std::io::Result<()> {
    fs::create_dir_all(folder.join("img"))?;
    let mut boxes = String::new();
    for k in (0..scene.len()).step_by(3) {
        let frame = scene.frame(k);
        let head = format!("P6\n{} {}\n255\n", frame.width, frame.height);
        fs::write(folder.join(format!("img/{k:04}.ppm")), [head.as_bytes(), &frame.rgb].concat())?;
        let [x, y, w, h] = scene.truth(k).bbox;
        boxes += &format!("{} {} {w} {h}\n", x + 1.0, y + 1.0);
    }
    fs::write(folder.join("groundtruth_rect.txt"), boxes)
}

fn main() -> std::io::Result<()> {
    let to = std::env::args().nth(1).expect("a folder");
    // A target of exactly the size of a template: its shifted templates contain the same patches.
    let square = SceneConfig { target_size: [32.0, 32.0], ..SceneConfig::simple() };
    let scenes =
        [("demo", Scene::demo()), ("occluded", Scene::occluded()), ("square", Scene::new(square))];
    scenes.iter().try_for_each(|(name, scene)| dump(scene, &Path::new(&to).join(name)))
}
