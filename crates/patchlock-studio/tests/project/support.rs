//! What the tests of projects share.

use std::fs;
use std::path::{Path, PathBuf};

use patchlock::BoundingBox;
use patchlock_media::Limits;
use patchlock_studio::export::reads;
use patchlock_studio::project::{Edit, Store};
use patchlock_track::export::{Format, Options};

/// Frames of the video that [`TestFolder::new`] makes.
pub const FRAMES: usize = 12;
/// Width and height of its frames.
pub const SIZE: (usize, usize) = (64, 48);

/// A folder with a video of images.
pub struct TestFolder {
    folder: tempfile::TempDir,
}

impl TestFolder {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let place = Self { folder };
        write_images(&place.video(), FRAMES);
        place
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn video(&self) -> PathBuf {
        self.folder.path().join("frames")
    }

    pub fn file(&self) -> PathBuf {
        self.folder.path().join("frames.patchlock.json")
    }

    /// A new project of the video.
    pub fn store(&self) -> Store {
        Store::open(&self.file(), Some(&self.video()), Limits::default()).unwrap()
    }

    /// A new project that says that the video has this many frames.
    pub fn store_of(&self, frames: usize) -> Store {
        self.store().save().unwrap();
        let text = fs::read_to_string(self.file()).unwrap();
        let said = format!("\"frames\":{FRAMES}");
        assert!(text.contains(&said));
        fs::write(self.file(), text.replace(&said, &format!("\"frames\":{frames}"))).unwrap();
        Store::open(&self.file(), None, Limits::default()).unwrap()
    }
}

/// The export format of this name.
pub fn format_named(name: &str) -> Format {
    Format::named(name, true).unwrap()
}

/// The options of an export of a clip, with its frames or with boxes only.
pub fn options(format: Format, video: &Path, frames: bool) -> Options {
    let images = reads(&format, frames, video).then(|| video.to_path_buf());
    Options { images, ..Options::new(format, "clip") }
}

/// Black images of 64 x 48 pixels.
pub fn write_images(folder: &Path, count: usize) {
    fs::create_dir_all(folder).unwrap();
    for k in 0..count {
        fs::write(folder.join(format!("{k:04}.bmp")), bmp(SIZE.0, SIZE.1)).unwrap();
    }
}

/// A black image of 24 bits per pixel; the width must be a multiple of 4.
pub fn bmp(width: usize, height: usize) -> Vec<u8> {
    let data = width * height * 3;
    let mut out = b"BM".to_vec();
    for number in [54 + data, 0, 54, 40, width, height] {
        out.extend_from_slice(&(number as u32).to_le_bytes());
    }
    out.extend_from_slice(&[1, 0, 24, 0]);
    for number in [0, data, 2835, 2835, 0, 0] {
        out.extend_from_slice(&(number as u32).to_le_bytes());
    }
    out.resize(54 + data, 0);
    out
}

pub fn bbox(x: f64, y: f64, w: f64, h: f64) -> BoundingBox {
    BoundingBox { x, y, w, h }
}

/// Adds a target in this frame, which has the label `target`.
pub fn add(frame: usize) -> Edit {
    Edit::AddTarget {
        label: "target".into(),
        frame,
        bbox: bbox(10.0, 10.0, 8.0, 6.0),
        outline: None,
    }
}
