//! Draws many targets on a frame, each with its box, outline and id in its own colour.

use patchlock::Status;
use patchlock_drawing::canvas::{Canvas, Line};
use patchlock_drawing::{lost_box, scale, tag, upright};

use super::Seen;
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

/// The colour of a target.
fn colour(id: u64) -> [u8; 3] {
    COLOURS[(id.wrapping_sub(1) % COLOURS.len() as u64) as usize]
}

/// Draws all targets.
pub fn outlines_and_names(canvas: &mut Canvas, targets: &[Seen]) {
    for seen in targets {
        outlines(canvas, seen);
    }
    // Tags are drawn last, so that no line covers them.
    for seen in targets {
        name(canvas, seen);
    }
}

fn outlines(canvas: &mut Canvas, seen: &Seen) {
    let dashed = match seen.estimate.status {
        Status::Tracked => false,
        Status::Uncertain => true,
        Status::Lost => return lost_box(canvas, seen.bbox),
    };
    let (scale, colour) = (scale(canvas), colour(seen.id.unwrap_or(1)));
    canvas.outline(&outline(seen), Line { width: 0.8 * scale, colour, dashed });
    canvas.outline(&upright(seen.bbox), Line { width: 1.8 * scale, colour, dashed });
}

/// Id and score above the box.
fn name(canvas: &mut Canvas, seen: &Seen) {
    let id = seen.id.unwrap_or(1);
    let called = seen.name.as_deref().map_or_else(|| id.to_string(), str::to_owned);
    let label = match seen.estimate.status {
        Status::Lost => format!("{called}  LOST"),
        Status::Tracked | Status::Uncertain => format!("{called}  {:.2}", seen.estimate.score),
    };
    tag(canvas, seen.bbox, &label, colour(id));
}
