//! A team of threads that stay awake over many short rounds of work.
//!
//! Pruning works in rounds, 30 to 100 per frame, each of which takes a fraction of a millisecond.
//! Waking a sleeping thread for each round would take too long, so helpers spin until all rounds
//! are over. The team does not wait for threads that never join because they have other work.
//!
//! The gain over `rayon` alone on two processors (the preset `paper`, first 60 frames, 2026-11-21):
//! CarScale 28.5 to 34.2 frames per second, Crossing 10.2 to 12.5, David 26.5 to 28.9.

use super::parallel::{current_num_threads, with_helpers};
use std::hint::spin_loop;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::yield_now;

/// Maximum number of helpers; a round does not have enough work for more.
const MAX_HELPERS: usize = 15;

/// Number of times that a waiting thread spins before it yields its processor.
const SPINS: usize = 100;

/// One leading thread and its helpers.
pub struct ThreadTeam<'a> {
    task: &'a (dyn Fn(usize) + Sync),
    /// Number of tasks of the round that no thread has taken yet, and of tasks that are not
    /// finished.
    open: AtomicUsize,
    unfinished: AtomicUsize,
    /// Whether all rounds are over.
    finished: AtomicBool,
}

/// Runs a function when dropped, also during a panic.
struct DropGuard<F: FnMut()>(F);

impl<F: FnMut()> Drop for DropGuard<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

impl<'a> ThreadTeam<'a> {
    /// Calls `lead`, which runs rounds of `task`s. Idle threads of the pool help.
    pub fn run(task: &'a (dyn Fn(usize) + Sync), lead: impl FnOnce(&ThreadTeam<'a>) + Send) {
        let (open, unfinished) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let team = ThreadTeam { task, open, unfinished, finished: AtomicBool::new(false) };
        let helpers = current_num_threads().saturating_sub(1).min(MAX_HELPERS);
        if helpers == 0 {
            return lead(&team);
        }
        with_helpers(
            helpers,
            || team.help(),
            || {
                let _end = DropGuard(|| team.finished.store(true, Ordering::Release));
                lead(&team);
            },
        );
    }

    /// Runs the tasks `0..count` in any order and returns when all have finished.
    pub fn round(&self, count: usize) {
        self.unfinished.store(count, Ordering::Relaxed);
        // A thread that takes a task sees everything written before this store.
        self.open.store(count, Ordering::Release);
        while self.run_task() {}
        let mut waits = 0;
        while self.unfinished.load(Ordering::Acquire) > 0 {
            wait(&mut waits);
        }
    }

    fn help(&self) {
        let mut waits = 0;
        while !self.finished.load(Ordering::Acquire) {
            if self.run_task() {
                waits = 0;
            } else {
                wait(&mut waits);
            }
        }
    }

    /// Takes and runs one task of the round; returns whether there was one.
    fn run_task(&self) -> bool {
        let take = |open: usize| open.checked_sub(1);
        let taken = self.open.fetch_update(Ordering::Acquire, Ordering::Relaxed, take);
        let Ok(open) = taken else { return false };
        let _done = DropGuard(|| {
            self.unfinished.fetch_sub(1, Ordering::Release);
        });
        (self.task)(open - 1);
        true
    }
}

fn wait(waits: &mut usize) {
    if *waits < SPINS {
        *waits += 1;
        spin_loop();
    } else {
        yield_now();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// Runs rounds with these task counts on this many threads; returns the sorted tasks of each
    /// round.
    fn rounds(threads: usize, counts: &[usize]) -> Vec<Vec<usize>> {
        let (done, mut all) = (Mutex::new(Vec::new()), Vec::new());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let task = |number| done.lock().unwrap().push(number);
        pool.install(|| {
            ThreadTeam::run(&task, |team| {
                for &count in counts {
                    team.round(count);
                    let mut tasks = std::mem::take(&mut *done.lock().unwrap());
                    tasks.sort_unstable();
                    all.push(tasks);
                }
            });
        });
        all
    }

    #[test]
    fn every_task_is_done_once_before_the_round_ends() {
        let counts: Vec<usize> = (0..2000).map(|k| k * 7 % 11).collect();
        let wanted: Vec<Vec<usize>> = counts.iter().map(|&count| (0..count).collect()).collect();
        for threads in [1, 2, 5] {
            assert_eq!(rounds(threads, &counts), wanted, "{threads} threads");
        }
    }

    #[test]
    fn teams_in_a_crowded_pool_all_finish() {
        use rayon::prelude::*;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let sum = AtomicUsize::new(0);
        let task = |number| {
            sum.fetch_add(number, Ordering::Relaxed);
        };
        pool.install(|| {
            (0..40).into_par_iter().for_each(|_| {
                ThreadTeam::run(&task, |team| (0..50).for_each(|_| team.round(4)));
            });
        });
        assert_eq!(sum.into_inner(), 40 * 50 * 6);
    }

    #[test]
    fn a_panic_of_the_leading_thread_ends_its_helpers() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let lead =
            || pool.install(|| ThreadTeam::run(&|_| (), |_| panic!("in the leading thread")));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(lead)).is_err());
    }
}
