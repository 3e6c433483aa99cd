//! Tracking jobs of a clip: one at a time, further ones wait. What a job finds is shown as it is
//! found, written about every two seconds, and undone as one step.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use patchlock::{BoundingBox, Tracker};
use patchlock_media::{Picture, Prefetcher};
use serde_json::{Value, json};

use super::answer::Refusal;
use super::clips::{OpenClip, ProjectState, no_target};
use super::lock;
use crate::engine::Settings;
use crate::engine::plan::{self, Anchor, Span, TrackRequest};
use crate::project::{Edit, TrackedBox, cut_map};
use crate::tracking::join::join;
use crate::tracking::review::doubtful;

/// Time between two messages with boxes.
const MESSAGES: Duration = Duration::from_millis(50);
/// Time between two times that the project is written.
const SAVES: Duration = Duration::from_secs(2);

/// The jobs of a clip.
#[derive(Default)]
pub struct Jobs {
    queue: Mutex<Queue>,
    ended: Condvar,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<QueuedJob>,
    running: Option<RunningJob>,
    /// The thread that works on them.
    worker: Option<JoinHandle<()>>,
    last_id: u64,
    /// No more jobs are taken.
    closed: bool,
}

impl Queue {
    /// The targets of the jobs that wait.
    fn waiting(&self) -> Vec<u64> {
        self.waiting.iter().map(|it| it.request.target()).collect()
    }
}

/// A job that waits.
#[derive(Debug, Clone, Copy)]
struct QueuedJob {
    id: u64,
    request: TrackRequest,
    /// The step of the history that it adds to.
    step: u64,
}

#[derive(Debug, Clone)]
struct RunningJob {
    id: u64,
    target: u64,
    /// The step of the history that it adds to.
    step: u64,
    stop: Arc<AtomicBool>,
    progress: JobProgress,
}

/// How far a job is.
#[derive(Debug, Clone, Copy)]
struct JobProgress {
    begun: Instant,
    done: usize,
    total: usize,
}

impl JobProgress {
    /// Frames per second.
    fn speed(&self) -> f64 {
        self.done as f64 / self.begun.elapsed().as_secs_f64().max(1e-3)
    }

    /// Seconds left; `None` before the first frame.
    fn left(&self) -> Option<f64> {
        (self.done > 0).then(|| (self.total - self.done.min(self.total)) as f64 / self.speed())
    }
}

impl Jobs {
    /// Begins a job, or lets it wait for those before it. Returns its id. It is undone with the change
    /// that has made the revision `since`, if it follows one; if that has been undone, there is no
    /// job.
    pub fn start(
        clip: &Arc<OpenClip>,
        request: TrackRequest,
        since: Option<u64>,
    ) -> Result<Option<u64>, Refusal> {
        let step = {
            let mut held = clip.hold();
            if since.is_some_and(|since| held.store.history().is_undone(since)) {
                return Ok(None);
            }
            if spans(&held, clip.frames, request)?.is_empty() {
                return Err(Refusal::bad("there are no frames to track there"));
            }
            held.store.begin_tracking(request.target(), since)
        };
        let mut queue = lock(&clip.jobs.queue);
        if queue.closed {
            drop(queue);
            clip.hold().store.end_tracking(step);
            return Err(Refusal::failed("the program is about to end"));
        }
        queue.last_id += 1;
        let id = queue.last_id;
        queue.waiting.push_back(QueuedJob { id, request, step });
        if queue.worker.is_none() {
            let clip = Arc::clone(clip);
            queue.worker = Some(thread::spawn(move || work(&clip)));
        }
        drop(queue);
        clip.tell_history(&clip.hold());
        clip.jobs.tell_queue(clip);
        Ok(Some(id))
    }

    /// Tells the windows which targets wait.
    fn tell_queue(&self, clip: &OpenClip) {
        // The lock is held until it is told: a window takes the list that comes last for the newest.
        let queue = lock(&self.queue);
        clip.tell(&json!({ "type": "queue", "waiting": queue.waiting() }));
    }

    /// The state for the page: `null`, or the running job and the targets that wait.
    pub fn state(&self) -> Value {
        let queue = lock(&self.queue);
        let waiting = queue.waiting();
        let Some(RunningJob { id, target, progress, .. }) = &queue.running else {
            return match queue.waiting.front() {
                Some(QueuedJob { id, request, .. }) => json!({
                    "id": id, "target": request.target(), "state": "waiting", "waiting": waiting,
                }),
                None => Value::Null,
            };
        };
        json!({
            "id": id,
            "target": target,
            "state": "running",
            "done": progress.done,
            "total": progress.total,
            "fps": progress.speed(),
            "left": progress.left(),
            "waiting": waiting,
        })
    }

    /// The targets that are tracked now, or wait for it.
    pub fn targets(&self) -> Vec<u64> {
        let queue = lock(&self.queue);
        let mut targets = queue.waiting();
        targets.extend(queue.running.as_ref().map(|running| running.target));
        targets
    }

    /// Stops all jobs, and takes no more.
    pub fn close(clip: &OpenClip) {
        let worker = {
            let mut queue = lock(&clip.jobs.queue);
            queue.closed = true;
            queue.worker.take()
        };
        clip.jobs.stop(clip, |_, _| true);
        // The thread holds the project until its last statement.
        worker.map(JoinHandle::join);
    }

    /// Stops the jobs whose target and step of the history are meant, and waits until the running one
    /// has handed over what it found. Returns whether one was running, and the targets of those that
    /// were waiting.
    pub fn stop(&self, clip: &OpenClip, is_meant: impl Fn(u64, u64) -> bool) -> (bool, Vec<u64>) {
        let mut queue = lock(&self.queue);
        let (dropped, waiting): (VecDeque<_>, _) =
            queue.waiting.drain(..).partition(|it| is_meant(it.request.target(), it.step));
        queue.waiting = waiting;
        let running = queue.running.as_ref().filter(|it| is_meant(it.target, it.step));
        let running = running.map(|running| {
            running.stop.store(true, Ordering::SeqCst);
            running.id
        });
        while running.is_some() && queue.running.as_ref().map(|running| running.id) == running {
            queue = self.ended.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
        drop(queue);
        if !dropped.is_empty() {
            let mut held = clip.hold();
            dropped.iter().for_each(|it| held.store.end_tracking(it.step));
            clip.tell_history(&held);
            drop(held);
            self.tell_queue(clip);
        }
        let dropped = dropped.iter().map(|it| it.request.target()).collect();
        (running.is_some(), dropped)
    }
}

fn spans(held: &ProjectState, frames: usize, request: TrackRequest) -> Result<Vec<Span>, Refusal> {
    let target = held.store.project().target(request.target());
    let target = target.ok_or_else(|| no_target(request.target()))?;
    plan::spans(target, request, frames).map_err(Refusal::bad)
}

/// Works on the jobs of a clip until none is left.
fn work(clip: &Arc<OpenClip>) {
    loop {
        let mut queue = lock(&clip.jobs.queue);
        let Some(QueuedJob { id, request, step }) = queue.waiting.pop_front() else {
            // Whoever closes the clip has taken the handle to wait for this thread.
            queue.worker = None;
            return;
        };
        let target = request.target();
        let progress = JobProgress { begun: Instant::now(), done: 0, total: 0 };
        let running = RunningJob { id, target, step, stop: Arc::default(), progress };
        queue.running = Some(running.clone());
        drop(queue);
        clip.jobs.tell_queue(clip);
        let result = Job::new(clip, running).run(request);
        // Whoever waits for the end may then change what the job has found.
        lock(&clip.jobs.queue).running = None;
        clip.jobs.ended.notify_all();
        let (state, error) = match &result {
            Ok(true) => ("done", None),
            Ok(false) => ("stopped", None),
            Err(refusal) => ("failed", Some(refusal.message())),
        };
        clip.announce(&mut clip.hold());
        clip.tell(
            &json!({ "type": "job", "state": state, "job": id, "target": target, "error": error }),
        );
    }
}

/// A job on the thread that works on it.
struct Job<'a> {
    clip: &'a OpenClip,
    running: RunningJob,
    /// Boxes that the windows do not know yet.
    untold: Vec<(usize, TrackedBox)>,
    told_at: Instant,
    /// Boxes that are not in the project yet.
    unsaved: BTreeMap<usize, TrackedBox>,
    saved_at: Instant,
}

impl<'a> Job<'a> {
    fn new(clip: &'a OpenClip, running: RunningJob) -> Self {
        let now = Instant::now();
        let (untold, unsaved) = (Vec::new(), BTreeMap::new());
        Self { clip, running, untold, told_at: now, unsaved, saved_at: now }
    }

    /// Shows the other threads how far it is, and the step that it adds to.
    fn publish(&self) {
        if let Some(running) = lock(&self.clip.jobs.queue).running.as_mut() {
            running.clone_from(&self.running);
        }
    }

    /// Tracks all spans; false if it was stopped.
    fn run(mut self, request: TrackRequest) -> Result<bool, Refusal> {
        let RunningJob { id: job, target, .. } = self.running;
        self.clip.tell(&json!({ "type": "job", "state": "running", "job": job, "target": target }));
        let result = self.track_all(request);
        self.tell();
        // What was found before an error is kept, too.
        let kept = self.keep();
        let mut held = self.clip.hold();
        held.store.end_tracking(self.running.step);
        let saved = held.store.save().map_err(Refusal::from);
        drop(held);
        let done = result?;
        kept.and(saved).map(|()| done)
    }

    fn track_all(&mut self, request: TrackRequest) -> Result<bool, Refusal> {
        // The project may have changed while the job waited.
        let (spans, before) = {
            let held = self.clip.hold();
            let target = held.store.project().target(self.running.target);
            let before = target.map(doubtful).unwrap_or_default();
            (spans(&held, self.clip.frames, request)?, before)
        };
        self.running.progress.total = spans.iter().map(Span::steps).sum();
        for span in spans {
            let Some(boxes) = self.track(span, &before)? else { return Ok(false) };
            if !boxes.is_empty() {
                self.untold.extend(&boxes);
                self.unsaved.extend(boxes);
                self.tell();
            }
        }
        Ok(true)
    }

    /// Tracks a span, with what was known before of [`doubtful`] frames. Returns the joined boxes of
    /// a span between two others, without those; of an open one, none are left to add. `None` if it
    /// was stopped. What was found until then, or until an error, is kept.
    fn track(
        &mut self,
        span: Span,
        before: &BTreeMap<usize, TrackedBox>,
    ) -> Result<Option<Vec<(usize, TrackedBox)>>, Refusal> {
        let (first, last) = match span {
            Span::Between { first, last } => (first, last),
            Span::Open { start, to } => {
                let pass = self.pass(start, to, true)?;
                return Ok(pass.map(|_| Vec::new()));
            }
        };
        let Some(forward) = self.pass(first, last.0, true)? else { return Ok(None) };
        let Some(mut backward) = self.pass(last, first.0, false)? else { return Ok(None) };
        backward.reverse();
        let before = |at: usize| before.get(&(first.0 + 1 + at)).copied();
        let joined = join(first.1, &forward, &backward, last.1, before);
        Ok(Some((first.0 + 1..).zip(joined).collect()))
    }

    /// Tracks from a box to a frame before or after it. Returns what was found after that of the
    /// box, which is also told and kept meanwhile if it is `shown`; `None` if it was stopped.
    fn pass(
        &mut self,
        (first, bbox): Anchor,
        to: usize,
        shown: bool,
    ) -> Result<Option<Vec<TrackedBox>>, Refusal> {
        let engine = &self.clip.engine;
        let stop = Arc::clone(&self.running.stop);
        let stopped = || stop.load(Ordering::SeqCst);
        let backward = to < first;
        let source = engine.open(backward)?;
        let mut frames = match backward {
            true => Prefetcher::start(source, (to..=first).rev()),
            false => Prefetcher::start(source, first..=to),
        };
        let mut session = None;
        let mut pass = Vec::new();
        let mut next = Some(first);
        while let Some(expected) = next {
            let Some((frame, picture)) = frames.next_unless(&stopped)? else {
                let ended = || Refusal::failed(format!("the video ended before frame {expected}"));
                return if stopped() { Ok(None) } else { Err(ended()) };
            };
            let found = step(&engine.settings, &mut session, &picture, bbox).map_err(|reason| {
                Refusal::failed(format!("the tracker stopped in frame {frame}: {reason}"))
            })?;
            if frame != first {
                pass.push(found);
                self.found(frame, shown.then_some(found));
            }
            next = match frame {
                _ if frame == to => None,
                _ if backward => frame.checked_sub(1),
                _ => Some(frame + 1),
            };
        }
        Ok(Some(pass))
    }

    /// A frame was tracked. Its box, if it is new to the windows, is told and kept from time to time.
    fn found(&mut self, frame: usize, tracked: Option<TrackedBox>) {
        self.running.progress.done += 1;
        if let Some(tracked) = tracked {
            self.untold.push((frame, tracked));
            self.unsaved.insert(frame, tracked);
        }
        if self.told_at.elapsed() >= MESSAGES {
            self.tell();
        }
        if self.saved_at.elapsed() >= SAVES {
            // An error here is one at the end, too, where it is reported.
            let _ = self.keep();
        }
    }

    /// Sends the windows what was found since the last time.
    fn tell(&mut self) {
        self.told_at = Instant::now();
        self.publish();
        let boxes: Vec<Value> = self.untold.drain(..).map(row).collect();
        let RunningJob { id, target, progress, .. } = &self.running;
        self.clip.tell(&json!({
            "type": "tracked",
            "job": id,
            "target": target,
            "boxes": boxes,
            "fps": progress.speed(),
            "left": progress.left(),
            "done": progress.done,
            "total": progress.total,
        }));
    }

    /// Puts what was found since the last time into the project.
    fn keep(&mut self) -> Result<(), Refusal> {
        self.saved_at = Instant::now();
        let target = self.running.target;
        let mut held = self.clip.hold();
        let mut edits = Vec::new();
        while let Some(piece) = first_run(&mut self.unsaved) {
            let ends = piece.keys().next().copied().zip(piece.keys().next_back().copied());
            let Some((from, to)) = ends else { break };
            edits.push(Edit::SetTracked { target, from, to, tracked: piece });
        }
        // The target may have been deleted in the meantime.
        if edits.is_empty() || held.store.project().target(target).is_none() {
            return Ok(());
        }
        self.running.step = held.store.track(target, self.running.step, edits)?;
        self.clip.tell_history(&held);
        let saved = held.store.save();
        // Whoever has the project may not wait for the jobs.
        drop(held);
        self.publish();
        Ok(saved?)
    }
}

/// Tracks in the next picture; in the first one, the tracker starts on a box.
fn step(
    settings: &Settings,
    tracker: &mut Option<Tracker>,
    picture: &Picture,
    bbox: BoundingBox,
) -> Result<TrackedBox, patchlock::Error> {
    let frame = picture.frame()?;
    let Settings { config, pool, .. } = settings;
    if let Some(tracker) = tracker {
        return Ok(pool.install(|| tracker.update(&frame))?.into());
    }
    let begun = pool.install(|| Tracker::start(config.clone(), &frame, bbox))?;
    Ok(tracker.insert(begun).estimate().into())
}

/// Takes out the first entries that follow each other without a gap.
fn first_run(boxes: &mut BTreeMap<usize, TrackedBox>) -> Option<BTreeMap<usize, TrackedBox>> {
    let first = *boxes.keys().next()?;
    let end = (first..).find(|frame| !boxes.contains_key(frame))?;
    Some(cut_map(boxes, [first, end - 1]))
}

/// A box for the page: frame, x, y, w, h, score, status, visible share.
fn row((frame, tracked): (usize, TrackedBox)) -> Value {
    let TrackedBox { bbox, score, status, visible, .. } = tracked;
    json!([frame, bbox.x, bbox.y, bbox.w, bbox.h, score, status, visible])
}
