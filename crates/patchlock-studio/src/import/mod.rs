//! Reads annotations of other programs, and our own tables, as targets of a project.
//!
//! A box counts as drawn by a person, and becomes a key frame, unless the file says otherwise: with
//! a key frame flag, a status, or a score below 1. Other boxes become tracked ones.

mod coco;
mod cvat;
mod images;
mod label_studio;
mod mot;
mod spans;
mod table;
mod voc;
mod xml;
mod yolo;

use std::collections::{BTreeMap, HashMap};

use patchlock::{BoundingBox, Status};

use self::images::Images;
pub use self::images::names_of;
use self::spans::Spans;
use crate::project::{
    Attribute, Edit, Error, Key, Label, Outline, Project, Target, TrackedBox, Video, check,
};

/// A format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A table of `patchlock track` or of a project, as CSV or as JSON lines: the columns `frame`,
    /// `x`, `y`, `w` and `h`, counted from 0, and, if there are, `id`, `label`, `score`, `status`,
    /// `key`, `occluded`, `truncated`, `hidden`, `visible`, `agreement`, `frame_w`, `frame_h` and
    /// `outline`; of CSV also `attribute:NAME`, with the value of an attribute in the frame.
    Csv,
    /// MOTChallenge, results or ground truth: `frame,id,left,top,width,height,confidence,...`,
    /// counted from one. Confidence 0 means lost. Ground truth has a class, which becomes the label
    /// `class N`, and the visible share.
    Mot,
    /// "CVAT for video 1.1" or "CVAT for images 1.1": an XML file. From a box that is outside to the
    /// next one that is not, the target is hidden. Rotated boxes and polygons are outlines. Attributes
    /// are read with their declarations. In a folder, the frame of an image is that with its name; in a
    /// video, its `id`. Boxes of images are targets of their own.
    Cvat,
    /// A JSON file in the format of COCO: a data set, or the list of a detector's results. In a
    /// folder, the frame of an image is that with its name, or its `frame_id`; in a video, its
    /// `frame_id`, or the number at the end of its name, counted from 0 or 1, or from the lowest
    /// one if the highest is beyond the video. Annotations of one target have the same `track_id`,
    /// `instance_id` or attribute `track_id`; others are targets of their own. A segmentation of one
    /// polygon is the outline. In results, the id of an image is its name, and the label of category 3
    /// is `class 3`.
    Coco,
    /// A JSON file of Label Studio: the key frames of a video, or rectangles of images.
    LabelStudio,
    /// YOLO: text files with the names of the images, and one with the names of the classes
    /// (`data.yaml`, `classes.txt` or `obj.names`). Boxes, rotated boxes and polygons are targets of
    /// their own. Images are found as with [`Format::Coco`].
    Yolo,
    /// Pascal VOC: XML files, of which each names its image. Boxes are targets of their own. Images
    /// are found as with [`Format::Coco`].
    Voc,
}

/// A file to import.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name, which may have a path.
    pub name: String,
    /// Its bytes.
    pub content: Vec<u8>,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 7] =
        [Self::Csv, Self::Mot, Self::Cvat, Self::Coco, Self::LabelStudio, Self::Yolo, Self::Voc];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// The name for people, with the endings of its files.
    pub fn title(self) -> &'static str {
        self.names().1
    }

    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Csv => ("csv", "Patchlock table (.csv, .jsonl)"),
            Self::Mot => ("mot", "MOTChallenge (.txt)"),
            Self::Cvat => ("cvat", "CVAT for video or for images 1.1 (.xml)"),
            Self::Coco => ("coco", "COCO, a data set or results (.json)"),
            Self::LabelStudio => ("label-studio", "Label Studio (.json)"),
            Self::Yolo => ("yolo", "YOLO (.txt of all images, with data.yaml or classes.txt)"),
            Self::Voc => ("voc", "Pascal VOC (.xml of all images)"),
        }
    }

    /// The format of this name.
    ///
    /// # Errors
    /// [`Error::Import`] if there is no such format; the message lists the names.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::Import(format!("there is no format {name:?}; the formats are {known}"))
        })
    }

    /// Whether the format has a file for each image, and not one for all.
    pub fn has_files(self) -> bool {
        matches!(self, Self::Yolo | Self::Voc)
    }
}

/// What a file has.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportResult {
    /// Its targets; the ids are those of this list, from 1.
    pub targets: Vec<Target>,
    /// The attributes that it declares for labels of its targets.
    pub declared: BTreeMap<String, Vec<Attribute>>,
    /// What is to be known before the targets are added, in sentences: how images were matched with
    /// frames, and what was left out.
    pub notes: Vec<String>,
}

impl ImportResult {
    /// The edits that add it to a project with these labels, to be applied as one step. An attribute
    /// that a label declares already stays as it is.
    pub fn edits(self, labels: &[Label]) -> Vec<Edit> {
        let mut edits = Vec::new();
        for (name, declared) in self.declared {
            let known = labels.iter().find(|label| label.name == name);
            if known.is_none() {
                edits.push(Edit::AddLabel { name: name.clone(), colour: None, at: None });
            }
            let mut attributes = known.map(|label| label.attributes.clone()).unwrap_or_default();
            let before = attributes.len();
            for attribute in declared {
                if attributes.iter().all(|known| known.name != attribute.name) {
                    attributes.push(attribute);
                }
            }
            if attributes.len() > before {
                edits.push(Edit::Declare { label: name, attributes });
            }
        }
        edits.push(Edit::Import { targets: self.targets });
        edits
    }
}

/// Reads the targets of a file. Those without a label in the file get the first of the project.
/// `images` are the names of the frames, as [`names_of`] gives them. Shapes other than boxes are left
/// out.
///
/// # Errors
/// [`Error::Import`] if the text is not in this format, or has boxes that the project cannot have;
/// it names the place.
pub fn read(
    format: Format,
    text: &[u8],
    project: &Project,
    images: &[String],
) -> Result<ImportResult, Error> {
    let file = File { name: String::new(), content: text.to_vec() };
    read_files(format, &[file], project, images)
}

/// As [`read`], of several files for [`Format::Yolo`] and [`Format::Voc`].
///
/// # Errors
/// As [`read`]; [`Error::Import`] if there are several files of another format, or none.
pub fn read_files(
    format: Format,
    files: &[File],
    project: &Project,
    images: &[String],
) -> Result<ImportResult, Error> {
    let label = project.labels.first().map_or("target", |label| &label.name);
    let mut found = ImportBuilder::new(&project.video, label, images);
    read_into(format, files, &mut found).map_err(Error::Import)?;
    found.finish().map_err(Error::Import)
}

fn read_into(format: Format, files: &[File], found: &mut ImportBuilder<'_>) -> Outcome {
    let read = match format {
        Format::Csv => table::read,
        Format::Mot => mot::read,
        Format::Cvat => cvat::read,
        Format::Coco => coco::read,
        Format::LabelStudio => label_studio::read,
        Format::Yolo => return yolo::read(files, found),
        Format::Voc => return voc::read(files, found),
    };
    let [file] = files else {
        let (name, count) = (format.name(), files.len());
        return Err(format!("{name} is one file, and {count} are given"));
    };
    read(text_of(&file.content)?, found)
}

/// The text of a file.
fn text_of(content: &[u8]) -> Outcome<&str> {
    let text = std::str::from_utf8(content);
    let text = text.map_err(|error| format!("the file is not text in UTF-8: {error}"))?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

type Outcome<T = ()> = Result<T, String>;

/// What a file says of a target in one frame.
#[derive(Debug, Clone, Default)]
struct Row {
    frame: usize,
    /// What the file calls the target; without a name, the row is a target of its own.
    track: Option<String>,
    label: Option<String>,
    /// `None` if it says nothing, or that it is hidden.
    bbox: Option<BoundingBox>,
    /// The outline, of which the upright box around it is the box of a key frame.
    outline: Option<Outline>,
    hidden: bool,
    /// Whether a person has drawn the box, if the file says so.
    key: Option<bool>,
    occluded: bool,
    truncated: bool,
    score: Option<f64>,
    status: Option<Status>,
    visible: Option<f64>,
    agreement: Option<f64>,
    /// Values of attributes, by name.
    values: Vec<(String, String)>,
}

/// Counts one more of this name, in a list in the order of the names.
pub(crate) fn count(counts: &mut Vec<(String, usize)>, name: &str) {
    match counts.binary_search_by(|(known, _)| known.as_str().cmp(name)) {
        Ok(at) => counts[at].1 += 1,
        Err(at) => counts.insert(at, (name.to_owned(), 1)),
    }
}

/// The targets that were found so far.
struct ImportBuilder<'a> {
    video: &'a Video,
    label: &'a str,
    targets: Vec<Target>,
    /// Where each of them is hidden.
    hidden: Vec<Spans>,
    /// Places in `targets`, by what the file calls them.
    places: HashMap<String, usize>,
    /// The attributes that the file declares, by label.
    declared: BTreeMap<String, Vec<Attribute>>,
    /// The names of the frames.
    images: Images,
    /// What is to be said besides.
    notes: Vec<String>,
    /// The numbers of shapes that are left out, by what they are.
    left_out: Vec<(String, usize)>,
}

impl<'a> ImportBuilder<'a> {
    fn new(video: &'a Video, label: &'a str, images: &[String]) -> Self {
        Self {
            video,
            label,
            targets: Vec::new(),
            hidden: Vec::new(),
            places: HashMap::new(),
            declared: BTreeMap::new(),
            images: Images::new(images),
            notes: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// Finds the frames of images with these names by numbers, if the frames have no names.
    fn number_images<'n>(&mut self, names: impl Iterator<Item = &'n str>) -> Outcome {
        let note = self.images.number(names, self.video.frames)?;
        self.notes.extend(note);
        Ok(())
    }

    /// Counts a shape that is left out.
    fn leave_out(&mut self, what: &str) {
        count(&mut self.left_out, what);
    }

    /// The target with this name; a new one without.
    fn target(&mut self, track: Option<&str>, label: Option<&str>) -> &mut Target {
        let place = self.place(track, label);
        &mut self.targets[place]
    }

    /// Its place in `targets`.
    fn place(&mut self, track: Option<&str>, label: Option<&str>) -> usize {
        let known = track.and_then(|track| self.places.get(track).copied());
        known.unwrap_or_else(|| {
            let place = self.targets.len();
            if let Some(track) = track {
                self.places.insert(track.to_owned(), place);
            }
            let label = label.unwrap_or(self.label).to_owned();
            self.targets.push(Target::new(place as u64 + 1, label));
            self.hidden.push(Spans::default());
            place
        })
    }

    /// Adds frames in which a target is hidden.
    fn hide(&mut self, track: Option<&str>, label: Option<&str>, frames: [usize; 2]) {
        let place = self.place(track, label);
        self.hidden[place].add(frames);
    }

    /// Adds what the file says in one place.
    fn add(&mut self, row: &Row) -> Outcome {
        check::frame(row.frame, self.video)?;
        let tracked = row.bbox.and_then(|bbox| row.as_tracked(bbox));
        let key = row.bbox.filter(|_| tracked.is_none()).map(|bbox| row.as_key(bbox));
        key.iter().try_for_each(|key| check::key(key, self.video))?;
        tracked.iter().try_for_each(check::tracked_box)?;
        let frame = row.frame;
        let place = self.place(row.track.as_deref(), row.label.as_deref());
        let (target, hidden) = (&mut self.targets[place], &mut self.hidden[place]);
        let seen = target.keys.contains_key(&frame) || target.tracked.contains_key(&frame);
        let twice = seen || hidden.holds(frame);
        if twice && (row.bbox.is_some() || row.hidden) {
            let name = row.track.as_deref().unwrap_or_default();
            return Err(format!("target {name} appears twice in frame {frame}"));
        }
        target.keys.extend(key.map(|key| (frame, key)));
        target.tracked.extend(tracked.map(|tracked| (frame, tracked)));
        if row.bbox.is_none() && row.hidden {
            hidden.add([frame; 2]);
        }
        let declared = self.declared.get(&target.label).map_or(&[][..], Vec::as_slice);
        for (name, value) in &row.values {
            let known = declared.iter().find(|attribute| attribute.name == *name);
            let is_fixed = known.is_some_and(|attribute| !attribute.mutable);
            if !is_fixed || !target.attributes.contains_key(name) {
                set_value(target, frame, name, value);
            }
        }
        Ok(())
    }

    /// Compares the size of the frames in the file with the video, if the file has it.
    fn check_size(&self, size: Option<(usize, usize)>) -> Outcome {
        let (width, height) = (self.video.width, self.video.height);
        let (w, h) = size.unwrap_or((width, height));
        ensure!(
            (w, h) == (width, height),
            "it is for frames of {w} x {h} pixels; those of the video are {width} x {height}"
        );
        Ok(())
    }

    /// Forgets attributes without a value: a table has a cell of each attribute in each row.
    fn forget_empty(&mut self) {
        for Target { attributes, changes, .. } in &mut self.targets {
            attributes.retain(|name, value| !value.is_empty() || changes.contains_key(name));
        }
    }

    /// All targets that have a box, and what is declared of their labels.
    fn finish(self) -> Outcome<ImportResult> {
        let Self { mut targets, mut declared, mut notes, left_out, .. } = self;
        if !left_out.is_empty() {
            let list = left_out.iter().map(|(what, count)| format!("{what} ({count})"));
            notes.push(format!("Left out: {}", list.collect::<Vec<_>>().join(", ")));
        }
        for (target, hidden) in targets.iter_mut().zip(self.hidden) {
            target.hidden = hidden.into_stretches();
        }
        targets.retain(|target| !target.keys.is_empty() || !target.tracked.is_empty());
        if targets.is_empty() {
            notes.insert(0, "there are no boxes in the file".to_owned());
            return Err(notes.join(". "));
        }
        declared.retain(|label, _| targets.iter().any(|target| target.label == *label));
        Ok(ImportResult { targets, declared, notes })
    }
}

/// Says the value of an attribute in a frame, in the order of the frames: the first is that of all
/// frames, and each other one a change.
fn set_value(target: &mut Target, frame: usize, name: &str, value: &str) {
    let changed = target.changes.get(name).and_then(|changes| changes.at(frame));
    let now = changed.or_else(|| target.attributes.get(name).map(String::as_str));
    match now {
        None => drop(target.attributes.insert(name.to_owned(), value.to_owned())),
        Some(now) if now == value => {}
        Some(_) => {
            let changes = target.changes.entry(name.to_owned()).or_default();
            changes.0.insert(frame, value.to_owned());
        }
    }
}

impl Row {
    /// The row as a person's. An outline that is no more than the box is left out.
    fn as_key(&self, bbox: BoundingBox) -> Key {
        let outline = self.outline.clone().filter(|outline| !outline.is_upright());
        let bbox = outline.as_ref().map_or(bbox, Outline::bounds);
        Key { bbox, outline, occluded: self.occluded, truncated: self.truncated }
    }

    /// The row as a tracker's, unless a person has drawn the box.
    fn as_tracked(&self, bbox: BoundingBox) -> Option<TrackedBox> {
        let drawn = self
            .key
            .unwrap_or(self.status.is_none() && self.score.is_none_or(|score| score == 1.0));
        let status = self.status.unwrap_or(Status::Tracked);
        let (score, visible, agreement) = (self.score.unwrap_or(1.0), self.visible, self.agreement);
        (!drawn).then_some(TrackedBox { bbox, score, status, visible, agreement })
    }
}
