//! Edits of what a reviewer says.

use super::{Edit, Project, Remark, Result, ReviewDecision, check, limits};

pub fn add(project: &mut Project, remark: Remark) -> Result<Vec<Edit>> {
    let mut remarks = project.remarks.clone();
    let replaces = |old: &Remark| match remark.verdict {
        ReviewDecision::Accepted => remark.target.is_some(),
        ReviewDecision::Rejected => {
            remark.target.is_some() && old.verdict == ReviewDecision::Accepted
        }
        ReviewDecision::Comment => false,
    };
    remarks.retain(|old| old.target != remark.target || !replaces(old));
    // An id may be used again when the last remark is removed: nothing refers to it.
    let id = project.remarks.last().map_or(0, |last| last.id) + 1;
    remarks.push(Remark { id, ..remark });
    set(project, remarks)
}

pub fn remove(project: &mut Project, id: u64) -> Result<Vec<Edit>> {
    let mut remarks = project.remarks.clone();
    remarks.retain(|remark| remark.id != id);
    ensure!(remarks.len() < project.remarks.len(), "there is no remark {id}");
    set(project, remarks)
}

pub fn set(project: &mut Project, remarks: Vec<Remark>) -> Result<Vec<Edit>> {
    check::at_most("remarks", remarks.len(), limits::REMARKS)?;
    if !remarks.is_sorted_by(|a, b| a.id < b.id) {
        return Err("the ids of the remarks are not in order, or appear twice".to_owned());
    }
    remarks.iter().try_for_each(|it| check::remark(it, project))?;
    let before = std::mem::replace(&mut project.remarks, remarks);
    Ok(vec![Edit::SetRemarks { remarks: before }])
}

/// Takes out what was said of a target that goes; returns the edit that puts it back.
pub fn without(project: &mut Project, target: u64) -> Option<Edit> {
    let before = project.remarks.clone();
    project.remarks.retain(|remark| remark.target != Some(target));
    let changed = project.remarks.len() != before.len();
    changed.then_some(Edit::SetRemarks { remarks: before })
}
