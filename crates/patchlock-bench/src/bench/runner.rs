//! Makes runs, one at a time or in parallel.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use patchlock::BoundingBox;
use patchlock_media::image_file;

use super::schemes::{self, Scheme};
use super::store::{Run, Store, Trajectory};
use super::subject::{Answer, Subject};
use crate::Error;
use crate::dataset::{Dataset, Sequence};

/// Creates a tracker under test for a seed.
pub type SubjectFactory<'a> = &'a (dyn Fn(u64) -> Result<Box<dyn Subject>, Error> + Sync);

/// Receives progress, from any thread.
pub trait ProgressListener: Sync {
    /// A run starts.
    fn begins(&self, task: &Run<'_>);
    /// One more frame was tracked.
    fn frame(&self);
    /// A run ended, with `left` frames not tracked.
    fn ends(&self, left: usize, complete: bool);
    /// Whether to stop. Incomplete runs are then discarded.
    fn stopped(&self) -> bool;
}

/// A run that failed.
#[derive(Debug)]
pub struct Failure {
    /// The target.
    pub target: String,
    /// The run, such as `seed 1`; empty if the whole target failed.
    pub run: String,
    /// The reason.
    pub error: Error,
}

/// The runs to make on sequences, ordered by target, seed and start. A sequence whose frames cannot
/// be used is a failure.
pub fn tasks<'a>(
    dataset: &Dataset,
    sequences: &[&'a Sequence],
    scheme: Scheme,
    seeds: &[u64],
) -> (Vec<Run<'a>>, Vec<Failure>) {
    let (mut tasks, mut failures) = (Vec::new(), Vec::new());
    for &sequence in sequences {
        let mut fail = |error| {
            failures.push(Failure { target: sequence.name.clone(), run: String::new(), error });
        };
        if sequence.frames.len() != sequence.truth.len() {
            fail(Error::Sequence(dataset.why_no_frames(&sequence.name)));
            continue;
        }
        let size = || {
            let path = sequence.frames.first().cloned().unwrap_or_default();
            image_file::size(&path).map_err(|error| Error::frame(&path, error))
        };
        match schemes::starts(scheme, sequence, dataset.origin(), size) {
            Err(error) => fail(error),
            Ok(starts) => {
                for (&seed, start) in
                    seeds.iter().flat_map(|seed| starts.iter().map(move |start| (seed, start)))
                {
                    let frames = &sequence.frames[start.first..];
                    let (target, clip) = (&sequence.name, None);
                    tasks.push(Run { target, frames, clip, seed, start: *start });
                }
            }
        }
    }
    (tasks, failures)
}

/// Makes the runs, `jobs` of them in parallel, with `threads` threads per tracker. Returns the runs
/// that failed; they do not stop the others.
pub fn run(
    tasks: &[Run<'_>],
    store: &Store,
    make: SubjectFactory<'_>,
    jobs: usize,
    threads: usize,
    listener: &dyn ProgressListener,
) -> Vec<Failure> {
    let next = AtomicUsize::new(0);
    let failures = Mutex::new(Vec::new());
    let work = || {
        while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
            if listener.stopped() {
                return;
            }
            listener.begins(task);
            let mut done = 0;
            let run = || one(task, store, make, jobs, threads, listener, &mut done);
            // Image decoders may panic on damaged files; that must not end the other runs.
            let result = catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| {
                Err(Error::Subject("the run stopped unexpectedly (panic)".to_string()))
            });
            let left = task.frames.len() - done;
            listener.ends(left, left == 0 && result.is_ok());
            // Ctrl-C also ends the programs under test, which is not a failure of theirs.
            if let Some(error) = result.err().filter(|_| !listener.stopped()) {
                let run = label(task.seed, task.start.variant);
                let failure = Failure { target: task.target.to_string(), run, error };
                failures.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(failure);
            }
        }
    };
    thread::scope(|scope| (0..jobs.max(1)).for_each(|_| drop(scope.spawn(work))));
    failures.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Seed and start of a run, in words.
pub fn label(seed: u64, variant: usize) -> String {
    match variant {
        0 => format!("seed {seed}"),
        start => format!("seed {seed}, start {start}"),
    }
}

/// Makes one run and saves it. `done` counts the tracked frames.
fn one(
    task: &Run<'_>,
    store: &Store,
    make: SubjectFactory<'_>,
    jobs: usize,
    threads: usize,
    listener: &dyn ProgressListener,
    done: &mut usize,
) -> Result<(), Error> {
    let mut subject = make(task.seed)?;
    let frames = task.frames.iter().take_while(|_| !listener.stopped()).map(Ok);
    let trajectory = trace(frames, task.start.bbox, |file, start| {
        let answer = subject.step(file, start)?;
        *done += 1;
        listener.frame();
        Ok(answer)
    })?;
    if *done < task.frames.len() {
        return Ok(()); // stopped: incomplete runs are not saved
    }
    store.keep(task, &store.series().write(task, trajectory, threads, jobs))
}

/// Passes frames to a tracker in order and collects its answers. The second argument of `look` is
/// the box to start on, for the first frame.
///
/// # Errors
/// The first error of `frames` or `look`.
pub fn trace<F>(
    frames: impl Iterator<Item = Result<F, Error>>,
    bbox: BoundingBox,
    mut look: impl FnMut(F, Option<BoundingBox>) -> Result<Answer, Error>,
) -> Result<Trajectory, Error> {
    let mut trajectory = Trajectory::default();
    for frame in frames {
        let start = trajectory.boxes.is_empty().then_some(bbox);
        trajectory.add(look(frame?, start)?);
    }
    Ok(trajectory)
}
