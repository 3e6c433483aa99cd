//! MOTChallenge results: `frame,id,left,top,width,height,confidence,-1,-1,-1` on each line; frames
//! and pixels count from 1.

use super::format::ImageUse;
use super::{Entry, Error, Format, Job};

pub const FORMAT: Format = Format {
    name: "mot",
    title: "MOTChallenge",
    content: "a text file for TrackEval and motmetrics: frame,id,left,top,width,height,confidence \
              (the score),-1,-1,-1; counted from 1",
    lost: Some("confidence 0"),
    images: ImageUse::Unused,
    needs_size: false,
    file: Some(("txt", text)),
    ..Format::BASE
};

/// The contents of the file. The confidence is the score, 1 if it is unknown, and 0 if the target
/// is lost.
fn text(job: &Job<'_>) -> Result<String, Error> {
    let line = |entry: &Entry| {
        let bbox = entry.bbox?;
        let confidence = entry.found().map_or(0.0, |_| entry.score.unwrap_or(1.0));
        Some(format!(
            "{},{},{:.4},{:.4},{:.4},{:.4},{:.4},-1,-1,-1\n",
            entry.frame + 1,
            entry.id,
            bbox.x + 1.0,
            bbox.y + 1.0,
            bbox.w,
            bbox.h,
            confidence
        ))
    };
    Ok(job.track.entries().iter().filter_map(line).collect())
}
