//! The clock: how long a piece of work takes.

use std::time::Instant;

/// Does the work; gives what it gave and the seconds that it took.
pub fn timed<R>(work: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}
