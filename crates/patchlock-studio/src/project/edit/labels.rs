//! Edits of labels.

use super::{Edit, Label, Project, Result, attributes, check, limits, refused};

/// The list of labels after an edit of it, whichever targets there are.
pub fn after(mut labels: Vec<Label>, edit: &Edit) -> Result<Vec<Label>> {
    match edit.clone() {
        Edit::AddLabel { name, colour, at } => drop(add(&mut labels, name, colour, at)?),
        Edit::SetLabel { name, new_name, colour } => {
            drop(set(&mut labels, &name, new_name, colour)?);
        }
        Edit::Declare { label, attributes } => {
            drop(attributes::declare(&mut labels, &label, attributes)?);
        }
        Edit::RemoveLabel { name } => {
            let index = label_index(&labels, &name)?;
            labels.remove(index);
        }
        _ => return Err(refused("it is no edit of labels")),
    }
    Ok(labels)
}

pub fn add_label(
    project: &mut Project,
    name: String,
    colour: Option<String>,
    at: Option<usize>,
) -> Result<Vec<Edit>> {
    add(&mut project.labels, name, colour, at)
}

fn add(
    labels: &mut Vec<Label>,
    name: String,
    colour: Option<String>,
    at: Option<usize>,
) -> Result<Vec<Edit>> {
    let count = labels.len();
    let mut label = Label::new(name, count);
    label.colour = colour.unwrap_or(label.colour);
    check::label(&label).map_err(refused)?;
    unused_label(labels, &label.name)?;
    if count >= limits::LABELS {
        return Err(refused(format!("there are {count} labels, and may not be more")));
    }
    let at = at.unwrap_or(count);
    if at > count {
        return Err(refused(format!("the place is {at}; allowed: 0 to {count}")));
    }
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
    check::label(&new).map_err(refused)?;
    if new.name != name {
        unused_label(labels, &new.name)?;
    }
    let old = std::mem::replace(&mut labels[index], new.clone());
    Ok((old, new))
}

pub fn remove_label(project: &mut Project, name: &str) -> Result<Vec<Edit>> {
    let index = label_index(&project.labels, name)?;
    let users = project.targets.iter().filter(|target| target.label == name).count();
    if users > 0 {
        return Err(refused(format!(
            "the label {name:?} cannot be removed: {users} targets have it"
        )));
    }
    let Label { name, colour, attributes } = project.labels.remove(index);
    let declare = Edit::Declare { label: name.clone(), attributes };
    Ok(vec![Edit::AddLabel { name, colour: Some(colour), at: Some(index) }, declare])
}

fn label_index(labels: &[Label], name: &str) -> Result<usize> {
    check::known_label(name, labels).map_err(refused)?;
    let index = labels.iter().position(|label| label.name == name);
    index.ok_or_else(|| refused("there is no such label"))
}

fn unused_label(labels: &[Label], name: &str) -> Result<()> {
    match labels.iter().any(|label| label.name == name) {
        true => Err(refused(format!("there is a label {name:?} already"))),
        false => Ok(()),
    }
}
