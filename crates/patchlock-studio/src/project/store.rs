//! A project with its file.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::{fs, io};

use patchlock_media::{Limits, Note};
use patchlock_track::files::{self, folder_of};
use sha2::{Digest as _, Sha256};

use super::history::History;
use super::lock::Lock;
use super::log::Log;
use super::video::unreadable;
use super::{Edit, Error, Label, PLACEHOLDER, Project, Video, check, file};

/// A project with its file and its history.
///
/// Edits change what is in memory; [`Store::save`] writes it. Nobody else can open the project
/// while the store lives, unless it was opened with [`Store::open_shared`].
#[derive(Debug)]
pub struct Store {
    /// The project file.
    path: PathBuf,
    /// The video, as it can be opened.
    video: PathBuf,
    /// Whether the caller has named the video, as opposed to the file.
    video_given: bool,
    project: Project,
    history: History,
    /// The file of the history, if it is kept.
    log: Option<Log>,
    revision: u64,
    /// The revision in the file; `None` if there is no file yet.
    saved: Option<u64>,
    /// Whether labels have changed since then, which is no step of the history.
    relabelled: bool,
    /// The text that was last read or written, of a shared project.
    text: Vec<u8>,
    lock: Option<Lock>,
    /// What the video may claim.
    limits: Limits,
    /// What a user should know of the frames of the video.
    notes: Vec<Note>,
}

/// The project file of a video, beside it: `clip.patchlock.json` for `clip.mp4`,
/// `frames.patchlock.json` for the folder `frames`. Where that is the project of another video,
/// such as `clip.mov`, or `is_taken` by one, it is `clip.mp4.patchlock.json`.
pub fn beside(video: &Path, is_taken: impl Fn(&Path) -> bool) -> PathBuf {
    // `.` and `..` have no name of their own.
    let whole = video.file_name().is_none().then(|| video.canonicalize().ok()).flatten();
    let video = whole.as_deref().unwrap_or(video);
    let file = |name: Option<&OsStr>| {
        let mut name = name.unwrap_or_default().to_owned();
        name.push(".patchlock.json");
        video.with_file_name(name)
    };
    let long = file(video.file_name());
    if video.is_dir() || long.exists() {
        return long;
    }
    let short = file(video.file_stem());
    if is_taken(&short) || is_of_another(&short, video, |_| true) { long } else { short }
}

/// The project file of a video in a folder for projects of videos from anywhere:
/// `clip.patchlock.json` for `clip.mp4`. Where that `is_taken`, or the project of another video, the
/// name also has a hash of the video's path, such as `clip-0f3a99c1.patchlock.json`. No video gets
/// the project of another of the same name, in whichever order they are opened.
pub fn in_folder(folder: &Path, video: &Path, is_taken: impl Fn(&Path) -> bool) -> PathBuf {
    let real = video.canonicalize().unwrap_or_else(|_| video.to_path_buf());
    // `.` and `..` have no name of their own.
    let named = if video.file_name().is_some() { video } else { real.as_path() };
    let stem = if real.is_dir() { named.file_name() } else { named.file_stem() };
    let stem = stem.unwrap_or_default();
    let file = |end: &str| {
        let mut name = stem.to_owned();
        name.push(end);
        name.push(".patchlock.json");
        folder.join(name)
    };
    let hash = Sha256::digest(real.as_os_str().as_encoded_bytes());
    let hash: String = hash.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
    let (short, long) = (file(""), file(&format!("-{hash}")));
    let is_moved = |project: &Project| project.video.change(&real).is_none();
    let is_taken = |file: &Path| is_taken(file) || is_of_another(file, &real, is_moved);
    if long.exists() || is_taken(&short) { long } else { short }
}

/// Whether a file is the project of another video: of one that exists, or of one that is no longer
/// there and which `is_moved` does not take for this one.
fn is_of_another(path: &Path, video: &Path, is_moved: impl Fn(&Project) -> bool) -> bool {
    let project = files::read(path).ok().and_then(|text| file::read(path, &text).ok());
    let Some((project, _)) = project else { return false };
    let expected = folder_of(path).join(&project.video.path);
    found(video, &expected, path).is_err() || (!expected.exists() && !is_moved(&project))
}

impl Store {
    /// Opens a project file, or begins a project for the video, with the label `target`, if there is
    /// no file; the first [`Store::save`] writes it. Without `video`, the file must exist, and the
    /// video is the one that it names. `limits` are on what the video may claim.
    ///
    /// # Errors
    /// [`Error::InUse`] if the project is open elsewhere; [`Error::Track`] if nothing can be written
    /// to the folder; else as [`Store::open_shared`].
    pub fn open(path: &Path, video: Option<&Path>, limits: Limits) -> Result<Self, Error> {
        let (path, lock) = locked(path)?;
        Self::open_or_begin(path, video, Some(lock), limits)
    }

    /// Opens a project without keeping others from it. [`Store::save`] fails if another program has
    /// the project open at that moment, or has changed the file since it was read.
    ///
    /// # Errors
    /// [`Error::Track`] if the file, or the video of a new project, cannot be read;
    /// [`Error::Invalid`] and [`Error::Version`] if the file is not a project;
    /// [`Error::OtherVideo`] if the project belongs to another video that still exists.
    pub fn open_shared(path: &Path, video: Option<&Path>, limits: Limits) -> Result<Self, Error> {
        Self::open_or_begin(real(path)?, video, None, limits)
    }

    fn open_or_begin(
        path: PathBuf,
        video: Option<&Path>,
        lock: Option<Lock>,
        limits: Limits,
    ) -> Result<Self, Error> {
        match video {
            Some(video) if !path.exists() => Self::begin(path, video, lock, limits),
            _ => Self::read(path, video, lock, limits),
        }
    }

    fn begin(
        path: PathBuf,
        video: &Path,
        lock: Option<Lock>,
        limits: Limits,
    ) -> Result<Self, Error> {
        let (description, notes) = Video::describe(video, folder_of(&path), limits)?;
        let project = Project {
            video: description,
            labels: vec![Label::new(PLACEHOLDER, 0)],
            targets: Vec::new(),
            next_id: 1,
            done: false,
            remarks: Vec::new(),
        };
        check::project(&project)
            .map_err(|reason| Error::Edit(format!("{}: {reason}", video.display())))?;
        Ok(Self { notes, ..Self::new(path, video.to_path_buf(), project, lock, limits) })
    }

    fn read(
        path: PathBuf,
        video: Option<&Path>,
        lock: Option<Lock>,
        limits: Limits,
    ) -> Result<Self, Error> {
        let text = files::read(&path).map_err(|error| Error::read(&path, error))?;
        let (mut project, revision) = file::read(&path, &text)?;
        let expected = folder_of(&path).join(&project.video.path);
        let video_given = video.is_some();
        let video = match video {
            Some(given) => {
                project.video.path = found(given, &expected, &path)?;
                given.to_path_buf()
            }
            None => expected,
        };
        let text = if lock.is_none() { text } else { Vec::new() };
        let store = Self::new(path, video, project, lock, limits);
        Ok(Self { video_given, revision, saved: Some(revision), text, ..store })
    }

    /// A project without a file.
    fn new(
        path: PathBuf,
        video: PathBuf,
        project: Project,
        lock: Option<Lock>,
        limits: Limits,
    ) -> Self {
        Self {
            path,
            video,
            video_given: true,
            project,
            history: History::default(),
            log: None,
            revision: 0,
            saved: None,
            relabelled: false,
            text: Vec::new(),
            lock,
            limits,
            notes: Vec::new(),
        }
    }

    /// The project.
    pub fn project(&self) -> &Project {
        &self.project
    }

    /// The project file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The video, as [`patchlock_media::open`] takes it. [`Store::video_to_read`] is for those who
    /// open it.
    pub fn video(&self) -> &Path {
        &self.video
    }

    /// The video, if it may be read: it is the one that the caller has named, or in the folder of
    /// the project file. A file of somebody else could name any other one.
    ///
    /// # Errors
    /// [`Error::VideoOutside`]; [`Error::Track`] if there is no such video.
    pub fn video_to_read(&self) -> Result<&Path, Error> {
        if self.video_given {
            return Ok(&self.video);
        }
        let real = |path: &Path| fs::canonicalize(path).map_err(|error| Error::read(path, error));
        match real(&self.video)?.starts_with(real(folder_of(&self.path))?) {
            true => Ok(&self.video),
            false => Err(Error::VideoOutside {
                path: self.path.clone(),
                video: self.project.video.path.clone(),
            }),
        }
    }

    /// What a user should know of the frames of the video, found when the project was begun.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// What the video may claim.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// A number that grows with each change, also over several runs of the program.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// What can be undone and redone.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Keeps the history in a file beside that of the project from now on, and takes up the one that
    /// an earlier run has kept there, if the project is as that run has left it.
    ///
    /// # Errors
    /// [`Error::Track`] if there is a project file that cannot be read again.
    pub fn keep_history(&mut self) -> Result<(), Error> {
        let text = self.saved.map(|_| files::read(&self.path)).transpose();
        let text = text.map_err(|error| Error::read(&self.path, error))?;
        let (log, history) = Log::open(&self.path, text.as_deref());
        (self.log, self.history) = (Some(log), history);
        Ok(())
    }

    /// Applies edits, all or none, as one step of the history. Returns the new revision, which is
    /// also the id of the step.
    ///
    /// # Errors
    /// [`Error::Edit`]; the project is unchanged.
    pub fn apply(&mut self, edits: Vec<Edit>) -> Result<u64, Error> {
        if !edits.is_empty() {
            self.history.apply(&mut self.project, edits, self.revision + 1)?;
            self.revision += 1;
        }
        Ok(self.revision)
    }

    /// Begins tracking of a target, which is written piece by piece and undone as one: with the step
    /// `since`, if no later step has to do with frames of the target, or else as a step of its own.
    /// Returns the id of the step.
    pub fn begin_tracking(&mut self, target: u64, since: Option<u64>) -> u64 {
        let step = self.history.begin(target, since, self.revision + 1);
        self.revision = self.revision.max(step);
        step
    }

    /// Adds tracked boxes of a target to the step that [`Store::begin_tracking`] has returned, or to
    /// a new one if that is no longer possible. Returns the id of the step.
    ///
    /// # Errors
    /// [`Error::Edit`]; the project is unchanged.
    pub fn track(&mut self, target: u64, step: u64, edits: Vec<Edit>) -> Result<u64, Error> {
        let step = self.begin_tracking(target, Some(step));
        if self.history.add(&mut self.project, step, target, edits)? {
            self.revision += 1;
        }
        Ok(step)
    }

    /// Ends tracking: if it has found nothing, there is nothing to undo.
    pub fn end_tracking(&mut self, step: u64) {
        self.history.end(step);
    }

    /// Takes back the last step, or with `redo` does the one again that was taken back last. Returns
    /// the new revision; `None` if there is no such step.
    ///
    /// # Errors
    /// [`Error::Edit`] never, unless there is a bug.
    pub fn step(&mut self, redo: bool) -> Result<Option<u64>, Error> {
        let moved = self.history.step(&mut self.project, redo)?;
        self.revision += u64::from(moved);
        Ok(moved.then_some(self.revision))
    }

    /// Gives the project the labels of all clips of its folder, which is no step of the history.
    /// Labels with other names now are given with the former and the new name. A label that a target
    /// has stays. Returns whether anything changed.
    pub fn set_labels(&mut self, labels: &[Label], renamed: &[(String, String)]) -> bool {
        for (from, to) in renamed {
            let targets = self.project.targets.iter_mut().filter(|target| target.label == *from);
            targets.for_each(|target| target.label.clone_from(to));
            self.history.rename_label(from, to);
        }
        let mut labels = labels.to_vec();
        for target in &self.project.targets {
            if !labels.iter().any(|label| label.name == target.label) {
                let known = self.project.labels.iter().find(|label| label.name == target.label);
                labels.extend(known.cloned());
            }
        }
        let changed = !renamed.is_empty() || labels != self.project.labels;
        self.project.labels = labels;
        self.relabelled |= changed && self.saved.is_some();
        changed
    }

    /// Whether the file has all changes.
    pub fn is_saved(&self) -> bool {
        self.saved == Some(self.revision) && !self.relabelled
    }

    /// Whether there are changes that are not in the file. A project that was only begun has none.
    pub fn has_unsaved_changes(&self) -> bool {
        self.revision != self.saved.unwrap_or(0) || self.relabelled
    }

    /// Writes the file, if it does not have all changes. It is replaced as a whole: after a crash
    /// there is the old one or the new one.
    ///
    /// # Errors
    /// [`Error::Track`]; the changes are still in memory. Of a shared project, [`Error::InUse`] and
    /// [`Error::Overtaken`].
    pub fn save(&mut self) -> Result<(), Error> {
        if self.is_saved() {
            return Ok(());
        }
        let cannot = |error| Error::write(&self.path, error);
        let lock = match &self.lock {
            Some(_) => None,
            None => Some(self.lock_unchanged()?),
        };
        let text = file::write(&self.project, self.revision);
        let text = text.map_err(|error| cannot(io::Error::other(error)))?;
        if let Some(log) = &mut self.log {
            log.write(&mut self.history, &text);
        }
        file::replace(&self.path, &text).map_err(cannot)?;
        drop(lock);
        self.text = if self.lock.is_none() { text } else { Vec::new() };
        (self.saved, self.relabelled) = (Some(self.revision), false);
        Ok(())
    }

    /// Takes the lock, and checks that the file is the one that was read.
    fn lock_unchanged(&self) -> Result<Lock, Error> {
        let lock = Lock::take(&self.path)?;
        let now = match files::read(&self.path) {
            Ok(now) => Some(now),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(Error::read(&self.path, error)),
        };
        match now.as_deref() == self.saved.map(|_| self.text.as_slice()) {
            true => Ok(lock),
            false => Err(Error::Overtaken { path: self.path.clone() }),
        }
    }

    /// How the video differs from the one that the project was made for, in words; `None` if it is
    /// the same. Reads up to 64 MiB of it, if [`Store::video_to_read`] allows that.
    pub fn changed(&self) -> Option<String> {
        match self.video_to_read() {
            Ok(video) => self.project.video.change(video),
            Err(Error::Track(patchlock_track::Error::Read(_, source))) => Some(unreadable(&source)),
            Err(error) => Some(unreadable(&error)),
        }
    }
}

/// The path of a project file with links resolved, so that the file is replaced and not a link to
/// it.
fn real(path: &Path) -> Result<PathBuf, Error> {
    match dunce::canonicalize(path) {
        Ok(real) => Ok(real),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = dunce::canonicalize(folder_of(path));
            let folder = folder.map_err(|error| Error::read(folder_of(path), error))?;
            Ok(folder.join(path.file_name().unwrap_or_default()))
        }
        Err(error) => Err(Error::read(path, error)),
    }
}

/// Takes the lock, and removes what a killed process left.
fn locked(path: &Path) -> Result<(PathBuf, Lock), Error> {
    let path = real(path)?;
    let lock = Lock::take(&path)?;
    file::remove_unfinished(&path);
    Ok((path, lock))
}

/// The path of the given video for the project file, if it may be the project's: the same file, or
/// one that takes the place of a file that is gone.
fn found(given: &Path, expected: &Path, project: &Path) -> Result<PathBuf, Error> {
    let real = fs::canonicalize(given).map_err(|error| Error::read(given, error))?;
    if fs::canonicalize(expected).is_ok_and(|expected| expected != real) {
        return Err(Error::OtherVideo {
            path: project.to_path_buf(),
            expected: expected.to_path_buf(),
            given: given.to_path_buf(),
        });
    }
    super::video::relative(given, folder_of(project)).map_err(|error| Error::read(given, error))
}
