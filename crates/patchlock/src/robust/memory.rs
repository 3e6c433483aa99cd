//! The memory: the mean of the tracking filter over sure frames. It says how sure a place is, and
//! where else the target could be.

use super::RobustConfig;
use super::hypothesis::Hypothesis;
use super::window::{Sample, Window};
use crate::correlation::response::{Response, ResponseBuffers};
use crate::numeric::numbers::Numbers;
use serde::{Deserialize, Serialize};

/// The smallest mean response: frames without texture give no response at all.
const LEAST_MEAN: f64 = 1e-9;

/// More frames than any video has; counting on from here never overflows.
const MAX_FRAMES: u64 = 1 << 53;

/// A filter that remembers the target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Memory {
    /// Its cells inside the window's mask.
    filter: Numbers,
    /// The mean of its response at the target over sure frames.
    mean: f64,
    /// Sure frames since the first.
    sure: u64,
    /// What it was after the first sure frames.
    early: Option<EarlyMemory>,
}

/// The memory as it was after the first sure frames. It never learns, so it notices when the memory
/// has learnt something else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct EarlyMemory {
    /// Its cells inside the window's mask.
    filter: Numbers,
    /// The mean of the memory's response at the target over the frames that it was learnt from.
    mean: f64,
}

/// What the memory says of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Recognition {
    /// How sure it is: its response, relative to its mean over sure frames.
    pub certainty: f64,
    /// Its strongest response outside half the target's size around the place, relative to that at
    /// the place, at most `elsewhere_most`.
    pub elsewhere: f64,
    /// How sure it was when it had seen no more than the first sure frames: the response of what it
    /// was then, relative to its mean then. Before, `certainty`.
    pub early: f64,
}

impl Memory {
    /// A memory of this filter, which was learnt from this sample.
    pub fn begin(sample: &Sample<'_>, filter: &[f32], buffers: &mut ResponseBuffers) -> Self {
        let mean = sample.respond(filter, buffers).at([0.0; 2]).max(LEAST_MEAN);
        Self { filter: filter.to_vec().into(), mean, sure: 0, early: None }
    }

    /// Checks what was read from a snapshot.
    ///
    /// # Errors
    /// What is damaged.
    pub fn check(&self, window: &Window) -> Result<(), &'static str> {
        let early = self.early.as_ref();
        let means = [Some(self.mean), early.map(|early| early.mean)];
        if !means.into_iter().flatten().all(|mean| mean.is_finite() && mean > 0.0) {
            return Err("the memory's mean response is not positive");
        }
        if self.sure > MAX_FRAMES {
            return Err("the memory has counted more frames than a video has");
        }
        let filters = [Some(&self.filter), early.map(|early| &early.filter)];
        if !filters.into_iter().flatten().all(|filter| filter.is_sound(window.filter())) {
            return Err("the memory is damaged");
        }
        Ok(())
    }

    /// The filter that remembers.
    pub fn filter(&self) -> &[f32] {
        &self.filter
    }

    /// The mean of its response at the target over sure frames.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Sure frames since the first.
    pub fn sure(&self) -> u64 {
        self.sure
    }

    /// The response to a sample.
    pub fn respond<'b>(
        &self,
        sample: &Sample<'b>,
        buffers: &'b mut ResponseBuffers,
    ) -> Response<'b> {
        sample.respond(&self.filter, buffers)
    }

    /// The place in a sample where it responds strongest.
    pub fn propose(&self, sample: &Sample<'_>, response: Response<'_>) -> Hypothesis {
        let peak = response.peak();
        Hypothesis { pose: sample.pose_at(peak.shift), response: peak.value, memory: peak.value }
    }

    /// How sure it is that the target is in the middle of a sample: its response there, relative to
    /// the mean.
    pub fn certainty(&self, response: Response<'_>) -> f64 {
        response.at([0.0; 2]) / self.mean
    }

    /// What it says of the target in the middle of a sample.
    pub fn recognise(
        &self,
        sample: &Sample<'_>,
        config: &RobustConfig,
        buffers: &mut ResponseBuffers,
    ) -> Recognition {
        let response = self.respond(sample, buffers);
        let certainty = self.certainty(response);
        let here = certainty * self.mean;
        let away = response.beyond(sample.window.cells().map(|side| side / 2.0));
        let elsewhere =
            if away <= 0.0 { 0.0 } else { config.elsewhere_most.min(away / here.max(0.0)) };
        let early = self.early.as_ref().map_or(certainty, |early| {
            sample.respond(&early.filter, buffers).at([0.0; 2]) / early.mean
        });
        Recognition { certainty, elsewhere, early }
    }

    /// Learns the tracking filter on a sure frame, on which it was this sure of the place.
    pub fn learn(&mut self, filter: &[f32], certainty: f64, config: &RobustConfig) {
        self.sure += 1;
        let rate = config.memory_rate.max(1.0 / (self.sure + 1) as f64) as f32;
        let pairs = self.filter.iter_mut().zip(filter);
        pairs.for_each(|(memory, filter)| *memory = *memory * (1.0 - rate) + filter * rate);
        // The response to the frame that the filter was learnt from is no measure of later ones.
        let rate = config.memory_rate.max(1.0 / self.sure as f64);
        self.mean = (self.mean * (1.0 + rate * (certainty - 1.0))).max(LEAST_MEAN);
        if self.early.is_none() && self.sure >= config.first_frames as u64 {
            self.early = Some(EarlyMemory { filter: self.filter.clone(), mean: self.mean });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::pose::Pose;
    use crate::robust::window::tests::{SIDE, impulse, plane, spectra, window};
    use crate::vision::crop::Planes;

    fn config() -> RobustConfig {
        RobustConfig {
            memory_rate: 0.25,
            first_frames: 2,
            elsewhere_most: 2.0,
            ..Default::default()
        }
    }

    /// A memory of an impulse, with this mean response: it responds to a sample with the sample's own
    /// plane.
    fn memory(window: &Window, mean: f64) -> Memory {
        Memory { filter: impulse(window).into(), mean, sure: 0, early: None }
    }

    fn on_sample<T>(cells: &[(usize, f32)], ask: impl FnOnce(&Sample<'_>) -> T) -> T {
        let (window, patch) = (window(), Planes::default());
        let spectra = spectra(&window, &plane(cells));
        let pose = Pose { centre: [100.0; 2], scale: 1.0, rotation: 0.0 };
        ask(&Sample { pose, window: &window, patch: &patch, spectra: &spectra })
    }

    fn recognise(cells: &[(usize, f32)], mean: f64) -> Recognition {
        on_sample(cells, |sample| {
            let buffers = &mut ResponseBuffers::default();
            memory(sample.window, mean).recognise(sample, &config(), buffers)
        })
    }

    #[test]
    fn certainty_is_relative_to_the_mean_and_elsewhere_to_the_place() {
        // The target has 2 x 3 cells: displacements from one cell along x, or 1.5 along y, are
        // elsewhere.
        let (right, down, two_down) = (1, SIDE, 2 * SIDE);
        for (cells, mean, certainty, elsewhere) in [
            (vec![(0, 0.5)], 1.0, 0.5, 0.0),
            (vec![(0, 0.5)], 0.25, 2.0, 0.0),
            (vec![(0, 0.5), (right, 0.4)], 1.0, 0.5, 0.8),
            (vec![(0, 0.5), (down, 0.4)], 1.0, 0.5, 0.0),
            (vec![(0, 0.5), (two_down, 0.25)], 1.0, 0.5, 0.5),
            // Never more than 2, also where the response at the place is not positive.
            (vec![(0, 0.1), (right, 0.9)], 1.0, 0.1, 2.0),
            (vec![(0, -0.5), (right, 0.1)], 1.0, -0.5, 2.0),
        ] {
            let found = recognise(&cells, mean);
            assert!((found.certainty - certainty).abs() < 1e-6, "{cells:?}: {found:?}");
            assert!((found.elsewhere - elsewhere).abs() < 1e-5, "{cells:?}: {found:?}");
        }
    }

    #[test]
    fn it_proposes_its_peak() {
        let hypothesis = on_sample(&[(0, 0.5), (3, 0.9)], |sample| {
            let (memory, mut buffers) = (memory(sample.window, 1.0), ResponseBuffers::default());
            memory.propose(sample, memory.respond(sample, &mut buffers))
        });
        let cell = window().cell(1.0);
        assert!((hypothesis.pose.centre[0] - 100.0 - 3.0 * cell).abs() < 0.2 * cell);
        assert!((hypothesis.response - 0.9).abs() < 0.05, "{hypothesis:?}");
        assert_eq!(hypothesis.memory, hypothesis.response);
    }

    #[test]
    fn the_first_sure_frames_count_alike_and_later_ones_with_the_rate() {
        let window = window();
        let mut memory = memory(&window, 1.0);
        let other = vec![0.0; memory.filter.len()];
        let at = memory.filter.iter().position(|value| *value == 1.0).unwrap();
        // The share of the first frame in the mean: a half, a third, a quarter, and then falling by
        // a quarter.
        for share in [0.5, 1.0 / 3.0, 0.25, 0.1875] {
            memory.learn(&other, 1.0, &config());
            assert!((memory.filter[at] - share).abs() < 1e-6, "{} {share}", memory.filter[at]);
        }
        assert_eq!((memory.sure(), memory.mean()), (4, 1.0));
    }

    #[test]
    fn the_mean_follows_the_certainty_but_stays_positive() {
        let window = window();
        let (mut memory, same) = (memory(&window, 2.0), memory(&window, 1.0).filter);
        // On the first sure frame it becomes the response there: the first frame itself does not
        // count.
        memory.learn(&same, 0.5, &config());
        assert_eq!(memory.mean(), 1.0);
        memory.learn(&same, 0.8, &config());
        assert!((memory.mean() - 0.9).abs() < 1e-12);
        memory.learn(&same, -1e6, &config());
        assert_eq!(memory.mean(), LEAST_MEAN);
    }

    #[test]
    fn the_early_memory_is_kept_after_the_first_sure_frames() {
        on_sample(&[(0, 0.5)], |sample| {
            let (mut memory, mut buffers) =
                (memory(sample.window, 1.0), ResponseBuffers::default());
            let blank = vec![0.0; memory.filter.len()];
            // Two frames with nothing: a third of the first filter is left, and the mean is 0.5.
            for _ in 0..2 {
                assert_eq!(memory.early.is_none(), memory.sure() < 2);
                let known = memory.recognise(sample, &config(), &mut buffers);
                assert_eq!(known.early, known.certainty);
                memory.learn(&blank, 0.5f64.sqrt(), &config());
            }
            let early = memory.recognise(sample, &config(), &mut buffers).early;
            for _ in 0..9 {
                memory.learn(&blank, 1.0, &config());
            }
            let known = memory.recognise(sample, &config(), &mut buffers);
            assert_eq!(known.early, early);
            assert!(known.certainty < 0.2 * early, "{known:?}");
        });
    }

    #[test]
    fn a_damaged_memory_is_refused() {
        let window = window();
        let (good, mut late) = (memory(&window, 1.0), memory(&window, 1.0));
        let blank = vec![0.0; late.filter.len()];
        (0..3).for_each(|_| late.learn(&blank, 1.0, &config()));
        assert_eq!([&good, &late].map(|memory| memory.check(&window)), [Ok(()); 2]);
        let (early, none) = (late.early.unwrap(), || Numbers::from(Vec::new()));
        for damaged in [
            Memory { mean: 0.0, ..good.clone() },
            Memory { mean: f64::NAN, ..good.clone() },
            Memory { sure: u64::MAX, ..good.clone() },
            Memory { filter: none(), ..good.clone() },
            Memory { early: Some(EarlyMemory { mean: 0.0, ..early.clone() }), ..good.clone() },
            Memory { early: Some(EarlyMemory { filter: none(), ..early }), ..good.clone() },
        ] {
            assert!(damaged.check(&window).is_err());
        }
    }
}
