//! The results of MOTChallenge: `frame,id,left,top,width,height,confidence,-1,-1,-1` a line, frames and pixels counted from 1.

use super::Job;

/// The file. The confidence is the score; 1 where there is none.
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
