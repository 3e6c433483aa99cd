//! The key frames of a target, for tools that interpolate between them. A tool shows the exact boxes
//! of key frames, and the target in no frame in which it has no box.

use patchlock::BoundingBox;

use super::track::Entry;

/// A box of a target that is written.
pub struct Key<'a> {
    /// Its entry.
    pub entry: &'a Entry,
    /// The box, in pixels counted from 0.
    pub bbox: BoundingBox,
    /// Whether the target has no box in the next frame.
    pub ends: bool,
}

/// The key frames among the entries of a target, which are ordered by frame: the first and the last
/// box of each run of consecutive frames with a box, boxes that a person has drawn, those whose state
/// differs from that of the box before, and every `step`-th between these.
pub fn keys<'a, S: PartialEq>(
    entries: &[&'a Entry],
    step: usize,
    state: impl Fn(&'a Entry) -> S,
) -> Vec<Key<'a>> {
    let mut found = entries.iter().filter_map(|entry| Some((*entry, entry.found()?))).peekable();
    let (mut keys, mut since, mut before) = (Vec::new(), 0, None);
    while let Some((entry, bbox)) = found.next() {
        let ends = found.peek().is_none_or(|(next, _)| next.frame > entry.frame + 1);
        let now = Some(state(entry));
        if since == step || entry.said.is_some() || before != now || ends {
            keys.push(Key { entry, bbox, ends });
            since = 0;
        }
        since += 1;
        before = now.filter(|_| !ends);
    }
    keys
}
