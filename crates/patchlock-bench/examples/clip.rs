//! `clip FOLDER [NETWORK.onnx ...]`: renders a clip and tracks it here, for comparison with what a browser
//! makes of the same pixels. Nothing hides or turns: there, a single bit of a pixel moves boxes by pixels.
//!
//! Writes `000.rgba` and so on, the pixels of the frames; `network-0.onnx` and so on, the networks; and
//! `boxes.json`: the size, the start box, and for each tracker what it says of each frame and the milliseconds
//! that a frame took.

use patchlock::{BoundingBox, Estimate, Frame, Network, Preset, Tracker, TrackerConfig};
use patchlock_scene::{Scene, SceneConfig, SceneFrame};
use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args_os().skip(1).map(PathBuf::from);
    let folder = arguments.next().ok_or("usage: clip FOLDER [NETWORK.onnx ...]")?;
    let files = arguments.map(fs::read).collect::<Result<Vec<_>, _>>()?;
    let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
    let scene = Scene::new(vga(SceneConfig::simple()));
    let frames: Vec<SceneFrame> = (0..scene.len()).map(|k| scene.frame(k)).collect();
    let [x, y, w, h] = scene.truth(0).bbox;
    let start = BoundingBox { x, y, w, h };

    let with = |preset: Preset, network: &Network| {
        let mut config = TrackerConfig::from(preset);
        config.network = Some(network.clone());
        config
    };
    let mut trackers = vec![
        ("robust", TrackerConfig::from(Preset::Robust)),
        ("patchnet", with(Preset::Network, &Network::patchnet())),
    ];
    if !files.is_empty() {
        let network = Network::from_bytes(&files)?;
        trackers.push(("network", with(Preset::Network, &network)));
        trackers.push(("robust+network", with(Preset::Robust, &network)));
    }
    let mut tracks = Vec::new();
    for (name, config) in trackers {
        let begun = Instant::now();
        let boxes = track(config, &frames, start)?;
        let ms = begun.elapsed().as_secs_f64() * 1e3 / (frames.len() - 1) as f64;
        tracks.push(format!("\"{name}\":{{\"ms\":{ms:.3},\"estimates\":[{}]}}", boxes.join(",")));
    }
    let (width, height) = (frames[0].width, frames[0].height);
    let count = frames.len();
    let networks = files.len();
    let size = format!(
        "\"networks\":{networks},\"count\":{count},\"width\":{width},\"height\":{height},\"start\":[{x},{y},{w},{h}]"
    );
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("boxes.json"), format!("{{{size},{}}}", tracks.join(",")))?;
    for (number, file) in files.iter().enumerate() {
        fs::write(folder.join(format!("network-{number}.onnx")), file)?;
    }
    for (number, frame) in frames.iter().enumerate() {
        let rgb = frame.rgb.chunks_exact(3);
        let rgba: Vec<u8> = rgb.flat_map(|rgb| [rgb[0], rgb[1], rgb[2], u8::MAX]).collect();
        fs::write(folder.join(format!("{number:03}.rgba")), rgba)?;
    }
    Ok(())
}

/// The scene on 640 x 480 pixels.
fn vga(scene: SceneConfig) -> SceneConfig {
    let larger = 640.0 / scene.width as f64;
    let mut vga = SceneConfig { width: 640, height: 480, ..scene };
    vga.target_size = vga.target_size.map(|side| side * larger);
    vga.path.iter_mut().for_each(|pose| pose.centre = pose.centre.map(|at| at * larger));
    if let Some(post) = &mut vga.post {
        (post.centre_x, post.width) = (post.centre_x * larger, post.width * larger);
    }
    vga
}

/// The estimates of all frames but the first, as JSON.
fn track(
    config: TrackerConfig,
    frames: &[SceneFrame],
    start: BoundingBox,
) -> Result<Vec<String>, patchlock::Error> {
    let frame = |k: usize| Frame::rgb8(&frames[k].rgb, frames[k].width, frames[k].height);
    let mut tracker = Tracker::start(config, &frame(0)?, start)?;
    (1..frames.len()).map(|k| Ok(json(tracker.update(&frame(k)?)?))).collect()
}

fn json(estimate: &Estimate) -> String {
    let BoundingBox { x, y, w, h } = estimate.bbox;
    let mut text = String::new();
    // Shortest digits that give the same bits again.
    let _ = write!(
        text,
        "{{\"box\":[{x:?},{y:?},{w:?},{h:?}],\"score\":{:?},\"status\":\"{}\"}}",
        estimate.score, estimate.status
    );
    text
}
