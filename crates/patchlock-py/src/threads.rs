//! The thread pools of trackers.
//!
//! Threads do not survive a fork, which Python's `multiprocessing` may use, so each process makes its own.

use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use patchlock_track::session::{self, MOST_THREADS};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::ThreadPool;

/// A pool, and the id of the process that made it.
type ProcessPool = Mutex<Option<(u32, Arc<ThreadPool>)>>;

/// The pool of all trackers that do not specify a number of threads: one thread per core.
static SHARED: ProcessPool = Mutex::new(None);

/// The threads of a tracker.
#[derive(Debug, Default)]
pub struct Threads {
    /// How many; `None` for the shared pool.
    pub count: Option<usize>,
    own: ProcessPool,
}

impl Threads {
    pub fn new(count: Option<usize>) -> PyResult<Self> {
        match count {
            Some(count) if !(1..=MOST_THREADS).contains(&count) => {
                Err(PyValueError::new_err(format!(
                    "threads is {count}; allowed: 1 to {MOST_THREADS}, or None for one per core"
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
            // The pool's threads exist only in the parent process: dropping it here would wait forever.
            Some(parents) => std::mem::forget(parents),
            None => {}
        }
        let pool = session::pool(Some(self.count.unwrap_or(0)));
        let pool = pool.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        *made = Some((process::id(), Arc::clone(&pool)));
        Ok(pool)
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        let own = self.own.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        if let Some((process, pool)) = own
            && process != process::id()
        {
            std::mem::forget(pool);
        }
    }
}
