//! The search after a loss: the memory looks at a few windows of the frame at a time.

use super::locate::FrameContext;
use super::pose::Pose;
use super::window::{SampleBuffers, Window};
use crate::config::RobustConfig;
use crate::correlation::response::ResponseBuffers;
use crate::vision::frame::FrameSize;

/// How a frame is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchParams {
    /// Windows on each frame, the one around the last place included.
    pub windows: u64,
    /// A place is found where the memory is more certain than this.
    above: f64,
    /// A peak in a window is examined at its centre if it is above this share of `above`: the
    /// window weakens it.
    promising: f64,
    /// Windows overlap by this share of their side, as responses fade towards their borders.
    overlap: f64,
    /// Sizes, relative to the last one, of one pass over the frame after the other.
    sizes: [f64; 4],
    /// Sizes, relative to the last one, that are tried at a place that was found.
    tried: [f64; 3],
    /// Of what is found while an unseen target is followed, at least this share is visible.
    pub least_visible: f64,
}

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

impl SearchParams {
    pub fn new(config: &RobustConfig) -> Self {
        Self {
            windows: config.search_windows as u64,
            above: config.found_above,
            promising: config.found_promising,
            overlap: config.search_overlap,
            sizes: [1.0, config.search_larger, config.search_smaller, 1.0],
            tried: [1.0, config.found_smaller, config.found_larger],
            least_visible: config.seen_again,
        }
    }
}

impl Searcher<'_> {
    /// Looks at the last place and at some more windows, from number `next` of the search on.
    /// Returns the place that the memory knows best, if that counts as found.
    pub fn search(&mut self, last: Pose, next: u64, params: &SearchParams) -> Option<Detection> {
        let poses = self.windows(last, next, params).take(params.windows as usize);
        let found = self.best(None, poses, params)?;
        // The window in which a target is found may have any size of the search, and the target
        // would keep it: the scale filter learns from there on.
        let sizes = params.tried.map(|size| Pose { scale: last.scale * size, ..found.pose });
        self.best(Some(found), sizes, params)
    }

    /// The places whose windows are looked at: the last one, then those of the search from number
    /// `next` on.
    pub fn windows(
        &self,
        last: Pose,
        next: u64,
        params: &SearchParams,
    ) -> impl Iterator<Item = Pose> + use<> {
        let FrameContext { frame, window, .. } = self.context;
        let passes = Passes::new((frame.size(), window), last, params);
        std::iter::once(last).chain((next..).map(move |number| passes.pose(number)))
    }

    /// How certain the memory is of a place.
    pub fn certainty(&mut self, pose: Pose) -> f64 {
        let FrameContext { frame, window, memory } = self.context;
        let sample = window.sample(frame, pose, self.sample);
        memory.certainty(memory.respond(&sample, self.response))
    }

    /// What the memory knows best: what was found before, or a place in the windows around these.
    fn best(
        &mut self,
        before: Option<Detection>,
        windows: impl IntoIterator<Item = Pose>,
        params: &SearchParams,
    ) -> Option<Detection> {
        let mut best = before;
        for around in windows {
            let least = best.map_or(params.above, |found| found.certainty);
            let found = self.look_around(around, params);
            best = found.filter(|found| found.certainty > least).or(best);
        }
        best
    }

    /// The memory's best place in the window around a place, unless its response is too weak to go
    /// there.
    fn look_around(&mut self, around: Pose, params: &SearchParams) -> Option<Detection> {
        let FrameContext { frame, window, memory } = self.context;
        let Self { sample: buffers, response, .. } = self;
        let sample = window.sample(frame, around, buffers);
        let hypothesis = memory.propose(&sample, memory.respond(&sample, response));
        if hypothesis.response < params.promising * params.above * memory.mean() {
            return None;
        }
        let pose = window.keep(hypothesis.pose, frame);
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
    fn new((frame, window): (FrameSize, &Window), last: Pose, params: &SearchParams) -> Self {
        let passes = params.sizes.map(|size| {
            let scale = last.scale * size;
            let step = window.side(scale) * (1.0 - params.overlap);
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
    use crate::robust::tracking_filter::TrackingFilter;
    use crate::robust::window::tests::window;
    use crate::vision::frame::Frame;
    use crate::vision::geometry::BoundingBox;
    use patchlock_scene::Scene;

    const FRAME: FrameSize = FrameSize { width: 320, height: 240 };

    /// At this scale, the window has a side of 80 pixels.
    const LAST: Pose = Pose { centre: [7.0, 9.0], scale: 1.25, rotation: 0.3 };

    fn params() -> SearchParams {
        SearchParams::new(&RobustConfig::default())
    }

    /// The windows of two rounds of passes, pass by pass.
    fn rounds() -> Vec<Vec<Pose>> {
        let (passes, mut next) = (Passes::new((FRAME, &window()), LAST, &params()), 0);
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
        let passes = Passes::new((FRAME, &window()), Pose { scale: 20.0, ..LAST }, &params());
        for (number, scale) in [20.0, 24.0, 16.0, 20.0, 20.0].into_iter().enumerate() {
            let pose = passes.pose(number as u64);
            assert_eq!((pose.centre, pose.scale), ([160.0, 120.0], scale));
        }
    }

    /// Calls with a searcher whose memory has learnt the target of the demo in its box, in that
    /// very frame.
    fn with_searcher(check: impl FnOnce(&mut Searcher<'_>, Pose, &SearchParams)) {
        let scene = Scene::demo();
        let (rendered, [x, y, w, h]) = (scene.frame(0), scene.truth(0).bbox);
        let frame = Frame::rgb8(&rendered.rgb, rendered.width, rendered.height).unwrap();
        let (config, bbox) = (RobustConfig::default(), BoundingBox { x, y, w, h });
        let (mut sample, mut response) = (SampleBuffers::default(), ResponseBuffers::default());
        let window = Window::begin(&frame, bbox, &config, &mut sample);
        let (pose, params) = (Pose::first(bbox), SearchParams::new(&config));
        let first = window.sample(&frame, pose, &mut sample);
        let tracking_filter = TrackingFilter::begin(&first, &config, &mut FilterScratch::default());
        let memory = Memory::begin(&first, tracking_filter.filter(), &config, &mut response);
        let mut searcher = Searcher {
            context: FrameContext { frame: &frame, window: &window, memory: &memory },
            sample: &mut sample,
            response: &mut response,
        };
        check(&mut searcher, pose, &params);
    }

    #[test]
    fn what_is_found_in_a_window_of_another_size_gets_its_own() {
        with_searcher(|searcher, target, params| {
            let once = SearchParams { windows: 1, ..*params };
            for size in params.sizes {
                let pose = Pose { scale: size, ..target };
                let found = searcher.look_around(pose, params).unwrap();
                assert_eq!(found.pose.scale, size);
                let sizes = params.tried.map(|size| Pose { scale: size, ..found.pose });
                let best = searcher.best(Some(found), sizes, params).unwrap().pose;
                assert_eq!(best.scale, 1.0, "found at {size}");
                let [x, y] = [0, 1].map(|axis| best.centre[axis] - target.centre[axis]);
                assert!(x.hypot(y) < 1.0, "found at {size}: {x}, {y} from the target");
            }
            let found = searcher.search(target, 0, &once).unwrap().pose;
            assert_eq!(found.scale, 1.0);
        });
    }

    #[test]
    fn the_target_is_found_wherever_the_search_began_and_not_below_the_limit() {
        with_searcher(|searcher, target, params| {
            let far = Pose { centre: [0.0, 0.0], ..target };
            let FrameContext { frame, window, .. } = searcher.context;
            let passes = Passes::new((frame.size(), window), target, params).passes;
            let all = SearchParams { windows: passes.iter().map(Pass::windows).sum(), ..*params };
            let found = searcher.search(far, 0, &all).unwrap().pose;
            let [x, y] = [0, 1].map(|axis| found.centre[axis] - target.centre[axis]);
            assert!(x.hypot(y) < 1.0, "{x}, {y} from the target");
            let strict = SearchParams { windows: passes[0].windows(), above: 1e6, ..*params };
            assert_eq!(searcher.search(target, 0, &strict), None);
        });
    }
}
