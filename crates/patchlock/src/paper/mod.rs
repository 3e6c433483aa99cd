//! The paper's tracker (Fig. 1): particles around the last state are weighed by the patch model,
//! the most likely one is the estimate, and the model learns from it every few frames.

mod config;
pub mod motion;
pub mod particles;
mod saved;
mod view;

use crate::estimate::{Estimate, Status};
use crate::network::Network;
use crate::network_error::NetworkError;
use crate::patch_model::memory::LearningScratch;
use crate::patch_model::model::{
    CandidateScores, Candidates, LikelihoodRequest, PatchErrorScratch, PatchModel, cut_candidate,
};
use crate::target_tracker::{Input, Start, TargetTracker, ViewSink};
use crate::vision::geometry::BoundingBox;
use crate::vision::state::State;
use crate::vision::warp;
use crate::{Error, error};
pub use config::PaperConfig;
use motion::Motion;
use particles::Particles;
use rand_pcg::Pcg64;
pub(crate) use saved::SavedPaper;
pub use view::{PaperView, PatchView, UpdateView};

/// The stream of the random numbers; any fixed one will do.
const STREAM: u128 = 0x7061_7463_686c_6f63;

/// A target of the paper's tracker.
#[derive(Debug)]
pub(crate) struct PaperTarget {
    state: State,
    rng: Pcg64,
    /// Frames since the first.
    frames: u64,
    model: PatchModel,
    config: PaperConfig,
}

/// Buffers that live from frame to frame. Their content does not, so that all targets of a thread
/// share them.
#[derive(Debug, Default)]
pub(crate) struct PaperScratch {
    particles: Particles,
    weighed: CandidateScores,
    look: PatchErrorScratch,
    learning: LearningScratch,
}

/// The smallest area of a box, in pixels. Patches of fewer pixels are interpolated from the same
/// few, so that all are nearly equal: what the solver cannot decide in `f32` it computes in `f64`,
/// 5 s for a frame at 1 pixel and 1 s at 16 (two cores). A target never becomes smaller.
const LEAST_AREA: f64 = 16.0;

/// Refuses a box that takes seconds for a frame.
///
/// # Errors
/// [`Error::BoxTooSmall`].
fn check_box(bbox: BoundingBox) -> Result<(), Error> {
    let BoundingBox { w, h, .. } = bbox;
    if w * h < LEAST_AREA {
        return Err(Error::BoxTooSmall { w, h, least: LEAST_AREA });
    }
    Ok(())
}

impl PaperTarget {
    /// Box, outline, score and status follow from the state and the visibility.
    fn finish_estimate(&self, out: &mut Estimate) {
        let Self { state, config, .. } = self;
        let side = config.patches.template_side;
        let (w, h) = state.size(side);
        out.bbox = BoundingBox::around([state.x, state.y], w, h);
        out.corners = warp::corners(&state.matrix(), side as f64 / 2.0);
        out.score = out.visibility.as_ref().map_or(0.0, |visibility| visibility.share());
        let sure = out.score > config.patches.delta;
        out.status = if sure { Status::Tracked } else { Status::Uncertain };
    }
}

impl TargetTracker for PaperTarget {
    type Config = PaperConfig;
    type Scratch = PaperScratch;
    type Snapshot = SavedPaper;
    type View<'a> = PaperView<'a>;

    fn begin(
        start: Start<'_>,
        config: &PaperConfig,
        scratch: &mut PaperScratch,
    ) -> Result<(Self, Estimate), Error> {
        let (image, bbox) = (start.input.grey, start.bbox);
        check_box(bbox)?;
        let (side, params) = (config.patches.template_side, config.patch_params());
        let state = State::from_box(bbox.centre(), bbox.w, bbox.h, side);
        let model = PatchModel::begin(image, &state.matrix(), params);
        let rng = Pcg64::new(u128::from(start.seed), STREAM);
        let target = Self { state, rng, frames: 0, model, config: config.clone() };
        let mut candidate = vec![0.0; side * side];
        cut_candidate(image, &state.matrix(), &params, &mut candidate);
        let mut estimate = Estimate::empty();
        let visibility = estimate.visibility.get_or_insert_default();
        let errors = target.model.look(&candidate, &mut scratch.look);
        errors.visibility(config.patches.epsilon, visibility);
        target.finish_estimate(&mut estimate);
        Ok((target, estimate))
    }

    // In the order of Fig. 1.
    fn update(
        &mut self,
        input: Input<'_>,
        scratch: &mut PaperScratch,
        show: ViewSink<'_, Self>,
        estimate: &mut Estimate,
    ) -> Result<(), NetworkError> {
        let (image, config) = (input.grey, &self.config);
        let PaperScratch { particles, weighed, learning, .. } = scratch;
        // Particles and their candidates (Sec. 2, Eq. 22).
        let motion = Motion::new(config, [image.width(), image.height()]);
        particles.draw(config.particles, &self.state, &motion, &mut self.rng);
        particles.warp(image, &config.patch_params());
        // Patches, joint codes, pooling, weights, likelihoods (Sec. 2.1 to 2.4).
        let candidates = Candidates { samples: particles.candidates(), order: particles.order() };
        let wanted = if show.is_some() { LikelihoodRequest::All } else { LikelihoodRequest::Best };
        self.model.weigh(candidates, wanted, weighed);
        // The estimate is the most likely particle (Eq. 23).
        let best = particles::most_likely(weighed.likelihoods());
        self.state = particles.states()[best];
        let visibility = estimate.visibility.get_or_insert_default();
        self.model.visibility(weighed, best, visibility);
        // Every few frames: subspace, template, dictionaries, buffers (Sec. 2.5).
        let candidate = particles.candidate(best);
        self.frames += 1;
        self.model.collect(candidate, learning);
        let step = config.patches.learning_step(self.frames);
        let learned = self.model.learn((candidate, visibility), step, &mut self.rng, learning);
        self.finish_estimate(estimate);
        if let Some(show) = show {
            show(self.view(best, &learned, scratch));
        }
        Ok(())
    }

    fn saved(&self) -> SavedPaper {
        SavedPaper::of(self)
    }

    fn restore(
        saved: SavedPaper,
        config: &PaperConfig,
        _network: Option<&Network>,
    ) -> Result<Self, Error> {
        saved.target(config).map_err(error::snapshot)
    }
}
