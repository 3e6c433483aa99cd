//! Edits of what labels declare, and of the values that targets have.

use std::collections::BTreeMap;

use super::targets::{index_of, target_mut};
use super::{Attribute, Changes, Edit, Label, Project, Result, Target, check};

/// Replaces the attributes of a label.
pub fn declare(labels: &mut [Label], name: &str, attributes: Vec<Attribute>) -> Result<Vec<Edit>> {
    check::known_label(name, labels)?;
    let mut labels = labels.iter_mut().filter(|label| label.name == name);
    let Some(label) = labels.next() else { return Ok(Vec::new()) };
    let new = Label { attributes: attributes.clone(), ..label.clone() };
    check::label(&new)?;
    let before = std::mem::replace(&mut label.attributes, attributes);
    Ok(vec![Edit::Declare { label: name.to_owned(), attributes: before }])
}

/// Gives an attribute of a target's label a value, or takes it back.
pub fn set_value(
    project: &mut Project,
    id: u64,
    name: String,
    frame: Option<usize>,
    value: Option<String>,
) -> Result<Vec<Edit>> {
    if let Some(frame) = frame {
        check::frame(frame, &project.video)?;
    }
    let mut new = without_boxes(&project.targets[index_of(project, id)?]);
    let declared = project.declared(&new.label);
    let attribute = declared.iter().find(|attribute| attribute.name == name);
    let attribute = attribute.ok_or_else(|| unknown(&new.label, &name, declared))?;
    if let Some(value) = &value {
        attribute.allows(value)?;
    }
    ensure!(
        attribute.mutable || frame.is_none(),
        "the attribute {name:?} is the same in all frames; leave out the frame, or let its label \
         declare it as mutable"
    );
    match (frame, value) {
        (Some(frame), value) => change(&mut new, attribute, frame, value)?,
        (None, Some(value)) => drop(new.attributes.insert(name, value)),
        (None, None) => drop(new.attributes.remove(&name)),
    }
    set_values(project, id, new.attributes, new.changes)
}

/// What is said of the whole target.
pub fn without_boxes(target: &Target) -> Target {
    let (attributes, changes) = (target.attributes.clone(), target.changes.clone());
    Target { attributes, changes, ..Target::new(target.id, target.label.clone()) }
}

/// A value that holds already is no change.
fn change(
    target: &mut Target,
    attribute: &Attribute,
    frame: usize,
    value: Option<String>,
) -> Result<()> {
    let name = &attribute.name;
    let changes = target.changes.entry(name.clone()).or_default();
    ensure!(
        changes.0.remove(&frame).is_some() || value.is_some(),
        "the attribute {name:?} does not change in frame {frame}; there is nothing to take back"
    );
    if let Some(value) = value.filter(|value| target.value(attribute, frame) != value) {
        target.changes.entry(name.clone()).or_default().0.insert(frame, value);
    }
    target.changes.retain(|_, changes| !changes.0.is_empty());
    Ok(())
}

fn unknown(label: &str, name: &str, declared: &[Attribute]) -> String {
    let known: Vec<&str> = declared.iter().map(|attribute| attribute.name.as_str()).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    format!("the label {label:?} declares no attribute {name:?}; it declares {known}")
}

/// Replaces all values of a target, also by those that its label does not allow: they may have been
/// there before the label was changed.
pub fn set_values(
    project: &mut Project,
    id: u64,
    attributes: BTreeMap<String, String>,
    changes: BTreeMap<String, Changes>,
) -> Result<Vec<Edit>> {
    check::attributes(&attributes)?;
    check::changes(&changes, &project.video)?;
    let target = target_mut(project, id)?;
    let attributes = std::mem::replace(&mut target.attributes, attributes);
    let changes = std::mem::replace(&mut target.changes, changes);
    Ok(vec![Edit::SetValues { target: id, attributes, changes }])
}
