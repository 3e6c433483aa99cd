//! Runs a tracker on its threads and measures the time of each step.

use std::sync::Arc;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;

/// Upper limit for the number of threads, to catch typing errors.
pub const MOST_THREADS: usize = 1024;

/// A pool with this number of threads, by default one per logical processor. With 0, `rayon` chooses the
/// number, which is that of the environment variable `RAYON_NUM_THREADS` if it is set.
///
/// # Errors
/// [`Error::Threads`] if the system cannot start the threads.
pub fn pool(threads: Option<usize>) -> Result<Arc<ThreadPool>, Error> {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or_else(cores)).build();
    pool.map(Arc::new).map_err(|error| Error::Threads(error.to_string()))
}

/// A tracker, of one or many targets, with the threads that it works on.
pub struct Session<T> {
    tracker: T,
    pool: Arc<ThreadPool>,
}

impl<T: Send> Session<T> {
    /// Combines a tracker with a pool.
    pub fn new(tracker: T, pool: Arc<ThreadPool>) -> Self {
        Self { tracker, pool }
    }

    /// The tracker, for calls that are not timed and need no threads.
    pub fn tracker_mut(&mut self) -> &mut T {
        &mut self.tracker
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `step` in the pool and returns its result with the elapsed seconds.
    ///
    /// # Errors
    /// The error of `step`.
    pub fn step<R: Send>(
        &mut self,
        step: impl FnOnce(&mut T) -> Result<R, patchlock::Error> + Send,
    ) -> Result<(R, f64), patchlock::Error> {
        step_on(&self.pool, &mut self.tracker, step)
    }
}

/// As [`Session::step`], with the pool given for each step: the Python package creates a new pool in a forked
/// process.
///
/// # Errors
/// The error of `step`.
pub fn step_on<T: Send, R: Send>(
    pool: &ThreadPool,
    tracker: &mut T,
    step: impl FnOnce(&mut T) -> Result<R, patchlock::Error> + Send,
) -> Result<(R, f64), patchlock::Error> {
    let (result, seconds) = timed(|| pool.install(|| step(tracker)));
    Ok((result?, seconds))
}

/// Runs `work` and returns its result with the elapsed time in seconds.
pub fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_runs_in_the_pool_and_is_timed() {
        let mut session = Session::new(0, pool(Some(3)).expect("starts"));
        assert_eq!(session.threads(), 3);
        let step = |count: &mut usize| {
            *count += rayon::current_num_threads();
            Ok(*count)
        };
        let (threads, seconds) = session.step(step).expect("no error");
        assert!(threads == 3 && seconds >= 0.0);
        assert_eq!(*session.tracker_mut(), 3);
        let refused = session.step(|_| Err::<(), _>(patchlock::Error::NotInitialised));
        assert!(matches!(refused, Err(patchlock::Error::NotInitialised)));
    }
}
