//! Edits of labels.

use super::{Edit, Error, Label, Project, Result, attributes, check, limits};

/// The list of labels after an edit of it, whichever targets there are.
///
/// # Errors
/// [`Error::Edit`] if the edit is not possible, or no edit of labels.
pub fn after(mut labels: Vec<Label>, edit: &Edit) -> std::result::Result<Vec<Label>, Error> {
    let changed = match edit.clone() {
        Edit::AddLabel { name, colour, at } => add(&mut labels, name, colour, at).map(drop),
        Edit::SetLabel { name, new_name, colour } => {
            set(&mut labels, &name, new_name, colour).map(drop)
        }
        Edit::Declare { label, attributes } => {
            attributes::declare(&mut labels, &label, attributes).map(drop)
        }
        Edit::RemoveLabel { name } => label_index(&labels, &name).map(|at| drop(labels.remove(at))),
        _ => Err("it is no edit of labels".to_owned()),
    };
    changed.map(|()| labels).map_err(Error::Edit)
}

pub fn add(
    labels: &mut Vec<Label>,
    name: String,
    colour: Option<String>,
    at: Option<usize>,
) -> Result<Vec<Edit>> {
    let count = labels.len();
    let mut label = Label::new(name, count);
    label.colour = colour.unwrap_or(label.colour);
    check::label(&label)?;
    unused_label(labels, &label.name)?;
    ensure!(count < limits::LABELS, "there are {count} labels, and may not be more");
    let at = at.unwrap_or(count);
    ensure!(at <= count, "the place is {at}; allowed: 0 to {count}");
    let name = label.name.clone();
    labels.insert(at, label);
    Ok(vec![Edit::RemoveLabel { name }])
}

pub fn set_label(
    project: &mut Project,
    name: String,
    new_name: Option<String>,
    colour: Option<String>,
) -> Result<Vec<Edit>> {
    let (old, new) = set(&mut project.labels, &name, new_name.clone(), colour.clone())?;
    for target in project.targets.iter_mut().filter(|target| target.label == name) {
        target.label.clone_from(&new.name);
    }
    Ok(vec![Edit::SetLabel {
        name: new.name,
        new_name: new_name.map(|_| name),
        colour: colour.map(|_| old.colour),
    }])
}

/// Changes a label of the list; returns it as it was and as it is.
fn set(
    labels: &mut [Label],
    name: &str,
    new_name: Option<String>,
    colour: Option<String>,
) -> Result<(Label, Label)> {
    let index = label_index(labels, name)?;
    let old = &labels[index];
    let new = Label {
        name: new_name.unwrap_or_else(|| name.to_owned()),
        colour: colour.unwrap_or_else(|| old.colour.clone()),
        attributes: old.attributes.clone(),
    };
    check::label(&new)?;
    if new.name != name {
        unused_label(labels, &new.name)?;
    }
    let old = std::mem::replace(&mut labels[index], new.clone());
    Ok((old, new))
}

pub fn remove_label(project: &mut Project, name: &str) -> Result<Vec<Edit>> {
    let index = label_index(&project.labels, name)?;
    let users = project.targets.iter().filter(|target| target.label == name).count();
    ensure!(users == 0, "the label {name:?} cannot be removed: {users} targets have it");
    let Label { name, colour, attributes } = project.labels.remove(index);
    let declare = Edit::Declare { label: name.clone(), attributes };
    Ok(vec![Edit::AddLabel { name, colour: Some(colour), at: Some(index) }, declare])
}

fn label_index(labels: &[Label], name: &str) -> Result<usize> {
    check::known_label(name, labels)?;
    let index = labels.iter().position(|label| label.name == name);
    index.ok_or_else(|| "there is no such label".to_owned())
}

fn unused_label(labels: &[Label], name: &str) -> Result<()> {
    ensure!(labels.iter().all(|label| label.name != name), "there is a label {name:?} already");
    Ok(())
}
