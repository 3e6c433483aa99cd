//! A run as a self-contained, serialisable job: everything that another process or machine needs to
//! make it. The answer is the two files of the run.

use std::path::{self, PathBuf};
use std::time::Duration;

use patchlock::{BoundingBox, Estimate};
use patchlock_media::{FrameRate, Order, Picture, Prefetcher};
use serde::{Deserialize, Serialize};

use super::plan::{self, Options, Plan};
use super::runner;
use super::schemes::Start;
use super::store::{Clip, Identity, Run, RunFiles, Series, Trajectory};
use super::trackers::{self, Patchlock};
use crate::Error;
use crate::dataset::Dataset;
use patchlock_track::{ModelPaths, start_box};

/// A run to make.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// What the run has in common with the others of its series.
    pub series: Series,
    /// The target's name.
    pub target: String,
    /// Seed of the tracker.
    pub seed: u64,
    /// The frame and box to start on.
    pub start: Start,
    /// The frames to track on.
    pub frames: Frames,
    /// Number of threads of the tracker.
    pub threads: usize,
    /// Number of runs made in parallel, for the manifest.
    pub side_by_side: usize,
    /// Time limit for each answer of an external tracker.
    pub patience: Duration,
    /// The files of the tracker's network, where the run is made. They do not depend on the working
    /// directory.
    #[serde(default)]
    pub paths: ModelPaths,
    /// The video to draw of the run, for what observes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub video: Option<PathBuf>,
}

/// Where the frames are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Frames {
    /// Image files, in order.
    Files(Vec<PathBuf>),
    /// A part of a source. `path` does not depend on the working directory.
    Clip {
        /// The source's full path.
        path: String,
        /// The range of frames.
        clip: Clip,
    },
}

/// Gets the frames of a run on a clip, for example to draw them.
pub trait FrameObserver {
    /// The frames come at this rate, and there are so many, if the source tells.
    ///
    /// # Errors
    /// Why the run must not go on.
    fn begin(&mut self, rate: Option<FrameRate>, expected: Option<usize>) -> Result<(), Error>;

    /// A frame that was tracked.
    ///
    /// # Errors
    /// Why the run must not go on.
    fn observe(&mut self, observed: ObservedFrame<'_>) -> Result<(), Error>;
}

/// A frame of a run.
#[derive(Debug)]
pub struct ObservedFrame<'a> {
    /// Its number in the source.
    pub frame: usize,
    /// Its pixels.
    pub picture: Picture,
    /// The box: the given one in the first frame, the tracked one in later frames.
    pub bbox: BoundingBox,
    /// The tracker's estimate.
    pub estimate: &'a Estimate,
    /// Time that the tracker took, in seconds.
    pub seconds: f64,
}

impl Job {
    /// The run, as the store identifies it.
    pub fn run(&self) -> Run<'_> {
        let (frames, clip) = match &self.frames {
            Frames::Files(files) => (&files[..], None),
            Frames::Clip { clip, .. } => (&[][..], Some(clip)),
        };
        Run { target: &self.target, seed: self.seed, start: self.start, frames, clip }
    }

    /// Seed and start of the run, in words.
    pub fn label(&self) -> String {
        runner::label(self.seed, self.start.variant)
    }

    /// Makes the run and returns the contents of its two files. `observer` sees each frame, if the
    /// run is one on a clip.
    ///
    /// # Errors
    /// An error of the frames, of the network's files, of the tracker or of the observer.
    pub fn track(&self, observer: Option<&mut dyn FrameObserver>) -> Result<RunFiles, Error> {
        let trajectory = match &self.frames {
            Frames::Files(files) => self.track_files(files)?,
            Frames::Clip { path, clip } => self.track_clip(path, clip, observer)?,
        };
        Ok(self.series.write(&self.run(), trajectory, self.threads, self.side_by_side))
    }

    /// The tracker to run, with its network, which a message does not hold.
    fn identity(&self) -> Result<Identity, Error> {
        let mut identity = self.series.subject.clone();
        if let Identity::Patchlock { configuration, network: Some(_), .. } = &mut identity
            && configuration.network.is_none()
        {
            configuration.network = self.paths.network(&configuration.method)?;
        }
        Ok(identity)
    }

    fn track_files(&self, files: &[PathBuf]) -> Result<Trajectory, Error> {
        let identity = self.identity()?;
        let mut subject = trackers::start(&identity, self.seed, self.threads, self.patience)?;
        let frames = files.iter().map(Ok);
        runner::trace(frames, self.start.bbox, |file, start| subject.step(file, start))
    }

    fn track_clip(
        &self,
        path: &str,
        clip: &Clip,
        mut observer: Option<&mut dyn FrameObserver>,
    ) -> Result<Trajectory, Error> {
        let Clip { start, end, stride, .. } = *clip;
        let order = Order { start, end, stride, reverse: false };
        order.check()?;
        let source = patchlock_media::open(path, false)?;
        let indices = order.indices(source.length())?;
        if let Some(observer) = &mut observer {
            observer.begin(source.rate(), order.count(source.length()))?;
        }
        let frames = Prefetcher::start(source, indices).map(|frame| frame.map_err(Error::from));
        let mut subject = Patchlock::of(&self.identity()?, self.seed, self.threads)?;
        let look = |(index, picture): (usize, Picture), start: Option<BoundingBox>| {
            if let Some(bbox) = start {
                start_box::check(&bbox, index, picture.width, picture.height)?;
            }
            let answer = subject.step_on(&picture, start).map_err(|error| {
                let reason = error.to_string();
                Error::from(patchlock_track::Error::TrackerInFrame(index, reason))
            })?;
            if let (Some(observer), Some(estimate)) = (&mut observer, subject.estimate()) {
                let bbox = answer.bbox.unwrap_or(estimate.bbox);
                let (frame, seconds) = (index, answer.seconds);
                observer.observe(ObservedFrame { frame, picture, bbox, estimate, seconds })?;
            }
            Ok(answer)
        };
        let trajectory = runner::trace(frames, self.start.bbox, look)?;
        if trajectory.boxes.is_empty() { Err(order.nothing().into()) } else { Ok(trajectory) }
    }
}

/// The jobs that a benchmark with these options consists of. The caller chooses how many of them
/// run in parallel, and on how many threads each.
///
/// # Errors
/// As [`plan::plan`].
pub fn of_bench(
    options: &Options,
    threads: usize,
    side_by_side: usize,
) -> Result<Plan<Job>, Error> {
    let dataset = Dataset::open(&options.dataset)?;
    let Plan { store, paths, tasks, before, failures } = plan::plan(options, &dataset)?;
    let paths = paths.absolute()?;
    let job = |task: Run<'_>| {
        let files = task.frames.iter();
        let files = files.map(|file| path::absolute(file).map_err(|e| Error::read(file, e)));
        Ok(Job {
            series: store.series().clone(),
            target: task.target.to_string(),
            seed: task.seed,
            start: task.start,
            frames: Frames::Files(files.collect::<Result<_, Error>>()?),
            threads,
            side_by_side,
            patience: options.tracker.patience(),
            paths: paths.clone(),
            video: None,
        })
    };
    let tasks = tasks.into_iter().map(job).collect::<Result<_, Error>>()?;
    Ok(Plan { store, paths, tasks, before, failures })
}
