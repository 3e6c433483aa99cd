//! The threads of trackers, and the time that they take.

use std::sync::Arc;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;

/// Upper limit for the number of threads, to catch typing errors.
pub const MOST_THREADS: usize = 1024;

/// A pool with this number of threads, by default one per logical processor. With 0, `rayon`
/// chooses the number, which is that of the environment variable `RAYON_NUM_THREADS` if it is set.
///
/// # Errors
/// [`Error::Threads`] if the system cannot start the threads.
pub fn pool(threads: Option<usize>) -> Result<Arc<ThreadPool>, Error> {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or_else(cores)).build();
    pool.map(Arc::new).map_err(|error| Error::Threads(error.to_string()))
}

/// Runs `work` in the pool and returns its result with the elapsed seconds.
///
/// # Errors
/// The error of `work`.
pub fn timed_on<R: Send, E: Send>(
    pool: &ThreadPool,
    work: impl FnOnce() -> Result<R, E> + Send,
) -> Result<(R, f64), E> {
    let (result, seconds) = timed(|| pool.install(work));
    Ok((result?, seconds))
}

/// Runs `work` and returns its result with the elapsed seconds.
pub fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_runs_in_the_pool_and_is_timed() {
        let pool = pool(Some(3)).expect("starts");
        let (threads, seconds) =
            timed_on(&pool, || Ok::<_, ()>(rayon::current_num_threads())).expect("no error");
        assert!(threads == 3 && seconds >= 0.0);
        assert_eq!(timed_on(&pool, || Err::<(), _>("refused")).err(), Some("refused"));
    }
}
