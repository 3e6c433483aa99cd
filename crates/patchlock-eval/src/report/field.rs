//! The trackers side by side: on the targets that all of them have, ranked, each with its look.

use std::collections::BTreeSet;

use super::palette::Look;
use crate::Error;
use crate::dataset::Dataset;
use crate::metrics::Curves;
use crate::names;
use crate::score::{self, Scoreboard, Summary, TargetScore, TrackerScore};

/// One tracker in the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Entrant<'a> {
    /// Its name.
    pub name: &'a str,
    /// The seeds that count.
    pub seeds: &'a [u64],
    /// The targets of the comparison, in their order.
    pub targets: Vec<&'a TargetScore>,
    /// Its means over them.
    pub overall: Summary,
    /// Its look in every plot.
    pub look: Look,
}

impl Entrant<'_> {
    /// A value of its curves for each target: the mean over seeds.
    pub fn each(&self, value: impl Fn(&Curves) -> f64) -> Vec<f64> {
        self.targets.iter().map(|target| self.mean(target, &value)).collect()
    }

    /// The same for one target.
    pub fn mean(&self, target: &TargetScore, value: impl Fn(&Curves) -> f64) -> f64 {
        let counts = target.seeds.iter().filter(|seed| self.seeds.contains(&seed.seed));
        let values: Vec<f64> = counts.map(|seed| value(&seed.curves)).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }
}

/// Where the runs begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// One pass from the first frame and box.
    Ope,
    /// From several start frames.
    Tre,
    /// From several first boxes.
    Sre,
}

impl Kind {
    /// As the runs of a tracker say.
    fn of(tracker: &TrackerScore) -> Self {
        let seeds = tracker.targets.iter().flat_map(|target| &target.seeds);
        let passes: Vec<_> = seeds.flat_map(|seed| &seed.passes).collect();
        if passes.iter().any(|pass| pass.first > 0) {
            Self::Tre
        } else if passes.iter().any(|pass| pass.variant > 0) {
            Self::Sre
        } else {
            Self::Ope
        }
    }

    /// The benchmark's short name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ope => "OPE",
            Self::Tre => "TRE",
            Self::Sre => "SRE",
        }
    }
}

/// All of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Field<'a> {
    /// Where the runs of all of them begin.
    pub kind: Kind,
    /// Names of the targets that all trackers have, in the order of the truth.
    pub targets: Vec<&'a str>,
    /// The trackers, the one with the largest AUC first.
    pub entrants: Vec<Entrant<'a>>,
    /// Place among them of the tracker that the report is about.
    pub about: usize,
    /// What a reader should know about what was left out.
    pub notes: Vec<String>,
}

impl<'a> Field<'a> {
    /// Puts the trackers side by side. `shown` are the names of those that every plot names; the report is about the first of them, or about the best
    /// tracker. Runs that begin elsewhere than those of the first shown one (of none: than in one-pass evaluation, if there is any) are left out.
    ///
    /// # Errors
    /// [`Error::NothingToCompare`] where there are no trackers, or no target that all of them have, or no tracker of a shown name.
    pub fn new(board: &'a Scoreboard, truth: &'a Dataset, shown: &[String]) -> Result<Self, Error> {
        let nothing = |reason: String| Err(Error::NothingToCompare { reason });
        if board.trackers.is_empty() {
            return nothing("there is no tracker that could be scored".to_string());
        }
        let known: Vec<&str> = board.trackers.iter().map(|tracker| tracker.name.as_str()).collect();
        if let Some(unknown) = shown.iter().find(|name| !known.contains(&name.as_str())) {
            return nothing(format!(
                "there is no tracker {unknown}; there are {}",
                names::some_of(&known)
            ));
        }
        let (kind, trackers, mut notes) = of_one_kind(board, shown);
        let (targets, left_out) = common_targets(&trackers, truth);
        notes.extend(left_out);
        if targets.is_empty() {
            return nothing(format!("no target has results of all {} trackers", trackers.len()));
        }
        let mut entrants: Vec<Entrant> = Vec::new();
        for tracker in trackers {
            let find = |name: &&str| tracker.targets.iter().find(|target| target.target == **name);
            let own: Vec<&TargetScore> = targets.iter().filter_map(find).collect();
            let Some(overall) = score::summary(own.iter().copied(), &tracker.seeds) else {
                continue;
            };
            let look = Look::FIRST; // until the ranking is known
            entrants.push(Entrant {
                name: &tracker.name,
                seeds: &tracker.seeds,
                targets: own,
                overall,
                look,
            });
        }
        if entrants.is_empty() {
            return nothing("no tracker has a seed that all of its targets have".to_string());
        }
        entrants.sort_by(|a, b| b.overall.auc.mean.total_cmp(&a.overall.auc.mean));
        let first =
            shown.first().and_then(|name| entrants.iter().position(|entrant| entrant.name == name));
        let about = first.unwrap_or(0);
        give_looks(&mut entrants, about, shown);
        Ok(Self { kind, targets, entrants, about, notes })
    }

    /// How many targets there are, in words.
    pub fn size(&self) -> String {
        let count = self.targets.len();
        format!("{count} target{}", if count == 1 { "" } else { "s" })
    }

    /// The tracker that the report is about.
    pub fn about(&self) -> &Entrant<'a> {
        &self.entrants[self.about]
    }

    /// Whether the plots are to name it whatever its rank.
    pub fn is_shown(&self, entrant: &Entrant) -> bool {
        entrant.look.strong
    }
}

/// The trackers whose runs begin in the same way, and what to say of the others.
fn of_one_kind<'a>(
    board: &'a Scoreboard,
    shown: &[String],
) -> (Kind, Vec<&'a TrackerScore>, Vec<String>) {
    let first = board.trackers.iter().find(|tracker| shown.first() == Some(&tracker.name));
    let least = board.trackers.iter().map(Kind::of).min().unwrap_or(Kind::Ope);
    let kind = first.map_or(least, Kind::of);
    let (own, others): (Vec<_>, Vec<_>) =
        board.trackers.iter().partition(|tracker| Kind::of(tracker) == kind);
    let note = |tracker: &&TrackerScore| {
        let (theirs, ours) = (Kind::of(tracker).name(), kind.name());
        format!("{} is left out: its runs are {theirs}, those of the report {ours}.", tracker.name)
    };
    let notes = others.iter().map(note).collect();
    (kind, own, notes)
}

/// The targets of the truth that all trackers have results of, and what to say if these are not all that there are.
fn common_targets<'a>(
    trackers: &[&TrackerScore],
    truth: &'a Dataset,
) -> (Vec<&'a str>, Option<String>) {
    let of = |tracker: &&TrackerScore| -> BTreeSet<String> {
        tracker.targets.iter().map(|target| target.target.clone()).collect()
    };
    let sets: Vec<BTreeSet<String>> = trackers.iter().map(of).collect();
    let in_all = |name: &str| sets.iter().all(|set| set.contains(name));
    let in_some = |name: &str| sets.iter().any(|set| set.contains(name));
    let named = truth.sequences.iter().map(|sequence| sequence.name.as_str());
    let (common, rest): (Vec<&str>, Vec<&str>) =
        named.filter(|name| in_some(name)).partition(|name| in_all(name));
    let most = sets.iter().map(BTreeSet::len).max().unwrap_or(0);
    let lacking: Vec<&str> = (trackers.iter().zip(&sets))
        .filter(|(_, set)| set.len() < most)
        .map(|(tracker, _)| tracker.name.as_str())
        .collect();
    let note = format!(
        "Compared on the {} targets that all trackers have. Left out, for lack of results of {}: {}.",
        common.len(),
        names::some_of(&lacking),
        names::some_of(&rest)
    );
    let note = (!rest.is_empty()).then_some(note);
    (common, note)
}

fn give_looks(entrants: &mut [Entrant], about: usize, shown: &[String]) {
    let mut k = 0;
    for (place, entrant) in entrants.iter_mut().enumerate() {
        entrant.look = if place == about {
            Look::FIRST
        } else {
            k += 1;
            Look::other(k - 1, shown.iter().any(|name| name == entrant.name))
        };
    }
}
