//! The search after a loss: the memory looks at a few windows of the frame at a time.

use super::RobustConfig;
use super::locate::FrameContext;
use super::pose::Pose;
use super::window::{SampleBuffers, Window};
use crate::correlation::response::ResponseBuffers;
use crate::vision::frame::FrameSize;

/// A place that the memory found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Detection {
    pub pose: Pose,
    pub certainty: f64,
}

/// The memory, looking at windows of one frame.
pub(crate) struct Searcher<'a> {
    pub context: FrameContext<'a>,
    pub sample: &'a mut SampleBuffers,
    pub response: &'a mut ResponseBuffers,
}

impl Searcher<'_> {
    /// Looks at the last place and at some more windows, from number `next` of the search on.
    /// Returns the place that the memory knows best, if that counts as found.
    pub fn search(&mut self, last: Pose, next: u64) -> Option<Detection> {
        let poses = self.windows(last, next).take(self.context.config.search_windows);
        let found = self.best(None, poses)?;
        self.in_best_size(found, last.scale)
    }

    /// A place that was found, in the size around this scale that the memory knows best. The window
    /// in which a target is found may have any size of the search, and the target would keep it: the
    /// scale filter learns from there on.
    fn in_best_size(&mut self, found: Detection, scale: f64) -> Option<Detection> {
        let config = self.context.config;
        let sizes = [1.0, config.found_smaller, config.found_larger];
        let poses = sizes.map(|size| Pose { scale: scale * size, ..found.pose });
        self.best(Some(found), poses)
    }

    /// The places whose windows are looked at: the last one, then those of the search from number
    /// `next` on.
    pub fn windows(&self, last: Pose, next: u64) -> impl Iterator<Item = Pose> + use<> {
        let FrameContext { frame, window, config, .. } = self.context;
        let passes = Passes::new((frame.size(), window), last, config);
        std::iter::once(last).chain((next..).map(move |number| passes.pose(number)))
    }

    /// How certain the memory is of a place.
    pub fn certainty(&mut self, pose: Pose) -> f64 {
        let FrameContext { frame, window, memory, .. } = self.context;
        let sample = window.sample(frame, pose, self.sample);
        memory.certainty(memory.respond(&sample, self.response))
    }

    /// What the memory knows best: what was found before, or a place in the windows around these.
    fn best(
        &mut self,
        before: Option<Detection>,
        windows: impl IntoIterator<Item = Pose>,
    ) -> Option<Detection> {
        let mut best = before;
        for around in windows {
            let least = best.map_or(self.context.config.found_above, |found| found.certainty);
            let found = self.look_around(around);
            best = found.filter(|found| found.certainty > least).or(best);
        }
        best
    }

    /// The memory's best place in the window around a place, unless its response is too weak to go
    /// there.
    fn look_around(&mut self, around: Pose) -> Option<Detection> {
        let FrameContext { frame, window, memory, config } = self.context;
        let Self { sample: buffers, response, .. } = self;
        let sample = window.sample(frame, around, buffers);
        let hypothesis = memory.propose(&sample, memory.respond(&sample, response));
        // The window weakens a peak that is not at its centre.
        if hypothesis.response < config.found_promising * config.found_above * memory.mean() {
            return None;
        }
        let pose = self.context.keep(hypothesis.pose);
        Some(Detection { pose, certainty: self.certainty(pose) })
    }
}

/// The windows of a search: over the frame, then again in another size.
#[derive(Debug)]
struct Passes {
    frame: FrameSize,
    last: Pose,
    passes: [Pass; 4],
}

/// One pass over the frame: windows of one size, in rows and columns.
#[derive(Debug, Clone, Copy)]
struct Pass {
    scale: f64,
    columns: u64,
    rows: u64,
}

impl Passes {
    /// The search for a target that was last at this place.
    fn new((frame, window): (FrameSize, &Window), last: Pose, config: &RobustConfig) -> Self {
        let sizes = [1.0, config.search_larger, config.search_smaller, 1.0];
        let passes = sizes.map(|size| {
            let scale = last.scale * size;
            // Windows overlap, as responses fade towards their borders.
            let step = window.side(scale) * (1.0 - config.search_overlap);
            let count = |length: usize| (length as f64 / step).ceil().max(1.0) as u64;
            Pass { scale, columns: count(frame.width), rows: count(frame.height) }
        });
        Self { frame, last, passes }
    }

    /// The place of the window with this number; after the last one, the first comes again.
    fn pose(&self, number: u64) -> Pose {
        let mut number = number % self.passes.iter().map(Pass::windows).sum::<u64>();
        let mut current = self.passes[0];
        for pass in self.passes {
            current = pass;
            if number < pass.windows() {
                break;
            }
            number -= pass.windows();
        }
        let Pass { scale, columns, rows } = current;
        let lengths = [self.frame.width as f64, self.frame.height as f64];
        let counts = [columns, rows];
        let cell = [number % columns, number / columns];
        let [x, y] =
            [0, 1].map(|axis| (cell[axis] as f64 + 0.5) * lengths[axis] / counts[axis] as f64);
        Pose { centre: [x, y], scale, ..self.last }
    }
}

impl Pass {
    fn windows(&self) -> u64 {
        self.columns * self.rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::filter::FilterScratch;
    use crate::robust::memory::Memory;
    use crate::robust::tracking_filter::learner;
    use crate::robust::window::tests::window;
    use crate::vision::frame::Frame;
    use crate::vision::geometry::BoundingBox;
    use patchlock_scene::Scene;

    const FRAME: FrameSize = FrameSize { width: 320, height: 240 };

    /// At this scale, the window has a side of 80 pixels.
    const LAST: Pose = Pose { centre: [7.0, 9.0], scale: 1.25, rotation: 0.3 };

    /// The windows of two rounds of passes, pass by pass.
    fn rounds() -> Vec<Vec<Pose>> {
        let (passes, mut next) =
            (Passes::new((FRAME, &window()), LAST, &RobustConfig::default()), 0);
        let pass = |number: usize| {
            let first = next;
            next += passes.passes[number % 4].windows();
            (first..next).map(|number| passes.pose(number)).collect()
        };
        (0..8).map(pass).collect()
    }

    #[test]
    fn each_pass_has_one_size() {
        for (number, poses) in rounds().iter().enumerate() {
            let scale = [1.25, 1.5, 1.0, 1.25][number % 4];
            for pose in poses {
                assert_eq!((pose.scale, pose.rotation), (scale, LAST.rotation));
            }
        }
    }

    #[test]
    fn each_pass_covers_the_frame() {
        for poses in rounds() {
            // In the middle half of a window, the response has not faded.
            let reach = window().side(poses[0].scale) / 4.0;
            let points = (0..240).step_by(7).flat_map(|y| (0..320).step_by(7).map(move |x| (x, y)));
            for (x, y) in points {
                let near = |pose: &Pose| {
                    let [cx, cy] = pose.centre;
                    (cx - f64::from(x)).abs() <= reach && (cy - f64::from(y)).abs() <= reach
                };
                assert!(poses.iter().any(near), "{x}, {y} at scale {}", poses[0].scale);
            }
        }
    }

    #[test]
    fn windows_go_row_by_row_and_begin_again() {
        let rounds = rounds();
        assert_eq!(
            [0, 1, 8].map(|k| rounds[0][k].centre),
            [[20.0, 20.0], [60.0, 20.0], [20.0, 60.0]]
        );
        assert_eq!(rounds[..4], rounds[4..]);
    }

    #[test]
    fn a_window_larger_than_the_frame_is_the_only_one_of_its_pass() {
        let (config, last) = (RobustConfig::default(), Pose { scale: 20.0, ..LAST });
        let passes = Passes::new((FRAME, &window()), last, &config);
        for (number, scale) in [20.0, 24.0, 16.0, 20.0, 20.0].into_iter().enumerate() {
            let pose = passes.pose(number as u64);
            assert_eq!((pose.centre, pose.scale), ([160.0, 120.0], scale));
        }
    }

    /// Calls with a searcher whose memory has learnt the target of the demo in its box, in that
    /// very frame.
    fn with_searcher(config: &RobustConfig, check: impl FnOnce(&mut Searcher<'_>, Pose)) {
        let scene = Scene::demo();
        let (rendered, [x, y, w, h]) = (scene.frame(0), scene.truth(0).bbox);
        let frame = Frame::rgb8(&rendered.rgb, rendered.width, rendered.height).unwrap();
        let bbox = BoundingBox { x, y, w, h };
        let (mut sample, mut response) = (SampleBuffers::default(), ResponseBuffers::default());
        let window = Window::begin(&frame, bbox, config, &mut sample);
        let pose = Pose::first(bbox);
        let first = window.sample(&frame, pose, &mut sample);
        let learner = learner(&window, config);
        let filter = learner.begin(window.fourier(), first.spectra, &mut FilterScratch::default());
        let memory = Memory::begin(&first, &filter, &mut response);
        let mut searcher = Searcher {
            context: FrameContext { frame: &frame, window: &window, memory: &memory, config },
            sample: &mut sample,
            response: &mut response,
        };
        check(&mut searcher, pose);
    }

    #[test]
    fn what_is_found_in_a_window_of_another_size_gets_its_own() {
        let config = RobustConfig { search_windows: 1, ..Default::default() };
        with_searcher(&config, |searcher, target| {
            for size in [1.0, config.search_larger, config.search_smaller] {
                let pose = Pose { scale: size, ..target };
                let found = searcher.look_around(pose).unwrap();
                assert_eq!(found.pose.scale, size);
                let best = searcher.in_best_size(found, target.scale).unwrap().pose;
                assert_eq!(best.scale, 1.0, "found at {size}");
                let [x, y] = [0, 1].map(|axis| best.centre[axis] - target.centre[axis]);
                assert!(x.hypot(y) < 1.0, "found at {size}: {x}, {y} from the target");
            }
            let found = searcher.search(target, 0).unwrap().pose;
            assert_eq!(found.scale, 1.0);
        });
    }

    #[test]
    fn the_target_is_found_wherever_the_search_began_and_not_below_the_limit() {
        let mut config = RobustConfig::default();
        let mut counts = [0; 4];
        with_searcher(&config, |searcher, target| {
            let FrameContext { frame, window, config, .. } = searcher.context;
            let passes = Passes::new((frame.size(), window), target, config).passes;
            counts = passes.map(|pass| pass.windows() as usize);
        });
        config.search_windows = counts.iter().sum();
        with_searcher(&config, |searcher, target| {
            let far = Pose { centre: [0.0, 0.0], ..target };
            let found = searcher.search(far, 0).unwrap().pose;
            let [x, y] = [0, 1].map(|axis| found.centre[axis] - target.centre[axis]);
            assert!(x.hypot(y) < 1.0, "{x}, {y} from the target");
        });
        config = RobustConfig { search_windows: counts[0], found_above: 1e6, ..config };
        with_searcher(&config, |searcher, target| assert_eq!(searcher.search(target, 0), None));
    }
}
