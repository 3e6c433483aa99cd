//! One target as a sequence of its own, for the formats of single-target benchmarks: from its first to its last frame, without those that were not tracked.

use super::track::{Entry, Track};

/// A target over time.
pub struct Sequence<'a> {
    /// The target.
    pub id: u64,
    /// The frames from its first to its last, with its entry where it is in them.
    pub frames: Vec<(usize, Option<&'a Entry>)>,
}

/// The sequences of all targets, in the order of their ids.
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
    /// `x,y,w,h` a line, the first pixel being called `origin`; zeros where the target is not in the frame.
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
