//! Shared by the tests of the command line: a small film in every kind of source, and fast
//! settings.

pub mod benchmark;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use image::{GrayImage, ImageBuffer, Luma, RgbImage};
use patchlock_media::{FrameRate, Mp4Writer};
use patchlock_scene::{KeyPose, Scene, SceneConfig};
use tempfile::TempDir;

pub const WIDTH: usize = 96;
pub const HEIGHT: usize = 72;
pub const BOX: &str = "20,18,32,28";
pub const COLUMNS: &str = "frame,x,y,w,h,score,visible_large,visible_small,x1,y1,x2,y2,x3,y3,x4,y4,ms,status,\
     frame_w,frame_h";

/// A temporary folder for one test.
pub struct Bench {
    pub folder: TempDir,
}

impl Bench {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("quick.toml"), "[paper]\nparticles = 12\n").unwrap();
        Self { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `patchlock track SOURCE --box ...` with few particles, run in the folder of the test.
    pub fn track(&self, source: &str) -> Command {
        let mut command = self.bare(source);
        command.args(["--box", BOX]);
        command
    }

    /// The same without a box.
    pub fn bare(&self, source: &str) -> Command {
        let mut command = patchlock();
        command.current_dir(self.folder.path()).args(["track", source, "--config", "quick.toml"]);
        command
    }

    /// The same with a box, and with a shell script in place of ffmpeg.
    #[cfg(unix)]
    pub fn track_with_ffmpeg(&self, source: &str, script: &str) -> Command {
        use std::os::unix::fs::PermissionsExt;
        fs::create_dir_all(self.path("bin")).unwrap();
        let program = self.path("bin/ffmpeg");
        // The program runs in a folder of its own.
        let folder = self.folder.path().display();
        fs::write(&program, format!("#!/bin/sh\ncd '{folder}'\n{script}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let mut command = self.track(source);
        command.env("PATH", format!("{}:/usr/bin:/bin", self.path("bin").display()));
        command
    }

    /// A folder of numbered PNG files.
    pub fn images(&self, name: &str, count: usize) {
        fs::create_dir_all(self.path(name)).unwrap();
        for k in 0..count {
            let image =
                RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, film(k, WIDTH, HEIGHT)).unwrap();
            image.save(self.path(name).join(format!("{k}.png"))).unwrap();
        }
    }

    /// A folder of frames in which the target turns by 60 degrees; returns its box in the first
    /// frame.
    pub fn turning(&self, name: &str, count: usize) -> String {
        let pose = |frame: usize, degrees: f64| {
            let (frame, centre) = (frame as f64, [120.0, 90.0]);
            KeyPose { frame, centre, scale: 1.0, degrees }
        };
        let path = vec![pose(0, 0.0), pose(count - 1, 60.0)];
        let scene = Scene::new(SceneConfig { frames: count, path, ..SceneConfig::simple() });
        fs::create_dir_all(self.path(name)).unwrap();
        for k in 0..count {
            let frame = scene.frame(k);
            let (width, height) = (frame.width as u32, frame.height as u32);
            let image = RgbImage::from_raw(width, height, frame.rgb).unwrap();
            image.save(self.path(name).join(format!("{k}.png"))).unwrap();
        }
        let [x, y, w, h] = scene.truth(0).bbox;
        format!("{x},{y},{w},{h}")
    }

    pub fn mp4(&self, name: &str, count: usize) -> PathBuf {
        let file = fs::File::create(self.path(name)).unwrap();
        let rate = FrameRate { frames: 25, seconds: 1 };
        let mut writer = Mp4Writer::new(file, WIDTH, HEIGHT, rate, Some(count)).unwrap();
        (0..count).for_each(|k| writer.push(&film(k, WIDTH, HEIGHT)).unwrap());
        writer.finish().unwrap();
        self.path(name)
    }

    pub fn lines(&self, name: &str) -> Vec<String> {
        fs::read_to_string(self.path(name)).unwrap().lines().map(str::to_string).collect()
    }

    /// Temporary files that were left in the folder.
    pub fn leftovers(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap().path());
        let is_temporary =
            |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with(".patchlock-");
        entries.filter(is_temporary).collect()
    }
}

pub fn patchlock() -> Command {
    let mut command = Command::cargo_bin("patchlock").unwrap();
    // Nothing is written to the home of whoever runs the tests.
    command.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
}

/// RGB pixels of a textured card in front of a smooth background; it moves one pixel per frame to
/// the right.
pub fn film(k: usize, width: usize, height: usize) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as i64 - 20 - k as i64, y as i64 - 18);
            if (0..32).contains(&u) && (0..28).contains(&v) {
                let tile = (u / 5 * 3 + v / 5 * 7) % 5;
                rgb.extend([60 + 40 * tile as u8, 220 - 30 * tile as u8, 40 + 6 * (u as u8)]);
            } else {
                rgb.extend([40 + (x as u8) / 2, 60 + (y as u8), 90]);
            }
        }
    }
    rgb
}

/// The film as 4:4:4 Y4M. The planes hold RGB instead of YUV; only the motion matters.
pub fn y4m(count: usize) -> Vec<u8> {
    let mut data = format!("YUV4MPEG2 W{WIDTH} H{HEIGHT} F25:1 C444\n").into_bytes();
    for k in 0..count {
        data.extend(b"FRAME\n");
        let rgb = film(k, WIDTH, HEIGHT);
        (0..3).for_each(|plane| data.extend(rgb.iter().skip(plane).step_by(3)));
    }
    data
}

pub fn grey16(file: &Path, k: usize) {
    let rgb = film(k, WIDTH, HEIGHT);
    let samples: Vec<u16> =
        rgb.chunks_exact(3).map(|p| u16::from(p[0]) * 12 + u16::from(p[1]) % 12).collect();
    let image: ImageBuffer<Luma<u16>, _> =
        ImageBuffer::from_raw(WIDTH as u32, HEIGHT as u32, samples).unwrap();
    image.save(file).unwrap();
}

pub fn grey_jpeg(file: &Path, k: usize) {
    let rgb = film(k, WIDTH, HEIGHT);
    let samples = rgb.chunks_exact(3).map(|p| p[1]).collect();
    GrayImage::from_raw(WIDTH as u32, HEIGHT as u32, samples).unwrap().save(file).unwrap();
}

/// The values of a column.
pub fn column(lines: &[String], name: &str) -> Vec<f64> {
    let place = lines[0].split(',').position(|column| column == name).unwrap();
    lines[1..].iter().map(|line| line.split(',').nth(place).unwrap().parse().unwrap()).collect()
}
