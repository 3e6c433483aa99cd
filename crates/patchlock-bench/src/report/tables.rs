//! The numbers of the report as tables, for use in other programs.

use super::attributes_of;
use super::comparison::{ComparedTracker, Comparison};
use crate::compare::BootstrapSamples;
use crate::metrics::{Calibration, Curves, StatusCounts};
use crate::score::{self, Measure, TargetScore};

/// One row per tracker.
pub fn trackers(comparison: &Comparison) -> Vec<Vec<String>> {
    let head = "tracker,targets,seeds,dp20,dp20_sd,auc,auc_sd,success50,mean_overlap,norm_precision,fps,\
         lost_share,lost_share_sd,overlap_not_lost,overlap_not_lost_sd";
    let mut table = vec![cells(head)];
    for tracker in &comparison.trackers {
        let all = &tracker.overall;
        let fps = all.fps.map_or(String::new(), |fps| format!("{:.3}", fps.mean));
        let mut row = vec![
            tracker.name.to_string(),
            tracker.targets.len().to_string(),
            tracker.seeds.len().to_string(),
        ];
        for measure in [all.dp20, all.auc] {
            row.extend([number(measure.mean), spread(measure)]);
        }
        row.extend([all.success50, all.mean_overlap, all.norm_precision].map(|m| number(m.mean)));
        row.push(fps);
        row.extend([number(all.lost_share.mean), spread(all.lost_share)]);
        row.extend([
            mean(all.overlap_not_lost),
            all.overlap_not_lost.map_or_else(String::new, spread),
        ]);
        table.push(row);
    }
    table
}

/// One row per tracker, target and seed.
pub fn targets(comparison: &Comparison) -> Vec<Vec<String>> {
    let head = "tracker,target,seed,dp20,auc,success50,mean_overlap,norm_precision,lost_share,\
                overlap_not_lost,lost_precision,lost_recall,false_lost,first_lost,losses,recoveries,\
                ece,auroc";
    let mut table = vec![cells(head)];
    for tracker in &comparison.trackers {
        for (target, seed) in
            tracker.targets.iter().flat_map(|t| t.seeds.iter().map(move |seed| (t, seed)))
        {
            let c = &seed.curves;
            let values = [c.dp20(), c.auc(), c.success50(), seed.mean_overlap, c.norm_precision()];
            let mut row =
                vec![tracker.name.to_string(), target.target.clone(), seed.seed.to_string()];
            row.extend(values.map(number));
            row.extend([Some(seed.lost_share), seed.overlap_not_lost].map(known));
            row.extend(of_counts(seed.status.as_ref()));
            row.extend(of_scores(seed.calibration.as_ref()));
            table.push(row);
        }
    }
    table
}

/// One row per tracker that says something of itself, and kind of mean: over targets, or pooled
/// over all frames.
pub fn status(comparison: &Comparison) -> Vec<Vec<String>> {
    let head =
        "tracker,mean,lost_precision,lost_recall,false_lost,first_lost,losses,recoveries,ece,auroc";
    let mut table = vec![cells(head)];
    for tracker in &comparison.trackers {
        let (status, scores) = (&tracker.overall.status, &tracker.overall.calibration);
        if status.is_none() && scores.is_none() {
            continue;
        }
        let mut row = [tracker.name, "targets"].map(str::to_string).to_vec();
        row.extend(status.as_ref().map_or_else(Default::default, |s| {
            let [losses, recoveries] = [s.losses, s.recoveries].map(Some);
            [s.precision, s.recall, s.false_lost, s.first_lost, losses, recoveries].map(mean)
        }));
        row.extend(scores.as_ref().map_or_else(Default::default, |s| [s.ece, s.auroc].map(mean)));
        table.push(row);
        let mut row = [tracker.name, "pooled"].map(str::to_string).to_vec();
        row.extend(of_counts(status.as_ref().map(|s| &s.pooled)));
        row.extend(of_scores(scores.as_ref().map(|s| &s.pooled)));
        table.push(row);
    }
    table
}

/// Precision, recall, false lost, first lost, losses, recoveries; empty where unknown.
fn of_counts(counts: Option<&StatusCounts>) -> [String; 6] {
    let Some(counts) = counts else { return Default::default() };
    let shares =
        [counts.precision(), counts.recall(), counts.false_lost(), counts.first_lost()].map(known);
    let [precision, recall, false_lost, first_lost] = shares;
    let (losses, recoveries) = (counts.losses.to_string(), counts.recoveries.to_string());
    [precision, recall, false_lost, first_lost, losses, recoveries]
}

/// ECE and AUROC; empty where unknown.
fn of_scores(scores: Option<&Calibration>) -> [String; 2] {
    scores.map_or_else(Default::default, |scores| [scores.ece(), scores.auroc()].map(known))
}

/// One row per tracker and attribute.
pub fn attributes(comparison: &Comparison) -> Vec<Vec<String>> {
    let mut table = vec![cells("tracker,attribute,targets,dp20,auc")];
    for (short, _) in attributes_of(comparison) {
        for tracker in &comparison.trackers {
            let has = |target: &&&TargetScore| target.attributes.contains(&short);
            let own: Vec<&TargetScore> = tracker.targets.iter().filter(has).copied().collect();
            let Some(summary) = score::summary(&own, tracker.seeds) else {
                continue;
            };
            let mut row = vec![tracker.name.to_string(), short.clone(), own.len().to_string()];
            row.extend([summary.dp20.mean, summary.auc.mean].map(number));
            table.push(row);
        }
    }
    table
}

/// One row per pair of trackers.
pub fn pairs(comparison: &Comparison, draws: &BootstrapSamples) -> Vec<Vec<String>> {
    let head =
        "first,second,targets,auc_mean,auc_low,auc_high,auc_p,dp20_mean,dp20_low,dp20_high,dp20_p";
    let mut table = vec![cells(head)];
    let each = |tracker: &ComparedTracker| [tracker.each(Curves::auc), tracker.each(Curves::dp20)];
    let values: Vec<[Vec<f64>; 2]> = comparison.trackers.iter().map(each).collect();
    for (a, first) in comparison.trackers.iter().enumerate() {
        for (b, second) in comparison.trackers.iter().enumerate().skip(a + 1) {
            let mut row = [first.name, second.name].map(str::to_string).to_vec();
            row.push(comparison.targets.len().to_string());
            for (x, y) in values[a].iter().zip(&values[b]) {
                let difference = draws.difference(x, y).into_iter();
                row.extend(difference.flat_map(|d| [d.mean, d.low, d.high, d.p]).map(number));
            }
            if row.len() < table[0].len() {
                return table; // too few targets to compare any two
            }
            table.push(row);
        }
    }
    table
}

fn cells(head: &str) -> Vec<String> {
    head.split(',').map(str::to_string).collect()
}

fn number(value: f64) -> String {
    format!("{value:.6}")
}

/// The value; empty where unknown.
fn known(value: Option<f64>) -> String {
    value.map_or_else(String::new, number)
}

/// The mean; empty where unknown.
fn mean(measure: Option<Measure>) -> String {
    known(measure.map(|measure| measure.mean))
}

/// The standard deviation; empty for a single seed.
fn spread(measure: Measure) -> String {
    measure.sd.map_or(String::new(), number)
}
