//! The search after a loss: the memory looks at a few windows of the frame at a time.

use super::place::Place;
use super::status::Phase;
use super::{Scratch, Target};
use crate::config::RobustConfig;
use crate::vision::frame::Frame;

/// Windows of the search overlap by this share of their side, as responses fade towards their borders.
const OVERLAP: f64 = 0.5;

/// A peak in a window is examined at its centre if it is above this share of what counts as found: the
/// window weakens it.
const PROMISING: f64 = 0.5;

/// Sizes, relative to the last one, of one pass over the frame after the other.
const SIZES: [f64; 4] = [1.0, 1.2, 0.8, 1.0];

/// Sizes, relative to the last one, that are tried at a place that was found.
const TRIED: [f64; 3] = [1.0, 0.8, 1.25];

impl Target {
    /// Looks at the last place and at some more windows. Goes to the place that the memory knows best if that
    /// counts as found, and says whether it did.
    pub fn search(
        &mut self,
        frame: &Frame<'_>,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> bool {
        let (last, Phase::Lost { next }) = (self.place, self.phase) else { return false };
        let windows = config.search_windows as u64;
        let mut best = (config.found_above, None);
        for number in 0..windows {
            // The first window of each frame is around the last place.
            let place = match number {
                0 => last,
                _ => self.window_place(frame, last, next + number - 1),
            };
            if let Some((certainty, found)) = self.look_around(frame, place, config, scratch)
                && certainty > best.0
            {
                best = (certainty, Some(found));
            }
        }
        let (certainty, Some(found)) = best else {
            self.phase = Phase::Lost { next: next + windows - 1 };
            return false;
        };
        self.place = self.best_size(frame, (certainty, found), last.scale, config, scratch);
        self.follower.begin_from_memory();
        self.follower.elsewhere = 0;
        self.phase = Phase::Trial { left: config.trial as u32, back: last };
        true
    }

    /// The size that the memory knows best at a place that was found with this certainty. The window in which
    /// a target is found may have any size of the search, and the target would keep it: the scale filter
    /// learns from there on.
    fn best_size(
        &self,
        frame: &Frame<'_>,
        found: (f64, Place),
        last: f64,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> Place {
        let mut best = found;
        for size in TRIED {
            let place = Place { scale: last * size, ..found.1 };
            if let Some((certainty, place)) = self.look_around(frame, place, config, scratch)
                && certainty > best.0
            {
                best = (certainty, place);
            }
        }
        best.1
    }

    /// The place of a window of the search: row by row over the frame, then again in another size.
    fn window_place(&self, frame: &Frame<'_>, last: Place, number: u64) -> Place {
        let step = |pass: u64| {
            let scale = last.scale * SIZES[(pass % SIZES.len() as u64) as usize];
            (scale, self.window.side(scale) * (1.0 - OVERLAP))
        };
        let count = |length: usize, step: f64| (length as f64 / step).ceil().max(1.0) as u64;
        let (mut pass, mut number) = (0, number);
        // Passes have nearly the same number of windows, so whole cycles of them can be skipped.
        let windows = |pass: u64| {
            let (_, step) = step(pass);
            count(frame.width(), step) * count(frame.height(), step)
        };
        let cycle: u64 = (0..SIZES.len() as u64).map(windows).sum();
        number %= cycle;
        while number >= windows(pass) {
            number -= windows(pass);
            pass += 1;
        }
        let (scale, step) = step(pass);
        let (columns, rows) = (count(frame.width(), step), count(frame.height(), step));
        let middle =
            |k: u64, count: u64, length: usize| (k as f64 + 0.5) * length as f64 / count as f64;
        let centre = [
            middle(number % columns, columns, frame.width()),
            middle(number / columns, rows, frame.height()),
        ];
        Place { centre, scale, rotation: last.rotation }
    }

    /// The memory's best place in the window around a place, with how sure it is there.
    fn look_around(
        &self,
        frame: &Frame<'_>,
        mut place: Place,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> Option<(f64, Place)> {
        let fourier = self.window.features().fourier();
        self.window.sample(frame, place, scratch);
        scratch.memory.fill(fourier, &self.follower.memory, &scratch.sample);
        let peak = scratch.memory.peak(fourier);
        if peak.value < PROMISING * config.found_above * self.follower.mean {
            return None;
        }
        let cell = self.window.cell(place.scale);
        place.shift(peak.shift.map(|cells| cells * cell));
        place.keep_within(frame, self.window.base());
        self.window.sample(frame, place, scratch);
        Some((self.follower.certainty(&self.window, scratch), place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::TrackerConfig;
    use crate::vision::geometry::BoundingBox;
    use patchlock_scene::Scene;

    #[test]
    fn what_is_found_in_a_window_of_another_size_gets_its_own() {
        let scene = Scene::demo();
        let (rendered, [x, y, w, h]) = (scene.frame(0), scene.truth(0).bbox);
        let frame = Frame::rgb8(&rendered.rgb, rendered.width, rendered.height).unwrap();
        let (config, mut scratch) = (TrackerConfig::default(), Scratch::default());
        let bbox = BoundingBox { x, y, w, h };
        let (target, _) = Target::begin(&frame, bbox, &config, &mut scratch);
        let rules = &config.robust;
        for size in SIZES {
            let place = Place { scale: size, ..target.place };
            let found = target.look_around(&frame, place, rules, &mut scratch).unwrap();
            assert_eq!(found.1.scale, size);
            let best = target.best_size(&frame, found, 1.0, rules, &mut scratch);
            assert_eq!(best.scale, 1.0, "found at {size}");
            let [x, y] = [0, 1].map(|axis| best.centre[axis] - bbox.centre()[axis]);
            assert!(x.hypot(y) < 1.0, "found at {size}: {x}, {y} from the target");
        }
    }
}
