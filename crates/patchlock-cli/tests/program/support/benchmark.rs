//! A synthetic benchmark in the OTB layout, and settings that track it quickly.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

use super::{Bench, patchlock};

/// Few particles and patches: a frame takes milliseconds.
const QUICK: &str = "small_step = 8\n[paper]\nparticles = 20\n";

/// A test folder with a dataset `data`.
pub struct Benchmark {
    pub bench: Bench,
}

impl Benchmark {
    /// Targets A, B, C ... on the same film with this number of frames.
    pub fn new(targets: usize, frames: usize) -> Self {
        let bench = Bench::new();
        fs::write(bench.path("quick.toml"), QUICK).unwrap();
        for name in ["A", "B", "C", "D", "E", "F"].iter().take(targets) {
            bench.images(&format!("data/{name}/img"), frames);
            // The film's card starts at 20, 18 and moves one pixel per frame; files count from 1.
            let truth: String = (0..frames).map(|k| format!("{},19,32,28\n", 21 + k)).collect();
            fs::write(bench.path(&format!("data/{name}/groundtruth_rect.txt")), truth).unwrap();
        }
        Self { bench }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.bench.path(name)
    }

    /// `patchlock ARGUMENTS ...` in the folder.
    pub fn patchlock(&self, arguments: &[&str]) -> Command {
        let mut command = patchlock();
        command.current_dir(self.bench.folder.path()).args(arguments);
        command
    }

    /// `patchlock bench data --config quick.toml --out OUT ...`.
    pub fn bench(&self, out: &str, more: &[&str]) -> Command {
        let mut command =
            self.patchlock(&["bench", "data", "--config", "quick.toml", "--out", out]);
        command.args(more);
        command
    }

    /// Every trajectory below a folder, by path.
    pub fn trajectories(&self, out: &str) -> BTreeMap<String, String> {
        let mut found = BTreeMap::new();
        let root = self.path(out);
        collect(&root, &root, &mut found);
        found
    }
}

fn collect(root: &Path, folder: &Path, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(root, &path, found);
        } else if path.extension().is_some_and(|end| end == "txt") {
            let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
            found.insert(name, fs::read_to_string(&path).unwrap());
        }
    }
}
