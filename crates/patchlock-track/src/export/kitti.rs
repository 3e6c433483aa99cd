//! KITTI tracking labels, one box per line: `frame id type truncated occluded alpha left top right
//! bottom height width length x y z rotation score`. Frames and pixels count from 0. What a tracker of
//! boxes does not know has the values that the development kit gives for it.

use super::format::ImageUse;
use super::{Entry, Error, Format, Job};

pub const FORMAT: Format = Format {
    name: "kitti",
    title: "KITTI tracking",
    content: "a text file for KITTI and TrackEval: frame id type truncated occluded alpha left top \
              right bottom, 3D placeholders, score; counted from 0",
    lost: Some("no line"),
    images: ImageUse::Unused,
    needs_size: false,
    file: Some(("txt", text)),
    ..Format::BASE
};

/// The contents of the file. The score is 1 if it is unknown.
fn text(job: &Job<'_>) -> Result<String, Error> {
    let line = |entry: &Entry| {
        let bbox = entry.found()?;
        // A person says yes or no; otherwise only occlusion may be known.
        let truncated = entry.manual.map_or(-1, |manual| i8::from(manual.truncated));
        let occluded = match (entry.manual, entry.is_occluded()) {
            (_, true) => 1,
            (Some(_), false) => 0,
            (None, false) => -1,
        };
        let kind = job.label(entry.id).split_whitespace().collect::<Vec<_>>().join("_");
        // Alpha, then height, width and length, the place and the rotation in space are not known.
        Some(format!(
            "{} {} {kind} {truncated} {occluded} -10 {:.4} {:.4} {:.4} {:.4} \
             -1 -1 -1 -1000 -1000 -1000 -10 {:.4}\n",
            entry.frame,
            entry.id,
            bbox.x,
            bbox.y,
            bbox.x + bbox.w,
            bbox.y + bbox.h,
            entry.score.unwrap_or(1.0)
        ))
    };
    Ok(job.track.entries().iter().filter_map(line).collect())
}
