//! Folders of strangers: any files, links, pipes and sockets under any names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use arbitrary::{Arbitrary, Unstructured};
use image::{DynamicImage, ImageFormat, RgbImage};
use patchlock::BoundingBox;
use patchlock_media::{Limits, image_file, open_by};
use patchlock_studio::export as studio_export;
use patchlock_studio::project::{Edit, LABELS_FILE, SharedLabels, Store};
use patchlock_track::export::{self, Entry, Format, Track};
use patchlock_track::files;
use serde_json::json;

use crate::check::{accepted, picture};
use crate::scratch::Scratch;
use crate::seeds::encoded;

/// Entries of a folder, and frames that are read of each.
const ENTRIES: usize = 32;
const FRAMES: usize = 3;
/// Width and height of the images. Those outside the folder have one colour, which no other has.
const SIZE: [u32; 2] = [16, 12];
const COLOUR: [u8; 3] = [255, 0, 255];
const SECRET: &[u8] = b"this belongs to somebody else";

/// The name of an entry.
#[derive(Arbitrary, Debug)]
enum Name {
    Frame(u8),
    /// A frame of a number that may be huge.
    Number(u64, u64),
    Known(u8),
    Any(Bytes),
    Long(u8),
}

/// A few bytes.
#[derive(Debug)]
struct Bytes(Vec<u8>);

impl<'a> Arbitrary<'a> for Bytes {
    fn arbitrary(data: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let length = data.int_in_range(0..=40)?.min(data.len());
        Ok(Self(data.bytes(length)?.to_vec()))
    }
}

const KNOWN: [&str; 12] = [
    "frames",
    "img",
    "clip.png",
    "clip.mp4",
    "clip.y4m",
    "clip.mkv",
    "groundtruth_rect.txt",
    "clip.patchlock.json",
    "clip.patchlock.json.lock",
    "frames.patchlock.json",
    LABELS_FILE,
    "patchlock-uploads",
];

impl Name {
    fn path(&self) -> PathBuf {
        let bytes = match self {
            Self::Frame(k) => format!("{:04}.bmp", k % 8).into_bytes(),
            Self::Number(a, b) => format!("{a}{b}.png").into_bytes(),
            Self::Known(k) => KNOWN[usize::from(*k) % KNOWN.len()].into(),
            Self::Any(Bytes(bytes)) => bytes.clone(),
            Self::Long(byte) => vec![*byte; 255],
        };
        let allowed = bytes.iter().map(|b| if matches!(b, 0 | b'/') { b'_' } else { *b });
        system::path(allowed.collect())
    }
}

/// What an entry is.
#[derive(Arbitrary, Debug)]
enum EntryKind {
    /// A folder with a few images, into which the entries that follow go.
    Folder(u8),
    /// The entries that follow go into the folder above.
    Up,
    Empty,
    /// An image, whole or its beginning.
    Image(u8, Option<u16>),
    /// A project of the clip that this leads to.
    Project(LinkTarget),
    Text(u8),
    Bytes(Bytes),
    Link(LinkTarget),
    Pipe,
    Socket,
}

/// Where a link leads, or the video of a project is.
#[derive(Arbitrary, Debug)]
enum LinkTarget {
    Image,
    Secret,
    Frames,
    Projects,
    Nowhere,
    Above,
    Entry(Name),
    Environment,
    Endless,
}

impl LinkTarget {
    fn path(&self, outside: &Path) -> PathBuf {
        match self {
            Self::Image => outside.join("frames/0000.bmp"),
            Self::Secret => outside.join("secret"),
            Self::Frames => outside.join("frames"),
            Self::Projects => outside.join("clip.patchlock.json"),
            Self::Nowhere => "nowhere".into(),
            Self::Above => "..".into(),
            Self::Entry(name) => name.path(),
            Self::Environment => "/proc/self/environ".into(),
            Self::Endless => "/dev/zero".into(),
        }
    }
}

const TEXTS: [&str; 5] = [
    "1,2,3,4\n5,6,7,8\n",
    "frame,id,x,y,w,h\n99999999999999999999,1,1,1,4,4\n",
    "{\"format\":\"patchlock-labels\",\"version\":1,\"labels\":[]}",
    "[[[[",
    "YUV4MPEG2 W99999 H99999 F25:1\nFRAME\n",
];

/// A folder, made from bytes.
pub fn folder(data: &[u8]) {
    let scratch = Scratch::new();
    let (outside, inside) = (scratch.folder().join("outside"), scratch.folder().join("inside"));
    fill_outside(&scratch);
    fs::create_dir(&inside).expect("makes a folder");
    let mut at = inside.clone();
    let mut data = Unstructured::new(data);
    for _ in 0..ENTRIES {
        let Ok((name, what)) = data.arbitrary() else { break };
        add(&inside, &outside, &mut at, (name, what));
    }
    let before = tree(scratch.folder());
    for (folder, state) in &before {
        if *state == State::Folder && folder.starts_with(&inside) {
            read(folder);
            copied(folder, &scratch.folder().join("out"));
        }
    }
    assert!(tree(scratch.folder()) == before, "reading a folder changed a file");
}

/// What is not of the folder: frames, a project of them, and a secret.
fn fill_outside(scratch: &Scratch) {
    frames_of_others(scratch, "outside/frames");
    scratch.file("outside/secret", SECRET);
    let project = project_of(&scratch.folder().join("outside/frames"));
    scratch.file("outside/clip.patchlock.json", project.as_bytes());
}

fn frames_of_others(scratch: &Scratch, folder: &str) {
    for k in 0..2 {
        let image = RgbImage::from_pixel(SIZE[0], SIZE[1], COLOUR.into());
        let image = encoded(ImageFormat::Bmp, &DynamicImage::from(image));
        scratch.file(&format!("{folder}/{k:04}.bmp"), &image);
    }
}

/// A project of the frames outside, which says that they are here.
fn project_of(video: &Path) -> String {
    static PROJECT: LazyLock<String> = LazyLock::new(|| {
        let scratch = Scratch::new();
        frames_of_others(&scratch, "frames");
        let file = scratch.folder().join("clip.json");
        let frames = scratch.folder().join("frames");
        let mut store = Store::open(&file, Some(&frames), Limits::default()).expect("is a video");
        let bbox = json!({ "x": 2, "y": 2, "w": 6, "h": 5 });
        let edit = json!({ "edit": "add_target", "label": "target", "frame": 0, "box": bbox });
        let edit: Edit = serde_json::from_value(edit).expect("is an edit");
        store.apply(vec![edit]).expect("can be added");
        store.save().expect("can be saved");
        drop(store);
        fs::read_to_string(file).expect("was saved")
    });
    let mut project: serde_json::Value = serde_json::from_str(&PROJECT).expect("is JSON");
    project["video"]["path"] = video.to_string_lossy().into();
    project.to_string()
}

/// Makes an entry. One that the system refuses, such as a second one of its name, is left out.
fn add(inside: &Path, outside: &Path, at: &mut PathBuf, (name, what): (Name, EntryKind)) {
    let path = at.join(name.path());
    if fs::symlink_metadata(&path).is_ok() {
        return;
    }
    let written = |content: &[u8]| fs::write(&path, content);
    let done = match what {
        EntryKind::Folder(count) => fs::create_dir(&path).and_then(|()| {
            at.clone_from(&path);
            let frame = |k| fs::write(path.join(format!("{k:04}.bmp")), image(5 * k));
            (0..count % 4).try_for_each(frame)
        }),
        EntryKind::Up => {
            if at.as_path() != inside {
                at.pop();
            }
            Ok(())
        }
        EntryKind::Empty => written(b""),
        EntryKind::Image(variant, end) => {
            let image = image(variant);
            written(&image[..end.map_or(image.len(), |end| usize::from(end).min(image.len()))])
        }
        EntryKind::Project(place) => written(project_of(&place.path(outside)).as_bytes()),
        EntryKind::Text(k) => written(TEXTS[usize::from(k) % TEXTS.len()].as_bytes()),
        EntryKind::Bytes(Bytes(bytes)) => written(&bytes),
        EntryKind::Link(place) => system::link(&place.path(outside), &path),
        EntryKind::Pipe => system::pipe(&path),
        EntryKind::Socket => system::socket(&path),
    };
    // Long names and some bytes are not allowed everywhere.
    let _ = done;
}

fn image(variant: u8) -> Vec<u8> {
    use ImageFormat::{Bmp, Jpeg, Png, Tiff, WebP};
    let formats = [Bmp, Png, Jpeg, Tiff, WebP];
    let shade = |x: u32, y: u32| image::Rgb([x as u8 * 9, y as u8 * 20, variant]);
    let image = DynamicImage::from(RgbImage::from_fn(SIZE[0], SIZE[1], shade));
    encoded(formats[usize::from(variant) % formats.len()], &image)
}

/// What a path is, without following it.
#[derive(PartialEq, Eq)]
enum State {
    Folder,
    File(Vec<u8>),
    Link(PathBuf),
    Other,
}

/// All that is below a folder, and the folder.
fn tree(root: &Path) -> BTreeMap<PathBuf, State> {
    let (mut found, mut left) = (BTreeMap::new(), vec![root.to_path_buf()]);
    while let Some(path) = left.pop() {
        let kind = fs::symlink_metadata(&path).expect("is there").file_type();
        let state = if kind.is_dir() {
            let entries = fs::read_dir(&path).expect("is a folder");
            left.extend(entries.map(|entry| entry.expect("is there").path()));
            State::Folder
        } else if kind.is_file() {
            State::File(fs::read(&path).expect("is a file"))
        } else if kind.is_symlink() {
            State::Link(fs::read_link(&path).expect("is a link"))
        } else {
            State::Other
        };
        found.insert(path, state);
    }
    found
}

/// Reads the folder and each of its entries as a video, its labels and its projects.
fn read(folder: &Path) {
    let entries = fs::read_dir(folder).expect("is a folder").map(|entry| entry.expect("is there"));
    let entries: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    for path in entries.iter().map(PathBuf::as_path).chain([folder]) {
        if let Some(mut source) = accepted(open_by(path.as_ref(), false, Limits::default(), None)) {
            for k in 0..FRAMES {
                let Some(Some(frame)) = accepted(source.frame(k)) else { break };
                picture(&frame);
            }
        }
        accepted(image_file::size(path));
        accepted(files::read(path));
        accepted(Store::open_shared(path, None, Limits::default()));
        accepted(Store::open_shared(path, Some(folder), Limits::default()));
    }
    accepted(SharedLabels::new(folder).read());
}

/// Exports the images of a folder and the clips of its projects, and looks at what was copied.
fn copied(folder: &Path, out: &Path) {
    for format in Format::ALL.into_iter().filter(|format| format.holds_frames()) {
        let count = accepted(files::images(folder)).map_or(0, |images| images.len());
        let count = count.clamp(1, FRAMES);
        let entry = |frame| Entry {
            frame,
            id: 1,
            bbox: Some(BoundingBox { x: 2.0, y: 2.0, w: 6.0, h: 5.0 }),
            score: None,
            corners: Some([[1.5, 1.5], [7.5, 1.5], [7.5, 6.5], [1.5, 6.5]]),
            status: None,
            ..Entry::default()
        };
        let track = Track::new((0..count).map(entry).collect()).expect("is a track");
        let options = export::Options {
            images: Some(folder.to_path_buf()),
            ..export::Options::new(format, "clip")
        };
        accepted(export::write(&track, &options, out, false));
        belongs_to_the_folder(out);
    }
    let Some((clips, labels)) = accepted(studio_export::of_folder(folder)) else { return };
    for format in Format::all(true).filter(|format| format.copies_frames()) {
        let options = export::Options::new(format, "clips");
        accepted(studio_export::write_all(&clips, &labels, &options, None, out, &|| false));
        belongs_to_the_folder(out);
    }
}

/// Nothing that was written is from outside, or of the system; it is removed.
fn belongs_to_the_folder(out: &Path) {
    if fs::symlink_metadata(out).is_err() {
        return;
    }
    for (path, state) in tree(out) {
        let bytes = match state {
            State::Folder => continue,
            State::File(bytes) => bytes,
            State::Link(_) | State::Other => panic!("{} is no file", path.display()),
        };
        assert!(!bytes.windows(SECRET.len()).any(|part| part == SECRET), "{}", path.display());
        let near = |rgb: &[u8]| rgb.iter().zip(COLOUR).all(|(a, b)| a.abs_diff(b) < 32);
        let image = image_file::decode(&bytes, Limits::default())
            .ok()
            .map(|image| image.to_rgb().into_owned());
        let is_outside = image.is_some_and(|image| image.chunks_exact(3).all(near));
        assert!(!is_outside, "{} was copied from outside", path.display());
    }
    fs::remove_dir_all(out).expect("can be removed");
}

/// What other systems have not, or not in the same way.
#[cfg(target_os = "linux")]
mod system {
    use std::ffi::OsString;
    use std::io;
    use std::os::unix::ffi::OsStringExt as _;
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;
    use std::path::{Path, PathBuf};

    use rustix::fs::{CWD, FileType, Mode, mknodat};

    pub fn path(bytes: Vec<u8>) -> PathBuf {
        OsString::from_vec(bytes).into()
    }

    pub fn link(to: &Path, at: &Path) -> io::Result<()> {
        symlink(to, at)
    }

    pub fn pipe(at: &Path) -> io::Result<()> {
        Ok(mknodat(CWD, at, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)?)
    }

    pub fn socket(at: &Path) -> io::Result<()> {
        UnixListener::bind(at).map(drop)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::io;
    use std::path::{Path, PathBuf};

    pub fn path(bytes: Vec<u8>) -> PathBuf {
        String::from_utf8_lossy(&bytes).into_owned().into()
    }

    pub fn link(_: &Path, _: &Path) -> io::Result<()> {
        Ok(())
    }

    pub fn pipe(_: &Path) -> io::Result<()> {
        Ok(())
    }

    pub fn socket(_: &Path) -> io::Result<()> {
        Ok(())
    }
}
