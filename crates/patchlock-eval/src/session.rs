//! The tracker at work: the one place that puts together a tracker, the threads that it works on, and the
//! clock.

use std::sync::Arc;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;
use crate::bench::clock;

/// More threads than any machine has: a number above it is a slip.
pub const MOST_THREADS: usize = 1024;

/// A pool of so many threads; without a number, one thread for each core. 0 leaves the number to `rayon`,
/// which looks at the environment variable `RAYON_NUM_THREADS` first.
///
/// # Errors
/// [`Error::Threads`] where the system refuses them.
pub fn pool(threads: Option<usize>) -> Result<Arc<ThreadPool>, Error> {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or_else(cores)).build();
    pool.map(Arc::new).map_err(|error| Error::Threads(error.to_string()))
}

/// A tracker, of one target or of many, with the threads that it works on.
pub struct Session<T> {
    tracker: T,
    pool: Arc<ThreadPool>,
}

impl<T: Send> Session<T> {
    /// This tracker on these threads.
    pub fn new(tracker: T, pool: Arc<ThreadPool>) -> Self {
        Self { tracker, pool }
    }

    /// The tracker, for what is no work on a frame.
    pub fn tracker_mut(&mut self) -> &mut T {
        &mut self.tracker
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Does a step on the threads; gives what it gave and the seconds that it took.
    ///
    /// # Errors
    /// Those of the step.
    pub fn step<R: Send>(
        &mut self,
        step: impl FnOnce(&mut T) -> Result<R, patchlock::Error> + Send,
    ) -> Result<(R, f64), patchlock::Error> {
        step_on(&self.pool, &mut self.tracker, step)
    }
}

/// The same where the pool is chosen for each step: the Python package makes a new one in a process that was
/// forked.
///
/// # Errors
/// Those of the step.
pub fn step_on<T: Send, R: Send>(
    pool: &ThreadPool,
    tracker: &mut T,
    step: impl FnOnce(&mut T) -> Result<R, patchlock::Error> + Send,
) -> Result<(R, f64), patchlock::Error> {
    let (result, seconds) = clock::timed(|| pool.install(|| step(tracker)));
    Ok((result?, seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_runs_in_the_pool_and_its_time_is_told() {
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
