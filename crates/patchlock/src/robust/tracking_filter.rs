//! The tracking filter: a correlation filter that learns on every frame.

use super::colours::ColourMap;
use super::hypothesis::Hypothesis;
use super::window::{Sample, Window};
use crate::config::RobustConfig;
use crate::correlation::filter::{FilterLearner, FilterParams, FilterScratch};
use crate::correlation::response::{Response, ResponseBuffers};
use crate::numeric::saved_numbers::SavedNumbers;

/// The filter that follows the target.
#[derive(Debug)]
pub(crate) struct TrackingFilter {
    learner: FilterLearner,
    /// Its cells inside the window's mask, a twentieth of its spectra.
    filter: Vec<f32>,
}

impl TrackingFilter {
    /// A filter that has learnt the target in the middle of a sample.
    pub fn begin(sample: &Sample<'_>, config: &RobustConfig, scratch: &mut FilterScratch) -> Self {
        let learner = learner(sample.window, config);
        let filter = learner.begin(sample.window.fourier(), sample.spectra, scratch);
        Self { learner, filter }
    }

    /// The filter, as a snapshot holds it.
    pub fn saved(&self) -> SavedNumbers {
        SavedNumbers::of(&self.filter)
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What does not fit the configuration.
    pub fn restore(
        saved: SavedNumbers,
        window: &Window,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        let filter = saved.restore(window.filter()).ok_or("the filter is damaged")?;
        Ok(Self { learner: learner(window, config), filter })
    }

    /// The filter that follows.
    pub fn filter(&self) -> &[f32] {
        &self.filter
    }

    /// The place in a sample where the filter responds strongest, or the filter and the map of
    /// colours together. `memory` is the memory's response to the sample.
    pub fn propose(
        &self,
        sample: &Sample<'_>,
        map: Option<ColourMap<'_>>,
        memory: Response<'_>,
        buffers: &mut ResponseBuffers,
    ) -> Hypothesis {
        let response = sample.respond(&self.filter, buffers);
        let peak = match map {
            Some(ColourMap { cells, weight }) => response.peak_with(cells, weight),
            None => response.peak(),
        };
        Hypothesis {
            pose: sample.pose_at(peak.shift),
            response: peak.value,
            memory: memory.at(peak.shift),
        }
    }

    /// Follows with this filter from now on.
    pub fn restart(&mut self, filter: &[f32]) {
        self.filter.copy_from_slice(filter);
    }

    /// Learns the target in the middle of a sample.
    pub fn learn(&mut self, sample: &Sample<'_>, scratch: &mut FilterScratch) {
        let fourier = sample.window.fourier();
        self.learner.learn(fourier, sample.spectra, &mut self.filter, scratch);
    }
}

/// What the filter learns for the target in a window.
fn learner(window: &Window, config: &RobustConfig) -> FilterLearner {
    let RobustConfig { label_width, penalty, temporal, .. } = *config;
    let (penalty, temporal) = (penalty as f32, temporal as f32);
    let params = FilterParams { label_width, penalty, temporal };
    FilterLearner::new(window.fourier(), window.cells(), window.mask(), params)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::pose::Pose;
    use crate::robust::window::tests::{SIDE, impulse, plane, spectra, window};
    use crate::vision::crop::Planes;

    const POSE: Pose = Pose { centre: [100.0, 100.0], scale: 1.0, rotation: 0.0 };

    /// The response of a filter that has learnt an impulse to samples with these cells.
    fn propose(cells: &[(usize, f32)], map: Option<(usize, f32)>) -> Hypothesis {
        let (window, patch, config) = (window(), Planes::default(), RobustConfig::default());
        let learnt = spectra(&window, &plane(&[(0, 1.0)]));
        let sample = |spectra| Sample { pose: POSE, window: &window, patch: &patch, spectra };
        let mut tracking_filter =
            TrackingFilter::begin(&sample(&learnt), &config, &mut FilterScratch::default());
        let impulse = impulse(&window);
        tracking_filter.restart(&impulse);
        let seen = spectra(&window, &plane(cells));
        let (sample, mut buffers) =
            (sample(&seen), [ResponseBuffers::default(), Default::default()]);
        let [own, memory] = &mut buffers;
        let memory = sample.respond(&impulse, memory);
        let map = map.map(|(cell, weight)| (plane(&[(cell, 1.0)]), weight));
        let map = map.as_ref().map(|(cells, weight)| ColourMap { cells, weight: *weight });
        tracking_filter.propose(&sample, map, memory, own)
    }

    #[test]
    fn it_proposes_its_peak_and_the_map_of_colours_decides_between_peaks() {
        // One peak three cells to the right, a lower one two cells down.
        let (right, down) = (3, 2 * SIDE);
        let cells = [(right, 1.0), (down, 0.9)];
        let cell = window().cell(1.0);
        let strongest = propose(&cells, None);
        assert!((strongest.pose.centre[0] - 100.0 - 3.0 * cell).abs() < 0.1 * cell);
        assert!((strongest.response - 1.0).abs() < 0.05, "{strongest:?}");
        assert!((strongest.memory - strongest.response).abs() < 1e-4, "{strongest:?}");
        let coloured = propose(&cells, Some((down, 0.2)));
        assert!((coloured.pose.centre[1] - 100.0 - 2.0 * cell).abs() < 0.1 * cell);
        // The value is the response's alone.
        assert!((coloured.response - 0.9).abs() < 0.1, "{coloured:?}");
        assert_eq!(propose(&cells, Some((down, 0.05))), strongest);
    }

    #[test]
    fn a_saved_filter_is_restored_or_refused() {
        let (window, patch, config) = (window(), Planes::default(), RobustConfig::default());
        let learnt = spectra(&window, &plane(&[(0, 1.0)]));
        let sample = Sample { pose: POSE, window: &window, patch: &patch, spectra: &learnt };
        let tracking_filter =
            TrackingFilter::begin(&sample, &config, &mut FilterScratch::default());
        let restored = TrackingFilter::restore(tracking_filter.saved(), &window, &config).unwrap();
        assert_eq!(restored.filter(), tracking_filter.filter());
        let damaged = SavedNumbers::of(&tracking_filter.filter()[1..]);
        assert!(TrackingFilter::restore(damaged, &window, &config).is_err());
    }
}
