//! The tracker: the paper's loop, put together from its parts.
//!
//! ```text
//! init:    box -> state; first templates -> dictionaries, buffers, subspace
//! update:  state -> particles -> candidates -> patches -> joint codes -> pooled features -> likelihoods -> state
//!          -> subspace; every few frames templates, dictionaries, buffers
//! ```

use crate::appearance::elimination::Race;
use crate::appearance::likelihood::LikelihoodRules;
use crate::appearance::pooling::PoolRules;
use crate::appearance::scale::{Findings, Scale, ScaleRules};
use crate::appearance::weighing::{Coding, Weighing, Workers};
use crate::config::{FirstTemplates, Outside, ScaleMotion, TrackerConfig};
use crate::estimate::{Estimate, VisibilityMap};
use crate::filter::{motion::Motion, particles, state::State};
use crate::memory::{self, Lesson, Memory};
use crate::observe::{FrameView, Observer, PatchView, UpdateView};
use crate::simd::instructions::Instructions;
use crate::sparse::codes::CodeRules;
use crate::sparse::somp::batched::BLOCK;
use crate::vision::frame::{Frame, GreyImage};
use crate::vision::geometry::BoundingBox;
use crate::vision::patches::{PatchGrid, likeness, normalise};
use crate::vision::warp;
use crate::{Error, Snapshot};
use rayon::prelude::*;

/// Follows one target through the frames of a video.
///
/// ```
/// use patchlock::{BoundingBox, Frame, Tracker, TrackerConfig};
///
/// let mut tracker = Tracker::new(TrackerConfig { particles: 50, ..TrackerConfig::preset("paper")? })?;
/// let pixels: Vec<u8> = (0..120 * 90).map(|k| (k * k % 251) as u8).collect();
/// let frame = Frame::grey8(&pixels, 120, 90)?;
/// tracker.init(&frame, BoundingBox { x: 30.0, y: 20.0, w: 40.0, h: 32.0 })?;
/// let estimate = tracker.update(&frame)?;
/// println!("{:?}, visibility {:.2}", estimate.bbox, estimate.score);
/// # Ok::<(), patchlock::Error>(())
/// ```
///
/// The candidates are weighed in the `rayon` pool that the caller is in, so `pool.install(|| tracker.update(&frame))` chooses the
/// number of threads. For the same seed the boxes are the same, bit for bit, on any number of them.
#[derive(Debug)]
pub struct Tracker {
    config: TrackerConfig,
    target: Option<Target>,
    image: GreyImage,
    work: Work,
}

/// A target: what is remembered of it, and what is derived from that.
#[derive(Debug)]
pub(crate) struct Target {
    memory: Memory,
    large: Scale,
    small: Scale,
}

/// Buffers that live from frame to frame so that nothing is allocated anew. Nothing in them outlives a frame, so that one target after another can
/// use them.
#[derive(Debug, Default)]
pub(crate) struct Work {
    particles: Vec<State>,
    candidates: Vec<f32>,
    likelihoods: Vec<f64>,
    large: Findings,
    small: Findings,
    workers: Workers,
    /// How much each candidate looks like the last template, and the candidates in that order.
    likeness: Vec<f64>,
    ranked: Vec<u32>,
    /// The candidates in an order in which neighbours look alike.
    arranged: Vec<u32>,
    race: Race,
    learning: memory::Scratch,
}

impl Tracker {
    /// A tracker without a target yet.
    ///
    /// # Errors
    /// [`Error::Config`] names the field that is wrong, its value and what is allowed. [`Error::Instructions`] where the environment asks
    /// for instructions that the processor does not have.
    pub fn new(config: TrackerConfig) -> Result<Self, Error> {
        config.validate()?;
        Instructions::chosen()?;
        Ok(Self { config, target: None, image: GreyImage::default(), work: Work::default() })
    }

    /// The configuration.
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// Begins on the target in this box of this frame; a target so far is forgotten. The result is what a new tracker would give.
    ///
    /// # Errors
    /// [`Error::BoxShape`], [`Error::BoxOutside`] or [`Error::Frame`]; then the tracker is as it was.
    pub fn init(&mut self, frame: &Frame<'_>, bbox: BoundingBox) -> Result<Estimate, Error> {
        bbox.check_in(frame.width(), frame.height())?;
        self.image.fill(frame)?;
        let (target, estimate) = Target::begin(&self.image, bbox, &self.config, &mut self.work);
        self.target = Some(target);
        Ok(estimate)
    }

    /// Begins anew on a box of this frame, to correct the track by hand or after a loss; the same as [`Tracker::init`].
    ///
    /// # Errors
    /// As [`Tracker::init`].
    pub fn reinit(&mut self, frame: &Frame<'_>, bbox: BoundingBox) -> Result<Estimate, Error> {
        self.init(frame, bbox)
    }

    /// Finds the target in the next frame and learns from it.
    ///
    /// # Errors
    /// [`Error::NotInitialised`] before the first `init`; [`Error::FrameSize`] or [`Error::Frame`] where the frame does not fit, and
    /// then the tracker is as it was.
    pub fn update(&mut self, frame: &Frame<'_>) -> Result<Estimate, Error> {
        let mut estimate = Estimate::empty();
        self.step(frame, None, &mut estimate)?;
        Ok(estimate)
    }

    /// As [`Tracker::update`], into an estimate that there is, from `init` or an earlier frame, which saves the allocation of its two maps. Nothing
    /// else is allocated once all buffers have grown.
    ///
    /// # Errors
    /// As [`Tracker::update`]; then the estimate is as it was too.
    pub fn update_into(&mut self, frame: &Frame<'_>, estimate: &mut Estimate) -> Result<(), Error> {
        self.step(frame, None, estimate)
    }

    /// As [`Tracker::update`], and shows the observer what happened. The boxes are the same.
    ///
    /// # Errors
    /// As [`Tracker::update`].
    pub fn update_observed(
        &mut self,
        frame: &Frame<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Estimate, Error> {
        let mut estimate = Estimate::empty();
        self.step(frame, Some(observer), &mut estimate)?;
        Ok(estimate)
    }

    /// Everything that is needed to go on to the same boxes later: serialise it with a `serde` format that
    /// keeps floats exact and knows 128-bit integers, such as the text of JSON (with `serde_json`'s feature `float_roundtrip`).
    pub fn snapshot(&self) -> Snapshot {
        Snapshot::new(self.config.clone(), self.target.as_ref().map(|target| target.memory.clone()))
    }

    /// A tracker that goes on where the snapshot was taken.
    ///
    /// # Errors
    /// [`Error::Snapshot`] or [`Error::Config`] where the parts do not fit together; [`Error::Instructions`] as in [`Tracker::new`].
    pub fn restore(snapshot: Snapshot) -> Result<Self, Error> {
        let (config, memory) = snapshot.check()?;
        let target = memory.map(|memory| Target::new(memory, &config));
        Ok(Self { target, ..Self::new(config)? })
    }

    fn step(
        &mut self,
        frame: &Frame<'_>,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) -> Result<(), Error> {
        let Self { config, target, image, work } = self;
        let target = target.as_mut().ok_or(Error::NotInitialised)?;
        target.memory.check_size(frame.width(), frame.height())?;
        image.fill(frame)?;
        target.step(image, config, work, observer, estimate);
        Ok(())
    }
}

impl Target {
    /// Begins on the target in this box of this image.
    pub(crate) fn begin(
        image: &GreyImage,
        bbox: BoundingBox,
        config: &TrackerConfig,
        work: &mut Work,
    ) -> (Self, Estimate) {
        let side = config.template_side;
        let state = State::from_box(bbox.centre(), bbox.w, bbox.h, side);
        let memory = Memory::begin(config, (image.width(), image.height()), state, |state| {
            let mut template = vec![0.0; side * side];
            candidate(image, state, side, &mut template);
            template
        });
        let target = Self::new(memory, config);
        work.particles.clear();
        work.particles.push(state);
        work.warp(image, side);
        work.weigh(image, &target, config, Whose::All);
        let mut estimate = Estimate::empty();
        work.estimate(0, &target, config, &mut estimate);
        (target, estimate)
    }

    /// Finds the target in the next image, of the same size, and learns from it.
    pub(crate) fn step(
        &mut self,
        image: &GreyImage,
        config: &TrackerConfig,
        work: &mut Work,
        observer: Option<&mut dyn Observer>,
        estimate: &mut Estimate,
    ) {
        let memory = &mut self.memory;
        let motion = motion(config);
        let (last, rng) = (memory.state, &mut memory.rng);
        particles::draw(&mut work.particles, config.particles, &last, &motion, rng);
        work.warp(image, config.template_side);
        let nearest =
            self.memory.is_gathering() && config.first_templates == FirstTemplates::Nearest;
        if nearest {
            work.compare_with(self.memory.last_template());
        } else {
            let whose = if observer.is_some() { Whose::All } else { Whose::Best };
            work.weigh(image, self, config, whose);
        }
        let best = particles::most_likely(&work.likelihoods);
        if nearest {
            work.estimate_unseen(best, self, config, estimate);
        } else {
            work.estimate(best, self, config, estimate);
        }
        let lesson = self.learn(best, work, estimate, config);
        if let Some(observer) = observer {
            observer.observe(&work.view(best, self, &lesson, config));
        }
    }

    /// What is remembered of it.
    pub(crate) fn memory(&self) -> &Memory {
        &self.memory
    }

    pub(crate) fn new(memory: Memory, config: &TrackerConfig) -> Self {
        let large = Scale::new(
            PatchGrid::new(
                config.template_side,
                config.large_patch,
                config.large_step,
                config.subtract_mean,
            ),
            scale_rules(config),
            memory.templates(),
            memory.large_buffer(),
        );
        let small = Scale::new(
            PatchGrid::new(
                config.template_side,
                config.small_patch,
                config.small_step,
                config.subtract_mean,
            ),
            scale_rules(config),
            memory.small_templates(),
            memory.small_buffer(),
        );
        Self { memory, large, small }
    }

    /// Takes the estimate into the memory, and follows with dictionaries and buffers.
    fn learn(
        &mut self,
        best: usize,
        work: &mut Work,
        estimate: &Estimate,
        config: &TrackerConfig,
    ) -> Lesson {
        let Work { particles, candidates, learning, .. } = work;
        let tracked = (particles[best], one(candidates, best, config.template_side));
        let lesson = self.memory.learn(tracked, estimate, self.large.grid(), config, learning);
        let memory = &self.memory;
        self.large.learn(
            lesson.large_dictionary.then(|| memory.templates()),
            lesson.large_buffer.then(|| memory.large_buffer()),
        );
        self.small.learn(
            lesson.small_dictionary.then(|| memory.small_templates()),
            lesson.small_buffer.then(|| memory.small_buffer()),
        );
        lesson
    }
}

impl Work {
    /// Warps the candidates of all particles.
    fn warp(&mut self, image: &GreyImage, side: usize) {
        let particles = &self.particles;
        self.candidates.resize(particles.len() * side * side, 0.0);
        let candidates = self.candidates.par_chunks_mut(side * side);
        candidates.zip(particles).for_each(|(out, state)| candidate(image, state, side, out));
    }

    /// The likelihoods of the candidates (Eq. 24): of all of them, or of those that can be the most likely one, the others then
    /// having minus infinity.
    fn weigh(&mut self, image: &GreyImage, target: &Target, config: &TrackerConfig, whose: Whose) {
        self.rank(image, target, config);
        let Self { particles, candidates, likelihoods, large, small, workers, race, .. } = self;
        large.begin(particles.len(), target.large.grid().locations());
        small.begin(particles.len(), target.small.grid().locations());
        let candidates = (candidates.as_slice(), config.template_side * config.template_side);
        let mut weighing = Weighing {
            coding: Coding::new(candidates, (&target.large, &target.small), workers),
            rules: LikelihoodRules::new(config),
            large_findings: large,
            small_findings: small,
        };
        // Without the division a share may exceed 1, and there is no bound to drop candidates by.
        if race.remaining().is_empty() {
            weighing.hide();
        } else if whose == Whose::All || !config.divide {
            weighing.code_all(race);
        } else {
            weighing.run(race);
        }
        likelihoods.clear();
        likelihoods.resize(particles.len(), f64::NEG_INFINITY);
        for &k in race.remaining() {
            likelihoods[k as usize] = weighing.likelihood(k);
        }
    }

    /// Enters all candidates that are not refused into the race, those first that look like the last template.
    fn rank(&mut self, image: &GreyImage, target: &Target, config: &TrackerConfig) {
        let Self { particles, candidates, likeness, ranked, arranged, race, .. } = self;
        compare(candidates, target.memory.last_template(), likeness);
        let refused = |k: usize| {
            config.outside == Outside::Reject && leaves(image, &particles[k], config.template_side)
        };
        ranked.clear();
        ranked.extend((0..particles.len() as u32).filter(|&k| !refused(k as usize)));
        let likeness = |k: u32| likeness[k as usize];
        // No two compare as equal, and a stable sort would allocate.
        ranked.sort_unstable_by(|&a, &b| likeness(b).total_cmp(&likeness(a)).then(a.cmp(&b)));
        particles::arrange(particles, particles.len().div_ceil(BLOCK), arranged);
        race.begin(ranked, arranged);
    }

    /// While the first templates are gathered by nearest neighbour, the inner product with the last of them ranks the candidates: for
    /// unit vectors the largest one is the smallest distance.
    fn compare_with(&mut self, template: &[f32]) {
        compare(&self.candidates, template, &mut self.likelihoods);
        // Nothing is coded on this frame, so an observer must not find the codes of an earlier one.
        self.large.begin(0, 0);
        self.small.begin(0, 0);
    }

    fn estimate(&self, best: usize, target: &Target, config: &TrackerConfig, out: &mut Estimate) {
        let rules = LikelihoodRules::new(config);
        let fill = |map: &mut VisibilityMap, scale: &Scale, findings: &Findings| {
            let visible = findings.features(best).map(|feature| rules.visible(&feature));
            map.fill(scale.grid().per_side(), visible);
        };
        fill(&mut out.large, &target.large, &self.large);
        fill(&mut out.small, &target.small, &self.small);
        self.finish_estimate(best, config, out);
    }

    /// The estimate where no codes are made: nothing is known to be hidden.
    fn estimate_unseen(
        &self,
        best: usize,
        target: &Target,
        config: &TrackerConfig,
        out: &mut Estimate,
    ) {
        let fill = |map: &mut VisibilityMap, grid: &PatchGrid| {
            map.fill(grid.per_side(), std::iter::repeat_n(true, grid.locations()));
        };
        fill(&mut out.large, target.large.grid());
        fill(&mut out.small, target.small.grid());
        self.finish_estimate(best, config, out);
    }

    /// What follows from the maps and the winner's state.
    fn finish_estimate(&self, best: usize, config: &TrackerConfig, out: &mut Estimate) {
        let state = &self.particles[best];
        let (w, h) = state.size(config.template_side);
        out.bbox = BoundingBox::around([state.x, state.y], w, h);
        out.corners = warp::corners(&state.matrix(), config.template_side as f64 / 2.0);
        out.likelihood = self.likelihoods[best];
        (out.visible_large, out.visible_small) = (out.large.share(), out.small.share());
        out.score = (out.visible_large + out.visible_small) / 2.0;
    }

    fn view<'a>(
        &'a self,
        best: usize,
        target: &'a Target,
        lesson: &'a Lesson,
        config: &TrackerConfig,
    ) -> FrameView<'a> {
        let rules = LikelihoodRules::new(config);
        let patches = |findings: &Findings| {
            let coded = findings.codes(best).zip(findings.features(best));
            coded
                .map(|(&code, feature)| PatchView {
                    code,
                    feature,
                    visible: rules.visible(&feature),
                })
                .collect()
        };
        let mask = if lesson.masked { self.learning.mask() } else { &[] };
        FrameView {
            frame: target.memory.frames(),
            particles: &self.particles,
            likelihoods: &self.likelihoods,
            best,
            candidate: one(&self.candidates, best, config.template_side),
            large: patches(&self.large),
            small: patches(&self.small),
            templates: target.memory.templates(),
            update: lesson.replaced.map(|replaced| UpdateView { replaced, mask }),
        }
    }
}

/// Whose likelihoods are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Whose {
    /// Every candidate's.
    All,
    /// The most likely candidate's.
    Best,
}

/// The inner product of each candidate with a template of the same length.
fn compare(candidates: &[f32], template: &[f32], out: &mut Vec<f64>) {
    let candidates = candidates.par_chunks_exact(template.len().max(1));
    candidates.map(|candidate| likeness(candidate, template)).collect_into_vec(out);
}

/// One of the candidates.
fn one(candidates: &[f32], k: usize, side: usize) -> &[f32] {
    &candidates[k * side * side..][..side * side]
}

/// Warps and normalises one candidate.
fn candidate(image: &GreyImage, state: &State, side: usize, out: &mut [f32]) {
    warp::warp(image, &state.matrix(), side, out);
    normalise(out);
}

/// Whether a corner of the candidate lies outside the frame.
fn leaves(image: &GreyImage, state: &State, side: usize) -> bool {
    let (right, bottom) = (image.width() as f64 - 1.0, image.height() as f64 - 1.0);
    let corners = warp::corners(&state.matrix(), (side as f64 - 1.0) / 2.0);
    !corners.iter().all(|[x, y]| (0.0..=right).contains(x) && (0.0..=bottom).contains(y))
}

fn motion(config: &TrackerConfig) -> Motion {
    Motion {
        sigma: [
            config.sigma_x,
            config.sigma_y,
            config.sigma_scale,
            config.sigma_rotation,
            config.sigma_aspect,
            config.sigma_skew,
        ],
        relative_scale: config.scale_motion == ScaleMotion::Relative,
    }
}

fn scale_rules(config: &TrackerConfig) -> ScaleRules {
    ScaleRules {
        codes: CodeRules {
            atoms: config.atoms,
            selection: config.selection,
            min_residual: config.min_residual,
            stop_energy: config.stop_energy,
        },
        pool: PoolRules { coefficients: config.coefficients, divide: config.divide },
        beta: config.beta,
        position_weights: config.position_weights,
    }
}
