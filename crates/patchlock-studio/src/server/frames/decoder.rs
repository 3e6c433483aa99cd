//! A thread that decodes one clip and encodes its frames, those that were asked for first.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::thread;
use std::time::Duration;

use axum::body::Bytes;
use patchlock_media::{Error, FrameFault, Limits};
use tokio::sync::oneshot;

use super::cache::{Cache, Key};
use super::jpeg;
use super::no_frame;
use super::source::{AHEAD, BACK, Source};
use crate::server::answer::Refusal;

/// Frames prepared against the direction of the last step, after those in the direction.
const BEHIND: usize = 6;
/// A source that nobody needs for this long is closed.
const IDLE: Duration = Duration::from_secs(60);

/// A frame that is looked at.
pub(super) struct Request {
    pub(super) key: Key,
    /// Who waits for it; `None` if it was in the cache.
    pub(super) answer: Option<oneshot::Sender<Result<Bytes, Refusal>>>,
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
    /// Those that somebody waits for.
    requests: Vec<Request>,
    /// The frame that was last looked at, and the number of the one before it.
    last: Option<(Key, usize)>,
    /// Whether neighbours of the last one may be missing.
    prepare: bool,
}

impl RequestQueue {
    fn add(&mut self, request: Request) {
        let key = request.key;
        let before = self.last.map_or(key.frame, |(last, _)| last.frame);
        self.last = Some((key, before));
        self.prepare = true;
        if request.answer.is_some() {
            self.requests.push(request);
        }
    }
}

/// A thread that decodes; it ends when this is dropped.
pub(super) struct Decoder(Sender<Request>);

impl Decoder {
    pub(super) fn start(job: Job) -> Self {
        let (asked, requests) = mpsc::channel();
        thread::spawn(move || job.run(&requests));
        Self(asked)
    }

    pub(super) fn ask(&self, request: Request) {
        // Who waits for an answer is told if the thread has ended.
        let _ = self.0.send(request);
    }
}

impl Job {
    fn run(self, asked: &Receiver<Request>) {
        let (mut source, mut wanted) = (None, RequestQueue::default());
        loop {
            match asked.try_recv() {
                Ok(request) => {
                    wanted.add(request);
                    continue;
                }
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => {}
            }
            let position = source.as_ref().map_or(0, |source: &Source| source.next);
            let Some(Request { key, answer }) = self.next(&mut wanted, position) else {
                match asked.recv_timeout(IDLE) {
                    Ok(request) => wanted.add(request),
                    Err(RecvTimeoutError::Timeout) => source = None,
                    Err(RecvTimeoutError::Disconnected) => return,
                }
                continue;
            };
            let jpeg = match self.cache.get(key) {
                Some(jpeg) => Ok(jpeg),
                None => self.encode(&mut source, key),
            };
            match answer {
                Some(answer) => drop(answer.send(jpeg)),
                // The error is reported when somebody asks for the frame.
                None if jpeg.is_err() => wanted.prepare = false,
                None => {}
            }
        }
    }

    /// The frame to decode next: one that is waited for, or else one to prepare.
    fn next(&self, wanted: &mut RequestQueue, position: usize) -> Option<Request> {
        let is_needed = |request: &Request| {
            // A closed connection no longer needs an answer.
            request.answer.as_ref().is_some_and(|answer| !answer.is_closed())
        };
        wanted.requests.retain(is_needed);
        if let Some(at) = nearest(&wanted.requests, position) {
            return Some(wanted.requests.swap_remove(at));
        }
        let key = self.missing(wanted);
        wanted.prepare = key.is_some();
        key.map(|key| Request { key, answer: None })
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
        let request = |frame| Request { key: key(frame), answer: Some(oneshot::channel().0) };
        let requests: Vec<Request> = [40, 12, 30, 5].map(request).into();
        assert_eq!(nearest(&requests, 11), Some(1));
        assert_eq!(nearest(&requests, 31), Some(0));
        assert_eq!(nearest(&requests, 41), Some(0));
        assert_eq!(nearest(&requests[1..], 41), Some(1));
        assert_eq!(nearest(&[], 0), None);
    }
}
