//! Edits of labels.

use super::{Edit, Label, Project, Result, check, limits, refused};

pub fn add_label(
    project: &mut Project,
    name: String,
    colour: Option<String>,
    at: Option<usize>,
) -> Result<Vec<Edit>> {
    let count = project.labels.len();
    let mut label = Label::new(name, count);
    label.colour = colour.unwrap_or(label.colour);
    check::label(&label).map_err(refused)?;
    unused_label(project, &label.name)?;
    if count >= limits::LABELS {
        return Err(refused(format!("there are {count} labels, and may not be more")));
    }
    let at = at.unwrap_or(count);
    if at > count {
        return Err(refused(format!("the place is {at}; allowed: 0 to {count}")));
    }
    let name = label.name.clone();
    project.labels.insert(at, label);
    Ok(vec![Edit::RemoveLabel { name }])
}

pub fn set_label(
    project: &mut Project,
    name: String,
    new_name: Option<String>,
    colour: Option<String>,
) -> Result<Vec<Edit>> {
    let index = label_index(project, &name)?;
    let old = &project.labels[index];
    let new = Label {
        name: new_name.clone().unwrap_or_else(|| name.clone()),
        colour: colour.clone().unwrap_or_else(|| old.colour.clone()),
    };
    check::label(&new).map_err(refused)?;
    if new.name != name {
        unused_label(project, &new.name)?;
    }
    for target in project.targets.iter_mut().filter(|target| target.label == name) {
        target.label.clone_from(&new.name);
    }
    let now = new.name.clone();
    let old = std::mem::replace(&mut project.labels[index], new);
    Ok(vec![Edit::SetLabel {
        name: now,
        new_name: new_name.map(|_| name),
        colour: colour.map(|_| old.colour),
    }])
}

pub fn remove_label(project: &mut Project, name: &str) -> Result<Vec<Edit>> {
    let index = label_index(project, name)?;
    let users = project.targets.iter().filter(|target| target.label == name).count();
    if users > 0 {
        return Err(refused(format!(
            "the label {name:?} cannot be removed: {users} targets have it"
        )));
    }
    let Label { name, colour } = project.labels.remove(index);
    Ok(vec![Edit::AddLabel { name, colour: Some(colour), at: Some(index) }])
}

fn label_index(project: &Project, name: &str) -> Result<usize> {
    check::known_label(name, &project.labels).map_err(refused)?;
    let index = project.labels.iter().position(|label| label.name == name);
    index.ok_or_else(|| refused("there is no such label"))
}

fn unused_label(project: &Project, name: &str) -> Result<()> {
    match project.labels.iter().any(|label| label.name == name) {
        true => Err(refused(format!("there is a label {name:?} already"))),
        false => Ok(()),
    }
}
