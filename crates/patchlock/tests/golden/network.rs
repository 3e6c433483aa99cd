//! Compares the loops of the method `network` with those in Python with onnxruntime, on networks of
//! made-up weights. What the networks themselves compute is compared in `network/programs.rs`, a
//! module of the library.

use crate::golden;
use patchlock::{BoundingBox, Frame, FrameView, Network, Preset, Tracker, TrackerConfig};
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    width: usize,
    height: usize,
    tracks: Vec<Track>,
}

#[derive(Deserialize)]
struct Track {
    networks: Vec<String>,
    first: [f64; 4],
    boxes: Vec<[f64; 4]>,
    scores: Vec<f64>,
}

impl File {
    /// The pixels of frame `k`, by the formula in the file.
    fn frame(&self, k: usize) -> Vec<u8> {
        let value = |at: usize| {
            let (x, y, c) = (at / 3 % self.width, at / 3 / self.width, at % 3);
            let (i, j) = ((x + 3 * k) / 11, (y + 2 * k) / 9);
            ((7 * i * i + 5 * j * j + 3 * i * j + 2 * c) % 8 * 25 + (x + 2 * y) % 9 * 6) as u8
        };
        (0..self.width * self.height * 3).map(value).collect()
    }
}

fn config(files: &[String]) -> TrackerConfig {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/network");
    let files: Vec<Vec<u8>> =
        files.iter().map(|name| std::fs::read(folder.join(name)).unwrap()).collect();
    let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
    let mut config = TrackerConfig::from(Preset::Network);
    config.network = Some(Network::from_bytes(&files).unwrap());
    config
}

#[test]
fn boxes_and_scores_are_those_of_the_published_loops() {
    let file: File = golden("network/network.json");
    assert_eq!(file.tracks.len(), 2);
    for track in &file.tracks {
        let pixels = file.frame(0);
        let frame = Frame::rgb8(&pixels, file.width, file.height).unwrap();
        let [x, y, w, h] = track.first;
        let first = BoundingBox { x, y, w, h };
        let mut tracker = Tracker::start(config(&track.networks), &frame, first).unwrap();
        let (mut worst, mut worst_score) = (0.0_f64, 0.0_f64);
        for (k, (wanted, score)) in (1..).zip(track.boxes.iter().zip(&track.scores)) {
            let pixels = file.frame(k);
            let frame = Frame::rgb8(&pixels, file.width, file.height).unwrap();
            let mut seen = 0.0;
            let mut observer = |view: &FrameView<'_>| {
                let FrameView::Network(view) = view else { panic!("another method's view") };
                seen = view.scores[view.chosen];
            };
            let estimate = tracker.update_observed(&frame, &mut observer).unwrap();
            let BoundingBox { x, y, w, h } = estimate.bbox;
            let apart = [x, y, w, h].into_iter().zip(wanted).map(|(a, b)| (a - b).abs());
            worst = apart.fold(worst, f64::max);
            worst_score = worst_score.max((seen - score).abs());
        }
        println!("{:?}: {worst:e} pixels, score {worst_score:e}", track.networks);
        assert!(worst < 5e-3 && worst_score < 1e-4, "{worst} pixels, score {worst_score}");
    }
}
