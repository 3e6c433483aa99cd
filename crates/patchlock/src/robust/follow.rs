//! The follower and the memory: where they respond, which of them is believed, and what they learn.

use super::place::{Place, Window};
use super::{Scratch, Target};
use crate::config::RobustConfig;
use crate::correlation::filter::{FilterNumbers, FilterRules};
use crate::correlation::fourier::Complex32;
use crate::correlation::response::Peak;
use crate::vision::frame::Frame;

/// Frames for which the memory must know better before it is believed.
const JUMP_AFTER: u32 = 2;

/// The smallest mean of the memory's response: frames without texture give no response at all.
const LEAST_MEAN: f64 = 1e-9;

/// The filters that follow the target and the one that remembers it.
#[derive(Debug)]
pub(crate) struct Follower {
    filters: Vec<Filter>,
    /// The mean of the filters, which is what follows.
    pub filter: Vec<Complex32>,
    /// The mean of the filters over sure frames.
    pub memory: Vec<Complex32>,
    /// The mean of the memory's response at the target over sure frames.
    pub mean: f64,
    /// Sure frames since the first.
    pub sure: u64,
    /// Frames on end on which the memory responded much stronger elsewhere.
    pub elsewhere: u32,
}

/// One of the filters whose mean follows the target.
#[derive(Debug)]
struct Filter {
    rules: FilterRules,
    spectra: Vec<Complex32>,
}

impl Follower {
    /// Filters that have learnt the target at this place.
    pub fn begin(
        frame: &Frame<'_>,
        window: &Window,
        place: Place,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> Self {
        let fourier = window.features().fourier();
        window.sample(frame, place, scratch);
        let begin = |rules: FilterRules| {
            let mut spectra = vec![Complex32::ZERO; scratch.sample.len()];
            rules.begin(fourier, &scratch.sample, &mut spectra, &mut scratch.filter);
            Filter { rules, spectra }
        };
        let filters = rules(window, config).into_iter().map(begin).collect();
        let mut follower = Self::new(filters, Vec::new(), 1.0);
        follower.memory.clone_from(&follower.filter);
        scratch.memory.fill(fourier, &follower.memory, &scratch.sample);
        follower.mean = scratch.memory.at(fourier, [0.0; 2]).max(LEAST_MEAN);
        follower
    }

    /// From the spectra of the filters, of the memory, and its mean response.
    pub fn restore(
        window: &Window,
        config: &RobustConfig,
        spectra: Vec<Vec<Complex32>>,
        memory: Vec<Complex32>,
        mean: f64,
    ) -> Self {
        let filters = rules(window, config).into_iter().zip(spectra);
        let filters = filters.map(|(rules, spectra)| Filter { rules, spectra });
        Self::new(filters.collect(), memory, mean)
    }

    fn new(filters: Vec<Filter>, memory: Vec<Complex32>, mean: f64) -> Self {
        let length = filters.first().map_or(0, |filter| filter.spectra.len());
        let filter = vec![Complex32::ZERO; length];
        let mut follower = Self { filters, filter, memory, mean, sure: 0, elsewhere: 0 };
        follower.average();
        follower
    }

    fn average(&mut self) {
        self.filter.fill(Complex32::ZERO);
        let share = 1.0 / self.filters.len() as f32;
        for Filter { spectra, .. } in &self.filters {
            self.filter.iter_mut().zip(spectra).for_each(|(sum, value)| *sum += value * share);
        }
    }

    /// The spectra of the filters whose mean follows.
    pub fn spectra(&self) -> impl Iterator<Item = &[Complex32]> {
        self.filters.iter().map(|filter| filter.spectra.as_slice())
    }

    /// Follows with the memory from now on.
    pub fn begin_from_memory(&mut self) {
        let filters = self.filters.iter_mut().map(|filter| &mut filter.spectra);
        filters.chain([&mut self.filter]).for_each(|spectra| spectra.copy_from_slice(&self.memory));
    }

    /// How sure the memory is that the sample at hand is centred on the target.
    pub fn certainty(&self, window: &Window, scratch: &mut Scratch) -> f64 {
        let fourier = window.features().fourier();
        scratch.memory.fill(fourier, &self.memory, &scratch.sample);
        scratch.memory.at(fourier, [0.0; 2]) / self.mean
    }

    /// Learns the sample at hand; the memory too if the frame is sure.
    pub fn learn(
        &mut self,
        window: &Window,
        certainty: f64,
        sure: bool,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) {
        let fourier = window.features().fourier();
        for Filter { rules, spectra } in &mut self.filters {
            rules.learn(fourier, &scratch.sample, spectra, &mut scratch.filter);
        }
        self.average();
        if sure {
            // The first frames count alike.
            self.sure += 1;
            let rate = config.memory_rate.max(1.0 / (self.sure + 1) as f64) as f32;
            let pairs = self.memory.iter_mut().zip(&self.filter);
            pairs.for_each(|(memory, filter)| *memory = *memory * (1.0 - rate) + filter * rate);
            // The response to the frame that the filter was learnt from is no measure of later ones.
            let rate = config.memory_rate.max(1.0 / self.sure as f64);
            self.mean = (self.mean * (1.0 + rate * (certainty - 1.0))).max(LEAST_MEAN);
        }
    }
}

/// The rules of the filters for the target in a window.
fn rules(window: &Window, config: &RobustConfig) -> Vec<FilterRules> {
    let numbers = [
        (1.0, config.penalty, config.temporal),
        (config.wide_mask, config.wide_penalty, config.wide_temporal),
        (1.0, config.slow_penalty, config.slow_temporal),
    ];
    let rules = |(mask, penalty, temporal): (f64, f64, f64)| {
        let (penalty, temporal) = (penalty as f32, temporal as f32);
        let numbers = FilterNumbers { label_width: config.label_width, mask, penalty, temporal };
        FilterRules::new(window.features().fourier(), window.cells(), numbers)
    };
    numbers.into_iter().take(config.filters).map(rules).collect()
}

impl Target {
    /// Moves to the follower's peak, or to the memory's where that has known better for some frames. Returns
    /// the follower's.
    pub fn follow(
        &mut self,
        frame: &Frame<'_>,
        config: &RobustConfig,
        scratch: &mut Scratch,
    ) -> Peak {
        let peak = self.respond(frame, config, scratch);
        let fourier = self.window.features().fourier();
        let known = scratch.memory.peak(fourier);
        let here = scratch.memory.at(fourier, peak.shift);
        let follower = &mut self.follower;
        let stronger = known.value > config.jump_ratio * here.max(0.0)
            && known.value > config.jump_least * follower.mean;
        follower.elsewhere = if stronger { follower.elsewhere + 1 } else { 0 };
        let mut shift = peak.shift;
        if follower.elsewhere >= JUMP_AFTER {
            follower.elsewhere = 0;
            follower.begin_from_memory();
            shift = known.shift;
        }
        self.shift_by(shift);
        peak
    }

    /// The responses of follower and memory to the window around the place at hand, and the follower's peak
    /// where the target's colours are.
    pub fn respond(&self, frame: &Frame<'_>, config: &RobustConfig, scratch: &mut Scratch) -> Peak {
        let Self { window, follower, colours, place, .. } = self;
        let fourier = window.features().fourier();
        window.sample(frame, *place, scratch);
        scratch.follower.fill(fourier, &follower.filter, &scratch.sample);
        scratch.memory.fill(fourier, &follower.memory, &scratch.sample);
        if config.colour_weight <= 0.0 || f64::from(colours.contrast()) < config.colour_contrast {
            return scratch.follower.peak(fourier);
        }
        colours.fill_map(&scratch.patch, window.pixels(), &mut scratch.map);
        let weight = config.colour_weight * follower.mean;
        scratch.follower.peak_with(fourier, &scratch.map.map, weight as f32)
    }

    /// Moves by this many cells of the window.
    pub fn shift_by(&mut self, shift: [f64; 2]) {
        let cell = self.window.cell(self.place.scale);
        self.place.shift(shift.map(|cells| cells * cell));
    }
}
