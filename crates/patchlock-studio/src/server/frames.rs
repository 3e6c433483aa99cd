//! Single frames as JPEG, whatever the video's encoding.
//!
//! Each clip has two threads that decode: one for the frames that a person looks at, which also prepares the
//! neighbours, and one for thumbnails, so that these do not disturb the former's position in the video. All
//! share one cache.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use image::{RgbImage, imageops};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use patchlock_media::{FrameSource, Limits, Picture, Pixels};
use serde::Deserialize;
use tokio::sync::oneshot;

use super::App;
use super::answer::{Asked, At, Refusal};

/// Bytes of encoded frames kept, of all clips together.
const CACHE_BYTES: usize = 256 << 20;
/// Quality of the JPEG: artefacts must not hide where a target ends.
const QUALITY: u8 = 88;
/// A frame of at most this width is a thumbnail.
const THUMBNAIL: u32 = 320;
/// Frames prepared after a step forward.
const AHEAD: usize = 24;
/// Frames prepared after a step back. A decoder comes to them many at a time, and may take longer.
const BACK: usize = 64;
/// Frames prepared against the direction of the last step, after those in the direction.
const BEHIND: usize = 6;
/// Frames prepared before the one that a source has to start again for: a step back would take a start, too.
const BEFORE: usize = 12;
/// A decoder that nobody needs for this long is closed.
const IDLE: Duration = Duration::from_secs(60);

/// An encoded frame of a clip; width 0 stands for the frame's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    clip: usize,
    frame: usize,
    width: u32,
}

/// Encoded frames, the least recently used of which is dropped first.
pub struct Cache {
    most: usize,
    held: Mutex<Held>,
}

#[derive(Default)]
struct Held {
    frames: HashMap<Key, (Bytes, u64)>,
    /// By the time of their last use.
    order: BTreeMap<u64, Key>,
    bytes: usize,
    clock: u64,
}

impl Default for Cache {
    fn default() -> Self {
        Self { most: CACHE_BYTES, held: Mutex::default() }
    }
}

impl Cache {
    fn get(&self, key: Key) -> Option<Bytes> {
        let mut held = lock(&self.held);
        held.clock += 1;
        let now = held.clock;
        let (jpeg, used) = held.frames.get_mut(&key)?;
        let (jpeg, before) = (jpeg.clone(), std::mem::replace(used, now));
        held.order.remove(&before);
        held.order.insert(now, key);
        Some(jpeg)
    }

    fn holds(&self, key: Key) -> bool {
        lock(&self.held).frames.contains_key(&key)
    }

    fn put(&self, key: Key, jpeg: Bytes) {
        let mut held = lock(&self.held);
        held.clock += 1;
        let now = held.clock;
        held.bytes += jpeg.len();
        if let Some((old, used)) = held.frames.insert(key, (jpeg, now)) {
            held.bytes -= old.len();
            held.order.remove(&used);
        }
        held.order.insert(now, key);
        while held.bytes > self.most {
            let Some((_, oldest)) = held.order.pop_first() else { return };
            if let Some((old, _)) = held.frames.remove(&oldest) {
                held.bytes -= old.len();
            }
        }
    }
}

/// A panic of another thread leaves the data as they were between two statements, which is good enough here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Reads frames of one clip.
pub struct Reader {
    clip: usize,
    cache: Arc<Cache>,
    viewed: Worker,
    thumbnails: Worker,
}

impl Reader {
    pub fn new(path: &Path, limits: Limits, frames: usize, clip: usize, cache: Arc<Cache>) -> Self {
        let worker = |prepares| {
            let (path, cache) = (path.to_path_buf(), Arc::clone(&cache));
            Worker::start(Job { path, limits, frames, cache, prepares })
        };
        Self { clip, viewed: worker(true), thumbnails: worker(false), cache }
    }

    /// A frame as JPEG, of this width if the frame is wider; 0 stands for its own.
    async fn jpeg(&self, frame: usize, width: u32) -> Result<Bytes, Refusal> {
        let key = Key { clip: self.clip, frame, width };
        let is_thumbnail = (1..=THUMBNAIL).contains(&width);
        if let Some(jpeg) = self.cache.get(key) {
            if !is_thumbnail {
                self.viewed.passed(key);
            }
            return Ok(jpeg);
        }
        let (answer, wait) = oneshot::channel();
        let worker = if is_thumbnail { &self.thumbnails } else { &self.viewed };
        worker.ask(Request { key, answer });
        wait.await.unwrap_or_else(|_| Err(Refusal::failed("the decoder has ended")))
    }
}

struct Request {
    key: Key,
    answer: oneshot::Sender<Result<Bytes, Refusal>>,
}

/// What a worker needs to decode.
struct Job {
    path: PathBuf,
    limits: Limits,
    /// The number of frames.
    frames: usize,
    cache: Arc<Cache>,
    /// Whether it prepares the neighbours of what was asked for.
    prepares: bool,
}

#[derive(Default)]
struct Wanted {
    requests: Vec<Request>,
    /// The frame that was last looked at, and the number of the one before it.
    last: Option<(Key, usize)>,
    /// Whether neighbours of the last one may be missing.
    prepare: bool,
    /// Nobody will ask again.
    closed: bool,
}

impl Wanted {
    fn look(&mut self, key: Key) {
        let before = self.last.map_or(key.frame, |(last, _)| last.frame);
        self.last = Some((key, before));
        self.prepare = true;
    }
}

#[derive(Default)]
struct Shared {
    wanted: Mutex<Wanted>,
    asked: Condvar,
}

/// A thread that decodes; it ends when this is dropped.
struct Worker {
    shared: Arc<Shared>,
}

impl Drop for Worker {
    fn drop(&mut self) {
        lock(&self.shared.wanted).closed = true;
        self.shared.asked.notify_all();
    }
}

impl Worker {
    fn start(job: Job) -> Self {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        thread::spawn(move || job.run(&theirs));
        Self { shared }
    }

    fn ask(&self, request: Request) {
        let mut wanted = lock(&self.shared.wanted);
        wanted.look(request.key);
        wanted.requests.push(request);
        self.shared.asked.notify_all();
    }

    /// A frame was looked at that was in the cache.
    fn passed(&self, key: Key) {
        lock(&self.shared.wanted).look(key);
        self.shared.asked.notify_all();
    }
}

/// What to do next.
enum Task {
    Answer(Request),
    Prepare(Key),
    /// Close the decoder: nothing was asked for in a while.
    Rest,
    End,
}

impl Job {
    fn run(self, shared: &Shared) {
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
                // What cannot be prepared is reported when it is asked for.
                None if jpeg.is_err() => lock(&shared.wanted).prepare = false,
                None => {}
            }
        }
    }

    /// Waits for something to do.
    fn next(&self, shared: &Shared, position: usize) -> Task {
        let mut wanted = lock(&shared.wanted);
        loop {
            if wanted.closed {
                return Task::End;
            }
            // Whoever has closed the connection no longer needs an answer.
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
    fn missing(&self, wanted: &Wanted) -> Option<Key> {
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

/// An open video.
struct Source {
    frames: Box<dyn FrameSource>,
    /// Whether it keeps frames for steps back. What comes from another program does not: that has to start
    /// again.
    keeps: bool,
    /// The frame after the last one that was read.
    next: usize,
}

impl Source {
    fn open(path: &Path, limits: Limits, keeps: bool) -> Result<Self, patchlock_media::Error> {
        let name = path.to_string_lossy();
        let frames = patchlock_media::open_within(&name, false, limits)?;
        // What comes from another program has no known length.
        let keeps = keeps && frames.length().is_some();
        let frames = match keeps {
            true => patchlock_media::open_within(&name, true, limits)?,
            false => frames,
        };
        Ok(Self { frames, keeps, next: 0 })
    }

    /// The first frame to read for this one: if the source has to start again, it does so for many steps
    /// back at once.
    fn first(&self, frame: usize) -> usize {
        if self.keeps || (self.next..=self.next + AHEAD).contains(&frame) {
            return frame;
        }
        let is_step_back = frame < self.next && self.next - frame <= BACK;
        frame.saturating_sub(if is_step_back { AHEAD } else { BEFORE })
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, patchlock_media::Error> {
        let picture = self.frames.frame(index)?;
        self.next = index + 1;
        Ok(picture)
    }
}

fn no_frame(frame: usize, frames: usize) -> Refusal {
    Refusal::unknown(format!("there is no frame {frame}; the video has {frames} frames, from 0"))
}

/// The request that takes the least decoding from a position in the video: the next one at or after it, or
/// else the last one before it.
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

/// Encodes a frame, scaled down to a width unless that is 0.
pub fn jpeg(picture: &Picture, width: u32) -> Result<Vec<u8>, Refusal> {
    let (w, h) = (picture.width as u32, picture.height as u32);
    if (1..w).contains(&width) {
        let height = (f64::from(h) * f64::from(width) / f64::from(w)).round().max(1.0) as u32;
        let image = RgbImage::from_raw(w, h, picture.to_rgb())
            .ok_or_else(|| Refusal::failed("cannot encode: the picture is incomplete"))?;
        return encode(
            &imageops::thumbnail(&image, width, height),
            (width, height),
            ColorType::Rgb,
        );
    }
    match &picture.pixels {
        Pixels::Grey8(grey) => encode(grey, (w, h), ColorType::Luma),
        Pixels::Rgb8(rgb) => encode(rgb, (w, h), ColorType::Rgb),
        Pixels::Grey16(_) => encode(&picture.to_rgb(), (w, h), ColorType::Rgb),
    }
}

fn encode(
    samples: &[u8],
    (width, height): (u32, u32),
    colour: ColorType,
) -> Result<Vec<u8>, Refusal> {
    let too_large =
        |_| Refusal::failed(format!("cannot encode: JPEG has no {width} x {height} pixels"));
    let width_16 = u16::try_from(width).map_err(too_large)?;
    let height_16 = u16::try_from(height).map_err(too_large)?;
    let mut out = Vec::with_capacity(samples.len() / 8);
    let mut encoder = Encoder::new(&mut out, QUALITY);
    // Colours at half the resolution, as nearly all video has them.
    encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
    let encoded = encoder.encode(samples, width_16, height_16, colour);
    encoded.map_err(|error| Refusal::failed(format!("cannot encode: {error}")))?;
    Ok(out)
}

/// How a frame is wanted.
#[derive(Deserialize)]
pub struct Size {
    #[serde(default)]
    width: u32,
}

/// `GET /api/clips/ID/frames/N?width=W`
pub async fn frame(
    State(app): State<Arc<App>>,
    At((clip, frame)): At<(usize, usize)>,
    Asked(Size { width }): Asked<Size>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let video = app.clips.open(clip).await?;
    if frame >= video.frames {
        return Err(no_frame(frame, video.frames));
    }
    // All widths from the frame's own on are the same picture.
    let width = if (width as usize) < video.width { width } else { 0 };
    // The token is another one each time the program starts, and so is what may have changed on disk.
    let tag = format!("\"{}-{}-{frame}-{width}\"", app.access.session(), clip);
    let caching = [(ETAG, tag.clone()), (CACHE_CONTROL, "private, max-age=3600, immutable".into())];
    if headers.get(IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return Ok((StatusCode::NOT_MODIFIED, caching).into_response());
    }
    let jpeg = video.reader.jpeg(frame, width).await?;
    Ok(([(CONTENT_TYPE, "image/jpeg")], caching, jpeg).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A video without frames.
    struct Nothing;

    impl FrameSource for Nothing {
        fn length(&self) -> Option<usize> {
            Some(0)
        }

        fn rate(&self) -> Option<patchlock_media::FrameRate> {
            None
        }

        fn frame(&mut self, _: usize) -> Result<Option<Picture>, patchlock_media::Error> {
            Ok(None)
        }
    }

    fn key(frame: usize) -> Key {
        Key { clip: 1, frame, width: 0 }
    }

    #[test]
    fn the_cache_holds_no_more_bytes_than_it_may_and_keeps_what_was_used_last() {
        let cache = Cache { most: 1000, held: Mutex::default() };
        for frame in 0..100 {
            cache.put(key(frame), Bytes::from(vec![0; 100]));
            // The first one is looked at again and again.
            assert!(cache.get(key(0)).is_some(), "{frame}");
            assert!(lock(&cache.held).bytes <= 1000);
        }
        let kept: Vec<usize> = (0..100).filter(|&frame| cache.holds(key(frame))).collect();
        assert_eq!(kept, [0, 91, 92, 93, 94, 95, 96, 97, 98, 99]);
        cache.put(key(99), Bytes::from(vec![0; 50]));
        let held = lock(&cache.held);
        assert!(held.bytes == 950 && held.order.len() == held.frames.len());
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
    fn a_source_that_starts_again_begins_before_the_frame() {
        let mut source = Source { frames: Box::new(Nothing), keeps: false, next: 500 };
        assert_eq!([500, 524, 525, 900].map(|frame| source.first(frame)), [500, 524, 513, 888]);
        assert_eq!([499, 436, 435, 5].map(|frame| source.first(frame)), [475, 412, 423, 0]);
        source.keeps = true;
        assert_eq!([5, 499, 900].map(|frame| source.first(frame)), [5, 499, 900]);
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
