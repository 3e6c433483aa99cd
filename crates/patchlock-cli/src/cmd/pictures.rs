//! The options of annotated videos.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use patchlock_media::FrameRate;

use super::{on_or_off, positive};
use crate::failure::{Failure, usage};
use crate::output::Sink;
use crate::output::background_sink::BackgroundSink;
use crate::output::gif::{self, Gif};
use crate::output::pending::PendingFile;
use crate::output::video::{self, QUALITY, Video};
use crate::output::view::View;

/// The part around a target, in sides of its box.
const CROP: std::ops::RangeInclusive<f64> = 1.0..=20.0;

/// What is drawn, and into which files.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("pictures").args(["video", "gif"]).multiple(true)))]
pub struct PictureArgs {
    /// Save a video (MP4, H.264) with the track drawn in
    ///
    /// It has box, outline, visible patches, score and frame number. Lines are solid while the
    /// target is tracked and dashed while it is uncertain; while it is lost, the last box is grey.
    /// Frames keep the times of the source; without times, there are 30 per second. Sound is left
    /// out. If ffmpeg with libx264 is installed, it encodes long videos, which is several times as
    /// fast.
    // Among the first options of the help.
    #[arg(long, value_name = "FILE.mp4", help_heading = None::<&str>)]
    pub video: Option<PathBuf>,

    /// Quantiser of --video, from 0 (best picture, largest file) to 51
    ///
    /// 6 more roughly halve the size.
    #[arg(
        long,
        value_name = "0..51",
        default_value_t = QUALITY,
        requires = "video",
        value_parser = clap::value_parser!(u8).range(0..=51)
    )]
    quality: u8,

    /// Save the video as an animated GIF
    ///
    /// It has ten frames per second, and is at most 480 pixels wide.
    #[arg(long, value_name = "FILE.gif")]
    pub gif: Option<PathBuf>,

    /// Largest size of --gif in MB
    ///
    /// To keep it, the GIF is smaller, or has fewer colours or frames.
    #[arg(
        long,
        value_name = "1..",
        default_value = "8",
        requires = "gif",
        value_parser = positive::<usize>()
    )]
    gif_mb: usize,

    /// Show only the part around the target in --video and --gif
    ///
    /// It is this many times as wide as the larger side of the target's box. Only for a single target.
    #[arg(long, value_name = "1..20", requires = "pictures")]
    crop: Option<f64>,

    /// Panels with score and patches in --video and --gif [default: on]
    ///
    /// Panels avoid the target.
    #[arg(long, value_name = "WHETHER", requires = "pictures", value_parser = on_or_off())]
    panel: Option<bool>,
}

impl PictureArgs {
    /// Checks --crop for one target, or for `many`.
    pub fn check_crop(&self, many: bool) -> Result<(), Failure> {
        let Some(crop) = self.crop else { return Ok(()) };
        if !CROP.contains(&crop) {
            let message = format!("--crop {crop}: must be {} to {}", CROP.start(), CROP.end());
            return Err(usage(message).hint("--crop 4 shows a square four times the target's side"));
        }
        if many {
            return Err(usage("--crop shows the part around one target, and there are several")
                .hint("leave it out, or track one target at a time"));
        }
        Ok(())
    }

    /// Checks the names of the files.
    pub fn check_names(&self) -> Result<(), Failure> {
        self.video.as_deref().map_or(Ok(()), video::check_name)?;
        self.gif.as_deref().map_or(Ok(()), gif::check_name)
    }

    /// Opens the videos, of frames at this rate.
    pub fn open(
        &self,
        create: impl Fn(&Path) -> Result<PendingFile, Failure>,
        rate: FrameRate,
        expected: Option<usize>,
    ) -> Result<Vec<Box<dyn Sink>>, Failure> {
        let view = || View::new(self.panel.unwrap_or(true), self.crop);
        let mut sinks: Vec<Box<dyn Sink>> = Vec::new();
        if let Some(path) = &self.video {
            let video = Video::new(create(path)?, rate, view(), self.quality, expected);
            sinks.push(Box::new(BackgroundSink::new(Box::new(video))));
        }
        if let Some(path) = &self.gif {
            let gif = Gif::new(create(path)?, rate, view(), self.gif_mb, expected);
            sinks.push(Box::new(BackgroundSink::new(Box::new(gif))));
        }
        Ok(sinks)
    }
}
