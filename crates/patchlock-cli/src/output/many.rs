//! Draws many targets on a frame, each with its box, outline and id in its own colour.

use super::Seen;
use super::canvas::{Area, Canvas};
use super::draw::{PANEL, PANEL_OPACITY, scale};
use super::row::Row;
use super::text;

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

/// Draws all targets and the frame number.
pub fn annotate(canvas: &mut Canvas, frame: usize, targets: &[Seen]) {
    for seen in targets {
        outlines(canvas, &seen.row);
    }
    // Tags are drawn last, so that no line covers them.
    for seen in targets {
        tag(canvas, &seen.row);
    }
    status(canvas, frame, targets.len());
}

fn outlines(canvas: &mut Canvas, row: &Row) {
    let (scale, colour) = (scale(canvas), colour(row.id.unwrap_or(1)));
    let corners = [[row.x1, row.y1], [row.x2, row.y2], [row.x3, row.y3], [row.x4, row.y4]];
    let points = corners.map(|[x, y]| [x as f32 + 0.5, y as f32 + 0.5]);
    canvas.outline(&points, 0.8 * scale, colour);
    let (x, y, w, h) = (row.x as f32, row.y as f32, row.w as f32, row.h as f32);
    canvas.outline(&[[x, y], [x + w, y], [x + w, y + h], [x, y + h]], 1.8 * scale, colour);
}

/// Id and score above the upper left corner of the box, moved down if that is outside the frame.
fn tag(canvas: &mut Canvas, row: &Row) {
    let scale = scale(canvas);
    let (size, margin) = ((11.0 * scale).round(), (3.0 * scale).round());
    let id = row.id.unwrap_or(1);
    let label = format!("{id}  {:.2}", row.score);
    let h = size + 2.0 * margin;
    let area = Area {
        x: (row.x as f32).max(0.0),
        y: (row.y as f32 - h - scale).max(0.0),
        w: text::width(&label, size) + 2.0 * margin,
        h,
    };
    canvas.fill_round(area, margin, PANEL, PANEL_OPACITY);
    canvas.text(&label, area.x + margin, area.y + h / 2.0, size, colour(id));
}

/// Frame number and number of targets, in the lower left corner.
fn status(canvas: &mut Canvas, frame: usize, targets: usize) {
    let scale = scale(canvas);
    let (size, margin) = ((12.0 * scale).round(), (6.0 * scale).round());
    let label = format!("{frame}   {targets} target{}", if targets == 1 { "" } else { "s" });
    let h = size + 2.0 * margin;
    let area = Area {
        x: margin,
        y: canvas.height() - h - margin,
        w: text::width(&label, size) + 2.0 * margin,
        h,
    };
    canvas.fill_round(area, margin * 0.7, PANEL, PANEL_OPACITY);
    canvas.text(&label, area.x + margin, area.y + h / 2.0, size, [200, 206, 214]);
}
