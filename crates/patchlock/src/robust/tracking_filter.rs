//! The tracking filter: a correlation filter that learns on every frame.

use super::RobustConfig;
use super::colours::ColourMap;
use super::hypothesis::Hypothesis;
use super::window::{Sample, Window};
use crate::correlation::filter::{FilterLearner, FilterParams};
use crate::correlation::response::{Response, ResponseBuffers};

/// The place in a sample where the filter responds strongest, or the filter and the map of
/// colours together. `memory` is the memory's response to the sample.
pub(crate) fn propose(
    filter: &[f32],
    sample: &Sample<'_>,
    map: Option<ColourMap<'_>>,
    memory: Response<'_>,
    buffers: &mut ResponseBuffers,
) -> Hypothesis {
    let response = sample.respond(filter, buffers);
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

/// What learns the filter of the target in a window.
pub(crate) fn learner(window: &Window, config: &RobustConfig) -> FilterLearner {
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

    /// What a filter that is an impulse proposes in a sample with these cells.
    fn propose(cells: &[(usize, f32)], map: Option<(usize, f32)>) -> Hypothesis {
        let (window, patch) = (window(), Planes::default());
        let (impulse, spectra) = (impulse(&window), spectra(&window, &plane(cells)));
        let sample = Sample { pose: POSE, window: &window, patch: &patch, spectra: &spectra };
        let [own, memory] = &mut [ResponseBuffers::default(), Default::default()];
        let memory = sample.respond(&impulse, memory);
        let map = map.map(|(cell, weight)| (plane(&[(cell, 1.0)]), weight));
        let map = map.as_ref().map(|(cells, weight)| ColourMap { cells, weight: *weight });
        super::propose(&impulse, &sample, map, memory, own)
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
}
