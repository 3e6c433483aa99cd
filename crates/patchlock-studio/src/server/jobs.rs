//! Tracking jobs of a clip: one at a time, further ones wait. What a job finds is shown as it is
//! found, written about every two seconds, and undone as one step.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::answer::Refusal;
use super::clips::{OpenClip, no_target};
use crate::engine::Listener;
use crate::engine::plan::{self, Span, Wish};
use crate::project::{Edit, Tracked};

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
    waiting: VecDeque<(u64, Wish)>,
    running: Option<RunningJob>,
    /// The thread that works on them.
    worker: Option<JoinHandle<()>>,
    last_id: u64,
    /// No more jobs are taken.
    closed: bool,
}

struct RunningJob {
    id: u64,
    target: u64,
    stop: Arc<AtomicBool>,
    pace: Pace,
}

/// How far a job is.
#[derive(Debug, Clone, Copy)]
struct Pace {
    begun: Instant,
    done: usize,
    total: usize,
}

impl Pace {
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
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a job, or lets it wait for those before it. Returns its id.
    pub fn start(clip: &Arc<OpenClip>, wish: Wish) -> Result<u64, Refusal> {
        if spans(clip, wish)?.is_empty() {
            return Err(Refusal::bad("there are no frames to track there"));
        }
        let mut queue = clip.jobs.lock();
        if queue.closed {
            return Err(Refusal::failed("the program is about to end"));
        }
        queue.last_id += 1;
        let id = queue.last_id;
        queue.waiting.push_back((id, wish));
        if queue.worker.is_none() {
            let clip = Arc::clone(clip);
            queue.worker = Some(thread::spawn(move || work(&clip)));
        }
        Ok(id)
    }

    /// The state for the page: `null`, or the running job and the targets that wait.
    pub fn state(&self) -> Value {
        let queue = self.lock();
        let waiting: Vec<u64> = queue.waiting.iter().map(|(_, wish)| wish.target()).collect();
        let Some(RunningJob { id, target, pace, .. }) = &queue.running else {
            return match queue.waiting.front() {
                Some((id, wish)) => json!({
                    "id": id, "target": wish.target(), "state": "waiting", "waiting": waiting,
                }),
                None => Value::Null,
            };
        };
        json!({
            "id": id,
            "target": target,
            "state": "running",
            "done": pace.done,
            "total": pace.total,
            "fps": pace.speed(),
            "left": pace.left(),
            "waiting": waiting,
        })
    }

    /// Stops all jobs, waits until the running one has handed over what it found, and returns their
    /// number.
    pub fn stop_all(&self) -> usize {
        self.stop(|_| true)
    }

    /// Stops all jobs of a target as [`Jobs::stop_all`] does.
    pub fn stop_for(&self, target: u64) -> usize {
        self.stop(|of| of == target)
    }

    /// Stops all jobs, and takes no more.
    pub fn close(&self) {
        let worker = {
            let mut queue = self.lock();
            queue.closed = true;
            queue.worker.take()
        };
        self.stop_all();
        // The thread holds the project until its last statement.
        worker.map(JoinHandle::join);
    }

    fn stop(&self, which: impl Fn(u64) -> bool) -> usize {
        let mut queue = self.lock();
        let before = queue.waiting.len();
        queue.waiting.retain(|(_, wish)| !which(wish.target()));
        let mut stopped = before - queue.waiting.len();
        let Some(running) = queue.running.as_ref().filter(|running| which(running.target)) else {
            return stopped;
        };
        stopped += 1;
        running.stop.store(true, Ordering::SeqCst);
        let id = running.id;
        while queue.running.as_ref().is_some_and(|running| running.id == id) {
            queue = self.ended.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
        stopped
    }
}

fn spans(clip: &OpenClip, wish: Wish) -> Result<Vec<Span>, Refusal> {
    let held = clip.hold();
    let target = held.store.project().target(wish.target());
    let target = target.ok_or_else(|| no_target(wish.target()))?;
    plan::spans(target, wish, clip.frames).map_err(Refusal::bad)
}

/// Works on the jobs of a clip until none is left.
fn work(clip: &Arc<OpenClip>) {
    loop {
        let mut queue = clip.jobs.lock();
        let Some((id, wish)) = queue.waiting.pop_front() else {
            // Whoever closes the clip has taken the handle to wait for this thread.
            queue.worker = None;
            return;
        };
        let stop = Arc::new(AtomicBool::new(false));
        let pace = Pace { begun: Instant::now(), done: 0, total: 0 };
        let target = wish.target();
        queue.running = Some(RunningJob { id, target, stop: Arc::clone(&stop), pace });
        drop(queue);
        let result = Job::new(clip, id, target, stop).run(wish);
        // Whoever waits for the end may then change what the job has found.
        clip.jobs.lock().running = None;
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

/// A running job.
struct Job<'a> {
    clip: &'a OpenClip,
    id: u64,
    target: u64,
    stop: Arc<AtomicBool>,
    pace: Pace,
    /// Boxes that the windows do not know yet.
    untold: Vec<(usize, Tracked)>,
    told_at: Instant,
    /// Boxes that are not in the project yet.
    unsaved: BTreeMap<usize, Tracked>,
    saved_at: Instant,
    /// The revision that the job has led to.
    since: Option<u64>,
}

impl<'a> Job<'a> {
    fn new(clip: &'a OpenClip, id: u64, target: u64, stop: Arc<AtomicBool>) -> Self {
        let now = Instant::now();
        let pace = Pace { begun: now, done: 0, total: 0 };
        Self {
            clip,
            id,
            target,
            stop,
            pace,
            untold: Vec::new(),
            told_at: now,
            unsaved: BTreeMap::new(),
            saved_at: now,
            since: None,
        }
    }

    /// Tracks all spans; false if it was stopped.
    fn run(mut self, wish: Wish) -> Result<bool, Refusal> {
        let (job, target) = (self.id, self.target);
        self.clip.tell(&json!({ "type": "job", "state": "running", "job": job, "target": target }));
        let result = self.track_all(wish);
        self.tell();
        // What was found before an error is kept, too.
        let kept = self.keep();
        let saved = self.clip.hold().store.save().map_err(Refusal::from);
        let done = result?;
        kept.and(saved).map(|()| done)
    }

    fn track_all(&mut self, wish: Wish) -> Result<bool, Refusal> {
        // The project may have changed while the job waited.
        let spans = spans(self.clip, wish)?;
        self.pace.total = spans.iter().map(Span::steps).sum();
        for span in spans {
            let engine = &self.clip.engine;
            let tracked = engine.track(span, self);
            let Some(boxes) = tracked.map_err(|error| Refusal::failed(error.to_string()))? else {
                return Ok(false);
            };
            if let Span::Between { .. } = span {
                self.untold.extend(&boxes);
                self.unsaved.extend(boxes);
                self.tell();
            }
        }
        Ok(true)
    }

    /// Sends the windows what was found since the last time.
    fn tell(&mut self) {
        self.told_at = Instant::now();
        if let Some(running) = self.clip.jobs.lock().running.as_mut() {
            running.pace = self.pace;
        }
        let boxes: Vec<Value> = self.untold.drain(..).map(row).collect();
        self.clip.tell(&json!({
            "type": "tracked",
            "job": self.id,
            "target": self.target,
            "boxes": boxes,
            "fps": self.pace.speed(),
            "left": self.pace.left(),
            "done": self.pace.done,
            "total": self.pace.total,
        }));
    }

    /// Puts what was found since the last time into the project.
    fn keep(&mut self) -> Result<(), Refusal> {
        self.saved_at = Instant::now();
        let mut held = self.clip.hold();
        let mut edits = Vec::new();
        while let Some(piece) = first_run(&mut self.unsaved) {
            let ends = piece.keys().next().copied().zip(piece.keys().next_back().copied());
            let Some((from, to)) = ends else { break };
            edits.push(Edit::SetTracked { target: self.target, from, to, tracked: piece });
        }
        // The target may have been deleted in the meantime.
        if edits.is_empty() || held.store.project().target(self.target).is_none() {
            return Ok(());
        }
        let revision = match self.since {
            Some(since) => held.store.apply_more(since, edits)?,
            None => held.store.apply(edits)?,
        };
        self.since = Some(revision);
        Ok(held.store.save()?)
    }
}

impl Listener for Job<'_> {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn found(&mut self, frame: usize, tracked: Option<Tracked>) {
        self.pace.done += 1;
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
}

/// Takes out the first entries that follow each other without a gap.
fn first_run(boxes: &mut BTreeMap<usize, Tracked>) -> Option<BTreeMap<usize, Tracked>> {
    let first = *boxes.keys().next()?;
    let end = (first..).find(|frame| !boxes.contains_key(frame))?;
    let rest = boxes.split_off(&end);
    Some(std::mem::replace(boxes, rest))
}

/// A box for the page: frame, x, y, w, h, score, status, visible share.
fn row((frame, tracked): (usize, Tracked)) -> Value {
    let Tracked { bbox, score, status, visible, .. } = tracked;
    json!([frame, bbox.x, bbox.y, bbox.w, bbox.h, score, status, visible])
}
