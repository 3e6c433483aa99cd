//! Splits a track into one sequence per target, for the formats of single-target benchmarks. A sequence
//! covers the tracked frames from the target's first box to its last entry.

use patchlock::BoundingBox;

use super::track::{Entry, Track};

/// An entry in which the target is found, and its box.
pub type Found<'a> = (&'a Entry, BoundingBox);

/// One target over time.
pub struct Sequence<'a> {
    /// The target.
    pub id: u64,
    /// The tracked frames; `None` where the target is lost or has no box.
    pub frames: Vec<(usize, Option<Found<'a>>)>,
}

/// The sequences of all targets that have a box, ordered by id.
pub fn sequences(track: &Track) -> Vec<Sequence<'_>> {
    let frames = track.frames();
    let sequence = |id: u64| {
        let own = track.entries().iter().filter(|entry| entry.id == id);
        let own: Vec<&Entry> = own.skip_while(|entry| entry.found().is_none()).collect();
        let span = own.first()?.frame..=own.last()?.frame;
        let mut next = own.into_iter().peekable();
        let entry = |&frame: &usize| {
            let entry = next.next_if(|entry| entry.frame == frame);
            (frame, entry.and_then(|entry| Some((entry, entry.found()?))))
        };
        Some(Sequence { id, frames: frames.range(span).map(entry).collect() })
    };
    track.ids().into_iter().filter_map(sequence).collect()
}

impl Sequence<'_> {
    /// `x,y,w,h` on each line, with `origin` as the coordinate of the first pixel; zeros where the target is
    /// absent.
    pub fn boxes(&self, origin: f64) -> String {
        let line = |(_, found): &(usize, Option<Found<'_>>)| match found {
            Some((_, bbox)) => format!(
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
