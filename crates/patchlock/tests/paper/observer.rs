//! The observer sees what the tracker computed.

use crate::methods::paper;
use crate::sequence::OCCLUDED;
use patchlock::paper::particles::most_likely;
use patchlock::patch_model::weights::{patch_weight, position_weights};
use patchlock::vision::patches::PatchGrid;
use patchlock::{
    Estimate, FrameView, Method, PaperConfig, PaperView, PatchView, Tracker, TrackerConfig,
    Visibility,
};

const FRAMES: usize = 36;

/// The settings of this method, and the whole configuration.
fn settings() -> (PaperConfig, TrackerConfig) {
    let all = paper();
    let Method::Paper(settings) = &all.method else { panic!("of the paper") };
    (settings.clone(), all)
}

fn visibility(estimate: &Estimate) -> &Visibility {
    estimate.visibility.as_ref().unwrap()
}

/// Tracks past the tree. Calls `look` with each frame's estimate, its view, and the templates
/// before the frame.
fn watch(config: &TrackerConfig, mut look: impl FnMut(&Estimate, &PaperView<'_>, &[Vec<f32>])) {
    let mut tracker = OCCLUDED.begin(config, 0);
    let mut templates: Vec<Vec<f32>> = Vec::new();
    for k in 1..FRAMES {
        // The view is passed before the estimate is returned, so a second tracker computes the
        // estimate first.
        let mut twin = Tracker::restore(tracker.snapshot()).unwrap();
        let estimate = twin.update(&OCCLUDED.frame(k)).unwrap().clone();
        let mut views = 0;
        let mut observer = |view: &FrameView<'_>| {
            let FrameView::Paper(view) = view else { panic!("the view of another method") };
            views += 1;
            assert_eq!(view.frame, k as u64);
            look(&estimate, view, &templates);
            templates = view.templates.to_vec();
        };
        let same = tracker.update_observed(&OCCLUDED.frame(k), &mut observer).unwrap();
        assert_eq!((same, views), (&estimate, 1));
    }
}

#[test]
fn particles_and_likelihoods_are_those_of_the_estimate() {
    let (config, all) = settings();
    watch(&all, |estimate, view, _| {
        assert_eq!(view.particles.len(), config.particles);
        assert_eq!(view.likelihoods.len(), config.particles);
        assert_eq!(view.best, most_likely(view.likelihoods));
        assert!(view.likelihoods.iter().all(|&l| l <= view.likelihoods[view.best]));
        let state = view.particles[view.best];
        assert_eq!(state.size(config.patches.template_side), (estimate.bbox.w, estimate.bbox.h));
        let [x, y] = estimate.bbox.centre();
        assert!((x - state.x).abs() < 1e-9 && (y - state.y).abs() < 1e-9);
        let norm: f64 = view.candidate.iter().map(|&v| f64::from(v).powi(2)).sum();
        assert!((norm - 1.0).abs() < 1e-6);
    });
}

/// The pooled share of a patch's code by Eq. 10-11.
fn share(patch: &PatchView, location: usize, locations: usize) -> f64 {
    let own = |atom: usize| atom % locations == location;
    let sum = |of_own: bool| -> f64 {
        let entries = patch.code.entries().filter(|&(atom, _)| !of_own || own(atom));
        entries.map(|(_, x)| x.abs()).sum()
    };
    if sum(false) > 0.0 { sum(true) / sum(false) } else { 0.0 }
}

#[test]
fn features_follow_from_the_codes() {
    let (config, all) = settings();
    watch(&all, |estimate, view, _| {
        for (patches, map) in
            [(&view.large, &visibility(estimate).large), (&view.small, &visibility(estimate).small)]
        {
            assert_eq!(patches.len(), map.rows * map.columns);
            for (location, patch) in patches.iter().enumerate() {
                assert!(patch.code.support().len() <= config.patches.atoms);
                let share = share(patch, location, patches.len());
                assert!((patch.feature.share - share).abs() < 1e-12);
                assert_eq!(patch.visible, patch.feature.error < config.patches.epsilon);
                assert_eq!(patch.visible, map.visible[location]);
            }
        }
    });
}

#[test]
fn the_likelihood_follows_from_the_features() {
    let (config, all) = settings();
    watch(&all, |estimate, view, _| {
        let weighted = |patches: &[PatchView]| {
            let side = (patches.len() as f64).sqrt() as usize;
            let positions = position_weights(side, config.beta, true);
            let weighted = patches.iter().zip(positions).map(|(patch, position)| {
                patch_weight(patch.visible, position) * patch.feature.share
            });
            weighted.sum::<f64>() / patches.len() as f64
        };
        let gamma = (visibility(estimate).large.share() - 1.0).exp();
        let want = gamma * weighted(&view.large) + weighted(&view.small);
        let got = view.likelihoods[view.best];
        assert!((got - want).abs() < 1e-12, "{got} {want}");
    });
}

/// The large dictionary consists of the templates after the previous frame.
#[test]
fn errors_follow_from_codes_templates_and_candidate() {
    let (config, all) = settings();
    let grid = PatchGrid::new(32, config.patches.large_patch, config.patches.large_step, false);
    let mut compared = 0;
    watch(&all, |_, view, templates| {
        if templates.is_empty() {
            return;
        }
        let atoms: Vec<Vec<f32>> = templates.iter().map(|t| grid.cut_all(t)).collect();
        let atoms: Vec<&[f32]> = atoms.iter().flat_map(|t| t.chunks_exact(grid.dim())).collect();
        let candidate = grid.cut_all(view.candidate);
        let patches = candidate.chunks_exact(grid.dim()).zip(&view.large);
        for (location, (signal, patch)) in patches.enumerate() {
            let mut left: Vec<f64> = signal.iter().map(|&v| f64::from(v)).collect();
            for (atom, x) in patch.code.entries().filter(|(k, _)| k % grid.locations() == location)
            {
                left.iter_mut().zip(atoms[atom]).for_each(|(l, &d)| *l -= x * f64::from(d));
            }
            let error: f64 = left.iter().map(|v| v * v).sum();
            assert!((error - patch.feature.error).abs() < 1e-9, "{error} {:?}", patch.feature);
            compared += 1;
        }
    });
    assert_eq!(compared, (FRAMES - 2) * 9);
}

#[test]
fn a_template_is_replaced_on_every_fifth_frame() {
    let (config, all) = settings();
    let mut partly_hidden = 0;
    watch(&all, |estimate, view, before| {
        assert_eq!(view.templates.len(), config.patches.templates);
        assert!(view.templates.iter().all(|t| t.len() == 32 * 32));
        let Visibility { large, small } = visibility(estimate);
        let enough = small.share() + large.share() > 2.0 * config.patches.delta;
        let due = view.frame % config.patches.update_interval as u64 == 0 && enough;
        assert_eq!(view.update.is_some(), due, "frame {}", view.frame);
        let Some(update) = view.update else {
            assert!(before.is_empty() || before == view.templates);
            return;
        };
        assert!((1..config.patches.templates).contains(&update.replaced));
        assert_eq!(update.mask.len(), 32 * 32);
        assert!(update.mask.iter().all(|v| (0.0..=1.0).contains(v)));
        partly_hidden += usize::from(update.mask.iter().any(|&v| v < 0.5));
        let mut expected = before.to_vec();
        expected.remove(update.replaced);
        assert_eq!(view.templates[..config.patches.templates - 1], expected);
        assert_eq!(view.templates[0], before[0]);
    });
    assert!(partly_hidden > 0);
}
