//! The compared trackers: restricted to the targets that all of them have, and ranked.

use super::palette::LineStyle;
use crate::Error;
use crate::bench::schemes::Scheme;
use crate::dataset::Dataset;
use crate::metrics::Curves;
use crate::score::{self, Scoreboard, Summary, TargetScore, TrackerScore};
use patchlock_track::names;

#[derive(Debug, Clone, PartialEq)]
pub struct ComparedTracker<'a> {
    pub name: &'a str,
    /// The seeds that count.
    pub seeds: &'a [u64],
    /// The scores on the targets of the comparison, in the order of [`Comparison::targets`].
    pub targets: Vec<&'a TargetScore>,
    /// The means over these targets.
    pub overall: Summary,
    pub style: LineStyle,
}

impl ComparedTracker<'_> {
    /// A value of the curves for each target, averaged over seeds.
    pub fn each(&self, value: fn(&Curves) -> f64) -> Vec<f64> {
        self.targets.iter().map(|target| self.mean(target, value)).collect()
    }

    /// A value of the curves for one target, averaged over seeds.
    pub fn mean(&self, target: &TargetScore, value: fn(&Curves) -> f64) -> f64 {
        let counts = target.seeds.iter().filter(|seed| self.seeds.contains(&seed.seed));
        let values: Vec<f64> = counts.map(|seed| value(&seed.curves)).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Comparison<'a> {
    pub scheme: Scheme,
    /// Names of the targets that all trackers have, in the order of the dataset.
    pub targets: Vec<&'a str>,
    /// The trackers, in decreasing order of AUC.
    pub trackers: Vec<ComparedTracker<'a>>,
    /// Index in `trackers` of the tracker that the report is about.
    pub about: usize,
    /// Remarks on what was left out.
    pub notes: Vec<String>,
}

impl<'a> Comparison<'a> {
    /// Selects and ranks the trackers. `shown` names the trackers that every plot names; the report
    /// is about the first of them, or by default about the best tracker. Trackers with another
    /// protocol than the first of `shown` (by default OPE, if any tracker has it) are left out.
    ///
    /// # Errors
    /// [`Error::NothingToCompare`] if there are no trackers, they have no target in common, or a
    /// name in `shown` is unknown.
    pub fn new(board: &'a Scoreboard, truth: &'a Dataset, shown: &[String]) -> Result<Self, Error> {
        let nothing = |reason: String| Err(Error::NothingToCompare { reason });
        if board.trackers.is_empty() {
            return nothing("no tracker could be scored".to_string());
        }
        let known: Vec<&str> = board.trackers.iter().map(|tracker| tracker.name.as_str()).collect();
        if let Some(unknown) = shown.iter().find(|name| !known.contains(&name.as_str())) {
            return nothing(format!(
                "there is no tracker {unknown}; the trackers are {}",
                names::some_of(&known)
            ));
        }
        let (scheme, trackers, mut notes) = of_one_scheme(board, shown);
        let (targets, left_out) = common_targets(&trackers, truth);
        notes.extend(left_out);
        if targets.is_empty() {
            return nothing(format!("no target has results from all {} trackers", trackers.len()));
        }
        let compared = trackers.iter().filter_map(|tracker| {
            let find = |name: &&str| tracker.targets.iter().find(|target| target.target == **name);
            let own: Vec<&TargetScore> = targets.iter().filter_map(find).collect();
            let overall = score::summary(&own, &tracker.seeds)?;
            let style = LineStyle::FIRST; // until the ranking is known
            let (name, seeds) = (tracker.name.as_str(), tracker.seeds.as_slice());
            Some(ComparedTracker { name, seeds, targets: own, overall, style })
        });
        let mut compared: Vec<ComparedTracker> = compared.collect();
        compared.sort_by(|a, b| b.overall.auc.mean.total_cmp(&a.overall.auc.mean));
        if compared.is_empty() {
            return nothing("no tracker has a seed that all of its targets have".to_string());
        }
        let first =
            shown.first().and_then(|name| compared.iter().position(|tracker| tracker.name == name));
        let about = first.unwrap_or(0);
        set_styles(&mut compared, about, shown);
        Ok(Self { scheme, targets, trackers: compared, about, notes })
    }

    /// The number of targets, in words.
    pub fn size(&self) -> String {
        names::counted(self.targets.len(), "target")
    }

    pub fn about(&self) -> &ComparedTracker<'a> {
        &self.trackers[self.about]
    }
}

/// The trackers with the protocol of the report, and a note on each of the others.
fn of_one_scheme<'a>(
    board: &'a Scoreboard,
    shown: &[String],
) -> (Scheme, Vec<&'a TrackerScore>, Vec<String>) {
    let first = board.trackers.iter().find(|tracker| shown.first() == Some(&tracker.name));
    let least = board.trackers.iter().map(scheme_of).min().unwrap_or(Scheme::Ope);
    let scheme = first.map_or(least, scheme_of);
    let (own, others): (Vec<_>, Vec<_>) =
        board.trackers.iter().partition(|tracker| scheme_of(tracker) == scheme);
    let note = |tracker: &&TrackerScore| {
        let (theirs, ours) = (scheme_of(tracker).title(), scheme.title());
        format!("{} is left out: its runs are {theirs}, this report compares {ours}.", tracker.name)
    };
    let notes = others.iter().map(note).collect();
    (scheme, own, notes)
}

/// The protocol that the runs of a tracker follow.
fn scheme_of(tracker: &TrackerScore) -> Scheme {
    let seeds = tracker.targets.iter().flat_map(|target| &target.seeds);
    let passes: Vec<_> = seeds.flat_map(|seed| &seed.passes).collect();
    if passes.iter().any(|pass| pass.first > 0) {
        Scheme::Tre
    } else if passes.iter().any(|pass| pass.variant > 0) {
        Scheme::Sre
    } else {
        Scheme::Ope
    }
}

/// The targets of the dataset that all trackers have results for, and a note if some have results
/// for more.
fn common_targets<'a>(
    trackers: &[&'a TrackerScore],
    truth: &'a Dataset,
) -> (Vec<&'a str>, Option<String>) {
    let of = |tracker: &&'a TrackerScore| {
        names::distinct(tracker.targets.iter().map(|target| target.target.as_str()).collect())
    };
    let sets: Vec<Vec<&str>> = trackers.iter().map(of).collect();
    let in_all = |name: &str| sets.iter().all(|set| set.binary_search(&name).is_ok());
    let in_some = |name: &str| sets.iter().any(|set| set.binary_search(&name).is_ok());
    let named = truth.sequences.iter().map(|sequence| sequence.name.as_str());
    let (common, rest): (Vec<&str>, Vec<&str>) =
        named.filter(|name| in_some(name)).partition(|name| in_all(name));
    let most = sets.iter().map(Vec::len).max().unwrap_or(0);
    let lacking: Vec<&str> = (trackers.iter().zip(&sets))
        .filter(|(_, set)| set.len() < most)
        .map(|(tracker, _)| tracker.name.as_str())
        .collect();
    let note = format!(
        "Compared on the {} targets that all trackers have. Left out, because there are no results \
         from {}: {}.",
        common.len(),
        names::some_of(&lacking),
        names::some_of(&rest)
    );
    let note = (!rest.is_empty()).then_some(note);
    (common, note)
}

fn set_styles(trackers: &mut [ComparedTracker], about: usize, shown: &[String]) {
    let mut k = 0;
    for (index, tracker) in trackers.iter_mut().enumerate() {
        tracker.style = if index == about {
            LineStyle::FIRST
        } else {
            k += 1;
            LineStyle::other(k - 1, shown.iter().any(|name| name == tracker.name))
        };
    }
}
