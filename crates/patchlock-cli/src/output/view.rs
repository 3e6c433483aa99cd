//! What annotated videos show of a frame: all of it, or the part around the target.

use anyhow::{Context, Result};
use patchlock::BoundingBox;
use patchlock_drawing::canvas::{Area, Canvas};

use super::draw::annotate_on;
use super::panels::Panels;
use super::{TargetResult, TrackedFrame};

/// Sides of a cropped video in pixels: smaller parts are enlarged, larger ones reduced.
const LEAST_SIDE: f64 = 240.0;
const MOST_SIDE: f64 = 960.0;

/// The part shown grows and shrinks by this share of what the target does, so that it does not
/// tremble.
const ZOOM_RATE: f64 = 0.05;

/// Draws one frame after the other.
#[derive(Debug)]
pub struct View {
    panels: Option<Panels>,
    crop: Option<Crop>,
}

/// The part around a target.
#[derive(Debug)]
struct Crop {
    /// Its side in larger sides of the target's box.
    sides: f64,
    /// The larger side of the box, smoothed; 0 before the first frame.
    target: f64,
    /// The side of the video.
    pixels: usize,
}

impl View {
    /// A view that has drawn nothing yet: with panels of score and patches or without, and with the
    /// part around the target, whose side is in sides of its box, or with the whole frame.
    pub fn new(panels: bool, crop: Option<f64>) -> Self {
        let crop = crop.map(|sides| Crop { sides, target: 0.0, pixels: 0 });
        Self { panels: panels.then(Panels::default), crop }
    }

    /// The annotated frame.
    ///
    /// # Errors
    /// If the frame is too large to be drawn on.
    pub fn draw(&mut self, tracked: &TrackedFrame<'_>) -> Result<Canvas> {
        let (width, height) = (tracked.picture.width, tracked.picture.height);
        let whole = Canvas::from_rgb(width, height, &tracked.picture.to_rgb());
        let mut whole =
            whole.with_context(|| format!("cannot draw on {width} x {height} pixels"))?;
        let panels = self.panels.as_mut();
        if let (Some(crop), [target]) = (&mut self.crop, tracked.targets) {
            let (mut part, target) = crop.cut(&whole, target)?;
            annotate_on(&mut part, tracked.frame, &[target], panels);
            return Ok(part);
        }
        annotate_on(&mut whole, tracked.frame, tracked.targets, panels);
        Ok(whole)
    }
}

impl Crop {
    /// The part of the frame around the target, and the target there.
    fn cut(&mut self, frame: &Canvas, target: &TargetResult) -> Result<(Canvas, TargetResult)> {
        let BoundingBox { w, h, .. } = target.bbox;
        if self.pixels == 0 {
            self.target = w.max(h);
            // Encoders want even sides.
            let side = (self.sides * self.target).clamp(LEAST_SIDE, MOST_SIDE);
            self.pixels = 2 * (side / 2.0).round() as usize;
        }
        self.target += ZOOM_RATE * (w.max(h) - self.target);
        let side = self.sides * self.target;
        let [x, y] = target.bbox.centre().map(|centre| centre + 0.5 - side / 2.0);
        let area = Area { x: x as f32, y: y as f32, w: side as f32, h: side as f32 };
        let part = frame.part(area, self.pixels).context("the video has no pixels")?;
        let scale = self.pixels as f64 / side;
        Ok((part, target.placed([x, y], scale)))
    }
}

#[cfg(test)]
mod tests {
    use patchlock::Status;

    use super::super::example;
    use super::*;

    /// The part around a box follows it, and the box is drawn in its middle.
    #[test]
    fn the_target_stays_in_the_middle_of_its_part() {
        let mut view = View::new(false, Some(3.0));
        for k in 0..5 {
            let mut target = example::target(Status::Tracked);
            target.bbox = BoundingBox { x: 250.0 * k as f64, y: 300.0, w: 100.0, h: 60.0 };
            let [x, y] = target.bbox.centre();
            let corner = |dx: f64, dy: f64| [x + 50.0 * dx, y + 30.0 * dy];
            target.estimate.corners =
                [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            let canvas = view.draw(&example::tracked(k, &[target])).expect("draws");
            assert_eq!((canvas.width(), canvas.height()), (300.0, 300.0));
            let rgb = canvas.to_rgb();
            let drawn: Vec<usize> = (0..300).filter(|x| rgb[(150 * 300 + x) * 3] != 100).collect();
            // Left and right of the box; the rest is grey, or black outside the frame.
            let white: Vec<_> =
                drawn.into_iter().filter(|x| rgb[(150 * 300 + x) * 3 + 1] > 120).collect();
            let (first, last) = (white[0] as f64, white[white.len() - 1] as f64);
            assert!((first - 100.0).abs() < 4.0 && (last - 200.0).abs() < 4.0, "{k}: {white:?}");
        }
    }

    #[test]
    fn parts_of_small_targets_are_enlarged_and_of_large_ones_reduced() {
        for (w, side) in [(10.0, 240.0), (900.0, 960.0)] {
            let mut target = example::target(Status::Tracked);
            target.bbox = BoundingBox { x: 100.0, y: 30.0, w, h: 8.0 };
            let mut view = View::new(true, Some(2.5));
            let canvas = view.draw(&example::tracked(0, &[target])).expect("draws");
            assert_eq!([canvas.width(), canvas.height()], [side; 2]);
        }
    }
}
