//! Which boxes of a track are written, and the count of the others.

use patchlock::Status;

use super::format::{Format, Purpose};
use super::track::{Entry, Track};
use crate::Error;

/// Which boxes are written. Those that a person has drawn meet `status` and `min_score`, and so do
/// boxes of which these are not known.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The statuses whose boxes are written; `None` for those of [`Format::statuses`].
    pub status: Option<Vec<Status>>,
    /// The least score of the boxes, 0 to 1.
    pub min_score: Option<f64>,
    /// Only frames whose number is a multiple of this are written, 1 for all. Formats with key
    /// frames have all frames.
    pub every: usize,
}

impl Default for Selection {
    fn default() -> Self {
        Self { status: None, min_score: None, every: 1 }
    }
}

impl Selection {
    /// The statuses in a text with commas between their names.
    ///
    /// # Errors
    /// [`Error::Export`] if a name is not that of a status.
    pub fn statuses(text: &str) -> Result<Vec<Status>, Error> {
        let all = [Status::Tracked, Status::Uncertain, Status::Lost];
        let named = |name: &str| {
            let found = all.into_iter().find(|status| status.name() == name.trim());
            found.ok_or_else(|| {
                Error::Export(format!(
                    "there is no status {name:?}; allowed: {}, or several with commas between them",
                    Status::NAMES.join(", ")
                ))
            })
        };
        text.split(',').map(named).collect()
    }

    /// Checks whether the format can have such a selection.
    pub(super) fn check(&self, format: &Format) -> Result<(), Error> {
        let refused = |reason: String| Err(Error::Export(reason));
        let name = format.name;
        if self.every == 0 {
            return refused("every 0th frame cannot be written; allowed: 1 or more".to_owned());
        }
        if self.every > 1 && format.has_key_frames {
            return refused(format!(
                "{name} cannot have every {}th frame: the tool shows all frames, and interpolates \
                 between key frames, of which there can be fewer",
                self.every
            ));
        }
        if let Some(score) = self.min_score.filter(|score| !(0.0..=1.0).contains(score)) {
            return refused(format!("the least score is {score}; allowed: 0 to 1"));
        }
        match &self.status {
            Some(status) if status.is_empty() => {
                refused(format!("no status is given; allowed: {}", Status::NAMES.join(", ")))
            }
            Some(status) if status.contains(&Status::Lost) && format.lost.is_none() => {
                refused(format!(
                    "{name} cannot mark lost targets: frames in which a target is lost are always left \
                     out of it. The statuses for it are tracked and uncertain"
                ))
            }
            _ => Ok(()),
        }
    }

    /// Why an entry is left out, if it is.
    fn reason(&self, entry: &Entry, statuses: &[Status]) -> Option<Reason> {
        if !entry.frame.is_multiple_of(self.every) {
            return Some(Reason::Between);
        }
        if entry.manual.is_some() {
            return None;
        }
        // Without a box, nobody knows where the target is.
        let status = entry.status.or(entry.bbox.is_none().then_some(Status::Lost));
        if let Some(status) = status.filter(|status| !statuses.contains(status)) {
            return Some(Reason::Status(status));
        }
        let least = self.min_score.unwrap_or(0.0);
        entry.score.is_some_and(|score| score < least).then_some(Reason::Score)
    }

    /// The entries of a track that are written in a format, and the count of all boxes. Of a format
    /// with whole frames, those of a frame are written together or not at all.
    pub(super) fn of(&self, track: &Track, format: &Format) -> (Track, Counts) {
        let statuses = self.status.as_deref().unwrap_or(format.statuses());
        let reasons = track.entries().iter().map(|entry| (entry, self.reason(entry, statuses)));
        let reasons: Vec<(&Entry, Option<Reason>)> = reasons.collect();
        let left = reasons.iter().filter(|(_, reason)| reason.is_some());
        let whole = format.purpose != Purpose::Exchange;
        let frames: Vec<usize> = left.filter(|_| whole).map(|(entry, _)| entry.frame).collect();
        let mut counts = Counts::default();
        let mut kept = Vec::new();
        for (entry, reason) in reasons {
            let is_left = || frames.binary_search(&entry.frame).is_ok();
            let beside = || is_left().then_some(Reason::Beside);
            let reason = reason.or_else(beside);
            if entry.bbox.is_some() {
                counts.add(entry, reason);
            }
            if reason.is_none() {
                kept.push(*entry);
            }
        }
        (track.with_entries(kept), counts)
    }
}

/// Why a box is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reason {
    /// Its frame is not one of every so many.
    Between,
    Status(Status),
    Score,
    /// Another box of its frame is left out.
    Beside,
}

/// How many boxes of a track are written, and how many are not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Boxes that are written.
    pub boxes: usize,
    /// Boxes that are written although the tracker was uncertain of them.
    pub uncertain: usize,
    /// Boxes of lost targets that are written, with the mark of the format.
    pub lost: usize,
    /// Boxes that are left out, by their status: tracked, uncertain and lost.
    pub left_by_status: [usize; 3],
    /// Boxes that are left out because of their score.
    pub left_by_score: usize,
    /// Boxes that are left out because another one of their frame is.
    pub left_beside: usize,
    /// Boxes of the frames between those that are written.
    pub left_between: usize,
}

impl Counts {
    fn add(&mut self, entry: &Entry, reason: Option<Reason>) {
        let count = match reason {
            Some(Reason::Between) => &mut self.left_between,
            Some(Reason::Status(status)) => &mut self.left_by_status[status as usize],
            Some(Reason::Score) => &mut self.left_by_score,
            Some(Reason::Beside) => &mut self.left_beside,
            None => &mut self.boxes,
        };
        *count += 1;
        if reason.is_none() && entry.manual.is_none() {
            match entry.status {
                Some(Status::Uncertain) => self.uncertain += 1,
                Some(Status::Lost) => self.lost += 1,
                Some(Status::Tracked) | None => {}
            }
        }
    }

    /// Adds those of another track.
    #[must_use]
    pub(super) fn plus(mut self, other: Self) -> Self {
        self.boxes += other.boxes;
        self.uncertain += other.uncertain;
        self.lost += other.lost;
        let statuses = self.left_by_status.iter_mut().zip(other.left_by_status);
        statuses.for_each(|(count, more)| *count += more);
        self.left_by_score += other.left_by_score;
        self.left_beside += other.left_beside;
        self.left_between += other.left_between;
        self
    }

    /// The number of boxes that are left out.
    pub fn left_out(&self) -> usize {
        let Self { left_by_status, left_by_score, left_beside, left_between, .. } = self;
        left_by_status.iter().sum::<usize>() + left_by_score + left_beside + left_between
    }

    /// What is left out, and what of the rest is doubtful: sentences without a full stop.
    pub fn remarks(&self) -> Vec<String> {
        let [tracked, uncertain, lost] = self.left_by_status;
        let left = [
            (uncertain, "uncertain"),
            (lost, "lost"),
            (tracked, "tracked"),
            (self.left_by_score, "with a lower score"),
            (self.left_beside, "beside one of these in the same frame"),
            (self.left_between, "in the frames between"),
        ];
        let doubtful = [(self.uncertain, "uncertain"), (self.lost, "lost")];
        let left = listed(&left).map(|list| {
            let all = self.boxes + self.left_out();
            format!("left out {} of {all} boxes: {list}", self.left_out())
        });
        let doubtful = listed(&doubtful)
            .map(|list| format!("doubtful among the {} boxes written: {list}", self.boxes));
        left.into_iter().chain(doubtful).collect()
    }
}

/// The counts that are not 0, with their words; `None` if all are.
fn listed(counts: &[(usize, &str)]) -> Option<String> {
    let parts = counts.iter().filter(|(count, _)| *count > 0);
    let parts: Vec<String> = parts.map(|(count, what)| format!("{count} {what}")).collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}
