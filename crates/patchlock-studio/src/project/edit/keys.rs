//! Edits of key frames.

use super::targets::target_mut;
use super::tracks::change_frames;
use super::{Edit, Frames, Key, Project, Result, check};

pub fn set_key(project: &mut Project, id: u64, frame: usize, key: Key) -> Result<Vec<Edit>> {
    check::frame(frame, &project.video)?;
    check::key(&key, &project.video)?;
    let mut new = Frames::default();
    new.keys.insert(frame, key);
    Ok(change_frames(target_mut(project, id)?, [frame; 2], |_| new))
}

pub fn remove_key(project: &mut Project, id: u64, frame: usize) -> Result<Vec<Edit>> {
    let target = target_mut(project, id)?;
    ensure!(target.keys.contains_key(&frame), "target {id} has no key in frame {frame}");
    Ok(change_frames(target, [frame; 2], |_| Frames::default()))
}
