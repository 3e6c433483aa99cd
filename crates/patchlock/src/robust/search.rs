//! The search after a loss: the memory looks at a few windows of the frame at a time.

use super::locate::Setting;
use super::place::Place;
use super::window::SampleBuffers;
use crate::config::RobustConfig;
use crate::correlation::response::ResponseBuffers;
use crate::vision::frame::FrameSize;

/// Windows of the search overlap by this share of their side, as responses fade towards their borders.
const OVERLAP: f64 = 0.5;

/// A peak in a window is examined at its centre if it is above this share of what counts as found: the
/// window weakens it.
const PROMISING: f64 = 0.5;

/// Sizes, relative to the last one, of one pass over the frame after the other.
const SIZES: [f64; 4] = [1.0, 1.2, 0.8, 1.0];

/// Sizes, relative to the last one, that are tried at a place that was found.
const TRIED: [f64; 3] = [1.0, 0.8, 1.25];

/// How a frame is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchParams {
    /// Windows on each frame, the one around the last place included.
    pub windows: u64,
    /// A place is found where the memory is more certain than this.
    above: f64,
}

/// A place that the memory found.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Found {
    place: Place,
    certainty: f64,
}

/// The memory, looking at windows of one frame.
pub(crate) struct Searcher<'a> {
    pub setting: Setting<'a>,
    pub sample: &'a mut SampleBuffers,
    pub response: &'a mut ResponseBuffers,
}

impl SearchParams {
    pub fn new(config: &RobustConfig) -> Self {
        Self { windows: config.search_windows as u64, above: config.found_above }
    }
}

impl Searcher<'_> {
    /// Looks at the last place and at some more windows, from number `next` of the search on. Returns the
    /// place that the memory knows best, if that counts as found.
    pub fn search(&mut self, last: Place, next: u64, params: &SearchParams) -> Option<Place> {
        let Setting { frame, window, .. } = self.setting;
        let (frame, side) = (frame.size(), window.side(1.0));
        let others = (next..).map(|number| window_place(frame, side, last, number));
        let places = std::iter::once(last).chain(others).take(params.windows as usize);
        let found = self.best(None, places, params)?;
        // The window in which a target is found may have any size of the search, and the target would keep it:
        // the scale filter learns from there on.
        let sizes = TRIED.map(|size| Place { scale: last.scale * size, ..found.place });
        self.best(Some(found), sizes, params).map(|found| found.place)
    }

    /// What the memory knows best: what was found before, or a place in the windows around these.
    fn best(
        &mut self,
        before: Option<Found>,
        windows: impl IntoIterator<Item = Place>,
        params: &SearchParams,
    ) -> Option<Found> {
        let mut best = before;
        for around in windows {
            let least = best.map_or(params.above, |found| found.certainty);
            let found = self.look_around(around, params);
            best = found.filter(|found| found.certainty > least).or(best);
        }
        best
    }

    /// The memory's best place in the window around a place, unless its response is too weak to go there.
    fn look_around(&mut self, around: Place, params: &SearchParams) -> Option<Found> {
        let Setting { frame, window, memory } = self.setting;
        let Self { sample: buffers, response, .. } = self;
        let sample = window.sample(frame, around, buffers);
        let hypothesis = memory.propose(&sample, memory.respond(&sample, response));
        if hypothesis.response < PROMISING * params.above * memory.mean() {
            return None;
        }
        let place = hypothesis.place.kept_within(frame.size(), window.base());
        let sample = window.sample(frame, place, buffers);
        let certainty = memory.certainty(memory.respond(&sample, response));
        Some(Found { place, certainty })
    }
}

/// The windows of one pass over the frame, in rows and columns.
#[derive(Debug, Clone, Copy)]
struct Pass {
    scale: f64,
    columns: u64,
    rows: u64,
}

impl Pass {
    /// The pass with this number. `side` is that of a window in the frame, at scale 1.
    fn new(frame: FrameSize, side: f64, last: Place, number: usize) -> Self {
        let scale = last.scale * SIZES[number % SIZES.len()];
        let step = side * scale * (1.0 - OVERLAP);
        let count = |length: usize| (length as f64 / step).ceil().max(1.0) as u64;
        Self { scale, columns: count(frame.width), rows: count(frame.height) }
    }

    fn windows(self) -> u64 {
        self.columns * self.rows
    }
}

/// The place of a window of the search: row by row over the frame, then again in another size. `side` is that
/// of a window in the frame, at scale 1.
fn window_place(frame: FrameSize, side: f64, last: Place, number: u64) -> Place {
    let passes = [0, 1, 2, 3].map(|number| Pass::new(frame, side, last, number));
    let mut number = number % passes.iter().map(|pass| pass.windows()).sum::<u64>();
    let mut current = passes[0];
    for pass in passes {
        current = pass;
        if number < pass.windows() {
            break;
        }
        number -= pass.windows();
    }
    let Pass { scale, columns, rows } = current;
    let middle =
        |k: u64, count: u64, length: usize| (k as f64 + 0.5) * length as f64 / count as f64;
    let centre = [
        middle(number % columns, columns, frame.width),
        middle(number / columns, rows, frame.height),
    ];
    Place { centre, scale, rotation: last.rotation }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correlation::filter::FilterScratch;
    use crate::robust::follower::Follower;
    use crate::robust::memory::Memory;
    use crate::robust::window::Window;
    use crate::vision::frame::Frame;
    use crate::vision::geometry::BoundingBox;
    use patchlock_scene::Scene;

    const FRAME: FrameSize = FrameSize { width: 320, height: 240 };
    const LAST: Place = Place { centre: [7.0, 9.0], scale: 2.0, rotation: 0.3 };

    /// The side of a window at scale 1.
    const SIDE: f64 = 40.0;

    /// The windows of the passes in turn.
    fn passes() -> Vec<Vec<Place>> {
        let mut next = 0;
        let pass = |number| {
            let count = Pass::new(FRAME, SIDE, LAST, number).windows();
            let places = (next..next + count).map(|k| window_place(FRAME, SIDE, LAST, k)).collect();
            next += count;
            places
        };
        (0..2 * SIZES.len()).map(pass).collect()
    }

    #[test]
    fn each_pass_has_one_size() {
        for (number, places) in passes().iter().enumerate() {
            let scale = [2.0, 2.4, 1.6, 2.0][number % 4];
            for place in places {
                assert_eq!((place.scale, place.rotation), (scale, LAST.rotation));
            }
        }
    }

    #[test]
    fn each_pass_covers_the_frame() {
        for places in passes() {
            // In the middle half of a window, the response has not faded.
            let reach = SIDE * places[0].scale * OVERLAP / 2.0;
            let points = (0..240).step_by(7).flat_map(|y| (0..320).step_by(7).map(move |x| (x, y)));
            for (x, y) in points {
                let near = |place: &Place| {
                    let [cx, cy] = place.centre;
                    (cx - f64::from(x)).abs() <= reach && (cy - f64::from(y)).abs() <= reach
                };
                assert!(places.iter().any(near), "{x}, {y} at scale {}", places[0].scale);
            }
        }
    }

    #[test]
    fn windows_go_row_by_row_and_begin_again() {
        let passes = passes();
        // 320 x 240 pixels in steps of half a window, which has 80 pixels.
        assert_eq!(passes[0].len(), 8 * 6);
        assert_eq!(
            passes[0][..2].iter().map(|p| p.centre).collect::<Vec<_>>(),
            [[20.0, 20.0], [60.0, 20.0]]
        );
        assert_eq!(passes[0][8].centre, [20.0, 60.0]);
        assert_eq!(passes[..4], passes[4..]);
        assert_eq!(
            window_place(FRAME, SIDE, LAST, u64::MAX - 3),
            window_place(FRAME, SIDE, LAST, (u64::MAX - 3) % passes[..4].concat().len() as u64)
        );
    }

    #[test]
    fn a_window_larger_than_the_frame_is_the_only_one_of_its_pass() {
        for number in 0..4 {
            let place = window_place(FRAME, 2000.0, LAST, number);
            assert_eq!(place.centre, [160.0, 120.0]);
        }
    }

    /// Calls with a searcher whose memory has learnt the target of the demo in its box, in that very frame.
    fn with_searcher(check: impl FnOnce(&mut Searcher<'_>, Place, &SearchParams)) {
        let scene = Scene::demo();
        let (rendered, [x, y, w, h]) = (scene.frame(0), scene.truth(0).bbox);
        let frame = Frame::rgb8(&rendered.rgb, rendered.width, rendered.height).unwrap();
        let (config, bbox) = (RobustConfig::default(), BoundingBox { x, y, w, h });
        let (mut sample, mut response) = (SampleBuffers::default(), ResponseBuffers::default());
        let window = Window::begin(&frame, bbox, &config, &mut sample);
        let (place, params) = (Place::first(bbox), SearchParams::new(&config));
        let first = window.sample(&frame, place, &mut sample);
        let follower = Follower::begin(&first, &config, &mut FilterScratch::default());
        let memory = Memory::begin(&first, follower.filter(), &config, &mut response);
        let mut searcher = Searcher {
            setting: Setting { frame: &frame, window: &window, memory: &memory },
            sample: &mut sample,
            response: &mut response,
        };
        check(&mut searcher, place, &params);
    }

    #[test]
    fn what_is_found_in_a_window_of_another_size_gets_its_own() {
        with_searcher(|searcher, target, params| {
            let once = SearchParams { windows: 1, ..*params };
            for size in SIZES {
                let place = Place { scale: size, ..target };
                let found = searcher.look_around(place, params).unwrap();
                assert_eq!(found.place.scale, size);
                let sizes = TRIED.map(|size| Place { scale: size, ..found.place });
                let best = searcher.best(Some(found), sizes, params).unwrap().place;
                assert_eq!(best.scale, 1.0, "found at {size}");
                let [x, y] = [0, 1].map(|axis| best.centre[axis] - target.centre[axis]);
                assert!(x.hypot(y) < 1.0, "found at {size}: {x}, {y} from the target");
            }
            let found = searcher.search(target, 0, &once).unwrap();
            assert_eq!(found.scale, 1.0);
        });
    }

    #[test]
    fn the_target_is_found_wherever_the_search_began_and_not_below_the_limit() {
        with_searcher(|searcher, target, params| {
            let far = Place { centre: [0.0, 0.0], ..target };
            let all = SearchParams { windows: 1000, ..*params };
            let found = searcher.search(far, 0, &all).unwrap();
            let [x, y] = [0, 1].map(|axis| found.centre[axis] - target.centre[axis]);
            assert!(x.hypot(y) < 1.0, "{x}, {y} from the target");
            let strict = SearchParams { windows: 1000, above: 1e6 };
            assert_eq!(searcher.search(target, 0, &strict), None);
        });
    }
}
