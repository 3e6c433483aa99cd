//! The key frames of a target, for tools that interpolate between them. A tool shows the exact boxes
//! of key frames, and the target in no frame in which it has no box.

use patchlock::BoundingBox;

use super::track::Entry;
use crate::Error;
use crate::outline::mean;

/// Which boxes are key frames, besides the first and the last of each run of frames with a box, those
/// that a person has drawn, and those at which something else changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KeyFrames {
    /// Every so many-th box; 1 makes all boxes key frames.
    Every(usize),
    /// So many that each box of the track overlaps the interpolated one by at least this IoU, above 0
    /// and below 1.
    Overlap(f64),
}

impl KeyFrames {
    /// Every so many-th box for a whole number from 1, the least overlap for a number below 1.
    ///
    /// # Errors
    /// [`Error::Export`] for other numbers.
    pub fn of(number: f64) -> Result<Self, Error> {
        if number > 0.0 && number < 1.0 {
            return Ok(Self::Overlap(number));
        }
        match number.fract() == 0.0 && (1.0..=1e9).contains(&number) {
            true => Ok(Self::Every(number as usize)),
            false => Err(Error::Export(format!(
                "{number} cannot be the number for key frames; allowed: a whole number from 1, for every \
                 so many-th frame, or a number between 0 and 1, for the least overlap (IoU) of \
                 interpolated boxes with the track"
            ))),
        }
    }
}

/// A box of a target that is written.
pub struct Key<'a> {
    /// Its entry.
    pub entry: &'a Entry,
    /// The box, in pixels counted from 0.
    pub bbox: BoundingBox,
    /// Whether the target has no box in the next frame.
    pub ends: bool,
}

/// The key frames among the entries of a target, which are ordered by frame. `state` is what must not
/// change between two of them. `overlap` is that of the box of the third entry with the one that is
/// interpolated between those of the first two, at this share of the way.
pub fn keys<'a, S: PartialEq>(
    entries: &[&'a Entry],
    how: KeyFrames,
    state: impl Fn(&'a Entry) -> S,
    overlap: impl Fn([&Entry; 2], f64, &Entry) -> f64,
) -> Vec<Key<'a>> {
    let found: Vec<(&Entry, BoundingBox)> =
        entries.iter().filter_map(|entry| Some((*entry, entry.found()?))).collect();
    let key = |k: usize, ends| Key { entry: found[k].0, bbox: found[k].1, ends };
    let (mut keys, mut last, mut before) = (Vec::new(), 0, None);
    for (k, (entry, _)) in found.iter().enumerate() {
        let ends = found.get(k + 1).is_none_or(|(next, _)| next.frame > entry.frame + 1);
        let now = Some(state(entry));
        if entry.manual.is_some() || before != now || ends {
            // Between two keys of one run, frames follow each other.
            let between =
                if before.is_some() { between(&found, [last, k], how, &overlap) } else { vec![] };
            keys.extend(between.into_iter().map(|k| key(k, false)));
            keys.push(key(k, ends));
            last = k;
        }
        before = now.filter(|_| !ends);
    }
    keys
}

/// The places of the keys between two, which are places in a run.
fn between(
    run: &[(&Entry, BoundingBox)],
    [from, to]: [usize; 2],
    how: KeyFrames,
    overlap: &impl Fn([&Entry; 2], f64, &Entry) -> f64,
) -> Vec<usize> {
    let least = match how {
        KeyFrames::Every(step) => return (from..to).step_by(step.max(1)).skip(1).collect(),
        KeyFrames::Overlap(least) => least,
    };
    let fits = |from: usize, to: usize| {
        let share = |k: usize| (k - from) as f64 / (to - from) as f64;
        let ends = [run[from].0, run[to].0];
        (from + 1..to).all(|k| overlap(ends, share(k), run[k].0) >= least)
    };
    let (mut places, mut at) = (Vec::new(), from);
    while at < to {
        at = reach(at, to, &fits);
        places.push(at);
    }
    places.pop(); // it is `to`
    places
}

/// The place of the next key after one: as far as the boxes between them fit. The distance is doubled,
/// then halved, so that the time follows the length of the run.
fn reach(from: usize, to: usize, fits: &impl Fn(usize, usize) -> bool) -> usize {
    let (mut good, mut bad) = (from + 1, to + 1);
    while good < to && bad > to {
        let next = (from + 2 * (good - from)).min(to);
        if fits(from, next) { good = next } else { bad = next }
    }
    while bad <= to && bad - good > 1 {
        let middle = good.midpoint(bad);
        if fits(from, middle) { good = middle } else { bad = middle }
    }
    good
}

/// The overlap (IoU) of the upright box of an entry with the interpolated one.
pub fn upright(ends: [&Entry; 2], share: f64, entry: &Entry) -> f64 {
    let boxes = |[a, b]: [&Entry; 2]| Some((a.bbox?, b.bbox?, entry.bbox?));
    boxes(ends).map_or(0.0, |(a, b, own)| mean((a, 0.0), (b, 0.0), share).0.overlap(&own))
}
