//! Networks: ONNX files of strangers.

use patchlock::{BoundingBox, Frame, ModelFile, Network, Preset, Tracker, TrackerConfig};

use crate::check::{accepted, estimate};
use crate::library::pattern;
use crate::onnx::edited;
use crate::{MADE_UP, choice};

const SIDE: usize = 64;
/// Frames that a network follows a target through.
const FRAMES: u8 = 2;

/// The first byte chooses a made-up file whose place the input takes, and the form: a file, or
/// changes of the made-up one. A file is examined and loaded; a network that loads follows a target.
pub fn model(data: &[u8]) {
    let (first, rest) = choice(data);
    let place = usize::from(first) % MADE_UP.len();
    let file = match usize::from(first) / MADE_UP.len() % 2 {
        0 => rest.to_vec(),
        _ => edited(MADE_UP[place], rest),
    };
    if let Some(known) = accepted(ModelFile::examine(&file)) {
        assert!(known.sha256.len() == 64 && !known.values.is_empty(), "{known:?}");
    }
    let files = match place {
        0 => vec![&file[..], MADE_UP[1]],
        1 => vec![MADE_UP[0], &file[..]],
        _ => vec![&file[..]],
    };
    if let Some(network) = accepted(Network::from_bytes(&files)) {
        for preset in [Preset::Network, Preset::Robust] {
            follow(preset, network.clone());
        }
    }
}

/// Whatever a network says, boxes and scores are finite.
fn follow(preset: Preset, network: Network) {
    let mut config = TrackerConfig::from(preset);
    config.network = Some(network);
    let bbox = BoundingBox { x: 20.0, y: 15.0, w: 21.0, h: 22.0 };
    let first = pattern(SIDE, SIDE, 60);
    let frame = Frame::grey8(&first, SIDE, SIDE).expect("is a frame");
    let Some(mut tracker) = accepted(Tracker::start(config, &frame, bbox)) else { return };
    for k in 0..FRAMES {
        let pixels = pattern(SIDE, SIDE, 63 + 3 * k);
        let frame = Frame::grey8(&pixels, SIDE, SIDE).expect("is a frame");
        accepted(tracker.update(&frame)).into_iter().for_each(estimate);
    }
}
