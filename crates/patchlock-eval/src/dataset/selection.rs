//! Which targets of a dataset are meant, by their names and their attributes.

use super::{Dataset, Remark, Sequence, Severity};
use crate::names::{self, near_matches};

/// Targets that a dataset does not have.
#[derive(Debug, thiserror::Error)]
pub enum SelectionError {
    /// No target has this name.
    #[error("--sequences: the dataset has no target {name}")]
    Name {
        /// The name.
        name: String,
        /// Names that could be meant.
        near: Vec<String>,
    },
    /// No target has this attribute.
    #[error("--attributes: no target of the dataset has the attribute {attribute}")]
    Attribute {
        /// The attribute.
        attribute: String,
        /// Those that they have.
        known: Vec<String>,
    },
    /// No target has both one of the names and one of the attributes.
    #[error("no target is left: none of the --sequences has one of the --attributes")]
    Nothing,
}

impl SelectionError {
    /// One line: what to do next.
    pub fn advice(&self) -> String {
        match self {
            Self::Name { near, .. } if near.is_empty() => {
                "patchlock dataset DIR lists them".to_string()
            }
            Self::Name { near, .. } => format!("did you mean {}?", near.join(" or ")),
            Self::Attribute { known, .. } if known.is_empty() => {
                "nothing is known of its attributes; attributes.csv beside it may list them"
                    .to_string()
            }
            Self::Attribute { known, .. } => format!("they have {}", known.join(", ")),
            Self::Nothing => {
                "patchlock dataset DIR lists the targets with their attributes".to_string()
            }
        }
    }
}

/// What is left of a dataset.
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
///
/// # Errors
/// [`SelectionError`].
pub fn choose<'a>(
    dataset: &'a Dataset,
    wanted: &[String],
    attributes: &[String],
) -> Result<Selection<'a>, SelectionError> {
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
        return Err(SelectionError::Nothing);
    }
    Ok(Selection { sequences, without_truth })
}

fn check_names(
    dataset: &Dataset,
    without_truth: &[&Remark],
    wanted: &[String],
) -> Result<(), SelectionError> {
    let targets = || dataset.sequences.iter().map(|sequence| sequence.name.as_str());
    let known = || targets().chain(without_truth.iter().filter_map(|r| r.target.as_deref()));
    let Some(strange) = wanted.iter().find(|name| !known().any(|target| means(name, target)))
    else {
        return Ok(());
    };
    let near = near_matches(strange, targets()).into_iter().map(str::to_string).collect();
    Err(SelectionError::Name { name: strange.clone(), near })
}

fn check_attributes(dataset: &Dataset, attributes: &[String]) -> Result<(), SelectionError> {
    let occurs = |attribute: &String| dataset.sequences.iter().any(|s| has(s, attribute));
    let Some(strange) = attributes.iter().find(|attribute| !occurs(attribute)) else {
        return Ok(());
    };
    let mut known: Vec<String> =
        dataset.sequences.iter().flat_map(|s| &s.attributes).cloned().collect();
    known.sort_unstable();
    known.dedup();
    Err(SelectionError::Attribute { attribute: strange.clone(), known })
}
