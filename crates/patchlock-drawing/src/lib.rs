//! Drawing on frames: boxes with tags, as in the annotated videos of the program and of the page.

pub mod canvas;
pub mod text;

use patchlock::BoundingBox;

use canvas::{Area, Canvas, Line};

/// A target that is lost.
pub const LOST: [u8; 3] = [196, 202, 210];
/// The background of text.
pub const PANEL: [u8; 3] = [12, 16, 22];
/// Opacity of that background.
pub const PANEL_OPACITY: f32 = 0.72;

/// Scale of text and lines. It grows more slowly than the frame, so that they stay legible on small
/// frames and do not cover large ones.
pub fn scale(canvas: &Canvas) -> f32 {
    (canvas.width().min(canvas.height()) / 240.0).powf(0.7).clamp(0.75, 4.0)
}

/// The corners of an upright box, on the canvas. A box covers whole pixels, and on the canvas pixel
/// k spans k to k + 1, so no offset is needed.
pub fn upright(bbox: BoundingBox) -> [[f32; 2]; 4] {
    let BoundingBox { x, y, w, h } = bbox;
    [[x, y], [x + w, y], [x + w, y + h], [x, y + h]].map(|corner| corner.map(|value| value as f32))
}

/// Draws the box of a lost target: what is still followed, or the last known one.
pub fn lost_box(canvas: &mut Canvas, bbox: BoundingBox) {
    let line = Line { width: 0.8 * scale(canvas), colour: LOST, dashed: false };
    canvas.outline(&upright(bbox), line);
}

/// Writes a text above the upper left corner of a box, moved down if that is outside the frame.
pub fn tag(canvas: &mut Canvas, bbox: BoundingBox, label: &str, colour: [u8; 3]) {
    let scale = scale(canvas);
    let (size, margin) = ((11.0 * scale).round(), (3.0 * scale).round());
    let h = size + 2.0 * margin;
    let area = Area {
        x: (bbox.x as f32).max(0.0),
        y: (bbox.y as f32 - h - scale).max(0.0),
        w: text::width(label, size) + 2.0 * margin,
        h,
    };
    canvas.fill_round(area, margin, PANEL, PANEL_OPACITY);
    canvas.text(label, area.x + margin, area.y + h / 2.0, size, colour);
}
