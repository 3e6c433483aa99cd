//! Draws many targets on a frame, each with its box, outline and id in its own colour.

use patchlock::Status;
use patchlock_drawing::canvas::{Canvas, Line};
use patchlock_drawing::{lost_box, scale, tag, upright};

use super::TargetResult;
use super::draw::outline;

/// Colours by id: the palette of Okabe and Ito, lightened to stand out on most frames.
const COLOURS: [[u8; 3]; 7] = [
    [255, 138, 76],
    [87, 177, 238],
    [47, 201, 155],
    [238, 156, 203],
    [242, 187, 58],
    [155, 220, 255],
    [230, 234, 240],
];

fn colour(id: u64) -> [u8; 3] {
    COLOURS[(id.wrapping_sub(1) % COLOURS.len() as u64) as usize]
}

pub fn outlines_and_names(canvas: &mut Canvas, targets: &[TargetResult]) {
    for target in targets {
        outlines(canvas, target);
    }
    // Tags are drawn last, so that no line covers them.
    for target in targets {
        name(canvas, target);
    }
}

fn outlines(canvas: &mut Canvas, target: &TargetResult) {
    let dashed = match target.estimate.status {
        Status::Tracked => false,
        Status::Uncertain => true,
        Status::Lost => return lost_box(canvas, target.bbox),
    };
    let (scale, colour) = (scale(canvas), colour(target.id.unwrap_or(1)));
    canvas.outline(&outline(target), Line { width: 0.8 * scale, colour, dashed });
    canvas.outline(&upright(target.bbox), Line { width: 1.8 * scale, colour, dashed });
}

/// Id and score above the box.
fn name(canvas: &mut Canvas, target: &TargetResult) {
    let id = target.id.unwrap_or(1);
    let called = target.name.as_deref().map_or_else(|| id.to_string(), str::to_owned);
    let label = match target.estimate.status {
        Status::Lost => format!("{called}  LOST"),
        Status::Tracked | Status::Uncertain => format!("{called}  {:.2}", target.estimate.score),
    };
    tag(canvas, target.bbox, &label, colour(id));
}
