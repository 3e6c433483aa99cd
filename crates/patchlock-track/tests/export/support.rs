//! A small track, and what tests do with its exports.

use image::RgbImage;
use patchlock::{BoundingBox, Status};
use patchlock_track::export::{self, Entry, Format, Options, Selection, Track};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Target 1 in frames 0, 2 and 6, and target 3 in frames 2 and 4, where its box leaves the frame.
/// Only every second frame was tracked.
pub fn track() -> Track {
    let entry = |frame, id, [x, y, w, h]: [f64; 4], score, corners| Entry {
        frame,
        id,
        bbox: Some(BoundingBox { x, y, w, h }),
        score,
        corners,
        status: None,
        ..Entry::default()
    };
    let corners = [[9.5, 4.5], [29.5, 4.5], [29.5, 14.5], [9.5, 14.5]];
    Track::new(vec![
        entry(6, 1, [14.0, 5.0, 20.0, 10.0], Some(0.75), None),
        entry(0, 1, [10.0, 5.0, 20.0, 10.0], Some(1.0), Some(corners)),
        entry(2, 3, [30.0, 20.0, 8.0, 6.0], None, None),
        entry(2, 1, [11.0, 5.0, 20.0, 10.0], Some(0.25), None),
        entry(4, 3, [-4.0, 27.0, 8.0, 6.123456], Some(0.5), None),
    ])
    .unwrap()
}

pub struct Workspace {
    folder: TempDir,
}

impl Workspace {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Seven frames of 40 x 30 pixels: a JPEG, then PNGs.
    pub fn images(&self) -> PathBuf {
        let folder = self.path("frames");
        fs::create_dir(&folder).unwrap();
        for k in 0..7u8 {
            let name = format!("{k}.{}", if k == 0 { "jpg" } else { "png" });
            RgbImage::from_pixel(40, 30, image::Rgb([30 * k, 100, 50]))
                .save(folder.join(name))
                .unwrap();
        }
        folder
    }

    pub fn export(&self, options: &Options) -> Result<(usize, PathBuf), String> {
        let out = self.path("out");
        let written = export::write(&track(), options, &out, false);
        written.map(|written| (written.files, out)).map_err(|error| error.to_string())
    }
}

/// A target in frames 0 to 6: lost in 2 and 3 and at the end, uncertain in 4. `blank`: lost without
/// a box.
pub fn lost_track(blank: bool) -> Track {
    use Status::{Lost, Tracked, Uncertain};
    let statuses = [Tracked, Tracked, Lost, Lost, Uncertain, Tracked, Lost];
    let entry = |(frame, status): (usize, Status)| {
        // The last known box stays.
        let x = [10.0, 11.0, 11.0, 11.0, 14.0, 15.0, 15.0][frame];
        let bbox = BoundingBox { x, y: 5.0, w: 20.0, h: 10.0 };
        let bbox = Some(bbox).filter(|_| !(blank && status == Lost));
        let (score, status) = (Some(0.75), Some(status));
        Entry { frame, id: 1, bbox, score, status, ..Entry::default() }
    };
    Track::new(statuses.into_iter().enumerate().map(entry).collect()).unwrap()
}

/// The output of both kinds of tracks with losses, by `read`.
pub fn lost_exports<T>(format: Format, read: impl Fn(&Path) -> T) -> [T; 2] {
    lost_exports_with(&options(format), read)
}

pub fn lost_exports_with<T>(options: &Options, read: impl Fn(&Path) -> T) -> [T; 2] {
    [false, true].map(|blank| {
        let workspace = Workspace::new();
        let out = workspace.path("out");
        export::write(&lost_track(blank), options, &out, false).unwrap();
        read(&out)
    })
}

/// The options of an export of boxes with these statuses.
pub fn with_status(format: &str, status: &str) -> Options {
    let status = Some(Selection::statuses(status).unwrap());
    let selection = Selection { status, ..Selection::default() };
    Options { selection, ..options(format_named(format)) }
}

/// The export format of this name.
pub fn format_named(name: &str) -> Format {
    Format::named(name, false).unwrap()
}

pub fn options(format: Format) -> Options {
    let size = format.needs_size.then_some((40, 30));
    Options { label: "toy car".into(), size, ..Options::new(format, "film") }
}

pub fn text(path: impl AsRef<Path>) -> String {
    fs::read_to_string(path.as_ref()).unwrap_or_else(|error| panic!("{:?}: {error}", path.as_ref()))
}

/// The text of a format that is one file.
pub fn exported_text(format: Format) -> String {
    let workspace = Workspace::new();
    let (files, out) = workspace.export(&options(format)).unwrap();
    assert_eq!(files, 1);
    text(out)
}

pub fn choosing(selection: Selection, options: &Options) -> Options {
    Options { selection, ..options.clone() }
}

/// A target that moves by a pixel per frame from 0 to 30, is half hidden in 12 to 14, and is lost
/// in 21 to 24.
pub fn long_track() -> Track {
    let entry = |frame: usize| {
        let bbox = BoundingBox { x: frame as f64, y: 5.0, w: 4.0, h: 3.0 };
        let hidden = (12..=14).contains(&frame);
        let lost = (21..=24).contains(&frame);
        let status = if lost { Status::Lost } else { Status::Tracked };
        let score = Some(if hidden { 0.25 } else { 1.0 });
        Entry {
            frame,
            id: 1,
            bbox: Some(bbox),
            score,
            corners: None,
            status: Some(status),
            ..Entry::default()
        }
    };
    Track::new((0..=30).map(entry).collect()).unwrap()
}

/// A video of up to 9 frames of 40 x 30 pixels, each brighter than the one before.
pub fn y4m(frames: u8) -> Vec<u8> {
    let mut bytes = b"YUV4MPEG2 W40 H30 F25:1 Ip A1:1 C420jpeg\n".to_vec();
    for k in 0..frames {
        bytes.extend(b"FRAME\n");
        bytes.extend(vec![30 * k; 40 * 30]);
        bytes.extend(vec![128; 2 * 20 * 15]);
    }
    bytes
}
