//! MOTChallenge results: `frame,id,left,top,width,height,confidence,-1,-1,-1` on each line; frames and pixels
//! count from 1.

use super::Job;

/// The contents of the file. The confidence is the score, or 1 if it is unknown.
pub fn text(job: &Job<'_>) -> String {
    let line = |entry: &super::Entry| {
        let bbox = entry.bbox;
        format!(
            "{},{},{:.4},{:.4},{:.4},{:.4},{:.4},-1,-1,-1\n",
            entry.frame + 1,
            entry.id,
            bbox.x + 1.0,
            bbox.y + 1.0,
            bbox.w,
            bbox.h,
            entry.score.unwrap_or(1.0)
        )
    };
    job.track.entries().iter().map(line).collect()
}
