//! The panels of an annotated frame: frame number, score and status in one, the maps of visible
//! patches in another. Each is in a corner where it covers no target, as long as there is one.

use patchlock::{Estimate, Visibility, VisibilityMap};
use patchlock_drawing::canvas::{Area, Canvas};
use patchlock_drawing::{PANEL, PANEL_OPACITY, scale, text};
use patchlock_track::names::counted;

use super::TargetResult;
use super::draw::{HIDDEN, VISIBLE, colour, score_label};

const TEXT: [u8; 3] = [200, 206, 214];

/// Where the panels were in the last frame. They stay there until a target comes in the way.
#[derive(Debug, Clone, Copy)]
pub struct Panels {
    status: Corner,
    maps: Corner,
}

impl Default for Panels {
    fn default() -> Self {
        Self { status: UPPER_LEFT, maps: LOWER_RIGHT }
    }
}

/// Whether it is on the right, and whether it is below.
type Corner = [bool; 2];

const UPPER_LEFT: Corner = [false, false];
const UPPER_RIGHT: Corner = [true, false];
const LOWER_LEFT: Corner = [false, true];
const LOWER_RIGHT: Corner = [true, true];

/// The area of a panel of this size in a corner.
fn place(canvas: &Canvas, [right, lower]: Corner, [w, h]: [f32; 2]) -> Area {
    let margin = margin(canvas);
    let at = |far: bool, side: f32, length: f32| match far {
        true => side - length - margin,
        false => margin,
    };
    Area { x: at(right, canvas.width(), w), y: at(lower, canvas.height(), h), w, h }
}

impl Panels {
    /// Draws the panels: for a single target without an id score and maps, for many their number.
    pub fn draw(&mut self, canvas: &mut Canvas, frame: usize, targets: &[TargetResult]) {
        let (size, margin) = (text_size(canvas), margin(canvas));
        let estimate = match targets {
            [target] if target.id.is_none() => Some(&target.estimate),
            _ => None,
        };
        let words = match estimate {
            Some(estimate) => [frame.to_string(), score_label(estimate)],
            None => [frame.to_string(), counted(targets.len(), "target")],
        };
        let [number, label] = words.each_ref().map(|word| text::width(word, size));
        let inner = number + 0.9 * size + label;
        let status = [inner + 2.0 * margin, size + 2.2 * margin];
        let maps = estimate.and_then(|estimate| estimate.visibility.as_ref());
        let side = 13.0 * (2.6 * scale(canvas)).round();
        let legend = (0.8 * size).round();
        let map_size = [2.0 * side + 3.0 * margin, side + 2.5 * margin + legend];

        let taken = maps.map(|_| self.maps);
        self.status = free(canvas, self.status, status, targets, taken);
        let area = place(canvas, self.status, status);
        score(canvas, area, &words, estimate);
        if let Some(Visibility { large, small }) = maps {
            self.maps = free(canvas, self.maps, map_size, targets, Some(self.status));
            let area = place(canvas, self.maps, map_size);
            canvas.fill_round(area, margin * 0.7, PANEL, PANEL_OPACITY);
            let inner = Area { x: area.x + margin, y: area.y + margin, h: legend, ..area };
            explain(canvas, Area { w: area.w - 2.0 * margin, ..inner });
            let top = inner.y + legend + 0.5 * margin;
            for (k, map) in [large, small].into_iter().enumerate() {
                let x = area.x + margin + k as f32 * (side + margin);
                grid(canvas, map, Area { x, y: top, w: side, h: side });
            }
        }
    }
}

fn text_size(canvas: &Canvas) -> f32 {
    (12.0 * scale(canvas)).round()
}

fn margin(canvas: &Canvas) -> f32 {
    (6.0 * scale(canvas)).round()
}

/// The corner for a panel of this size: the last one, if no target is there, else the first one
/// that is free of targets and not taken by the other panel. If there is none, the last one.
fn free(
    canvas: &Canvas,
    last: Corner,
    size: [f32; 2],
    targets: &[TargetResult],
    taken: Option<Corner>,
) -> Corner {
    let is_free = |corner: &Corner| {
        let area = place(canvas, *corner, size);
        taken != Some(*corner) && !targets.iter().any(|target| covers(area, target))
    };
    let all = [last, UPPER_LEFT, UPPER_RIGHT, LOWER_RIGHT, LOWER_LEFT];
    all.into_iter().find(is_free).unwrap_or(last)
}

fn covers(area: Area, target: &TargetResult) -> bool {
    let [x, y, w, h] =
        [target.bbox.x, target.bbox.y, target.bbox.w, target.bbox.h].map(|v| v as f32);
    area.x < x + w && x < area.x + area.w && area.y < y + h && y < area.y + area.h
}

/// Frame number, score and status, with a bar for the score.
fn score(canvas: &mut Canvas, panel: Area, words: &[String; 2], estimate: Option<&Estimate>) {
    let (size, margin) = (text_size(canvas), margin(canvas));
    let (left, middle) = (panel.x + margin, panel.y + margin * 0.8 + size / 2.0);
    let (inner, colour) = (panel.w - 2.0 * margin, estimate.map_or(TEXT, colour));
    canvas.fill_round(panel, margin * 0.7, PANEL, PANEL_OPACITY);
    canvas.text(&words[0], left, middle, size, TEXT);
    let right = left + inner - text::width(&words[1], size);
    canvas.text(&words[1], right, middle, size, colour);
    if let Some(estimate) = estimate {
        let (y, h) = (panel.y + panel.h - margin * 0.85, (scale(canvas) * 2.0).round());
        let bar = Area { x: left, y, w: inner, h };
        canvas.fill(bar, [90, 98, 108], 0.8);
        canvas.fill(Area { w: inner * estimate.score.clamp(0.0, 1.0) as f32, ..bar }, colour, 1.0);
    }
}

/// What the colours of the maps mean, in these colours. A patch that is not explained is hidden, or
/// its looks have changed: the model cannot tell.
fn explain(canvas: &mut Canvas, area: Area) {
    let (middle, size) = (area.y + area.h / 2.0, area.h);
    canvas.text("visible", area.x, middle, size, VISIBLE);
    let right = area.x + area.w - text::width("hidden", size);
    canvas.text("hidden", right, middle, size, HIDDEN);
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
    use patchlock::{BoundingBox, Status};

    use super::super::example;
    use super::*;

    fn at(x: f64, y: f64) -> TargetResult {
        let mut target = example::target(Status::Tracked);
        target.bbox = BoundingBox { x, y, w: 300.0, h: 200.0 };
        target
    }

    /// The corners of both panels while the target goes through these places.
    fn corners(places: &[TargetResult]) -> Vec<[Corner; 2]> {
        let (mut panels, plain) = (Panels::default(), Canvas::plain(1280, 960, [100; 3]));
        let mut canvas = plain.expect("has pixels");
        let draw = |target: &TargetResult| {
            panels.draw(&mut canvas, 1, std::slice::from_ref(target));
            [panels.status, panels.maps]
        };
        places.iter().map(draw).collect()
    }

    #[test]
    fn the_colours_of_the_maps_are_named_beside_each_other() {
        let size = 12.0;
        for scale in [1.0, 2.0, 4.0] {
            let area = 2.0 * 13.0 * (2.6f32 * scale).round() + 6.0 * scale;
            let legend = (0.8 * size * scale).round();
            let words = text::width("visible", legend) + text::width("hidden", legend);
            assert!(words + 0.5 * legend < area, "{words} of {area}");
        }
    }

    #[test]
    fn panels_leave_the_corner_of_the_target_and_stay_where_they_are_then() {
        let (left, right) = (UPPER_LEFT, UPPER_RIGHT);
        let places = [at(400.0, 400.0), at(0.0, 0.0), at(400.0, 400.0), at(900.0, 0.0)];
        let status: Vec<_> = corners(&places).iter().map(|corners| corners[0]).collect();
        assert_eq!(status, [left, right, right, left]);
        let maps: Vec<_> =
            corners(&[at(400.0, 400.0), at(900.0, 700.0)]).iter().map(|c| c[1]).collect();
        assert_eq!(maps, [LOWER_RIGHT, UPPER_RIGHT]);
    }

    #[test]
    fn panels_never_share_a_corner_and_stay_if_the_target_is_everywhere() {
        let mut large = at(0.0, 0.0);
        (large.bbox.w, large.bbox.h) = (1280.0, 960.0);
        let places = [at(900.0, 700.0), at(0.0, 0.0), at(900.0, 0.0), large, at(0.0, 700.0)];
        let found = corners(&places);
        assert!(found.iter().all(|[status, maps]| status != maps), "{found:?}");
        assert_eq!(found[2], found[3]);
    }
}
