//! The follower: the mean of correlation filters that learn on every frame. Filters that differ err
//! in different places.

use super::choose::{Hypothesis, Source};
use super::colours::ColourMap;
use super::window::{Sample, Window};
use crate::config::RobustConfig;
use crate::correlation::filter::{FilterLearner, FilterParams, FilterScratch};
use crate::correlation::response::{Response, ResponseBuffers};
use crate::numeric::saved_numbers::SavedNumbers;

/// The filters, and their mean, which follows the target. They are held as their cells inside the
/// window's mask, a tenth of their spectra.
#[derive(Debug)]
pub(crate) struct Follower {
    filters: Vec<Filter>,
    mean: Vec<f32>,
}

/// One of the filters.
#[derive(Debug)]
struct Filter {
    learner: FilterLearner,
    cells: Vec<f32>,
}

impl Follower {
    /// Filters that have learnt the target in the middle of a sample.
    pub fn begin(sample: &Sample<'_>, config: &RobustConfig, scratch: &mut FilterScratch) -> Self {
        let fourier = sample.window.fourier();
        let begin = |learner: FilterLearner| {
            let cells = learner.begin(fourier, sample.spectra, scratch);
            Filter { learner, cells }
        };
        Self::of(learners(sample.window, config).into_iter().map(begin).collect())
    }

    /// Each filter, as a snapshot holds it.
    pub fn saved(&self) -> Vec<SavedNumbers> {
        self.filters.iter().map(|filter| SavedNumbers::of(&filter.cells)).collect()
    }

    /// From a snapshot.
    ///
    /// # Errors
    /// What does not fit the configuration.
    pub fn restore(
        saved: Vec<SavedNumbers>,
        window: &Window,
        config: &RobustConfig,
    ) -> Result<Self, &'static str> {
        if saved.len() != config.filters {
            return Err("the number of filters is not that of the configuration");
        }
        let filters = learners(window, config).into_iter().zip(saved);
        let restore = |(learner, saved): (_, SavedNumbers)| {
            saved.restore(window.filter()).map(|cells| Filter { learner, cells })
        };
        let filters: Option<_> = filters.map(restore).collect();
        Ok(Self::of(filters.ok_or("a filter is damaged")?))
    }

    fn of(filters: Vec<Filter>) -> Self {
        let length = filters.first().map_or(0, |filter| filter.cells.len());
        let mut follower = Self { filters, mean: vec![0.0; length] };
        follower.average();
        follower
    }

    fn average(&mut self) {
        self.mean.fill(0.0);
        let share = 1.0 / self.filters.len() as f32;
        for Filter { cells, .. } in &self.filters {
            self.mean.iter_mut().zip(cells).for_each(|(sum, value)| *sum += value * share);
        }
    }

    /// The filter that follows.
    pub fn filter(&self) -> &[f32] {
        &self.mean
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
        let response = sample.respond(&self.mean, buffers);
        let peak = match map {
            Some(ColourMap { cells, weight }) => response.peak_with(cells, weight),
            None => response.peak(),
        };
        Hypothesis {
            place: sample.place_at(peak.shift),
            source: Source::Follower,
            response: peak.value,
            memory: memory.at(peak.shift),
        }
    }

    /// Follows with this filter from now on.
    pub fn restart(&mut self, filter: &[f32]) {
        let filters = self.filters.iter_mut().map(|filter| &mut filter.cells);
        filters.chain([&mut self.mean]).for_each(|cells| cells.copy_from_slice(filter));
    }

    /// Learns the target in the middle of a sample.
    pub fn learn(&mut self, sample: &Sample<'_>, scratch: &mut FilterScratch) {
        for Filter { learner, cells } in &mut self.filters {
            learner.learn(sample.window.fourier(), sample.spectra, cells, scratch);
        }
        self.average();
    }
}

/// What the filters learn for the target in a window.
fn learners(window: &Window, config: &RobustConfig) -> Vec<FilterLearner> {
    let params = |mask: f64, penalty: f64, temporal: f64| FilterParams {
        label_width: config.label_width,
        mask,
        penalty: penalty as f32,
        temporal: temporal as f32,
    };
    let all = [
        params(1.0, config.penalty, config.temporal),
        params(config.wide_mask, config.wide_penalty, config.wide_temporal),
        params(1.0, config.slow_penalty, config.slow_temporal),
    ];
    let learner =
        |params| FilterLearner::new(window.fourier(), window.cells(), window.mask(), params);
    all.into_iter().take(config.filters).map(learner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::place::Place;
    use crate::robust::window::tests::{SIDE, impulse, plane, spectra, window};
    use crate::vision::crop::Planes;

    const PLACE: Place = Place { centre: [100.0, 100.0], scale: 1.0, stretch: 1.0, rotation: 0.0 };

    /// The response of a filter that has learnt an impulse to samples with these cells.
    fn propose(cells: &[(usize, f32)], map: Option<(usize, f32)>) -> Hypothesis {
        let (window, patch, config) = (window(), Planes::default(), RobustConfig::default());
        let learnt = spectra(&window, &plane(&[(0, 1.0)]));
        let sample = |spectra| Sample { place: PLACE, window: &window, patch: &patch, spectra };
        let mut follower =
            Follower::begin(&sample(&learnt), &config, &mut FilterScratch::default());
        let impulse = impulse(&window);
        follower.restart(&impulse);
        let seen = spectra(&window, &plane(cells));
        let (sample, mut buffers) =
            (sample(&seen), [ResponseBuffers::default(), Default::default()]);
        let [own, memory] = &mut buffers;
        let memory = sample.respond(&impulse, memory);
        let map = map.map(|(cell, weight)| (plane(&[(cell, 1.0)]), weight));
        let map = map.as_ref().map(|(cells, weight)| ColourMap { cells, weight: *weight });
        follower.propose(&sample, map, memory, own)
    }

    #[test]
    fn it_proposes_its_peak_and_the_map_of_colours_decides_between_peaks() {
        // One peak three cells to the right, a lower one two cells down.
        let (right, down) = (3, 2 * SIDE);
        let cells = [(right, 1.0), (down, 0.9)];
        let cell = window().cell(1.0);
        let strongest = propose(&cells, None);
        assert!((strongest.place.centre[0] - 100.0 - 3.0 * cell).abs() < 0.1 * cell);
        assert_eq!(strongest.source, Source::Follower);
        assert!((strongest.response - 1.0).abs() < 0.05, "{strongest:?}");
        assert!((strongest.memory - strongest.response).abs() < 1e-4, "{strongest:?}");
        let coloured = propose(&cells, Some((down, 0.2)));
        assert!((coloured.place.centre[1] - 100.0 - 2.0 * cell).abs() < 0.1 * cell);
        // The value is the response's alone.
        assert!((coloured.response - 0.9).abs() < 0.1, "{coloured:?}");
        assert_eq!(propose(&cells, Some((down, 0.05))), strongest);
    }

    #[test]
    fn a_saved_follower_is_restored_or_refused() {
        let (window, patch, config) = (window(), Planes::default(), RobustConfig::default());
        let learnt = spectra(&window, &plane(&[(0, 1.0)]));
        let sample = Sample { place: PLACE, window: &window, patch: &patch, spectra: &learnt };
        let follower = Follower::begin(&sample, &config, &mut FilterScratch::default());
        let restored = Follower::restore(follower.saved(), &window, &config).unwrap();
        assert_eq!(restored.filter(), follower.filter());
        let mut fewer = follower.saved();
        fewer.pop();
        assert!(Follower::restore(fewer, &window, &config).is_err());
        let mut damaged = follower.saved();
        damaged[1] = SavedNumbers::of(&follower.filter()[1..]);
        assert!(Follower::restore(damaged, &window, &config).is_err());
    }
}
