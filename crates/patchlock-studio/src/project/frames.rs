//! What a target has in a range of frames, and how it is taken out and put back.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Key, Target, Tracked, by_frame};

/// What a target has in a range of frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Frames {
    /// Its key frames.
    #[serde(with = "by_frame")]
    pub keys: BTreeMap<usize, Key>,
    /// Its tracked boxes.
    #[serde(with = "by_frame")]
    pub tracked: BTreeMap<usize, Tracked>,
    /// First and last frame of each stretch in which it is not visible; in order, and apart from each other.
    pub hidden: Vec<[usize; 2]>,
}

impl Frames {
    /// The first and the last frame with anything in it.
    pub fn span(&self) -> Option<[usize; 2]> {
        let first = [
            self.keys.keys().next().copied(),
            self.tracked.keys().next().copied(),
            self.hidden.first().map(|stretch| stretch[0]),
        ];
        let last = [
            self.keys.keys().next_back().copied(),
            self.tracked.keys().next_back().copied(),
            self.hidden.last().map(|stretch| stretch[1]),
        ];
        Some([first.into_iter().flatten().min()?, last.into_iter().flatten().max()?])
    }

    /// The number of boxes.
    pub fn boxes(&self) -> usize {
        self.keys.len() + self.tracked.len()
    }
}

impl Target {
    /// Takes out what is in the frames `from..=to`.
    pub(super) fn cut(&mut self, [from, to]: [usize; 2]) -> Frames {
        let hidden = common(&self.hidden, [from, to]);
        remove(&mut self.hidden, [from, to]);
        Frames {
            keys: cut_map(&mut self.keys, [from, to]),
            tracked: cut_map(&mut self.tracked, [from, to]),
            hidden,
        }
    }

    /// Puts in what was taken out of the same frames, or belongs there.
    pub(super) fn put(&mut self, mut frames: Frames) {
        self.keys.append(&mut frames.keys);
        self.tracked.append(&mut frames.tracked);
        for stretch in frames.hidden {
            add(&mut self.hidden, stretch);
        }
    }

    /// Takes out everything.
    pub(super) fn cut_all(&mut self) -> Frames {
        Frames {
            keys: std::mem::take(&mut self.keys),
            tracked: std::mem::take(&mut self.tracked),
            hidden: std::mem::take(&mut self.hidden),
        }
    }
}

fn cut_map<V>(map: &mut BTreeMap<usize, V>, [from, to]: [usize; 2]) -> BTreeMap<usize, V> {
    if from == to {
        return map.remove_entry(&from).into_iter().collect();
    }
    let mut inside = map.split_off(&from);
    let mut after = to.checked_add(1).map_or_else(BTreeMap::new, |end| inside.split_off(&end));
    map.append(&mut after);
    inside
}

/// The parts of the stretches that are in a range.
pub fn common(stretches: &[[usize; 2]], [from, to]: [usize; 2]) -> Vec<[usize; 2]> {
    let parts = stretches.iter().map(|&[a, b]| [a.max(from), b.min(to)]);
    parts.filter(|[a, b]| a <= b).collect()
}

/// Adds a stretch. Those that it overlaps or touches become one with it.
pub fn add(stretches: &mut Vec<[usize; 2]>, [mut from, mut to]: [usize; 2]) {
    let begin = stretches.partition_point(|stretch| stretch[1].saturating_add(1) < from);
    let end = stretches.partition_point(|stretch| stretch[0] <= to.saturating_add(1));
    if begin < end {
        from = from.min(stretches[begin][0]);
        to = to.max(stretches[end - 1][1]);
    }
    stretches.splice(begin..end, [[from, to]]);
}

/// Removes the frames of a range.
pub fn remove(stretches: &mut Vec<[usize; 2]>, [from, to]: [usize; 2]) {
    let begin = stretches.partition_point(|stretch| stretch[1] < from);
    let end = stretches.partition_point(|stretch| stretch[0] <= to);
    if begin >= end {
        return;
    }
    let (first, last) = (stretches[begin][0], stretches[end - 1][1]);
    let before = (first < from).then(|| [first, from - 1]);
    let after = (last > to).then(|| [to + 1, last]);
    stretches.splice(begin..end, before.into_iter().chain(after));
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Stretches from a set of frames, written out.
    fn of(frames: &[bool]) -> Vec<[usize; 2]> {
        let mut stretches: Vec<[usize; 2]> = Vec::new();
        for frame in (0..frames.len()).filter(|&frame| frames[frame]) {
            match stretches.last_mut() {
                Some(last) if last[1] + 1 == frame => last[1] = frame,
                _ => stretches.push([frame, frame]),
            }
        }
        stretches
    }

    proptest! {
        #[test]
        fn stretches_are_sets_of_frames(
            mut set in prop::collection::vec(any::<bool>(), 1..40),
            a in 0usize..40,
            b in 0usize..40,
            adds in any::<bool>(),
        ) {
            let range = [a.min(b).min(set.len() - 1), a.max(b).min(set.len() - 1)];
            let mut stretches = of(&set);
            let inside: Vec<bool> = (0..set.len())
                .map(|frame| set[frame] && (range[0]..=range[1]).contains(&frame))
                .collect();
            prop_assert_eq!(common(&stretches, range), of(&inside));
            set[range[0]..=range[1]].fill(adds);
            if adds { add(&mut stretches, range) } else { remove(&mut stretches, range) }
            prop_assert_eq!(stretches, of(&set));
        }
    }
}
