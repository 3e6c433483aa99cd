//! A target of the paper's tracker between two frames, as a snapshot holds it.

use super::{LEAST_AREA, PaperConfig, PaperTarget};
use crate::patch_model::memory::PatchMemory;
use crate::patch_model::model::PatchModel;
use crate::vision::state::State;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// More frames than any video has; counting on from here never overflows.
const MAX_FRAMES: u64 = 1 << 53;

/// Larger than any side that a tracker reaches: ten times that of a frame. Corners stay finite.
const LARGEST_SIDE: f64 = 1e15;

/// All that the target's next frames depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedPaper {
    pub state: State,
    pub rng: Pcg64,
    pub frames: u64,
    pub model: PatchMemory,
}

impl SavedPaper {
    /// The target as a snapshot holds it.
    pub fn of(target: &PaperTarget) -> Self {
        let PaperTarget { state, rng, frames, model, .. } = target;
        Self { state: *state, rng: rng.clone(), frames: *frames, model: model.memory().clone() }
    }

    /// A target that continues from a saved one.
    ///
    /// # Errors
    /// What does not fit the configuration.
    pub fn target(self, config: &PaperConfig) -> Result<PaperTarget, &'static str> {
        let Self { state, rng, frames, model } = self;
        if frames > MAX_FRAMES {
            return Err("it has counted more frames than a video has");
        }
        if !state.is_valid() {
            return Err(
                "a number of the state is not finite, or its scale or aspect is not positive",
            );
        }
        let (width, height) = state.size(config.patches.template_side);
        if width.max(height) > LARGEST_SIDE {
            return Err("its target is larger than any frame");
        }
        // The state of a box of just this area may be smaller by rounding.
        if width * height < LEAST_AREA * (1.0 - 1e-9) {
            return Err("its target is smaller than any that the method `paper` follows");
        }
        model.check(&config.patch_params(), config.patches.update_interval)?;
        let model = PatchModel::restore(model, config.patch_params());
        Ok(PaperTarget { state, rng, frames, model, config: config.clone() })
    }
}
