//! The numbers of the report as tables, for other programs.

use super::attributes_of;
use super::field::{Entrant, Field};
use crate::compare::Draws;
use crate::metrics::Curves;
use crate::score::{self, Measure, TargetScore};

/// One row a tracker.
pub fn trackers(field: &Field) -> Vec<Vec<String>> {
    let head =
        "tracker,targets,seeds,dp20,dp20_sd,auc,auc_sd,success50,mean_overlap,norm_precision,fps";
    let mut table = vec![cells(head)];
    for entrant in &field.entrants {
        let all = &entrant.overall;
        let fps = all.fps.map_or(String::new(), |fps| format!("{:.3}", fps.mean));
        let mut row = vec![
            entrant.name.to_string(),
            entrant.targets.len().to_string(),
            entrant.seeds.len().to_string(),
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

/// One row a tracker, target and seed.
pub fn targets(field: &Field) -> Vec<Vec<String>> {
    let mut table =
        vec![cells("tracker,target,seed,dp20,auc,success50,mean_overlap,norm_precision")];
    for entrant in &field.entrants {
        for (target, seed) in
            entrant.targets.iter().flat_map(|t| t.seeds.iter().map(move |seed| (t, seed)))
        {
            let c = &seed.curves;
            let values = [c.dp20(), c.auc(), c.success50(), seed.mean_overlap, c.norm_precision()];
            let mut row =
                vec![entrant.name.to_string(), target.target.clone(), seed.seed.to_string()];
            row.extend(values.map(number));
            table.push(row);
        }
    }
    table
}

/// One row a tracker and attribute.
pub fn attributes(field: &Field) -> Vec<Vec<String>> {
    let mut table = vec![cells("tracker,attribute,targets,dp20,auc")];
    for (short, _) in attributes_of(field) {
        for entrant in &field.entrants {
            let has = |target: &&&TargetScore| target.attributes.contains(&short);
            let own: Vec<&TargetScore> = entrant.targets.iter().filter(has).copied().collect();
            let Some(summary) = score::summary(own.iter().copied(), entrant.seeds) else {
                continue;
            };
            let mut row = vec![entrant.name.to_string(), short.clone(), own.len().to_string()];
            row.extend([summary.dp20.mean, summary.auc.mean].map(number));
            table.push(row);
        }
    }
    table
}

/// One row a pair of trackers.
pub fn pairs(field: &Field, draws: &Draws) -> Vec<Vec<String>> {
    let head =
        "first,second,targets,auc_mean,auc_low,auc_high,auc_p,dp20_mean,dp20_low,dp20_high,dp20_p";
    let mut table = vec![cells(head)];
    let each = |entrant: &Entrant| [entrant.each(Curves::auc), entrant.each(Curves::dp20)];
    let values: Vec<[Vec<f64>; 2]> = field.entrants.iter().map(each).collect();
    for (a, first) in field.entrants.iter().enumerate() {
        for (b, second) in field.entrants.iter().enumerate().skip(a + 1) {
            let mut row = [first.name, second.name].map(str::to_string).to_vec();
            row.push(field.targets.len().to_string());
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

/// Empty of one seed.
fn spread(measure: Measure) -> String {
    measure.sd.map_or(String::new(), number)
}
