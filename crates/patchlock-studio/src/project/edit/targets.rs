//! Edits of whole targets.

use std::collections::BTreeMap;

use super::attributes::{set_values, without_boxes};
use super::{Edit, Key, Label, Project, Result, Target, check, limits, remarks};

pub fn add_target(
    project: &mut Project,
    label: String,
    frame: usize,
    key: Key,
) -> Result<Vec<Edit>> {
    check::known_label(&label, &project.labels)?;
    check::frame(frame, &project.video)?;
    check::key(&key, &project.video)?;
    let id = new_id(project)?;
    let mut target = Target::new(id, label);
    target.keys.insert(frame, key);
    project.targets.push(target);
    Ok(vec![Edit::DeleteTarget { target: id }])
}

pub fn set_target(
    project: &mut Project,
    id: u64,
    label: Option<String>,
    attributes: Option<BTreeMap<String, String>>,
) -> Result<Vec<Edit>> {
    if let Some(label) = &label {
        check::known_label(label, &project.labels)?;
    }
    let mut new = without_boxes(&project.targets[index_of(project, id)?]);
    new.label = label.clone().unwrap_or(new.label);
    if let Some(attributes) = &attributes {
        check::attributes(attributes)?;
        // Changes that another label does not allow stay, and do not count.
        let fixed = Target { attributes: attributes.clone(), ..Target::new(id, new.label.clone()) };
        check::fits(&fixed, project.declared(&new.label))?;
    }
    let target = target_mut(project, id)?;
    let before = std::mem::replace(&mut target.label, new.label);
    let mut undo = Vec::new();
    if let Some(attributes) = attributes {
        undo.extend(set_values(project, id, attributes, new.changes)?);
    }
    if label.is_some() {
        undo.push(Edit::SetTarget { target: id, label: Some(before), attributes: None });
    }
    Ok(undo)
}

pub fn delete_target(project: &mut Project, id: u64) -> Result<Vec<Edit>> {
    let at = index_of(project, id)?;
    let target = project.targets.remove(at);
    let remarks = remarks::without(project, id);
    Ok([Edit::Restore { target, at }].into_iter().chain(remarks).collect())
}

pub fn restore(project: &mut Project, target: Target, at: usize) -> Result<Vec<Edit>> {
    let (id, count) = (target.id, project.targets.len());
    ensure!(project.target(id).is_none(), "there is a target {id} already");
    ensure!(at <= count, "the place is {at}; allowed: 0 to {count}");
    ensure!(count < limits::TARGETS, "there are {count} targets, and may not be more");
    check::target(&target, &project.labels, &project.video)?;
    project.next_id = project.next_id.max(id + 1);
    project.targets.insert(at, target);
    Ok(vec![Edit::DeleteTarget { target: id }])
}

pub fn import(project: &mut Project, targets: Vec<Target>) -> Result<Vec<Edit>> {
    let mut labels = project.labels.clone();
    for target in &targets {
        if !labels.iter().any(|label| label.name == target.label) {
            labels.push(Label::new(target.label.clone(), labels.len()));
        }
    }
    for (k, target) in targets.iter().enumerate() {
        // The id is a new one, so that of the file may be any.
        let target = Target { id: 1, ..target.clone() };
        let declared = labels.iter().find(|label| label.name == target.label);
        let declared = declared.map_or(&[][..], |label| &label.attributes);
        check::target(&target, &labels, &project.video)
            .and_then(|()| check::fits(&target, declared))
            .map_err(|reason| format!("target {} of those to import: {reason}", k + 1))?;
    }
    labels[project.labels.len()..].iter().try_for_each(check::label)?;
    let count = targets.len();
    ensure!(
        labels.len() <= limits::LABELS && project.targets.len() + count <= limits::TARGETS,
        "the project may have {} labels and {} targets; this would be more",
        limits::LABELS,
        limits::TARGETS
    );
    ensure!(project.next_id + count as u64 <= limits::ID, "all ids of targets are used up");
    let mut undo = Vec::new();
    for label in labels.split_off(project.labels.len()) {
        undo.push(Edit::RemoveLabel { name: label.name.clone() });
        project.labels.push(label);
    }
    for target in targets {
        let id = new_id(project)?;
        project.targets.push(Target { id, ..target });
        undo.push(Edit::DeleteTarget { target: id });
    }
    undo.reverse();
    Ok(undo)
}

pub fn index_of(project: &Project, id: u64) -> Result<usize> {
    let index = project.targets.iter().position(|target| target.id == id);
    index.ok_or_else(|| format!("there is no target {id}"))
}

pub fn target_mut(project: &mut Project, id: u64) -> Result<&mut Target> {
    let index = index_of(project, id)?;
    Ok(&mut project.targets[index])
}

/// Takes the next id. The ids may only run out if a file claims so.
pub fn new_id(project: &mut Project) -> Result<u64> {
    ensure!(
        project.targets.len() < limits::TARGETS,
        "the project has {} targets, and may not have more",
        limits::TARGETS
    );
    let id = project.next_id;
    ensure!(id < limits::ID, "all ids of targets are used up");
    project.next_id += 1;
    Ok(id)
}
