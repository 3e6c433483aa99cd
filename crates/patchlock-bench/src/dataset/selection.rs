//! Selects targets of a dataset by name and attribute.

use super::{Dataset, Remark, Sequence, Severity};
use crate::Error;
use patchlock_track::names::{self, near_matches};

/// The selected part of a dataset.
pub struct Selection<'a> {
    /// The targets.
    pub sequences: Vec<&'a Sequence>,
    /// The selected targets that cannot be used because their ground truth is invalid.
    pub without_truth: Vec<&'a Remark>,
}

/// Whether a name selects a target: its own name, or that of a sequence with several targets.
fn selects(wanted: &str, target: &str) -> bool {
    let whole = target.rsplit_once('.').map_or("", |(whole, _)| whole);
    names::same(wanted, target) || names::same(wanted, whole)
}

fn has(sequence: &Sequence, attribute: &str) -> bool {
    sequence.attributes.iter().any(|own| own.eq_ignore_ascii_case(attribute))
}

/// Selects the targets with one of the names (all if empty) and one of the attributes (any if
/// empty).
///
/// # Errors
/// [`Error::NoTarget`], [`Error::NoAttribute`], [`Error::NothingSelected`].
pub fn choose<'a>(
    dataset: &'a Dataset,
    wanted: &[String],
    attributes: &[String],
) -> Result<Selection<'a>, Error> {
    let named = |target: &str| wanted.is_empty() || wanted.iter().any(|name| selects(name, target));
    let without_truth = dataset.remarks.iter().filter(|remark| {
        remark.severity == Severity::NoTruth && remark.target.as_deref().is_some_and(named)
    });
    let without_truth: Vec<&Remark> = without_truth.collect();
    check_names(dataset, &without_truth, wanted)?;
    check_attributes(dataset, attributes)?;
    let fits = |sequence: &&Sequence| {
        attributes.is_empty() || attributes.iter().any(|attribute| has(sequence, attribute))
    };
    let sequences = dataset.sequences.iter().filter(|sequence| named(&sequence.name)).filter(fits);
    let sequences: Vec<&Sequence> = sequences.collect();
    if sequences.is_empty() && without_truth.is_empty() {
        return Err(Error::NothingSelected);
    }
    Ok(Selection { sequences, without_truth })
}

fn check_names(
    dataset: &Dataset,
    without_truth: &[&Remark],
    wanted: &[String],
) -> Result<(), Error> {
    let targets = || dataset.sequences.iter().map(|sequence| sequence.name.as_str());
    let known = || targets().chain(without_truth.iter().filter_map(|r| r.target.as_deref()));
    let Some(unknown) = wanted.iter().find(|name| !known().any(|target| selects(name, target)))
    else {
        return Ok(());
    };
    let near = near_matches(unknown, targets()).into_iter().map(str::to_string).collect();
    Err(Error::NoTarget(unknown.clone(), near))
}

fn check_attributes(dataset: &Dataset, attributes: &[String]) -> Result<(), Error> {
    let occurs = |attribute: &String| dataset.sequences.iter().any(|s| has(s, attribute));
    let Some(unknown) = attributes.iter().find(|attribute| !occurs(attribute)) else {
        return Ok(());
    };
    let mut known: Vec<String> =
        dataset.sequences.iter().flat_map(|s| &s.attributes).cloned().collect();
    known.sort_unstable();
    known.dedup();
    Err(Error::NoAttribute(unknown.clone(), known))
}
