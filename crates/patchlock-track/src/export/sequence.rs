//! Splits a track into one sequence per target, for the formats of single-target benchmarks. A
//! sequence covers the tracked frames from the target's first box to its last entry.

use std::path::Path;

use patchlock::BoundingBox;

use super::track::{Entry, Track};
use super::{Item, Job, MOST_LINES};
use crate::Error;

/// An entry in which the target is found, and its box.
pub type BoxEntry<'a> = (&'a Entry, BoundingBox);

/// One target over time.
pub struct Sequence<'a> {
    /// The target.
    pub id: u64,
    /// The tracked frames; `None` where the target is lost or has no box.
    pub frames: Vec<(usize, Option<BoxEntry<'a>>)>,
}

/// What a format has of the sequences of a clip, those of all targets that have a box, ordered by id.
///
/// # Errors
/// [`Error::Export`] if they have more than [`MOST_LINES`] frames together.
pub fn items(
    job: &Job<'_>,
    of: impl Fn(&Job<'_>, &Sequence<'_>) -> Vec<Item>,
) -> Result<Vec<Item>, Error> {
    Ok(sequences(job.track)?.iter().flat_map(|sequence| of(job, sequence)).collect())
}

fn sequences(track: &Track) -> Result<Vec<Sequence<'_>>, Error> {
    let frames = track.frames();
    let mut spans = Vec::new();
    for (id, mut own) in track.by_target() {
        own.drain(..own.iter().take_while(|entry| entry.found().is_none()).count());
        if let (Some(first), Some(last)) = (own.first(), own.last()) {
            let begin = frames.partition_point(|&frame| frame < first.frame);
            let end = frames.partition_point(|&frame| frame <= last.frame);
            spans.push((id, own, &frames[begin..end]));
        }
    }
    let lines = spans.iter().map(|(_, _, span)| span.len()).sum::<usize>();
    if lines > MOST_LINES {
        return Err(Error::Export(format!(
            "the format has a line for each frame between the first and the last box of a target, {lines} \
             for this track of {} targets; at most {MOST_LINES} are written",
            spans.len()
        )));
    }
    Ok(spans.into_iter().map(|(id, own, span)| sequence(id, own, span)).collect())
}

/// The sequence of a target in these frames; its entries are in some of them.
fn sequence<'a>(id: u64, entries: Vec<&'a Entry>, frames: &[usize]) -> Sequence<'a> {
    let mut next = entries.into_iter().peekable();
    let found = |&frame: &usize| {
        let entry = next.next_if(|entry| entry.frame == frame);
        (frame, entry.and_then(|entry| Some((entry, entry.found()?))))
    };
    Sequence { id, frames: frames.iter().map(found).collect() }
}

impl Sequence<'_> {
    /// The images of its frames, by their numbers in the sequence from 1, in this folder.
    pub fn images(&self, job: &Job<'_>, folder: &Path) -> Vec<Item> {
        let frames = self.frames.iter().zip(1..);
        let image = |k: usize| folder.join(format!("{k:08}.jpg"));
        frames.filter_map(|((frame, _), k)| job.frames.jpeg(*frame, image(k))).collect()
    }

    /// `x,y,w,h` on each line, with `origin` as the coordinate of the first pixel; zeros where the
    /// target is absent.
    pub fn boxes(&self, origin: f64) -> String {
        let line = |(_, found): &(usize, Option<BoxEntry<'_>>)| match found {
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
