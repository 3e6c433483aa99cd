//! The numbers of the report as tables, for use in other programs.

use super::attributes_of;
use super::comparison::{ComparedTracker, Comparison};
use crate::compare::Draws;
use crate::metrics::Curves;
use crate::score::{self, Measure, TargetScore};

/// One row per tracker.
pub fn trackers(comparison: &Comparison) -> Vec<Vec<String>> {
    let head =
        "tracker,targets,seeds,dp20,dp20_sd,auc,auc_sd,success50,mean_overlap,norm_precision,fps";
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
        table.push(row);
    }
    table
}

/// One row per tracker, target and seed.
pub fn targets(comparison: &Comparison) -> Vec<Vec<String>> {
    let mut table =
        vec![cells("tracker,target,seed,dp20,auc,success50,mean_overlap,norm_precision")];
    for tracker in &comparison.trackers {
        for (target, seed) in
            tracker.targets.iter().flat_map(|t| t.seeds.iter().map(move |seed| (t, seed)))
        {
            let c = &seed.curves;
            let values = [c.dp20(), c.auc(), c.success50(), seed.mean_overlap, c.norm_precision()];
            let mut row =
                vec![tracker.name.to_string(), target.target.clone(), seed.seed.to_string()];
            row.extend(values.map(number));
            table.push(row);
        }
    }
    table
}

/// One row per tracker and attribute.
pub fn attributes(comparison: &Comparison) -> Vec<Vec<String>> {
    let mut table = vec![cells("tracker,attribute,targets,dp20,auc")];
    for (short, _) in attributes_of(comparison) {
        for tracker in &comparison.trackers {
            let has = |target: &&&TargetScore| target.attributes.contains(&short);
            let own: Vec<&TargetScore> = tracker.targets.iter().filter(has).copied().collect();
            let Some(summary) = score::summary(own.iter().copied(), tracker.seeds) else {
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
pub fn pairs(comparison: &Comparison, draws: &Draws) -> Vec<Vec<String>> {
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

/// The standard deviation; empty for a single seed.
fn spread(measure: Measure) -> String {
    measure.sd.map_or(String::new(), number)
}
