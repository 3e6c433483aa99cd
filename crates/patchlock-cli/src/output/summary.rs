//! Statistics of a run, as a JSON object.

use std::path::PathBuf;

use anyhow::Result;
use serde::Serialize;

use super::pending::PendingFile;

/// Statistics of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of tracked frames, including the first.
    pub frames: usize,
    /// Number of targets.
    pub targets: usize,
    /// Frames per second of the tracker alone: includes the first frame, but not decoding and writing.
    pub tracking_fps: f64,
    /// Median time per frame in milliseconds.
    pub ms_median: f64,
    /// 95th percentile of the time per frame in milliseconds.
    pub ms_p95: f64,
    /// Name of the preset.
    pub preset: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of threads of the tracker.
    pub threads: usize,
    /// Version of this program.
    pub version: &'static str,
}

impl Summary {
    /// Computes the statistics from the times of the frames.
    pub fn new(times_ms: &[f64], targets: usize, preset: &str, seed: u64, threads: usize) -> Self {
        let mut sorted = times_ms.to_vec();
        sorted.sort_by(f64::total_cmp);
        let total: f64 = sorted.iter().sum();
        Self {
            frames: sorted.len(),
            targets,
            tracking_fps: if total > 0.0 { round(1e3 * sorted.len() as f64 / total) } else { 0.0 },
            ms_median: round(quantile(&sorted, 0.5)),
            ms_p95: round(quantile(&sorted, 0.95)),
            preset: preset.to_string(),
            seed,
            threads,
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// Writes the object and completes the file.
    pub fn write(&self, file: PendingFile) -> Result<PathBuf> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        Ok(file.filled(text.as_bytes())?.commit()?)
    }
}

/// A quantile, interpolated linearly between the two nearest values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let place = share * last as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    below + (above - below) * place.fract()
}

fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_known_times() {
        let times: Vec<f64> = (1..=101).rev().map(f64::from).collect();
        let summary = Summary::new(&times, 1, "paper", 7, 2);
        assert_eq!((summary.frames, summary.ms_median, summary.ms_p95), (101, 51.0, 96.0));
        assert_eq!(summary.tracking_fps, 19.608); // 101 frames in 5.151 s
        assert_eq!(Summary::new(&[], 0, "paper", 0, 1).tracking_fps, 0.0);
    }
}
