//! The pictures of a track, in the order in which they are stored and in that in which they are
//! shown.

use std::fs::File;
use std::path::Path;

use crate::limits;
use crate::mp4_edits::{self, EditList, PresentedFrame};
use crate::mp4_index::{self, Sample};

/// The pictures of a track in the two orders that a reader needs.
pub struct Pictures {
    /// In storage order, which is the decoding order.
    pub samples: Vec<Sample>,
    /// Of each sample, its index in presentation order.
    pub shown: Vec<usize>,
    /// Maps an index in presentation order to an index in `samples`.
    pub stored: Vec<usize>,
    /// The samples from which all frames of their own and of later indices can be decoded; both
    /// their indices in `samples` and in presentation order rise.
    pub entrances: Vec<usize>,
}

impl Pictures {
    pub fn new(samples: Vec<Sample>) -> Self {
        let mut stored: Vec<usize> = (0..samples.len()).collect();
        stored.sort_by_key(|&k| samples[k].time); // stable: equal times keep the stored order
        let mut shown = vec![0; stored.len()];
        stored.iter().enumerate().for_each(|(number, &k)| shown[k] = number);
        let mut entrances = Vec::new();
        for at in (0..samples.len()).filter(|&k| samples[k].keyframe) {
            while entrances.pop_if(|earlier: &mut usize| shown[*earlier] >= shown[at]).is_some() {}
            entrances.push(at);
        }
        Self { samples, shown, stored, entrances }
    }

    /// The frames that an edit list shows.
    pub fn shown(
        &self,
        timescale: u32,
        list: &EditList,
        bytes: u64,
    ) -> Result<Vec<PresentedFrame>, String> {
        let times: Vec<i64> = self.stored.iter().map(|&k| self.samples[k].time).collect();
        let most = limits::frames(bytes) as usize;
        mp4_edits::shown(&times, timescale, list, most)
    }

    /// Leaves out the frames from the first one on whose data would come after the end of the file,
    /// and returns how many these are. Data that are missing between others are left alone.
    pub fn cut(&self, frames: &mut Vec<PresentedFrame>, bytes: u64) -> usize {
        let is_there =
            |sample: &Sample| sample.offset.saturating_add(u64::from(sample.size)) <= bytes;
        let end = self.samples.iter().rposition(is_there).map_or(0, |last| last + 1);
        let whole = frames.iter().position(|frame| self.stored[frame.picture] >= end);
        let missing = whole.map_or(0, |whole| frames.len() - whole);
        frames.truncate(frames.len() - missing);
        missing
    }

    /// The place in `entrances` of the last one from which a decoder can reach a frame; `None` if it
    /// has to begin with the first sample.
    pub fn entrance(&self, index: usize) -> Option<usize> {
        let goal = self.stored[index];
        let behind = self.entrances.partition_point(|&k| k <= goal && self.shown[k] <= index);
        behind.checked_sub(1)
    }
}

/// When each frame of a file is shown, in millionths of a second, whatever its encoding; `None` if
/// the index does not tell.
pub fn frame_times(path: &Path) -> Option<Vec<i64>> {
    let mut file = File::open(path).ok()?;
    let bytes = file.metadata().ok()?.len();
    let track = mp4_index::read(&mut file, bytes).ok()??;
    if track.fragmented {
        return None;
    }
    let frames = Pictures::new(track.samples).shown(track.timescale, &track.edits, bytes).ok()?;
    frames.iter().map(|frame| micros(frame.time, track.timescale)).collect()
}

/// Ticks in millionths of a second.
pub fn micros(ticks: i64, timescale: u32) -> Option<i64> {
    let scale = i128::from(timescale);
    i64::try_from((i128::from(ticks) * 1_000_000 + scale / 2).div_euclid(scale)).ok()
}
