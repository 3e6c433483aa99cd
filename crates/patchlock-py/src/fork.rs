//! Forks of the process, which Python's `multiprocessing` may use.
//!
//! A forked child has only the thread that forked. What another thread held at that moment stays locked in the
//! child, and what it had half changed stays so. A fork therefore waits until no thread works on a tracker.

use std::cell::RefCell;
use std::sync::{PoisonError, RwLock, RwLockWriteGuard};

use pyo3::prelude::*;
use pyo3::types::{IntoPyDict as _, PyDict};

/// Held for reading by those that work on trackers, for writing by one that forks.
static WORKING: RwLock<()> = RwLock::new(());

thread_local! {
    /// What the thread that forks holds until it has.
    static FORKING: RefCell<Option<RwLockWriteGuard<'static, ()>>> = const { RefCell::new(None) };
}

/// Works on a tracker while other Python threads continue; no fork happens meanwhile. All locks that a child may
/// need are taken in such work only. It must not take long.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> T {
    py.detach(|| {
        let _working = WORKING.read().unwrap_or_else(PoisonError::into_inner);
        work()
    })
}

#[pyfunction]
fn before(py: Python<'_>) {
    // Detached: other Python threads must be able to go on to the end of their work.
    py.detach(|| {
        let alone = WORKING.write().unwrap_or_else(PoisonError::into_inner);
        FORKING.with(|forking| *forking.borrow_mut() = Some(alone));
    });
}

#[pyfunction]
fn after() {
    FORKING.with(|forking| drop(forking.borrow_mut().take()));
}

/// Has Python call this module whenever it forks.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let os = py.import("os")?;
    // Windows has no forks.
    if !os.hasattr("register_at_fork")? {
        return Ok(());
    }
    let before = wrap_pyfunction!(before, module)?;
    let after = wrap_pyfunction!(after, module)?;
    let hooks: Bound<'_, PyDict> =
        [("before", &before), ("after_in_parent", &after), ("after_in_child", &after)]
            .into_py_dict(py)?;
    os.call_method("register_at_fork", (), Some(&hooks))?;
    Ok(())
}
