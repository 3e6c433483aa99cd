//! A thread that decodes one clip and encodes its frames, those that were asked for first.

use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::Duration;

use axum::body::Bytes;
use patchlock_media::{Error, FrameFault, Limits};
use tokio::sync::oneshot;

use super::cache::{Cache, Key};
use super::jpeg;
use super::source::{AHEAD, BACK, Source};
use super::{lock, no_frame};
use crate::server::answer::Refusal;

/// Frames prepared against the direction of the last step, after those in the direction.
const BEHIND: usize = 6;
/// A source that nobody needs for this long is closed.
const IDLE: Duration = Duration::from_secs(60);

pub(super) struct Request {
    pub(super) key: Key,
    pub(super) answer: oneshot::Sender<Result<Bytes, Refusal>>,
}

/// What the thread needs to decode.
pub(super) struct Job {
    pub(super) path: PathBuf,
    pub(super) limits: Limits,
    /// The number of frames.
    pub(super) frames: usize,
    pub(super) cache: Arc<Cache>,
    /// Whether it prepares the neighbours of the last frame asked for.
    pub(super) prepares: bool,
}

#[derive(Default)]
struct RequestQueue {
    requests: Vec<Request>,
    /// The frame that was last looked at, and the number of the one before it.
    last: Option<(Key, usize)>,
    /// Whether neighbours of the last one may be missing.
    prepare: bool,
    /// Nobody will ask again.
    closed: bool,
}

impl RequestQueue {
    fn look(&mut self, key: Key) {
        let before = self.last.map_or(key.frame, |(last, _)| last.frame);
        self.last = Some((key, before));
        self.prepare = true;
    }
}

#[derive(Default)]
struct DecoderState {
    wanted: Mutex<RequestQueue>,
    asked: Condvar,
}

/// A thread that decodes; it ends when this is dropped.
pub(super) struct Decoder {
    shared: Arc<DecoderState>,
}

impl Drop for Decoder {
    fn drop(&mut self) {
        lock(&self.shared.wanted).closed = true;
        self.shared.asked.notify_all();
    }
}

impl Decoder {
    pub(super) fn start(job: Job) -> Self {
        let shared = Arc::new(DecoderState::default());
        let theirs = Arc::clone(&shared);
        thread::spawn(move || job.run(&theirs));
        Self { shared }
    }

    pub(super) fn ask(&self, request: Request) {
        let mut wanted = lock(&self.shared.wanted);
        wanted.look(request.key);
        wanted.requests.push(request);
        self.shared.asked.notify_all();
    }

    /// Takes note that a frame was looked at that was in the cache.
    pub(super) fn passed(&self, key: Key) {
        lock(&self.shared.wanted).look(key);
        self.shared.asked.notify_all();
    }
}

/// What to do next.
enum Task {
    Answer(Request),
    Prepare(Key),
    /// Close the source: nothing was asked for in a while.
    Rest,
    End,
}

impl Job {
    fn run(self, shared: &DecoderState) {
        let mut source = None;
        loop {
            let position = source.as_ref().map_or(0, |source: &Source| source.next);
            let (key, answer) = match self.next(shared, position) {
                Task::Answer(request) => (request.key, Some(request.answer)),
                Task::Prepare(key) => (key, None),
                Task::Rest => {
                    source = None;
                    continue;
                }
                Task::End => return,
            };
            let jpeg = match self.cache.get(key) {
                Some(jpeg) => Ok(jpeg),
                None => self.encode(&mut source, key),
            };
            match answer {
                Some(answer) => drop(answer.send(jpeg)),
                // The error is reported when somebody asks for the frame.
                None if jpeg.is_err() => lock(&shared.wanted).prepare = false,
                None => {}
            }
        }
    }

    /// Waits for something to do.
    fn next(&self, shared: &DecoderState, position: usize) -> Task {
        let mut wanted = lock(&shared.wanted);
        loop {
            if wanted.closed {
                return Task::End;
            }
            // A closed connection no longer needs an answer.
            wanted.requests.retain(|request| !request.answer.is_closed());
            if let Some(at) = nearest(&wanted.requests, position) {
                return Task::Answer(wanted.requests.swap_remove(at));
            }
            if let Some(key) = self.missing(&wanted) {
                return Task::Prepare(key);
            }
            wanted.prepare = false;
            let waited = shared.asked.wait_timeout(wanted, IDLE);
            let (after, time) = waited.unwrap_or_else(|poisoned| poisoned.into_inner());
            if time.timed_out() && after.requests.is_empty() {
                return Task::Rest;
            }
            wanted = after;
        }
    }

    /// A neighbour of the last frame that is not in the cache.
    fn missing(&self, wanted: &RequestQueue) -> Option<Key> {
        let (last, before) = wanted.last.filter(|_| self.prepares && wanted.prepare)?;
        let mut near = neighbours(last.frame, last.frame >= before, self.frames);
        let missing = |frame: &usize| !self.cache.holds(Key { frame: *frame, ..last });
        near.find(missing).map(|frame| Key { frame, ..last })
    }

    /// Decodes and encodes a frame, and those before it that have to be decoded anyway.
    fn encode(&self, source: &mut Option<Source>, key: Key) -> Result<Bytes, Refusal> {
        let opened = match source {
            Some(opened) => opened,
            None => source.insert(Source::open(&self.path, self.limits, self.prepares)?),
        };
        let first = if self.prepares { opened.first(key.frame) } else { key.frame };
        let mut wanted = None;
        for frame in first..=key.frame {
            let picture = match opened.frame(frame) {
                Ok(Some(picture)) => picture,
                Ok(None) => return Err(no_frame(frame, self.frames)),
                // It is an error when somebody asks for it.
                Err(Error::Frame { fault: FrameFault::Damaged, .. }) if frame < key.frame => {
                    continue;
                }
                Err(error) => {
                    *source = None;
                    return Err(error.into());
                }
            };
            let jpeg = Bytes::from(jpeg(&picture, key.width)?);
            self.cache.put(Key { frame, ..key }, jpeg.clone());
            wanted = Some(jpeg);
        }
        wanted.ok_or_else(|| no_frame(key.frame, self.frames))
    }
}

/// The request that takes the least decoding from a position in the video: the next one at or after
/// it, or else the last one before it.
fn nearest(requests: &[Request], position: usize) -> Option<usize> {
    let frame = |at: &usize| requests[*at].key.frame;
    let after = (0..requests.len()).filter(|at| frame(at) >= position).min_by_key(frame);
    after.or_else(|| (0..requests.len()).max_by_key(frame))
}

/// The frames to prepare around a frame, the most probable first.
fn neighbours(frame: usize, forward: bool, frames: usize) -> impl Iterator<Item = usize> {
    let at = move |step: usize, forward: bool| match forward {
        true => frame.checked_add(step).filter(|&there| there < frames),
        false => frame.checked_sub(step),
    };
    let ahead = (1..=if forward { AHEAD } else { BACK }).filter_map(move |step| at(step, forward));
    ahead.chain((1..=BEHIND).filter_map(move |step| at(step, !forward)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(frame: usize) -> Key {
        Key { clip: 1, frame, width: 0 }
    }

    #[test]
    fn neighbours_are_prepared_in_the_direction_of_the_last_step() {
        let near = |frame, forward| neighbours(frame, forward, 50).collect::<Vec<_>>();
        assert_eq!(near(40, true), [41, 42, 43, 44, 45, 46, 47, 48, 49, 39, 38, 37, 36, 35, 34]);
        assert_eq!(near(3, false), [2, 1, 0, 4, 5, 6, 7, 8, 9]);
        assert_eq!(near(49, true), [48, 47, 46, 45, 44, 43]);
        assert!(neighbours(25, true, 50).all(|frame| frame < 50 && frame != 25));
        assert_eq!(neighbours(0, true, 1).count(), 0);
    }

    #[test]
    fn the_request_that_needs_the_least_decoding_is_next() {
        let request = |frame| Request { key: key(frame), answer: oneshot::channel().0 };
        let requests: Vec<Request> = [40, 12, 30, 5].map(request).into();
        assert_eq!(nearest(&requests, 11), Some(1));
        assert_eq!(nearest(&requests, 31), Some(0));
        assert_eq!(nearest(&requests, 41), Some(0));
        assert_eq!(nearest(&requests[1..], 41), Some(1));
        assert_eq!(nearest(&[], 0), None);
    }
}
