//! Draws the track on a frame: box and rotated outline, and the panels with score and patches; of
//! many targets, each with its id and in its own colour. Lines are solid when the target is tracked,
//! dashed when that is uncertain; of a lost target only the box is drawn, which is what is still
//! followed or the last known one, thin and grey, with the word LOST.

use patchlock::{Estimate, Status};
use patchlock_drawing::canvas::{Canvas, Line};
use patchlock_drawing::{LOST, lost_box, scale, tag, upright};

use super::TargetResult;
use super::panels::Panels;

/// Visible patches and high scores. Teal and orange can be told apart with any colour vision.
pub const VISIBLE: [u8; 3] = [46, 211, 183];
/// Hidden patches and low scores.
pub const HIDDEN: [u8; 3] = [255, 127, 40];
/// The upright box.
pub const BOX: [u8; 3] = [255, 255, 255];

/// Colours of many targets by id: the palette of Okabe and Ito, lightened to stand out on most frames.
const COLOURS: [[u8; 3]; 7] = [
    [255, 138, 76],
    [87, 177, 238],
    [47, 201, 155],
    [238, 156, 203],
    [242, 187, 58],
    [155, 220, 255],
    [230, 234, 240],
];

/// Draws targets on a canvas, and the panels, if they are wanted.
pub fn annotate_on(
    canvas: &mut Canvas,
    frame: usize,
    targets: &[TargetResult],
    panels: Option<&mut Panels>,
) {
    match targets {
        [target] if target.id.is_none() => {
            let colour = by_score(target.estimate.score);
            let thin = (upright(target.bbox), 1.0, BOX);
            outlines(canvas, target, [thin, (outline(target), 1.8, colour)]);
            if target.estimate.status == Status::Lost {
                tag(canvas, target.bbox, "LOST", LOST);
            }
        }
        targets => {
            for target in targets {
                let (outline, colour) = (outline(target), by_id(target));
                let thick = (upright(target.bbox), 1.8, colour);
                outlines(canvas, target, [(outline, 0.8, colour), thick]);
            }
            // Last, so that no line covers them.
            targets.iter().for_each(|target| name(canvas, target));
        }
    }
    if let Some(panels) = panels {
        panels.draw(canvas, frame, targets);
    }
}

/// The corners of the target's outline, on the canvas. They are points, and a point with integer
/// coordinates is the centre of a pixel.
fn outline(target: &TargetResult) -> [[f32; 2]; 4] {
    target.estimate.corners.map(|corner| corner.map(|value| value as f32 + 0.5))
}

/// Draws these outlines of the target, each with its width and colour; of a lost one only its box.
fn outlines(
    canvas: &mut Canvas,
    target: &TargetResult,
    outlines: [([[f32; 2]; 4], f32, [u8; 3]); 2],
) {
    let dashed = match target.estimate.status {
        Status::Tracked => false,
        Status::Uncertain => true,
        Status::Lost => return lost_box(canvas, target.bbox),
    };
    let scale = scale(canvas);
    for (corners, width, colour) in outlines {
        canvas.outline(&corners, Line { width: width * scale, colour, dashed });
    }
}

/// Name or id, and score, above the box.
fn name(canvas: &mut Canvas, target: &TargetResult) {
    let id = || target.id.unwrap_or(1).to_string();
    let called = target.name.as_deref().map_or_else(id, str::to_owned);
    let label = match target.estimate.status {
        Status::Lost => format!("{called}  LOST"),
        Status::Tracked | Status::Uncertain => format!("{called}  {:.2}", target.estimate.score),
    };
    tag(canvas, target.bbox, &label, by_id(target));
}

fn by_id(target: &TargetResult) -> [u8; 3] {
    let id = target.id.unwrap_or(1);
    COLOURS[(id.wrapping_sub(1) % COLOURS.len() as u64) as usize]
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

#[cfg(test)]
mod tests {
    use patchlock::BoundingBox;
    use patchlock_drawing::PANEL;

    use super::super::example;
    use super::super::view::View;
    use super::*;

    /// The frame with targets of this status, with ids if `many`.
    fn drawn(status: Status, many: bool) -> Vec<u8> {
        let bbox = BoundingBox { x: 300.0, y: 300.0, w: 600.0, h: 400.0 };
        let mut target = example::target(status);
        (target.bbox, target.id) = (bbox, many.then_some(1));
        // The outline is far inside the upright box.
        target.estimate.corners = [[400.0, 400.0], [800.0, 400.0], [800.0, 600.0], [400.0, 600.0]];
        let drawn = View::new(true, None).draw(&example::tracked(3, &[target]));
        drawn.expect("draws").to_rgb()
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
        let label = |status| score_label(&example::target(status).estimate);
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
