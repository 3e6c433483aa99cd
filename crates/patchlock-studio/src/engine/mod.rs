//! Tracking jobs: which stretches of a video a request means ([`plan`]), and a tracker on the frames
//! of one ([`Engine::track`]). [`look`] compares a frame with the nearest key frame.

pub mod look;
pub mod plan;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use patchlock::{BoundingBox, TrackerConfig};
use patchlock_media::{Limits, Picture, Prefetcher};
use patchlock_track::session::Session;
use rayon::ThreadPool;

use crate::project::TrackedBox;
use crate::tracking::FrameEstimate;
use crate::tracking::join::join;
use plan::{Anchor, Span};

/// What a tracker needs to know of a video.
#[derive(Clone)]
pub struct Engine {
    /// The video, as [`patchlock_media::open`] takes it.
    pub video: PathBuf,
    /// What it may claim.
    pub limits: Limits,
    /// The settings of the tracker.
    pub config: TrackerConfig,
    /// The threads of the tracker.
    pub pool: Arc<ThreadPool>,
}

/// Why tracking has failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A frame cannot be read.
    #[error(transparent)]
    Video(#[from] patchlock_media::Error),
    /// The tracker refuses a frame or its settings.
    #[error("the tracker stopped in frame {frame}: {reason}")]
    Tracker {
        /// The frame.
        frame: usize,
        /// The reason.
        reason: patchlock::Error,
    },
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
    /// Tracks a span, with what was known before of [doubtful](crate::tracking::review::doubtful)
    /// frames. Returns the boxes of its frames without those that it starts from, or `None` if the
    /// listener has stopped it; what was found until then it knows.
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
            Span::After { start, to } => return self.pass(start, to, true, listener).map(alone),
            Span::Before { start, to } => return self.pass(start, to, true, listener).map(alone),
        };
        let Some(forward) = self.pass(first, last.0, true, listener)? else { return Ok(None) };
        let Some(mut backward) = self.pass(last, first.0, false, listener)? else {
            return Ok(None);
        };
        backward.reverse();
        let found = |pass: Vec<(usize, FrameEstimate)>| -> Vec<FrameEstimate> {
            pass.into_iter().map(|(_, found)| found).collect()
        };
        let before = |at: usize| before.get(&(first.0 + 1 + at)).copied();
        let joined = join(first.1, &found(forward), &found(backward), last.1, before);
        Ok(Some((first.0 + 1..).zip(joined).collect()))
    }

    /// Tracks from a box to a frame before or after it.
    fn pass(
        &self,
        start: Anchor,
        to: usize,
        shown: bool,
        listener: &mut dyn Listener,
    ) -> Result<Option<Vec<(usize, FrameEstimate)>>, Error> {
        let (first, bbox) = start;
        let backward = to < first;
        let source = patchlock_media::open_within(&self.video, backward, self.limits)?;
        let mut frames = match backward {
            true => Prefetcher::start(source, (to..=first).rev()),
            false => Prefetcher::start(source, first..=to),
        };
        let tracker = |frame, reason| Error::Tracker { frame, reason };
        let mut session = None;
        let mut pass = Vec::new();
        let mut next = Some(first);
        while let Some(expected) = next {
            let taken = frames.next_unless(&|| listener.stopped())?;
            let Some((frame, picture)) = taken else {
                return if listener.stopped() { Ok(None) } else { Err(Error::Ended(expected)) };
            };
            let found = self.step(&mut session, &picture, bbox);
            let found = found.map_err(|reason| tracker(frame, reason))?;
            if frame != first {
                pass.push((frame, found));
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
        session: &mut Option<Session>,
        picture: &Picture,
        bbox: BoundingBox,
    ) -> Result<FrameEstimate, patchlock::Error> {
        let frame = picture.frame()?;
        if let Some(session) = session {
            return Ok(FrameEstimate::from(session.update(&frame)?.0));
        }
        let (config, pool) = (self.config.clone(), Arc::clone(&self.pool));
        let (begun, _) = Session::start(config, pool, &frame, bbox)?;
        Ok(FrameEstimate::from(session.insert(begun).estimate()))
    }
}

/// The boxes of a span that was tracked from one side only.
fn alone(pass: Option<Vec<(usize, FrameEstimate)>>) -> Option<Vec<(usize, TrackedBox)>> {
    Some(pass?.into_iter().map(|(frame, found)| (frame, found.into())).collect())
}
