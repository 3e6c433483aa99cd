//! Tracking jobs: which stretches of a video a request means ([`plan`]), and a tracker on the frames
//! of one ([`Engine::track`]). [`look`] compares a frame with the nearest key frame.

pub mod look;
pub mod plan;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use patchlock::{BoundingBox, Tracker, TrackerConfig};
use patchlock_media::{FrameSource, Limits, Picture, Prefetcher};
use rayon::ThreadPool;

use crate::project::TrackedBox;
use crate::tracking::FrameEstimate;
use crate::tracking::join::join;
use plan::{Anchor, Span};

/// What all videos share.
#[derive(Clone)]
pub struct Settings {
    /// The settings of the tracker.
    pub config: TrackerConfig,
    /// The threads of the tracker.
    pub pool: Arc<ThreadPool>,
    /// What a video may claim.
    pub limits: Limits,
}

/// What a tracker needs to know of a video.
pub struct Engine {
    /// The video, as [`patchlock_media::open`] takes it.
    pub video: PathBuf,
    pub settings: Settings,
}

/// Why tracking has failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A frame cannot be read.
    #[error(transparent)]
    Video(#[from] patchlock_media::Error),
    /// The tracker refuses a frame or its settings.
    #[error("the tracker stopped in frame {frame}: {reason}")]
    Tracker { frame: usize, reason: patchlock::Error },
    /// The video ends early.
    #[error("the video ended before frame {0}")]
    Ended(usize),
}

/// Who wants to know what a tracker finds, and may stop it.
pub trait Listener {
    /// Whether to stop before the next frame.
    fn stopped(&self) -> bool;

    /// A box was found. Those of a span between two key frames come twice: as tracked forward, and,
    /// with the last one, all as joined. A pass over the frames that shows nothing new has no box.
    fn found(&mut self, frame: usize, tracked: Option<TrackedBox>);
}

impl Engine {
    /// Opens the video, to read it forward or backward.
    pub fn open(&self, backward: bool) -> Result<Box<dyn FrameSource>, patchlock_media::Error> {
        patchlock_media::open_within(&self.video, backward, self.settings.limits)
    }

    /// Tracks a span, with what was known before of [doubtful](crate::tracking::review::doubtful)
    /// frames. Returns the joined boxes of a span between two others, without those; of an open one,
    /// the listener knows all. `None` if the listener has stopped it; what was found until then it
    /// knows.
    ///
    /// # Errors
    /// [`Error`]; what was found until then the listener knows.
    pub fn track(
        &self,
        span: Span,
        before: &BTreeMap<usize, TrackedBox>,
        listener: &mut dyn Listener,
    ) -> Result<Option<Vec<(usize, TrackedBox)>>, Error> {
        let (first, last) = match span {
            Span::Between { first, last } => (first, last),
            Span::Open { start, to } => {
                let pass = self.pass(start, to, true, listener)?;
                return Ok(pass.map(|_| Vec::new()));
            }
        };
        let Some(forward) = self.pass(first, last.0, true, listener)? else { return Ok(None) };
        let Some(mut backward) = self.pass(last, first.0, false, listener)? else {
            return Ok(None);
        };
        backward.reverse();
        let before = |at: usize| before.get(&(first.0 + 1 + at)).copied();
        let joined = join(first.1, &forward, &backward, last.1, before);
        Ok(Some((first.0 + 1..).zip(joined).collect()))
    }

    /// Tracks from a box to a frame before or after it. Returns what was found after that of the box.
    fn pass(
        &self,
        start: Anchor,
        to: usize,
        shown: bool,
        listener: &mut dyn Listener,
    ) -> Result<Option<Vec<FrameEstimate>>, Error> {
        let (first, bbox) = start;
        let backward = to < first;
        let source = self.open(backward)?;
        let mut frames = match backward {
            true => Prefetcher::start(source, (to..=first).rev()),
            false => Prefetcher::start(source, first..=to),
        };
        let mut tracker = None;
        let mut pass = Vec::new();
        let mut next = Some(first);
        while let Some(expected) = next {
            let taken = frames.next_unless(&|| listener.stopped())?;
            let Some((frame, picture)) = taken else {
                return if listener.stopped() { Ok(None) } else { Err(Error::Ended(expected)) };
            };
            let found = self.step(&mut tracker, &picture, bbox);
            let found = found.map_err(|reason| Error::Tracker { frame, reason })?;
            if frame != first {
                pass.push(found);
                listener.found(frame, shown.then(|| found.into()));
            }
            next = match frame {
                _ if frame == to => None,
                _ if backward => frame.checked_sub(1),
                _ => Some(frame + 1),
            };
        }
        Ok(Some(pass))
    }

    /// Tracks in the next picture; in the first one, the tracker starts on a box.
    fn step(
        &self,
        tracker: &mut Option<Tracker>,
        picture: &Picture,
        bbox: BoundingBox,
    ) -> Result<FrameEstimate, patchlock::Error> {
        let frame = picture.frame()?;
        let Settings { config, pool, .. } = &self.settings;
        if let Some(tracker) = tracker {
            return Ok(FrameEstimate::from(pool.install(|| tracker.update(&frame))?));
        }
        let begun = pool.install(|| Tracker::start(config.clone(), &frame, bbox))?;
        Ok(FrameEstimate::from(tracker.insert(begun).estimate()))
    }
}
