//! Means over targets and seeds.

use super::{SeedScore, TargetScore};
use crate::metrics::{Calibration, Curves, StatusCounts};

/// A mean over seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    /// The mean.
    pub mean: f64,
    /// The sample standard deviation; `None` for a single seed.
    pub sd: Option<f64>,
}

/// The scores of a tracker, averaged over all or some targets.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Precision at 20 pixels.
    pub dp20: Measure,
    /// Mean of the success curve.
    pub auc: Measure,
    /// Success at an overlap of 0.5.
    pub success50: Measure,
    /// Mean overlap.
    pub mean_overlap: Measure,
    /// Share of the frames in which the target is lost.
    pub lost_share: Measure,
    /// Mean overlap over the other frames, over the targets that have any; `None` if none has.
    pub overlap_not_lost: Option<Measure>,
    /// Mean of the curve of normalised precision.
    pub norm_precision: Measure,
    /// Frames per second; `None` if times are unknown.
    pub fps: Option<Measure>,
    /// The mean curves.
    pub curves: Curves,
    /// What the statuses were worth; `None` unless the tracker gave one for every frame.
    pub status: Option<StatusSummary>,
    /// What the scores were worth; `None` unless the tracker gave one for every frame.
    pub calibration: Option<CalibrationSummary>,
}

/// The measures of [`StatusCounts`], over the targets that have the value; `None` if none has.
#[derive(Debug, Clone, PartialEq)]
pub struct StatusSummary {
    /// Share of the frames with the status lost in which the target is gone.
    pub precision: Option<Measure>,
    /// Share of the frames in which the target is gone that have the status lost.
    pub recall: Option<Measure>,
    /// Share of the frames in which the box is on the target that have the status lost.
    pub false_lost: Option<Measure>,
    /// Number of frames before the first with the status lost.
    pub first_lost: Option<Measure>,
    /// Number of losses per target.
    pub losses: Measure,
    /// Number of recoveries per target.
    pub recoveries: Measure,
    /// The counts over all targets and seeds.
    pub pooled: StatusCounts,
}

/// The measures of [`Calibration`], over the targets that have the value; `None` if none has.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationSummary {
    /// The expected calibration error.
    pub ece: Option<Measure>,
    /// The area under the ROC curve.
    pub auroc: Option<Measure>,
    /// The frames of all targets and seeds.
    pub pooled: Calibration,
}

/// The means over some targets, such as those with one attribute; `None` without targets or seeds.
pub fn summary<'a>(targets: &[&'a TargetScore], seeds: &[u64]) -> Option<Summary> {
    let rows: Vec<Vec<&SeedScore>> = seeds
        .iter()
        .map(|&seed| {
            targets.iter().filter_map(|t| t.seeds.iter().find(|s| s.seed == seed)).collect()
        })
        .collect();
    let curves_of = |row: &Vec<&'a SeedScore>| -> Vec<&'a Curves> {
        row.iter().map(|score| &score.curves).collect()
    };
    let curves: Option<Vec<Curves>> =
        rows.iter().map(|row| Curves::mean(&curves_of(row))).collect();
    let curves = curves?;
    let over_seeds = |value: fn(&Curves) -> f64| measure(curves.iter().map(value).collect());
    let over_targets = |value: fn(&SeedScore) -> f64| {
        measure(rows.iter().map(|row| mean(row.iter().map(|score| value(score)))).collect())
    };
    let fps: Option<Vec<f64>> = rows.iter().map(|row| fps(row)).collect();
    Some(Summary {
        dp20: over_seeds(Curves::dp20)?,
        auc: over_seeds(Curves::auc)?,
        success50: over_seeds(Curves::success50)?,
        mean_overlap: over_targets(|score| score.mean_overlap)?,
        lost_share: over_targets(|score| score.lost_share)?,
        overlap_not_lost: over_known(&rows, &|score| score.overlap_not_lost),
        norm_precision: over_seeds(Curves::norm_precision)?,
        fps: fps.and_then(measure),
        curves: Curves::mean(&curves.iter().collect::<Vec<_>>())?,
        status: status(&rows),
        calibration: calibration(&rows),
    })
}

/// `None` unless all scores have statuses.
fn status(rows: &[Vec<&SeedScore>]) -> Option<StatusSummary> {
    let pooled = rows.iter().flatten().try_fold(StatusCounts::default(), |mut pooled, score| {
        pooled.join(score.status.as_ref()?);
        Some(pooled)
    })?;
    let over = |value: fn(&StatusCounts) -> Option<f64>| {
        over_known(rows, &|score| score.status.as_ref().and_then(value))
    };
    Some(StatusSummary {
        precision: over(StatusCounts::precision),
        recall: over(StatusCounts::recall),
        false_lost: over(StatusCounts::false_lost),
        first_lost: over(StatusCounts::first_lost),
        losses: over(|counts| Some(counts.losses as f64))?,
        recoveries: over(|counts| Some(counts.recoveries as f64))?,
        pooled,
    })
}

/// `None` unless all scores have the tracker's own scores.
fn calibration(rows: &[Vec<&SeedScore>]) -> Option<CalibrationSummary> {
    let pooled = rows.iter().flatten().try_fold(Calibration::default(), |mut pooled, score| {
        pooled.join(score.calibration.as_ref()?);
        Some(pooled)
    })?;
    let over = |value: fn(&Calibration) -> Option<f64>| {
        over_known(rows, &|score| score.calibration.as_ref().and_then(value))
    };
    Some(CalibrationSummary {
        ece: over(Calibration::ece),
        auroc: over(Calibration::auroc),
        pooled,
    })
}

/// The mean over the targets that have the value, for each seed that has any, then over these
/// seeds.
fn over_known(
    rows: &[Vec<&SeedScore>],
    value: &dyn Fn(&SeedScore) -> Option<f64>,
) -> Option<Measure> {
    let known = |row: &Vec<&SeedScore>| -> Vec<f64> {
        row.iter().filter_map(|score| value(score)).collect()
    };
    let rows = rows.iter().map(known).filter(|known| !known.is_empty());
    measure(rows.map(|known| mean(known.into_iter())).collect())
}

/// Total frames divided by total time; `None` unless all times are known.
fn fps(scores: &[&SeedScore]) -> Option<f64> {
    let times: Option<Vec<(usize, f64)>> = scores.iter().map(|score| score.time).collect();
    let times = times?;
    let (frames, seconds) = (
        times.iter().map(|time| time.0).sum::<usize>(),
        times.iter().map(|time| time.1).sum::<f64>(),
    );
    (seconds > 0.0).then(|| frames as f64 / seconds)
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// Mean and standard deviation; `None` without values.
fn measure(values: Vec<f64>) -> Option<Measure> {
    if values.is_empty() {
        return None;
    }
    let mean = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let sd = (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt());
    Some(Measure { mean, sd })
}

#[cfg(test)]
mod tests {
    use super::*;
    use patchlock::Status::{self, Lost, Tracked};

    /// A target with two frames after the first: overlap, score and status of each.
    fn target(frames: Option<[(f64, f64, Status); 2]>, lost_share: f64) -> TargetScore {
        let known = frames.map(|frames| {
            let frames = [&[(1.0, 1.0, Tracked)], &frames[..]].concat();
            let overlaps: Vec<Option<f64>> = frames.iter().map(|frame| Some(frame.0)).collect();
            let (mut status, mut calibration) = (StatusCounts::default(), Calibration::default());
            status.add(&frames.iter().map(|frame| frame.2).collect::<Vec<_>>(), &overlaps);
            calibration.add(&frames.iter().map(|frame| frame.1).collect::<Vec<_>>(), &overlaps);
            (status, calibration)
        });
        let (status, calibration) = known.unzip();
        let curves = Curves { precision: [0.5; 51], normalised: [0.5; 51], success: [0.5; 21] };
        let seed = SeedScore {
            seed: 0,
            passes: Vec::new(),
            curves,
            mean_overlap: 0.5,
            lost_share,
            overlap_not_lost: (lost_share < 1.0).then_some(0.8),
            time: None,
            status,
            calibration,
        };
        TargetScore { target: String::new(), attributes: Vec::new(), seeds: vec![seed] }
    }

    #[test]
    fn targets_without_a_value_do_not_count_in_its_mean() {
        let never = target(Some([(0.9, 0.9, Tracked), (0.9, 0.7, Tracked)]), 0.0);
        let half = target(Some([(0.9, 0.9, Lost), (0.0, 0.1, Lost)]), 0.5);
        let whole = target(None, 1.0);
        let summary = |targets: &[&TargetScore]| summary(targets, &[0]).unwrap();
        let mean = |measure: Option<Measure>| measure.unwrap().mean;

        let known = summary(&[&never, &half]);
        let status = known.status.unwrap();
        assert_eq!((mean(status.precision), mean(status.recall)), (0.5, 1.0), "only of `half`");
        assert_eq!((mean(status.false_lost), status.pooled.false_lost()), (0.5, Some(1.0 / 3.0)));
        assert_eq!((status.losses.mean, mean(status.first_lost)), (0.5, 1.0));
        let calibration = known.calibration.unwrap();
        assert_eq!((mean(calibration.auroc), calibration.pooled.auroc()), (1.0, Some(1.0)));
        // Of `never` (0.1 + 0.3) / 2, of `half` (0.1 + 0.1) / 2; pooled (0.1 + 0.1 + 0.3 + 0.1)
        // / 4.
        assert!((mean(calibration.ece) - 0.15).abs() < 1e-12);
        assert!((calibration.pooled.ece().unwrap() - 0.15).abs() < 1e-12);

        let all = summary(&[&never, &half, &whole]);
        assert!(all.status.is_none() && all.calibration.is_none(), "unknown for one target");
        assert_eq!((all.lost_share.mean, mean(all.overlap_not_lost)), (0.5, 0.8));
        assert_eq!(summary(&[&whole]).overlap_not_lost, None);
    }
}
