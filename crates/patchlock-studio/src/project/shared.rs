//! What all clips of a folder have in common: the labels, in the order of their classes. They are in
//! a file of the folder, and each project has a copy, so that it can be read alone.

use std::collections::{BTreeSet, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use patchlock_track::files;
use serde::{Deserialize, Serialize};

use super::file::replace;
use super::lock::Lock;
use super::{Attribute, Edit, Error, Label, PLACEHOLDER, Project, check, limits};

/// The name of the file.
pub const FILE: &str = "patchlock-labels.json";
/// The first member of every such file.
const FORMAT: &str = "patchlock-labels";
/// The newest version that is read. It is written of labels with attributes, which older programs do
/// not know; others are of version 1.
const VERSION: u64 = 2;
/// Times to wait for another program that changes the labels, and how long each time.
const WAITS: (u32, Duration) = (100, Duration::from_millis(20));

/// A label of all clips.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    colour: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    attributes: Vec<Attribute>,
    /// Names that it had before: projects that were not open then still have them.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    was: BTreeSet<String>,
}

/// The labels of all clips of a folder.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Vocabulary {
    entries: Vec<Entry>,
    /// Names of labels that were removed: projects that were not open then still list them.
    removed: BTreeSet<String>,
    /// Whether there is no file yet.
    is_new: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    version: u64,
    labels: Vec<Entry>,
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    removed: BTreeSet<String>,
}

/// The labels of a folder, with their file.
#[derive(Debug)]
pub struct SharedLabels {
    path: PathBuf,
    /// The labels as long as there is no file.
    known: Vocabulary,
}

impl SharedLabels {
    /// Those of a folder; nothing is read yet.
    pub fn new(folder: &Path) -> Self {
        let known = Vocabulary { is_new: true, ..Vocabulary::default() };
        Self { path: folder.join(FILE), known }
    }

    /// The labels as they are now.
    ///
    /// # Errors
    /// [`Error::Track`]; [`Error::Labels`] if the file is not as it must be.
    pub fn read(&self) -> Result<Vocabulary, Error> {
        match files::read(&self.path) {
            Ok(text) => Vocabulary::parse(&text)
                .map_err(|reason| Error::Labels { path: self.path.clone(), reason }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(self.known.clone()),
            Err(error) => Err(Error::read(&self.path, error)),
        }
    }

    /// Changes the labels as they are now, and writes them. Other programs wait meanwhile.
    ///
    /// # Errors
    /// As [`SharedLabels::read`], and those of the work, after which nothing is changed;
    /// [`Error::InUse`]; [`Error::Track`].
    pub fn update<T>(
        &mut self,
        work: impl FnOnce(&mut Vocabulary) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let _lock = self.lock()?;
        let before = self.read()?;
        let mut now = before.clone();
        let done = work(&mut now)?;
        // A folder in which nobody has named a label needs no file.
        if now != before && !(now.is_new && now.is_plain()) {
            let text = now.text().map_err(|error| Error::write(&self.path, error.into()))?;
            replace(&self.path, &text).map_err(|error| Error::write(&self.path, error))?;
        }
        self.known = now;
        Ok(done)
    }

    fn lock(&self) -> Result<Lock, Error> {
        let (times, pause) = WAITS;
        for _ in 0..times {
            match Lock::take(&self.path) {
                Err(Error::InUse { .. }) => std::thread::sleep(pause),
                other => return other,
            }
        }
        Lock::take(&self.path)
    }
}

impl Vocabulary {
    fn parse(text: &[u8]) -> Result<Self, String> {
        let document: Document = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        let Document { format, version, labels: entries, removed } = document;
        ensure!(format == FORMAT, "its member `format` is not {FORMAT:?}");
        ensure!(
            (1..=VERSION).contains(&version),
            "it is of version {version}; this program reads versions up to {VERSION}"
        );
        check::at_most("labels", entries.len(), limits::LABELS)?;
        check::at_most("removed labels", removed.len(), limits::LABELS)?;
        let mut names = HashSet::new();
        for entry in &entries {
            check::label(&entry.label())?;
            check::at_most("former names", entry.was.len(), limits::LABELS)?;
            ensure!(names.insert(&entry.name), "the label {:?} appears twice", entry.name);
        }
        Ok(Self { entries, removed, is_new: false })
    }

    fn text(&self) -> serde_json::Result<Vec<u8>> {
        let (labels, removed) = (self.entries.clone(), self.removed.clone());
        let format = FORMAT.to_owned();
        let declares = labels.iter().any(|label| !label.attributes.is_empty());
        let version = if declares { VERSION } else { 1 };
        let document = Document { format, version, labels, removed };
        let mut text = serde_json::to_vec_pretty(&document)?;
        text.push(b'\n');
        Ok(text)
    }

    /// Whether it has nothing but the label with which each project begins.
    fn is_plain(&self) -> bool {
        match self.entries.as_slice() {
            [] => true,
            [only] => only.label() == Label::new(PLACEHOLDER, 0),
            _ => false,
        }
    }

    /// The labels in the order of their classes.
    pub fn labels(&self) -> Vec<Label> {
        self.entries.iter().map(Entry::label).collect()
    }

    /// Adds the labels that only a project has, unless they were removed and its targets do not need
    /// them. Returns the former names of its labels, with the new ones.
    ///
    /// # Errors
    /// [`Error::Edit`] if there would be too many.
    pub fn absorb(&mut self, project: &Project) -> Result<Vec<(String, String)>, Error> {
        let mut renamed = Vec::new();
        for label in &project.labels {
            if self.has(&label.name) {
                continue;
            }
            let now = self.entries.iter().find(|entry| entry.was.contains(&label.name));
            if let Some(now) = now {
                renamed.push((label.name.clone(), now.name.clone()));
                continue;
            }
            let is_used = project.targets.iter().any(|target| target.label == label.name);
            if is_used || !self.removed.contains(&label.name) {
                self.add(label.clone())?;
            }
        }
        Ok(renamed)
    }

    fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.name == name)
    }

    fn add(&mut self, label: Label) -> Result<(), Error> {
        check::at_most("labels", self.entries.len() + 1, limits::LABELS).map_err(Error::Edit)?;
        let Label { name, colour, attributes } = label;
        for entry in &mut self.entries {
            entry.was.remove(&name);
        }
        self.removed.remove(&name);
        self.entries.push(Entry { name, colour, attributes, was: BTreeSet::new() });
        Ok(())
    }

    /// Applies an edit of labels. `in_use` says whether a target of any clip has a label. Returns
    /// the former name and the new one if a label has another name now.
    ///
    /// # Errors
    /// [`Error::Edit`] if it is not possible, or no edit of labels.
    pub fn apply(
        &mut self,
        edit: &Edit,
        in_use: impl Fn(&str) -> bool,
    ) -> Result<Option<(String, String)>, Error> {
        if let Edit::RemoveLabel { name } = edit
            && in_use(name)
        {
            return Err(Error::Edit(format!(
                "the label {name:?} cannot be removed: targets of this clip or another one have it"
            )));
        }
        let labels = super::edit::labels_after(self.labels(), edit)?;
        let mut entries: Vec<Entry> = Vec::new();
        for (k, Label { name, colour, attributes }) in labels.into_iter().enumerate() {
            let place = self.entries.iter().position(|entry| entry.name == name);
            // A label with another name keeps its place.
            let was = place.or_else(|| matches!(edit, Edit::SetLabel { .. }).then_some(k));
            let was = was.map(|at| self.entries[at].was.clone()).unwrap_or_default();
            entries.push(Entry { name, colour, attributes, was });
        }
        let renamed = match edit {
            Edit::SetLabel { name, new_name: Some(new), .. } if name != new => {
                Some((name.clone(), new.clone()))
            }
            _ => None,
        };
        let names: Vec<String> = entries.iter().map(|entry| entry.name.clone()).collect();
        for entry in &mut entries {
            if let Some((former, _)) = renamed.as_ref().filter(|(_, new)| *new == entry.name) {
                entry.was.insert(former.clone());
            }
            entry.was.retain(|name| !names.contains(name));
        }
        if let Edit::RemoveLabel { name } = edit {
            if self.removed.len() >= limits::LABELS {
                self.removed.pop_first();
            }
            self.removed.insert(name.clone());
        }
        self.removed.retain(|name| !names.contains(name));
        self.entries = entries;
        Ok(renamed)
    }
}

impl Entry {
    fn label(&self) -> Label {
        let (name, colour) = (self.name.clone(), self.colour.clone());
        Label { name, colour, attributes: self.attributes.clone() }
    }
}
