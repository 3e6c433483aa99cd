//! Sets of frames, as stretches `[first, last]` that are in order and apart from each other.

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
