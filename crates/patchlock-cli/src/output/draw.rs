//! Draws the track on a frame: box, rotated outline, visible patches, score and frame number.

use patchlock::{BoundingBox, Visibility, VisibilityMap};

use super::canvas::{Area, Canvas};
use super::many;
use super::{Seen, Tracked, text};

/// Visible patches and high scores. Teal and orange can be told apart with any colour vision.
pub const VISIBLE: [u8; 3] = [46, 211, 183];
/// Hidden patches and low scores.
pub const HIDDEN: [u8; 3] = [255, 127, 40];
/// The upright box.
pub const BOX: [u8; 3] = [255, 255, 255];
/// The background of text.
pub const PANEL: [u8; 3] = [12, 16, 22];
/// Opacity of that background.
pub const PANEL_OPACITY: f32 = 0.72;

/// Draws the track on a frame; returns RGB bytes of the same size.
pub fn annotate(tracked: &Tracked<'_>) -> Vec<u8> {
    let rgb = tracked.picture.to_rgb();
    let Some(mut canvas) = Canvas::from_rgb(tracked.picture.width, tracked.picture.height, &rgb)
    else {
        return rgb;
    };
    match tracked.targets {
        // With a single target there is room for the visibility maps.
        [seen] if seen.id.is_none() => {
            outlines(&mut canvas, seen);
            status(&mut canvas, tracked.frame, seen.estimate.score);
            if let Some(Visibility { large, small }) = &seen.estimate.visibility {
                maps(&mut canvas, [large, small]);
            }
        }
        targets => many::annotate(&mut canvas, tracked.frame, targets),
    }
    canvas.to_rgb()
}

/// Scale of text and lines. It grows more slowly than the frame, so that they stay legible on small frames
/// and do not cover large ones.
pub fn scale(canvas: &Canvas) -> f32 {
    (canvas.width().min(canvas.height()) / 240.0).powf(0.7).clamp(0.75, 4.0)
}

/// The corners of the upright box, on the canvas. A box covers whole pixels, and on the canvas pixel k spans
/// k to k + 1, so no offset is needed.
pub fn upright(seen: &Seen) -> [[f32; 2]; 4] {
    let BoundingBox { x, y, w, h } = seen.bbox;
    [[x, y], [x + w, y], [x + w, y + h], [x, y + h]].map(|corner| corner.map(|value| value as f32))
}

/// The corners of the target's outline, on the canvas. They are points, and a point with integer coordinates
/// is the centre of a pixel.
pub fn outline(seen: &Seen) -> [[f32; 2]; 4] {
    seen.estimate.corners.map(|corner| corner.map(|value| value as f32 + 0.5))
}

/// Draws the upright box and the outline of the target.
fn outlines(canvas: &mut Canvas, seen: &Seen) {
    let scale = scale(canvas);
    canvas.outline(&upright(seen), scale, BOX);
    canvas.outline(&outline(seen), 1.8 * scale, by_score(seen.estimate.score));
}

/// A colour from orange (low score) to teal (high score).
pub fn by_score(score: f64) -> [u8; 3] {
    let share = ((score - 0.25) / 0.5).clamp(0.0, 1.0);
    std::array::from_fn(|k| {
        let (low, high) = (f64::from(HIDDEN[k]), f64::from(VISIBLE[k]));
        (low + (high - low) * share).round() as u8
    })
}

/// Frame number, score and a bar for the score, in the upper left corner.
fn status(canvas: &mut Canvas, frame: usize, score: f64) {
    let scale = scale(canvas);
    let size = (12.0 * scale).round();
    let margin = (6.0 * scale).round();
    let label = frame.to_string();
    let colour = by_score(score);
    let score_label = format!("{score:.2}");
    let gap = size * 0.9;
    let inner = text::width(&label, size) + gap + text::width(&score_label, size);
    let panel = Area { x: margin, y: margin, w: inner + 2.0 * margin, h: size + 2.2 * margin };
    canvas.fill_round(panel, margin * 0.7, PANEL, PANEL_OPACITY);
    let middle = margin * 1.8 + size / 2.0;
    canvas.text(&label, 2.0 * margin, middle, size, [200, 206, 214]);
    canvas.text(
        &score_label,
        2.0 * margin + inner - text::width(&score_label, size),
        middle,
        size,
        colour,
    );
    let bar = Area {
        x: 2.0 * margin,
        y: panel.y + panel.h - margin * 0.85,
        w: inner,
        h: (scale * 2.0).round(),
    };
    canvas.fill(bar, [90, 98, 108], 0.8);
    canvas.fill(Area { w: inner * score.clamp(0.0, 1.0) as f32, ..bar }, colour, 1.0);
}

/// The maps of large and small patches, in the lower right corner at the same size.
fn maps(canvas: &mut Canvas, maps: [&VisibilityMap; 2]) {
    let scale = scale(canvas);
    let margin = (6.0 * scale).round();
    let side = 13.0 * (2.6 * scale).round();
    let panel = Area {
        x: canvas.width() - 3.0 * margin - 2.0 * side - margin,
        y: canvas.height() - 3.0 * margin - side,
        w: 2.0 * side + 3.0 * margin,
        h: side + 2.0 * margin,
    };
    canvas.fill_round(panel, margin * 0.7, PANEL, PANEL_OPACITY);
    for (k, map) in maps.into_iter().enumerate() {
        let x = panel.x + margin + k as f32 * (side + margin);
        grid(canvas, map, Area { x, y: panel.y + margin, w: side, h: side });
    }
}

/// One map of patches. Cells start at whole pixels, so that the gaps between them look even.
fn grid(canvas: &mut Canvas, map: &VisibilityMap, area: Area) {
    if map.rows == 0 || map.columns == 0 {
        return;
    }
    let edge = |k: usize, count: usize, length: f32| (length * k as f32 / count as f32).round();
    for (k, &visible) in map.visible.iter().enumerate().take(map.rows * map.columns) {
        let (row, column) = (k / map.columns, k % map.columns);
        let (left, right) =
            (edge(column, map.columns, area.w), edge(column + 1, map.columns, area.w));
        let (top, bottom) = (edge(row, map.rows, area.h), edge(row + 1, map.rows, area.h));
        let gap = if right - left > 4.5 { 1.0 } else { 0.0 };
        let cell = Area {
            x: area.x + left,
            y: area.y + top,
            w: right - left - gap,
            h: bottom - top - gap,
        };
        canvas.fill(cell, if visible { VISIBLE } else { HIDDEN }, 1.0);
    }
}
