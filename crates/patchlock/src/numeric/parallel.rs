//! Work that `rayon` shares among threads. Without the feature `rayon` the same calls do it on one
//! thread, in order, as where the system has no threads. The results are the same, bit for bit.

#[cfg(feature = "rayon")]
pub use shared::*;

#[cfg(not(feature = "rayon"))]
pub use alone::*;

#[cfg(feature = "rayon")]
mod shared {
    pub use rayon::prelude::*;
    pub use rayon::{current_num_threads, current_thread_index};

    /// Runs `lead`, while as many idle threads as `count` run `help`. Returns when all are done.
    pub fn with_helpers(count: usize, help: impl Fn() + Sync, lead: impl FnOnce() + Send) {
        rayon::scope(|scope| {
            for _ in 0..count {
                scope.spawn(|_| help());
            }
            lead();
        });
    }
}

#[cfg(any(test, not(feature = "rayon")))]
#[cfg_attr(feature = "rayon", allow(dead_code))]
mod alone {
    use std::slice::{ChunksExact, ChunksMut, IterMut};

    /// The number of threads that share the work.
    pub fn current_num_threads() -> usize {
        1
    }

    /// The number of this thread among those of the pool, if it is one of them.
    pub fn current_thread_index() -> Option<usize> {
        None
    }

    /// Runs `lead`; there is nobody to help.
    pub fn with_helpers(_count: usize, _help: impl Fn() + Sync, lead: impl FnOnce() + Send) {
        lead();
    }

    /// `rayon`'s iterators over slices.
    pub trait ParallelSlice<T> {
        /// As `chunks_exact`.
        fn par_chunks_exact(&self, length: usize) -> ChunksExact<'_, T>;
        /// As `chunks_mut`.
        fn par_chunks_mut(&mut self, length: usize) -> ChunksMut<'_, T>;
        /// As `iter_mut`.
        fn par_iter_mut(&mut self) -> IterMut<'_, T>;
    }

    impl<T> ParallelSlice<T> for [T] {
        fn par_chunks_exact(&self, length: usize) -> ChunksExact<'_, T> {
            self.chunks_exact(length)
        }

        fn par_chunks_mut(&mut self, length: usize) -> ChunksMut<'_, T> {
            self.chunks_mut(length)
        }

        fn par_iter_mut(&mut self) -> IterMut<'_, T> {
            self.iter_mut()
        }
    }

    /// What `rayon`'s iterators can do and those of the standard library cannot.
    pub trait ParallelIterator: Iterator + Sized {
        /// Replaces the contents of `into`.
        fn collect_into_vec(self, into: &mut Vec<Self::Item>) {
            into.clear();
            into.extend(self);
        }
    }

    impl<I: Iterator> ParallelIterator for I {}
}

#[cfg(all(test, feature = "rayon"))]
mod tests {
    use super::{alone, shared};
    use proptest::prelude::*;

    /// What the tracker does with the calls of one of both modules.
    macro_rules! worked {
        ($module:ident, $values:expr, $length:expr) => {{
            use $module::*;
            let (values, length) = ($values, $length);
            let (mut scaled, mut counted, mut sums) = (values.clone(), values.clone(), vec![7.0]);
            let own = values.par_chunks_exact(length);
            scaled.par_chunks_mut(length).zip(own).enumerate().for_each(|(k, (out, own))| {
                out.iter_mut().zip(own).for_each(|(out, own)| *out = out.sqrt() * own + k as f32);
            });
            counted.par_iter_mut().enumerate().for_each(|(k, out)| *out /= k as f32 + 0.1);
            let each = values.par_chunks_exact(length);
            each.map(|chunk| chunk.iter().sum::<f32>()).collect_into_vec(&mut sums);
            let failed = counted.par_chunks_mut(length).try_for_each(|chunk| {
                chunk.iter().all(|value| value.is_finite()).then_some(()).ok_or("not finite")
            });
            (scaled, counted, sums, failed)
        }};
    }

    proptest! {
        #[test]
        fn one_thread_without_rayon_gives_the_same_bits(
            values in prop::collection::vec(0.0f32..1e9, 0..200),
            length in 1usize..20,
        ) {
            let shared = worked!(shared, &values, length);
            let alone = worked!(alone, &values, length);
            prop_assert_eq!(shared, alone);
        }
    }

    #[test]
    fn one_thread_leads_and_has_no_helpers() {
        let led = std::sync::atomic::AtomicUsize::new(0);
        let lead = || {
            led.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        };
        alone::with_helpers(3, || panic!("there is nobody to help"), lead);
        assert_eq!(led.into_inner(), 1);
        assert_eq!((alone::current_num_threads(), alone::current_thread_index()), (1, None));
    }
}
