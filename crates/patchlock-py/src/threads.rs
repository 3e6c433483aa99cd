//! The threads that a tracker works on.
//!
//! Threads do not survive a fork, which Python's `multiprocessing` may do, so each process makes its own.

use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// More threads than any machine has: a number above it is a slip.
const MOST_THREADS: usize = 1024;

/// A pool, and the process that it belongs to.
type Made = Mutex<Option<(u32, Arc<ThreadPool>)>>;

/// What all trackers share that ask for no number of threads: one thread for each core.
static SHARED: Made = Mutex::new(None);

/// The threads of a tracker.
#[derive(Debug, Default)]
pub struct Threads {
    /// How many; `None` for the pool that all share.
    pub count: Option<usize>,
    own: Made,
}

impl Threads {
    pub fn new(count: Option<usize>) -> PyResult<Self> {
        match count {
            Some(count) if !(1..=MOST_THREADS).contains(&count) => {
                Err(PyValueError::new_err(format!(
                    "threads is {count}; allowed: 1 to {MOST_THREADS}, or None for one for each core"
                )))
            }
            count => Ok(Self { count, own: Mutex::new(None) }),
        }
    }

    /// The pool, made at its first use in this process.
    pub fn pool(&self) -> PyResult<Arc<ThreadPool>> {
        let made = if self.count.is_some() { &self.own } else { &SHARED };
        let mut made = made.lock().unwrap_or_else(PoisonError::into_inner);
        match made.take() {
            Some((process, pool)) if process == process::id() => {
                *made = Some((process, Arc::clone(&pool)));
                return Ok(pool);
            }
            // The threads of the pool are in the parent process: nothing here may wait for them.
            Some(parents) => std::mem::forget(parents),
            None => {}
        }
        let pool = ThreadPoolBuilder::new().num_threads(self.count.unwrap_or(0)).build();
        let pool =
            pool.map_err(|e| PyRuntimeError::new_err(format!("cannot start the threads: {e}")))?;
        let pool = Arc::new(pool);
        *made = Some((process::id(), Arc::clone(&pool)));
        Ok(pool)
    }
}
