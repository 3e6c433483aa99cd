//! What a target has in a range of frames, and how it is taken out and put back.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Key, Target, TrackedBox, by_frame, stretches};

/// What a target has in a range of frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Frames {
    /// Its key frames.
    #[serde(with = "by_frame")]
    pub keys: BTreeMap<usize, Key>,
    /// Its tracked boxes.
    #[serde(with = "by_frame")]
    pub tracked: BTreeMap<usize, TrackedBox>,
    /// First and last frame of each stretch in which it is not visible; in order, and apart from
    /// each other.
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
        self.keys.values().map(Key::size).sum::<usize>() + self.tracked.len()
    }
}

impl Target {
    /// Takes out what is in the frames `from..=to`.
    pub(super) fn cut(&mut self, [from, to]: [usize; 2]) -> Frames {
        let hidden = stretches::common(&self.hidden, [from, to]);
        stretches::remove(&mut self.hidden, [from, to]);
        Frames {
            keys: cut_map(&mut self.keys, [from, to]),
            tracked: cut_map(&mut self.tracked, [from, to]),
            hidden,
        }
    }

    /// Puts in what was taken out of the same frames, or belongs there.
    pub(super) fn put(&mut self, frames: Frames) {
        self.keys.extend(frames.keys);
        self.tracked.extend(frames.tracked);
        for stretch in frames.hidden {
            stretches::add(&mut self.hidden, stretch);
        }
    }
}

/// Takes the entries of the frames `from..=to` out of a map.
pub fn cut_map<V>(map: &mut BTreeMap<usize, V>, [from, to]: [usize; 2]) -> BTreeMap<usize, V> {
    let mut cut = BTreeMap::new();
    cut.extend(map.extract_if(from..=to, |_, _| true));
    cut
}
