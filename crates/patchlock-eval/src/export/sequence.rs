//! Splits a track into one sequence per target, for the formats of single-target benchmarks. A sequence
//! covers the tracked frames from the target's first to its last.

use super::track::{Entry, Track};

/// One target over time.
pub struct Sequence<'a> {
    /// The target.
    pub id: u64,
    /// The tracked frames from the target's first to its last, with its entry, or `None` in frames without
    /// it.
    pub frames: Vec<(usize, Option<&'a Entry>)>,
}

/// The sequences of all targets, ordered by id.
pub fn sequences(track: &Track) -> Vec<Sequence<'_>> {
    let frames = track.frames();
    let sequence = |id: u64| {
        let own: Vec<&Entry> = track.entries().iter().filter(|entry| entry.id == id).collect();
        let span = own[0].frame..=own[own.len() - 1].frame;
        let mut next = own.into_iter().peekable();
        let entry = |&frame: &usize| (frame, next.next_if(|entry| entry.frame == frame));
        Sequence { id, frames: frames.range(span).map(entry).collect() }
    };
    track.ids().into_iter().map(sequence).collect()
}

impl Sequence<'_> {
    /// `x,y,w,h` on each line, with `origin` as the coordinate of the first pixel; zeros where the target is
    /// absent.
    pub fn boxes(&self, origin: f64) -> String {
        let line = |(_, entry): &(usize, Option<&Entry>)| match entry {
            Some(Entry { bbox, .. }) => format!(
                "{:.4},{:.4},{:.4},{:.4}\n",
                bbox.x + origin,
                bbox.y + origin,
                bbox.w,
                bbox.h
            ),
            None => "0,0,0,0\n".to_string(),
        };
        self.frames.iter().map(line).collect()
    }
}
