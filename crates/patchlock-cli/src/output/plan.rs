//! Which files a run writes. All are checked before the work starts and opened before the first
//! frame.

use std::path::{Path, PathBuf};

use anyhow::Result;
use patchlock_media::FrameRate;

use super::Sink;
use super::background_sink::BackgroundSink;
use super::gif::{self, Gif};
use super::inputs::{Inputs, resolved};
use super::pending::{self, PendingFile};
use super::row::LostPosition;
use super::tables::{Format, Stdout, Table};
use super::video::{self, Video};
use super::view::{Style, View};
use crate::failure::{Failure, usage};

/// The outputs that the command line asks for.
#[derive(Debug)]
pub struct Plan {
    tables: Vec<(Format, PathBuf)>,
    pictures: Pictures,
    summary: Option<PathBuf>,
    overwrite: bool,
    /// Whether the boxes also go to a project.
    into_project: bool,
}

/// The annotated videos.
#[derive(Debug, Clone)]
pub struct Pictures {
    pub video: Option<PathBuf>,
    /// The quantiser of the video.
    pub quality: u8,
    pub gif: Option<PathBuf>,
    /// Most MB of the GIF.
    pub gif_megabytes: usize,
    /// How frames are shown in both.
    pub style: Style,
}

pub struct Outputs {
    /// The outputs that receive tracked frames.
    pub sinks: Vec<Box<dyn Sink>>,
    pub summary: Option<PendingFile>,
}

impl Plan {
    /// Checks names, duplicates and existing files.
    pub fn check(
        save: &[PathBuf],
        pictures: Pictures,
        summary: Option<&Path>,
        overwrite: bool,
        inputs: &Inputs,
    ) -> Result<Self, Failure> {
        let table = |path: &PathBuf| Format::of(path).map(|format| (format, path.clone()));
        let tables: Result<Vec<_>, _> = save.iter().map(table).collect();
        pictures.video.as_deref().map_or(Ok(()), video::check_name)?;
        pictures.gif.as_deref().map_or(Ok(()), gif::check_name)?;
        let plan = Self {
            tables: tables?,
            pictures,
            summary: summary.map(Path::to_path_buf),
            overwrite,
            into_project: false,
        };
        let mut taken: Vec<PathBuf> = Vec::new();
        for path in plan.paths() {
            pending::check(path, overwrite)?;
            inputs.check(path)?;
            let place = resolved(path);
            if taken.contains(&place) {
                return Err(usage(format!("{} is given for two outputs", path.display()))
                    .hint("give each its own name"));
            }
            taken.push(place);
        }
        Ok(plan)
    }

    /// The same files, beside a project or not.
    pub fn with_project(self, into_project: bool) -> Self {
        Self { into_project, ..self }
    }

    /// All files, in the order of the options.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let tables = self.tables.iter().map(|(_, path)| path.as_path());
        let Pictures { video, gif, .. } = &self.pictures;
        tables.chain(video.as_deref()).chain(gif.as_deref()).chain(self.summary.as_deref())
    }

    /// Whether the table goes to standard output, which it does if no file and no project is given.
    pub fn prints(&self) -> bool {
        !self.into_project && self.paths().next().is_none()
    }

    pub fn open(
        &self,
        lost: LostPosition,
        rate: FrameRate,
        expected: Option<usize>,
    ) -> Result<Outputs> {
        let create = |path: &PathBuf| PendingFile::create(path, self.overwrite);
        let mut sinks: Vec<Box<dyn Sink>> = Vec::new();
        for (format, path) in &self.tables {
            sinks.push(Box::new(Table::new(*format, lost, create(path)?.keep_partial())));
        }
        let Pictures { video, quality, gif, gif_megabytes, style } = &self.pictures;
        if let Some(path) = video {
            let video = Video::new(create(path)?, rate, View::new(*style), *quality, expected);
            sinks.push(Box::new(BackgroundSink::new(Box::new(video))));
        }
        if let Some(path) = gif {
            let gif = Gif::new(create(path)?, rate, View::new(*style), *gif_megabytes, expected);
            sinks.push(Box::new(BackgroundSink::new(Box::new(gif))));
        }
        let summary = self.summary.as_ref().map(create).transpose()?;
        if self.prints() {
            sinks.push(Box::new(Stdout::new(lost)));
        }
        Ok(Outputs { sinks, summary })
    }
}
