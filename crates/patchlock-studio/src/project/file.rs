//! The text of a project file. `docs/project-file.md` describes it.

use std::collections::BTreeMap;
use std::io::{self, Write as _};
use std::path::Path;

use patchlock::{BoundingBox, Status};
use patchlock_track::files::folder_of;
use serde::{Deserialize, Serialize};

use super::{
    Changes, Error, Key, Label, Project, Remark, Target, TrackedBox, Video, by_frame, check,
};

/// The newest version that is read. It is written of projects with outlines. Those with attributes
/// that labels declare, or that change from frame to frame, are of version 3, those with remarks of
/// version 2, others of version 1: older programs read what they know.
pub const VERSION: u64 = 4;
/// The first member of every project file.
const FORMAT: &str = "patchlock-project";

/// What says whether a text is a project, and of which version.
#[derive(Deserialize)]
struct Head {
    format: Option<String>,
    version: Option<u64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "version")]
    _version: u64,
    #[serde(default)]
    revision: u64,
    #[serde(default)]
    done: bool,
    video: Video,
    labels: Vec<Label>,
    next_id: Option<u64>,
    targets: Vec<TargetForm>,
    #[serde(default)]
    remarks: Vec<Remark>,
}

/// A target, with its tracked boxes in columns.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetForm {
    id: u64,
    label: String,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    attributes: BTreeMap<String, String>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    changes: BTreeMap<String, Changes>,
    #[serde(default, with = "by_frame")]
    keys: BTreeMap<usize, Key>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    hidden: Vec<[usize; 2]>,
    #[serde(default)]
    tracked: Vec<Run>,
}

/// Consecutive frames with tracked boxes: one element of each column per frame.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    from: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    w: Vec<f64>,
    h: Vec<f64>,
    score: Vec<f64>,
    /// One letter per frame.
    status: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    visible: Option<Vec<Option<f64>>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    agreement: Option<Vec<Option<f64>>>,
}

/// The text of a project: one line per target, so that a change of one is a change of one line.
pub fn write(project: &Project, revision: u64) -> serde_json::Result<Vec<u8>> {
    let Project { video, labels, targets, next_id, done, remarks } = project;
    let mut out = format!("{{\n  \"format\": \"{FORMAT}\"").into_bytes();
    member(&mut out, "version", &version_of(project))?;
    member(&mut out, "revision", &revision)?;
    if *done {
        member(&mut out, "done", done)?;
    }
    member(&mut out, "video", video)?;
    member(&mut out, "labels", labels)?;
    member(&mut out, "next_id", next_id)?;
    out.extend_from_slice(b",\n  \"targets\": [");
    for (k, target) in targets.iter().enumerate() {
        out.extend_from_slice(if k == 0 { b"\n    " } else { b",\n    " });
        serde_json::to_writer(&mut out, &TargetForm::from(target))?;
    }
    out.extend_from_slice(if targets.is_empty() { b"]" } else { b"\n  ]" });
    if !remarks.is_empty() {
        member(&mut out, "remarks", remarks)?;
    }
    out.extend_from_slice(b"\n}\n");
    Ok(out)
}

/// Adds a member after others, on a line of its own.
fn member(out: &mut Vec<u8>, name: &str, value: &impl Serialize) -> serde_json::Result<()> {
    out.extend_from_slice(format!(",\n  \"{name}\": ").as_bytes());
    serde_json::to_writer(out, value)
}

/// The oldest version that has all of a project.
fn version_of(project: &Project) -> u64 {
    let declares = project.labels.iter().any(|label| !label.attributes.is_empty());
    if project.targets.iter().any(Target::has_outlines) {
        VERSION
    } else if declares || project.targets.iter().any(|target| !target.changes.is_empty()) {
        3
    } else if project.remarks.is_empty() {
        1
    } else {
        2
    }
}

/// The project and revision of the text of a file, checked.
pub fn read(path: &Path, text: &[u8]) -> Result<(Project, u64), Error> {
    let invalid = |reason: String| Error::Invalid { path: path.to_path_buf(), reason };
    let not_json = |error: serde_json::Error| invalid(error.to_string());
    let head: Head = serde_json::from_slice(text).map_err(not_json)?;
    if head.format.as_deref() != Some(FORMAT) {
        return Err(invalid(format!("its member `format` is not {FORMAT:?}")));
    }
    match head.version {
        Some(1..=VERSION) => {}
        Some(version) => return Err(Error::Version { path: path.to_path_buf(), version }),
        None => return Err(invalid("it has no member `version`".to_owned())),
    }
    let document: Document = serde_json::from_slice(text).map_err(not_json)?;
    let Document { revision, done, video, labels, next_id, targets, remarks, .. } = document;
    check::video(&video).map_err(invalid)?;
    let targets = targets.into_iter().map(|target| target.read(video.frames));
    let targets = targets.collect::<Result<Vec<Target>, String>>().map_err(invalid)?;
    let largest = targets.iter().map(|target| target.id).max().unwrap_or(0);
    let next_id = next_id.unwrap_or(largest.saturating_add(1));
    let project = Project { video, labels, targets, next_id, done, remarks };
    check::project(&project).map_err(invalid)?;
    Ok((project, revision))
}

impl From<&Target> for TargetForm {
    fn from(target: &Target) -> Self {
        let mut tracked: Vec<Run> = Vec::new();
        for (&frame, entry) in &target.tracked {
            let run = match tracked.last_mut().filter(|run| run.from + run.x.len() == frame) {
                Some(run) => run,
                None => tracked.push_mut(Run { from: frame, ..Run::default() }),
            };
            run.push(entry);
        }
        tracked.iter_mut().for_each(Run::finish);
        Self {
            id: target.id,
            label: target.label.clone(),
            attributes: target.attributes.clone(),
            changes: target.changes.clone(),
            keys: target.keys.clone(),
            hidden: target.hidden.clone(),
            tracked,
        }
    }
}

impl TargetForm {
    fn read(self, frames: usize) -> Result<Target, String> {
        let Self { id, label, attributes, changes, keys, hidden, tracked: runs } = self;
        let mut tracked = BTreeMap::new();
        for run in runs {
            let from = run.from;
            let wrong = |reason| format!("target {id}: tracked boxes from frame {from}: {reason}");
            run.read(frames, &mut tracked).map_err(wrong)?;
        }
        Ok(Target { id, label, attributes, changes, keys, tracked, hidden })
    }
}

impl Run {
    fn push(&mut self, tracked: &TrackedBox) {
        let TrackedBox { bbox: BoundingBox { x, y, w, h }, score, status, visible, agreement } =
            *tracked;
        let columns = [&mut self.x, &mut self.y, &mut self.w, &mut self.h, &mut self.score];
        for (column, value) in columns.into_iter().zip([x, y, w, h, score]) {
            column.push(value);
        }
        self.status.push(letter(status));
        self.visible.get_or_insert_default().push(visible);
        self.agreement.get_or_insert_default().push(agreement);
    }

    /// Drops columns without a value.
    fn finish(&mut self) {
        for column in [&mut self.visible, &mut self.agreement] {
            column.take_if(|column| column.iter().all(Option::is_none));
        }
    }

    fn read(self, frames: usize, into: &mut BTreeMap<usize, TrackedBox>) -> Result<(), String> {
        let count = self.x.len();
        let shares = |column: Option<Vec<Option<f64>>>| column.unwrap_or_else(|| vec![None; count]);
        let (visible, agreement) = (shares(self.visible), shares(self.agreement));
        let lengths = [
            ("y", self.y.len()),
            ("w", self.w.len()),
            ("h", self.h.len()),
            ("score", self.score.len()),
            ("status", self.status.chars().count()),
            ("visible", visible.len()),
            ("agreement", agreement.len()),
        ];
        if let Some((name, length)) = lengths.into_iter().find(|(_, length)| *length != count) {
            return Err(format!("`x` has {count} values and `{name}` has {length}"));
        }
        ensure!(
            self.from.checked_add(count).is_some_and(|end| end <= frames),
            "the {count} frames are not all in the video, which has {frames}"
        );
        for (k, status) in self.status.chars().enumerate() {
            let tracked = TrackedBox {
                bbox: BoundingBox { x: self.x[k], y: self.y[k], w: self.w[k], h: self.h[k] },
                score: self.score[k],
                status: status_of(status)?,
                visible: visible[k],
                agreement: agreement[k],
            };
            let frame = self.from + k;
            ensure!(into.insert(frame, tracked).is_none(), "frame {frame} appears twice");
        }
        Ok(())
    }
}

/// The letter of a status: the first of its name.
fn letter(status: Status) -> char {
    match status {
        Status::Tracked => 't',
        Status::Uncertain => 'u',
        Status::Lost => 'l',
    }
}

fn status_of(letter: char) -> Result<Status, String> {
    match letter {
        't' => Ok(Status::Tracked),
        'u' => Ok(Status::Uncertain),
        'l' => Ok(Status::Lost),
        _ => Err(format!(
            "{letter:?} is not a status; the letters are t (tracked), u (uncertain), l (lost)"
        )),
    }
}

/// Writes a file whole or not at all, also if the process is killed or the power fails.
/// Returns the new file.
pub fn replace(path: &Path, text: &[u8]) -> io::Result<std::fs::File> {
    let folder = folder_of(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut builder = tempfile::Builder::new();
    let prefix = unfinished_prefix(&name);
    builder.prefix(&prefix).suffix(UNFINISHED);
    #[cfg(unix)]
    let permissions = {
        use std::os::unix::fs::PermissionsExt as _;
        let existing = std::fs::metadata(path).map(|about| about.permissions());
        existing.unwrap_or_else(|_| std::fs::Permissions::from_mode(0o666))
    };
    #[cfg(unix)]
    builder.permissions(permissions);
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(text)?;
    file.as_file().sync_all()?;
    let file = file.persist(path).map_err(|error| error.error)?;
    // The new name is on the disk only after this. Folders can't be opened everywhere.
    #[cfg(unix)]
    std::fs::File::open(folder)?.sync_all()?;
    Ok(file)
}

/// The end of the names of files that are being written.
const UNFINISHED: &str = ".unfinished";

fn unfinished_prefix(name: &str) -> String {
    format!(".{name}.")
}

/// Removes what a killed process left behind. Only for the one who holds the lock.
pub fn remove_unfinished(path: &Path) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let prefix = unfinished_prefix(&name);
    let entries = std::fs::read_dir(folder_of(path)).into_iter().flatten();
    for entry in entries.flatten() {
        let other = entry.file_name();
        let other = other.to_string_lossy();
        if other.starts_with(&prefix) && other.ends_with(UNFINISHED) {
            // It is in nobody's way, so an error does not matter.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
