//! Edit lists of MP4: which part of a track is shown, and when. Cameras and editors trim a video
//! so, and encoders with B-frames shift it so that it begins at 0.

use shiguredo_mp4::boxes::ElstEntry;

/// One frame as it is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PresentedFrame {
    /// Number of the picture among the stored ones, counted in the order of their times.
    pub picture: usize,
    /// When it is shown, in ticks of the track.
    pub time: i64,
}

/// Which part of a track is shown when; without edits, all of it.
pub struct EditList {
    /// The edits. Their durations are in ticks of the movie.
    pub edits: Vec<ElstEntry>,
    /// Ticks of the movie per second.
    pub timescale: u32,
}

/// What is shown of pictures with these rising `times`, in ticks of the track. Of each edit, these
/// are the pictures that begin within it. There may be `most` frames.
pub fn shown(
    times: &[i64],
    timescale: u32,
    EditList { edits, timescale: movie_timescale }: &EditList,
    most: usize,
) -> Result<Vec<PresentedFrame>, String> {
    if edits.is_empty() {
        let all = times.iter().enumerate();
        return Ok(all.map(|(picture, &time)| PresentedFrame { picture, time }).collect());
    }
    let mut frames = Vec::new();
    let mut begin = 0_i64;
    for edit in edits {
        let ticks = i128::from(edit.edit_duration) * i128::from(timescale);
        let movie = i128::from(*movie_timescale);
        let ticks = i64::try_from((ticks + movie / 2) / movie).unwrap_or(i64::MAX);
        // Nothing is shown for a while.
        if edit.media_time < 0 {
            begin = begin.saturating_add(ticks);
            continue;
        }
        let from = times.partition_point(|&time| time < edit.media_time);
        // Without a duration, the edit goes to the end of the track.
        let end = if ticks == 0 { i64::MAX } else { edit.media_time.saturating_add(ticks) };
        let to = times.partition_point(|&time| time < end).max(from);
        if frames.len() + (to - from) > most {
            return Err("the index is damaged: its edit list shows too many frames".to_string());
        }
        frames.extend((from..to).map(|picture| {
            let time = begin.saturating_add(times[picture].saturating_sub(edit.media_time));
            PresentedFrame { picture, time }
        }));
        begin = begin.saturating_add(ticks);
    }
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shiguredo_mp4::FixedPointNumber;

    fn edit(edit_duration: u64, media_time: i64) -> ElstEntry {
        ElstEntry { edit_duration, media_time, media_rate: FixedPointNumber::new(1, 0) }
    }

    /// Frames of 100 ticks at 1000 per second; movie ticks are 600 per second.
    fn pairs(edits: &[ElstEntry]) -> Vec<(usize, i64)> {
        let times: Vec<i64> = (2..8).map(|k| k * 100).collect();
        let list = EditList { edits: edits.to_vec(), timescale: 600 };
        let frames = shown(&times, 1000, &list, 100).expect("few frames");
        frames.iter().map(|frame| (frame.picture, frame.time)).collect()
    }

    #[test]
    fn an_edit_shows_the_pictures_that_begin_in_it() {
        assert_eq!(pairs(&[])[0], (0, 200));
        assert_eq!(
            pairs(&[edit(360, 200)]),
            (0..6).map(|k| (k, k as i64 * 100)).collect::<Vec<_>>()
        );
        assert_eq!(pairs(&[edit(120, 350)]), [(2, 50), (3, 150)], "200 ticks from 350 on");
        assert_eq!(pairs(&[edit(0, 600)]), [(4, 0), (5, 100)]);
        assert_eq!(pairs(&[edit(60, -1), edit(60, 200), edit(60, 200)]), [(0, 100), (0, 200)]);
        assert_eq!(pairs(&[edit(60, 5000)]), []);
    }

    #[test]
    fn an_edit_list_cannot_multiply_frames_without_end() {
        let list = EditList { edits: vec![edit(60_000, 0); 1000], timescale: 600 };
        assert!(shown(&[0, 1, 2], 1000, &list, 100).is_err());
        let edits = vec![edit(u64::MAX, i64::MAX), edit(u64::MAX, 0), edit(1, -1)];
        let huge = EditList { edits, timescale: 1 };
        assert_eq!(shown(&[0, 1], 1000, &huge, 100).expect("two").len(), 2);
    }
}
