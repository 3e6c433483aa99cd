//! The patch model on its own: `look` gives the same visibility as weighing a candidate among many,
//! and changes nothing.

use patchlock::patch_model::memory::{LearningScratch, LearningStep};
use patchlock::patch_model::model::{
    CandidateScores, Candidates, LikelihoodRequest, PatchErrorScratch, PatchModel, cut_candidate,
};
use patchlock::patch_model::params::PatchParams;
use patchlock::vision::frame::GreyImage;
use patchlock::{BoundingBox, PaperConfig, State, Visibility};
use rand_pcg::Pcg64;

use crate::sequence::OCCLUDED;

fn image(k: usize) -> GreyImage {
    let mut image = GreyImage::default();
    image.fill(&OCCLUDED.frame(k)).unwrap();
    image
}

fn state(bbox: BoundingBox) -> State {
    State::from_box(bbox.centre(), bbox.w, bbox.h, 32)
}

/// Candidates around the true box of frame `k`.
fn candidates(k: usize, count: usize, params: &PatchParams) -> Vec<f32> {
    let (image, truth) = (image(k), state(OCCLUDED.truth(k)));
    let mut all = vec![0.0; count * 1024];
    for (n, out) in all.chunks_exact_mut(1024).enumerate() {
        let (dx, dy) = ((n % 5) as f64 * 1.7 - 3.0, (n / 5) as f64 * 1.3 - 2.0);
        let state = State { x: truth.x + dx, y: truth.y + dy, ..truth };
        cut_candidate(&image, &state.matrix(), params, out);
    }
    all
}

fn begun(params: PatchParams) -> PatchModel {
    PatchModel::begin(&image(0), &state(OCCLUDED.truth(0)).matrix(), params)
}

/// Parameters with this step between small patches, in samples.
fn params(small_step: usize) -> PatchParams {
    let mut config = PaperConfig::default();
    config.patches.small_step = small_step;
    config.patch_params()
}

#[test]
fn a_look_is_the_visibility_of_the_weighed_candidate() {
    for small_step in [2, 4, 8] {
        let params = params(small_step);
        let (mut model, mut learning) = (begun(params), LearningScratch::default());
        let mut rng = Pcg64::new(1, 1);
        let (mut weighed, mut look) = (CandidateScores::default(), PatchErrorScratch::default());
        let order: Vec<u32> = (0..20).collect();
        let mut hidden = 0;
        for k in [1, 12, 24, 30, 40] {
            let samples = candidates(k, 20, &params);
            let all = Candidates { samples: &samples, order: &order };
            model.weigh(all, LikelihoodRequest::All, &mut weighed);
            let before = model.memory().clone();
            for (n, candidate) in samples.chunks_exact(1024).enumerate() {
                let (mut seen, mut expected) = (Visibility::default(), Visibility::default());
                model.look(candidate, &mut look).visibility(params.likelihood.epsilon, &mut seen);
                model.visibility(&weighed, n, &mut expected);
                assert_eq!(seen, expected, "step {small_step}, frame {k}, candidate {n}");
                hidden += seen.small.visible.iter().filter(|visible| !**visible).count();
            }
            assert_eq!(*model.memory(), before);
            // Learning happens only on request.
            let mut seen = Visibility::default();
            model
                .look(&samples[..1024], &mut look)
                .visibility(params.likelihood.epsilon, &mut seen);
            model.collect(&samples[..1024], &mut learning);
            let step = LearningStep { templates: true, small_dictionary: true };
            let learned = model.learn((&samples[..1024], &seen), step, &mut rng, &mut learning);
            assert!(learned.small_dictionary);
        }
        assert!(hidden > 0);
    }
}

#[test]
fn the_model_learns_only_when_the_caller_asks() {
    let params = params(8);
    let (mut model, mut learning) = (begun(params), LearningScratch::default());
    let before = model.memory().clone();
    let candidate = candidates(1, 1, &params);
    let (mut look, mut seen) = (PatchErrorScratch::default(), Visibility::default());
    model.look(&candidate, &mut look).visibility(params.likelihood.epsilon, &mut seen);
    let mut rng = Pcg64::new(1, 1);
    let nothing = LearningStep::default();
    let learned = model.learn((&candidate, &seen), nothing, &mut rng, &mut learning);
    assert_eq!((learned.replaced, learned.small_dictionary), (None, false));
    assert_eq!(*model.memory(), before);
    let templates = LearningStep { templates: true, small_dictionary: false };
    let learned = model.learn((&candidate, &seen), templates, &mut rng, &mut learning);
    assert!(learned.replaced.is_some());
    assert_ne!(model.memory().templates, before.templates);
    assert_eq!(model.memory().small_templates, before.small_templates);
}
