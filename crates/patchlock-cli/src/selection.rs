//! Which targets of a dataset are meant: `--sequences` and `--attributes`.

use patchlock_eval::dataset::{Dataset, Remark, Sequence, Severity};
use patchlock_eval::names;

use crate::complaint::{Complaint, usage};
use crate::settings::near_matches;

/// What the options leave of a dataset.
pub struct Selection<'a> {
    /// The targets.
    pub sequences: Vec<&'a Sequence>,
    /// Why others that are meant can't be used: their truth is wrong.
    pub without_truth: Vec<&'a Remark>,
}

/// Whether a name means a target: its own, or that of a sequence with several targets.
fn means(wanted: &str, target: &str) -> bool {
    let whole = target.rsplit_once('.').map_or("", |(whole, _)| whole);
    names::same(wanted, target) || names::same(wanted, whole)
}

fn has(sequence: &Sequence, attribute: &str) -> bool {
    sequence.attributes.iter().any(|own| own.eq_ignore_ascii_case(attribute))
}

/// The targets of these names, or all, that have one of these attributes, or any.
pub fn choose<'a>(
    dataset: &'a Dataset,
    wanted: &[String],
    attributes: &[String],
) -> Result<Selection<'a>, Complaint> {
    let named = |target: &str| wanted.is_empty() || wanted.iter().any(|name| means(name, target));
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
        let message = "no target is left: none of the --sequences has one of the --attributes";
        return Err(
            usage(message).hint("patchlock dataset DIR lists the targets with their attributes")
        );
    }
    Ok(Selection { sequences, without_truth })
}

fn check_names(
    dataset: &Dataset,
    without_truth: &[&Remark],
    wanted: &[String],
) -> Result<(), Complaint> {
    let targets = || dataset.sequences.iter().map(|sequence| sequence.name.as_str());
    let known = || targets().chain(without_truth.iter().filter_map(|r| r.target.as_deref()));
    let Some(strange) = wanted.iter().find(|name| !known().any(|target| means(name, target)))
    else {
        return Ok(());
    };
    let near = near_matches(strange, targets());
    let advice = match near.is_empty() {
        true => "patchlock dataset DIR lists them".to_string(),
        false => format!("did you mean {}?", near.join(" or ")),
    };
    Err(usage(format!("--sequences: the dataset has no target {strange}")).hint(advice))
}

fn check_attributes(dataset: &Dataset, attributes: &[String]) -> Result<(), Complaint> {
    let occurs = |attribute: &String| dataset.sequences.iter().any(|s| has(s, attribute));
    let Some(strange) = attributes.iter().find(|attribute| !occurs(attribute)) else {
        return Ok(());
    };
    let mut known: Vec<&str> =
        dataset.sequences.iter().flat_map(|s| &s.attributes).map(String::as_str).collect();
    known.sort_unstable();
    known.dedup();
    let advice = match known.is_empty() {
        true => "nothing is known of its attributes; attributes.csv beside it may list them".into(),
        false => format!("they have {}", known.join(", ")),
    };
    Err(usage(format!("--attributes: no target of the dataset has the attribute {strange}"))
        .hint(advice))
}
