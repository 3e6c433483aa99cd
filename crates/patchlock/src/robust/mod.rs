//! The method `robust`. One follows, one knows, one sees: the mean of correlation filters that learn on every
//! frame follows the target, with a map of its colours; the mean of these filters over frames that were sure
//! knows it, says how sure a place is, and finds the target again; the paper's patch model sees which parts
//! are visible.

mod follow;
mod place;
mod saved;
mod search;
mod size;
mod status;
mod turn;
pub(crate) mod view;
mod visible;

use crate::config::TrackerConfig;
use crate::correlation::features::FeatureScratch;
use crate::correlation::filter::FilterScratch;
use crate::correlation::fourier::Complex32;
use crate::correlation::histogram::{Histograms, MapScratch, Rates};
use crate::correlation::response::Response;
use crate::correlation::rotation::RotationScratch;
use crate::correlation::scale::{ScaleFilter, ScaleScratch};
use crate::estimate::Estimate;
use crate::patch_model::visibility::Visibility;
use crate::vision::crop::{CropScratch, Planes};
use crate::vision::frame::Frame;
use crate::vision::geometry::BoundingBox;
use follow::Follower;
use place::{Place, Window};
pub(crate) use saved::Saved;
use status::{Evidence, Phase};
use turn::Rotation;
use view::RobustView;
use visible::{Visible, VisibleScratch};

/// A target of the method `robust`.
#[derive(Debug)]
pub(crate) struct Target {
    place: Place,
    window: Window,
    follower: Follower,
    colours: Histograms,
    size: ScaleFilter,
    rotation: Rotation,
    visible: Visible,
    phase: Phase,
    /// The running mean of how sure the memory was on recent frames on which the place was known.
    recent: f64,
    /// The mean visible share on sure frames.
    seen: f64,
    /// The mean contrast of colours on sure frames.
    contrast: f64,
    /// Frames since the first.
    frames: u64,
}

/// Buffers that live from frame to frame. Their content does not, so that all targets of a thread share them.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    crop: CropScratch,
    patch: Planes,
    features: FeatureScratch,
    /// The spectra of the sample at hand.
    sample: Vec<Complex32>,
    filter: FilterScratch,
    follower: Response,
    memory: Response,
    map: MapScratch,
    scale: ScaleScratch,
    rotation: RotationScratch,
    visible: VisibleScratch,
}

impl Target {
    /// Begins on the target in this box of the first frame.
    pub fn begin(
        frame: &Frame<'_>,
        bbox: BoundingBox,
        config: &TrackerConfig,
        scratch: &mut Scratch,
    ) -> (Self, Estimate) {
        let rules = &config.robust;
        let place = Place { centre: bbox.centre(), scale: 1.0, rotation: 0.0 };
        let window = Window::begin(frame, bbox, rules, scratch);
        let follower = Follower::begin(frame, &window, place, rules, scratch);
        let colours = Histograms::begin(&scratch.patch, window.pixels(), &mut scratch.map);
        let (region, channels) = (place.region(window.base()), window.planes());
        let size =
            ScaleFilter::begin(frame, channels, region, size::rules(rules), &mut scratch.scale);
        let rotation = Rotation::begin(frame, region, &mut scratch.rotation);
        let visible = Visible::begin(frame, region, config);
        let phase = Phase::Following { doubtful: 0 };
        let mut target = Self {
            place,
            window,
            follower,
            colours,
            size,
            rotation,
            visible,
            phase,
            recent: 1.0,
            seen: 0.0,
            contrast: 0.0,
            frames: 0,
        };
        let mut estimate = Estimate::empty();
        target.look(frame, scratch, &mut estimate);
        target.seen = estimate.visibility.as_ref().map_or(0.0, Visibility::share);
        target.contrast = target.colours.contrast().into();
        let evidence = Evidence { visible: target.seen, ..target.ask_memory(frame, scratch) };
        target.finish_estimate(&evidence, rules, &mut estimate);
        (target, estimate)
    }

    /// Finds the target in the next frame and learns from it.
    pub fn step(
        &mut self,
        frame: &Frame<'_>,
        config: &TrackerConfig,
        scratch: &mut Scratch,
        show: Option<&mut dyn FnMut(RobustView<'_>)>,
        estimate: &mut Estimate,
    ) {
        let rules = &config.robust;
        self.frames += 1;
        let lost = matches!(self.phase, Phase::Lost { .. });
        let evidence = if lost && !self.search(frame, rules, scratch) {
            self.ask_memory(frame, scratch)
        } else {
            self.track(frame, config, scratch, estimate)
        };
        self.finish_estimate(&evidence, rules, estimate);
        if let Some(show) = show {
            show(self.view(frame, &evidence, scratch));
        }
    }

    /// Follows the target from the place at hand, and returns what is known of where that leads.
    fn track(
        &mut self,
        frame: &Frame<'_>,
        config: &TrackerConfig,
        scratch: &mut Scratch,
        estimate: &mut Estimate,
    ) -> Evidence {
        let rules = &config.robust;
        // Where the follower responds, unless the memory knows better; then rotation and size.
        let peak = self.follow(frame, rules, scratch);
        self.check_turn(frame, peak, rules, scratch);
        self.measure(frame, scratch);
        self.place.keep_within(frame, self.window.base());
        // How sure that is, and which parts are visible.
        let known = self.ask_memory(frame, scratch);
        self.look(frame, scratch, estimate);
        let visible = estimate.visibility.as_ref().map_or(0.0, Visibility::share);
        let evidence = Evidence { visible, ..known };
        self.advance(&evidence, rules);
        if !matches!(self.phase, Phase::Lost { .. }) {
            self.learn(frame, &evidence, config, scratch, estimate);
        }
        evidence
    }

    /// Follower, colours and rotation always learn, size if the score is not low, the memory and the patch
    /// model only what is sure.
    fn learn(
        &mut self,
        frame: &Frame<'_>,
        evidence: &Evidence,
        config: &TrackerConfig,
        scratch: &mut Scratch,
        estimate: &Estimate,
    ) {
        let (rules, certainty) = (&config.robust, evidence.certainty);
        let first = self.frames <= rules.first_frames as u64;
        let known = self.is_sure(evidence, rules) || first && !self.is_covered(evidence, rules);
        let sure = known && matches!(self.phase, Phase::Following { .. });
        self.follower.learn(&self.window, certainty, sure, rules, scratch);
        let rates = Rates { target: rules.colour_rate as f32, around: rules.around_rate as f32 };
        self.colours.learn(&scratch.patch, self.window.pixels(), rates, &mut scratch.map);
        let region = self.place.region(self.window.base());
        if evidence.score(rules) >= rules.scale_least {
            self.size.update(frame, self.window.planes(), region, &mut scratch.scale);
        }
        self.rotation.learn(frame, region, rules, &mut scratch.rotation);
        if sure && let Some(visibility) = &estimate.visibility {
            self.visible.learn(self.follower.sure, visibility, config, &mut scratch.visible);
        }
    }

    /// Which parts are visible in the box at hand.
    fn look(&self, frame: &Frame<'_>, scratch: &mut Scratch, estimate: &mut Estimate) {
        let region = self.place.region(self.window.base());
        let visibility = estimate.visibility.get_or_insert_default();
        self.visible.look(frame, region, &mut scratch.visible, visibility);
    }
}
