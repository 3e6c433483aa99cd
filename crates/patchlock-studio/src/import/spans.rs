//! A set of frames to which stretches are added in any order, each in a time that hardly grows.

use std::collections::BTreeMap;

/// Stretches of frames that are apart from each other: the last frame of each, by its first.
#[derive(Debug, Default)]
pub struct Spans(BTreeMap<usize, usize>);

impl Spans {
    /// Whether a frame is in the set.
    pub fn holds(&self, frame: usize) -> bool {
        self.0.range(..=frame).next_back().is_some_and(|(_, last)| frame <= *last)
    }

    /// Adds a stretch. Those that it overlaps or touches become one with it.
    pub fn add(&mut self, [mut from, mut to]: [usize; 2]) {
        while let Some((&first, &last)) = self.0.range(..=to.saturating_add(1)).next_back()
            && last.saturating_add(1) >= from
        {
            self.0.remove(&first);
            (from, to) = (from.min(first), to.max(last));
        }
        self.0.insert(from, to);
    }

    /// The stretches, in order.
    pub fn into_stretches(self) -> Vec<[usize; 2]> {
        self.0.into_iter().map(|(first, last)| [first, last]).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::project::stretches;

    proptest! {
        #[test]
        fn spans_are_the_stretches_of_a_project(
            added in prop::collection::vec((0usize..60, 0usize..4), 0..40),
            frame in 0usize..70,
        ) {
            let (mut spans, mut expected) = (Spans::default(), Vec::new());
            for (from, more) in added {
                spans.add([from, from + more]);
                stretches::add(&mut expected, [from, from + more]);
            }
            let holds = expected.iter().any(|[a, b]| (*a..=*b).contains(&frame));
            prop_assert_eq!(spans.holds(frame), holds);
            prop_assert_eq!(spans.into_stretches(), expected);
        }
    }
}
