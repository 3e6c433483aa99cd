//! Threads that stay together over many short rounds of work.
//!
//! A race goes round by round, 30 to 100 times a frame, and a round takes a fraction of a millisecond. A thread that falls asleep between two rounds
//! is woken too late, so those that help wait awake until all rounds are over. One that never comes, as it has other work, is not waited for.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::yield_now;

/// Most threads that help: a round has not enough work for more.
const MOST_HELPERS: usize = 15;

/// Turns that a thread waits before it offers its processor to others.
const SPINS: usize = 100;

/// One thread that leads, and those that help it.
pub struct Crew<'a> {
    task: &'a (dyn Fn(usize) + Sync),
    /// Tasks of the round that nobody has taken, and tasks that are not done.
    open: AtomicUsize,
    undone: AtomicUsize,
    /// Whether there are no more rounds.
    over: AtomicBool,
}

/// Does something when it goes out of scope, also where that is by a panic.
struct Finally<F: FnMut()>(F);

impl<F: FnMut()> Drop for Finally<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

impl<'a> Crew<'a> {
    /// Calls `lead`, whose rounds consist of `task`s; idle threads of the pool help.
    pub fn gather(task: &'a (dyn Fn(usize) + Sync), lead: impl FnOnce(&Crew<'a>) + Send) {
        let (open, undone) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let crew = Crew { task, open, undone, over: AtomicBool::new(false) };
        let helpers = rayon::current_num_threads().saturating_sub(1).min(MOST_HELPERS);
        if helpers == 0 {
            return lead(&crew);
        }
        rayon::scope(|scope| {
            for _ in 0..helpers {
                scope.spawn(|_| crew.help());
            }
            let _end = Finally(|| crew.over.store(true, Ordering::Release));
            lead(&crew);
        });
    }

    /// Does the tasks `0..count`, in any order, and returns when all are done.
    pub fn round(&self, count: usize) {
        self.undone.store(count, Ordering::Relaxed);
        // Who takes a task sees what was written before.
        self.open.store(count, Ordering::Release);
        while self.work() {}
        let mut turns = 0;
        while self.undone.load(Ordering::Acquire) > 0 {
            wait(&mut turns);
        }
    }

    fn help(&self) {
        let mut turns = 0;
        while !self.over.load(Ordering::Acquire) {
            if self.work() {
                turns = 0;
            } else {
                wait(&mut turns);
            }
        }
    }

    /// Does a task, if there is one.
    fn work(&self) -> bool {
        let take = |open: usize| open.checked_sub(1);
        let taken = self.open.fetch_update(Ordering::Acquire, Ordering::Relaxed, take);
        let Ok(open) = taken else { return false };
        let _done = Finally(|| {
            self.undone.fetch_sub(1, Ordering::Release);
        });
        (self.task)(open - 1);
        true
    }
}

fn wait(turns: &mut usize) {
    if *turns < SPINS {
        *turns += 1;
        spin_loop();
    } else {
        yield_now();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// The tasks of each round, in order, on this many threads.
    fn rounds(threads: usize, counts: &[usize]) -> Vec<Vec<usize>> {
        let (done, mut all) = (Mutex::new(Vec::new()), Vec::new());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let task = |number| done.lock().unwrap().push(number);
        pool.install(|| {
            Crew::gather(&task, |crew| {
                for &count in counts {
                    crew.round(count);
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
    fn crews_within_a_crowded_pool_all_come_to_an_end() {
        use rayon::prelude::*;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let sum = AtomicUsize::new(0);
        let task = |number| {
            sum.fetch_add(number, Ordering::Relaxed);
        };
        pool.install(|| {
            (0..40).into_par_iter().for_each(|_| {
                Crew::gather(&task, |crew| (0..50).for_each(|_| crew.round(4)));
            });
        });
        assert_eq!(sum.into_inner(), 40 * 50 * 6);
    }

    #[test]
    fn a_panic_of_the_leader_ends_the_helpers() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let lead = || pool.install(|| Crew::gather(&|_| (), |_| panic!("the leader's")));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(lead)).is_err());
    }
}
