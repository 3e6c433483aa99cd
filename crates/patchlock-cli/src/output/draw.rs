//! Draws the track on a frame: box, rotated outline, visible patches, score and frame number. Lines are solid
//! when the target is tracked, dashed when that is uncertain; of a lost target only the last known box is
//! drawn, thin and grey, with the word LOST.

use patchlock::{Estimate, Status, Visibility, VisibilityMap};
use patchlock_studio::drawing::canvas::{Area, Canvas, Line};
use patchlock_studio::drawing::{LOST, PANEL, PANEL_OPACITY, lost_box, scale, tag, text, upright};

use super::many;
use super::{Seen, Tracked};

/// Visible patches and high scores. Teal and orange can be told apart with any colour vision.
pub const VISIBLE: [u8; 3] = [46, 211, 183];
/// Hidden patches and low scores.
pub const HIDDEN: [u8; 3] = [255, 127, 40];
/// The upright box.
pub const BOX: [u8; 3] = [255, 255, 255];
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
            status(&mut canvas, tracked.frame, &seen.estimate);
            if let Some(Visibility { large, small }) = &seen.estimate.visibility {
                maps(&mut canvas, [large, small]);
            }
        }
        targets => many::annotate(&mut canvas, tracked.frame, targets),
    }
    canvas.to_rgb()
}

/// The corners of the target's outline, on the canvas. They are points, and a point with integer coordinates
/// is the centre of a pixel.
pub fn outline(seen: &Seen) -> [[f32; 2]; 4] {
    seen.estimate.corners.map(|corner| corner.map(|value| value as f32 + 0.5))
}

/// Draws the upright box and the outline of the target.
fn outlines(canvas: &mut Canvas, seen: &Seen) {
    let scale = scale(canvas);
    let dashed = match seen.estimate.status {
        Status::Tracked => false,
        Status::Uncertain => true,
        Status::Lost => {
            lost_box(canvas, seen.bbox);
            return tag(canvas, seen.bbox, "LOST", LOST);
        }
    };
    canvas.outline(&upright(seen.bbox), Line { width: scale, colour: BOX, dashed });
    let colour = by_score(seen.estimate.score);
    canvas.outline(&outline(seen), Line { width: 1.8 * scale, colour, dashed });
}

/// The colour of an estimate: by its score, or grey if the target is lost.
pub fn colour(estimate: &Estimate) -> [u8; 3] {
    match estimate.status {
        Status::Lost => LOST,
        Status::Tracked | Status::Uncertain => by_score(estimate.score),
    }
}

/// The score in words; with the status, unless the target is simply tracked.
pub fn score_label(estimate: &Estimate) -> String {
    match estimate.status {
        Status::Tracked => format!("{:.2}", estimate.score),
        status => format!("{:.2} {status}", estimate.score),
    }
}

/// A colour from orange (low score) to teal (high score).
fn by_score(score: f64) -> [u8; 3] {
    let share = ((score - 0.25) / 0.5).clamp(0.0, 1.0);
    std::array::from_fn(|k| {
        let (low, high) = (f64::from(HIDDEN[k]), f64::from(VISIBLE[k]));
        (low + (high - low) * share).round() as u8
    })
}

/// Frame number, score, status and a bar for the score, in the upper left corner.
fn status(canvas: &mut Canvas, frame: usize, estimate: &Estimate) {
    let scale = scale(canvas);
    let size = (12.0 * scale).round();
    let margin = (6.0 * scale).round();
    let label = frame.to_string();
    let (score_label, colour) = (score_label(estimate), colour(estimate));
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
    canvas.fill(Area { w: inner * estimate.score.clamp(0.0, 1.0) as f32, ..bar }, colour, 1.0);
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

#[cfg(test)]
mod tests {
    use patchlock::BoundingBox;

    use super::super::example;
    use super::*;

    /// The frame with targets of this status, with ids if `many`.
    fn drawn(status: Status, many: bool) -> Vec<u8> {
        let bbox = BoundingBox { x: 300.0, y: 300.0, w: 600.0, h: 400.0 };
        let mut seen = example::seen(status);
        (seen.bbox, seen.id) = (bbox, many.then_some(1));
        // The outline is far inside the upright box.
        seen.estimate.corners = [[400.0, 400.0], [800.0, 400.0], [800.0, 600.0], [400.0, 600.0]];
        annotate(&example::tracked(3, &[seen]))
    }

    /// The share of the pixels with this colour between two columns of a row.
    fn share(rgb: &[u8], y: usize, columns: std::ops::Range<usize>, colour: [u8; 3]) -> f64 {
        let count = columns.len() as f64;
        let near = |x: &usize| {
            let pixel = &rgb[(y * 1280 + x) * 3..][..3];
            pixel.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 40)
        };
        columns.filter(near).count() as f64 / count
    }

    #[test]
    fn lines_are_solid_when_tracked_and_dashed_when_uncertain() {
        for (many, colour) in [(false, BOX), (true, [255, 138, 76])] {
            // The lower side of the box.
            let side = |status| {
                let rgb = drawn(status, many);
                (697..703).map(|y| share(&rgb, y, 310..890, colour)).fold(0.0, f64::max)
            };
            assert!(side(Status::Tracked) > 0.99);
            let dashed = side(Status::Uncertain);
            assert!((0.4..0.8).contains(&dashed), "{dashed}");
            assert!(side(Status::Lost) < 0.1);
        }
    }

    #[test]
    fn a_lost_target_is_a_grey_box_with_a_word() {
        for many in [false, true] {
            let (lost, tracked) = (drawn(Status::Lost, many), drawn(Status::Tracked, many));
            let side = (697..703).map(|y| share(&lost, y, 310..890, LOST)).fold(0.0, f64::max);
            assert!(side > 0.99, "{side}");
            // Nothing is drawn where the outline of a tracked target is.
            let outline = |rgb: &[u8]| (395..405).any(|y| share(rgb, y, 410..790, [100; 3]) < 0.9);
            assert!(outline(&tracked) && !outline(&lost));
            // The word is above the box: many bright pixels on a dark area.
            let bright = (255..295).map(|y| share(&lost, y, 300..420, PANEL)).sum::<f64>();
            assert!(bright > 5.0, "{bright}");
        }
    }

    #[test]
    fn the_status_is_beside_the_score_unless_tracked() {
        let label = |status| score_label(&example::seen(status).estimate);
        assert_eq!(label(Status::Tracked), "0.50");
        assert_eq!(label(Status::Uncertain), "0.50 uncertain");
        assert_eq!(label(Status::Lost), "0.50 lost");
        let panel = |status| {
            let rgb = drawn(status, false);
            (16..60).map(|y| share(&rgb, y, 10..400, PANEL)).sum::<f64>()
        };
        assert!(panel(Status::Uncertain) > 1.3 * panel(Status::Tracked));
    }
}
