//! What the tracker remembers of its target, and how it learns (Sec. 2.5): everything that a saved state holds.
//! Dictionaries and the patches of the buffers are derived from it.

use crate::Error;
use crate::appearance::subspace::{self, Subspace, SubspaceRules};
use crate::appearance::update::NewTemplate;
use crate::appearance::{buffer, templates};
use crate::config::{FirstTemplates, TrackerConfig};
use crate::estimate::Estimate;
use crate::filter::state::State;
use crate::vision::patches::PatchGrid;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// The stream of the random numbers; any fixed one does.
const STREAM: u128 = 0x7061_7463_686c_6f63;

/// More frames than any video has; counting on from here never overflows.
const MAX_FRAMES: u64 = 1 << 53;

/// The target as it is remembered between two frames. Templates and buffers are normalised candidates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Memory {
    width: usize,
    height: usize,
    pub(crate) state: State,
    pub(crate) rng: Pcg64,
    /// Frames since the first, and those of them since the first templates were complete.
    frames: u64,
    steps: u64,
    gathering: bool,
    templates: Vec<Vec<f32>>,
    /// The templates when the small dictionary was last made.
    small_templates: Vec<Vec<f32>>,
    large_buffer: Vec<Vec<f32>>,
    small_buffer: Vec<Vec<f32>>,
    subspace: Subspace,
    /// Tracked candidates that the subspace has not taken in yet.
    batch: Vec<Vec<f32>>,
}

/// What a frame changed.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Lesson {
    /// The template that was replaced.
    pub replaced: Option<usize>,
    /// Whether the new one was made with a mask, which the scratch then holds.
    pub masked: bool,
    pub large_dictionary: bool,
    pub small_dictionary: bool,
    pub large_buffer: bool,
    pub small_buffer: bool,
}

/// Room to learn in, so that nothing is allocated anew. Nothing in it is remembered.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// Candidates that the subspace has taken in, to be written over.
    spare: Vec<Vec<f32>>,
    subspace: subspace::Scratch,
    new: NewTemplate,
}

impl Scratch {
    /// The mask of the template that was made last.
    pub fn mask(&self) -> &[f64] {
        self.new.mask()
    }
}

impl Memory {
    /// The memory after the first frame; `cut` makes the normalised candidate of a state.
    pub fn begin(
        config: &TrackerConfig,
        (width, height): (usize, usize),
        state: State,
        cut: impl Fn(&State) -> Vec<f32>,
    ) -> Self {
        let count = match config.first_templates {
            FirstTemplates::Shifts | FirstTemplates::WarmUp => config.templates,
            FirstTemplates::Nearest => 1,
        };
        let shifted = |[dx, dy]: [f64; 2]| State { x: state.x + dx, y: state.y + dy, ..state };
        let shifts = templates::shifts(count);
        let mut memory = Self {
            width,
            height,
            state,
            rng: Pcg64::new(u128::from(config.seed), STREAM),
            frames: 0,
            steps: 0,
            gathering: config.first_templates != FirstTemplates::Shifts,
            templates: shifts.into_iter().map(|shift| cut(&shifted(shift))).collect(),
            small_templates: Vec::new(),
            large_buffer: Vec::new(),
            small_buffer: Vec::new(),
            subspace: Subspace::default(),
            batch: Vec::new(),
        };
        memory.begin_again(config);
        if !memory.gathering {
            memory.begin_subspace(config);
        }
        memory
    }

    /// Dictionaries and buffers follow the templates as they are.
    fn begin_again(&mut self, config: &TrackerConfig) {
        self.small_templates.clone_from(&self.templates);
        self.large_buffer = buffer::begin(&self.templates, config.buffer);
        self.small_buffer.clone_from(&self.large_buffer);
    }

    fn begin_subspace(&mut self, config: &TrackerConfig) {
        self.subspace = Subspace::default();
        let mut scratch = subspace::Scratch::default();
        self.subspace.add(&self.templates, &subspace_rules(config), &mut scratch);
    }

    /// Learns from the estimate: its state and candidate, and what of it is visible.
    pub fn learn(
        &mut self,
        (state, candidate): (State, &[f32]),
        estimate: &Estimate,
        grid: &PatchGrid,
        config: &TrackerConfig,
        scratch: &mut Scratch,
    ) -> Lesson {
        self.state = state;
        self.frames += 1;
        if self.gathering {
            return self.gather(candidate, config);
        }
        self.steps += 1;
        let mut copy = scratch.spare.pop().unwrap_or_default();
        copy.clear();
        copy.extend_from_slice(candidate);
        self.batch.push(copy);
        let mut lesson = Lesson::default();
        let every = |interval: usize| self.steps.is_multiple_of(interval as u64);
        let (large_turn, small_turn) =
            (every(config.update_interval), every(config.small_update_interval));
        if large_turn {
            self.subspace.add(&self.batch, &subspace_rules(config), &mut scratch.subspace);
            scratch.spare.append(&mut self.batch);
            lesson.replaced =
                self.update_templates(candidate, estimate, grid, config, &mut scratch.new);
            lesson.masked = lesson.replaced.is_some();
            lesson.large_dictionary = lesson.replaced.is_some();
            if estimate.visible_large > config.large_buffer_guard {
                buffer::push(&mut self.large_buffer, candidate);
                lesson.large_buffer = true;
            }
        }
        if small_turn {
            self.small_templates.clone_from(&self.templates);
            lesson.small_dictionary = true;
            if estimate.visible_small > config.small_buffer_guard {
                buffer::push(&mut self.small_buffer, candidate);
                lesson.small_buffer = true;
            }
        }
        lesson
    }

    /// Replaces a template where enough of the estimate is visible, and says which.
    fn update_templates(
        &mut self,
        candidate: &[f32],
        estimate: &Estimate,
        grid: &PatchGrid,
        config: &TrackerConfig,
        new: &mut NewTemplate,
    ) -> Option<usize> {
        if estimate.visible_small + estimate.visible_large <= 2.0 * config.delta {
            return None;
        }
        new.make(candidate, grid, &estimate.large.visible, &self.subspace, config);
        let growth = config.replacement_growth;
        let replaced = templates::draw_replaced(self.templates.len(), growth, &mut self.rng);
        templates::replace(&mut self.templates, replaced, new.template());
        Some(replaced)
    }

    /// Takes the tracked candidate into the first templates, unconditionally.
    fn gather(&mut self, candidate: &[f32], config: &TrackerConfig) -> Lesson {
        let replaced = match config.first_templates {
            FirstTemplates::Nearest => None,
            FirstTemplates::Shifts | FirstTemplates::WarmUp => Some(1),
        };
        let slot = replaced.unwrap_or(self.templates.len());
        templates::replace(&mut self.templates, slot, candidate);
        self.gathering = match config.first_templates {
            FirstTemplates::Nearest => self.templates.len() < config.templates,
            FirstTemplates::Shifts | FirstTemplates::WarmUp => {
                self.frames < config.warm_up_frames as u64
            }
        };
        self.begin_again(config);
        if !self.gathering {
            self.begin_subspace(config);
        }
        Lesson {
            replaced,
            masked: false,
            large_dictionary: true,
            small_dictionary: true,
            large_buffer: true,
            small_buffer: true,
        }
    }

    pub fn is_gathering(&self) -> bool {
        self.gathering
    }

    pub fn frames(&self) -> u64 {
        self.frames
    }

    pub fn templates(&self) -> &[Vec<f32>] {
        &self.templates
    }

    pub fn last_template(&self) -> &[f32] {
        self.templates.last().map_or(&[], Vec::as_slice)
    }

    pub fn small_templates(&self) -> &[Vec<f32>] {
        &self.small_templates
    }

    pub fn large_buffer(&self) -> &[Vec<f32>] {
        &self.large_buffer
    }

    pub fn small_buffer(&self) -> &[Vec<f32>] {
        &self.small_buffer
    }

    /// Width and height of the frames.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Refuses frames of another size than the first.
    pub fn check_size(&self, width: usize, height: usize) -> Result<(), Error> {
        if (width, height) == (self.width, self.height) {
            return Ok(());
        }
        Err(Error::FrameSize {
            width,
            height,
            expected_width: self.width,
            expected_height: self.height,
        })
    }

    /// Whether this could be the memory of a tracker with this configuration.
    pub fn check(&self, config: &TrackerConfig) -> Result<(), Error> {
        let length = config.template_side * config.template_side;
        let sound = |all: &[Vec<f32>]| {
            all.iter().all(|t| t.len() == length && t.iter().all(|v| v.abs() <= 1.001))
        };
        let gathers = self.gathering && config.first_templates == FirstTemplates::Nearest;
        let enough = if gathers {
            (1..=config.templates).contains(&self.templates.len())
        } else {
            self.templates.len() == config.templates
        };
        let checks = [
            (self.width > 0 && self.height > 0, "the frame size is 0"),
            (
                self.frames.max(self.steps) <= MAX_FRAMES,
                "it has counted more frames than a video has",
            ),
            (self.state.is_valid(), "the state is not a shape"),
            (enough && sound(&self.templates), "the templates do not fit the configuration"),
            (
                self.small_templates.len() == self.templates.len() && sound(&self.small_templates),
                "the small dictionary's templates do not fit the configuration",
            ),
            (
                [&self.large_buffer, &self.small_buffer]
                    .iter()
                    .all(|buffer| buffer.len() == config.buffer && sound(buffer)),
                "the buffers do not fit the configuration",
            ),
            (
                self.batch.len() < config.update_interval && sound(&self.batch),
                "the waiting candidates do not fit the configuration",
            ),
            (
                self.gathering || self.subspace.fits(length),
                "the subspace does not fit the configuration",
            ),
        ];
        match checks.iter().find(|(holds, _)| !holds) {
            Some((_, what)) => Err(Error::Snapshot((*what).to_owned())),
            None => Ok(()),
        }
    }
}

fn subspace_rules(config: &TrackerConfig) -> SubspaceRules {
    SubspaceRules {
        forgetting: config.forgetting,
        keep: config.subspace_keep,
        vectors: config.subspace_vectors,
    }
}

/// The version of the saved form; raised when the meaning of its fields changes.
const VERSION: u32 = 1;

/// A tracker's state between two frames, made by [`Tracker::snapshot`](crate::Tracker::snapshot).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    version: u32,
    config: TrackerConfig,
    memory: Option<Memory>,
}

impl Snapshot {
    pub(crate) fn new(config: TrackerConfig, memory: Option<Memory>) -> Self {
        Self { version: VERSION, config, memory }
    }

    /// The parts, where they fit together.
    pub(crate) fn check(self) -> Result<(TrackerConfig, Option<Memory>), Error> {
        if self.version != VERSION {
            return Err(Error::Snapshot(format!(
                "its version is {}, this program reads version {VERSION}",
                self.version
            )));
        }
        self.config.validate()?;
        if let Some(memory) = &self.memory {
            memory.check(&self.config)?;
        }
        Ok((self.config, self.memory))
    }
}
