//! The options of annotated videos.

use std::path::PathBuf;

use clap::builder::RangedU64ValueParser;
use clap::{ArgGroup, Args};

use super::on_or_off;
use crate::failure::{Failure, usage};
use crate::output::plan::Pictures;
use crate::output::video::QUALITY;
use crate::output::view::Style;

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
        allow_negative_numbers = true,
        requires = "video",
        value_parser = clap::value_parser!(u8).range(0..=51)
    )]
    quality: u8,

    /// Save the video as an animated GIF
    ///
    /// It has ten frames per second, and is at most 480 pixels wide.
    #[arg(long, value_name = "FILE.gif")]
    gif: Option<PathBuf>,

    /// Largest size of --gif in MB
    ///
    /// To keep it, the GIF is smaller, or has fewer colours or frames.
    #[arg(
        long,
        value_name = "1..",
        default_value = "8",
        allow_negative_numbers = true,
        requires = "gif",
        value_parser = RangedU64ValueParser::<usize>::new().range(1..)
    )]
    gif_mb: usize,

    /// Show only the part around the target in --video and --gif
    ///
    /// It is this many times as wide as the larger side of the target's box. Only for a single target.
    #[arg(long, value_name = "1..20", allow_negative_numbers = true, requires = "pictures")]
    crop: Option<f64>,

    /// Panels with score and patches in --video and --gif [default: on]
    ///
    /// Panels avoid the target.
    #[arg(long, value_name = "WHETHER", requires = "pictures", value_parser = on_or_off())]
    panel: Option<bool>,
}

impl PictureArgs {
    /// The videos to write of one target, or of `many`.
    pub fn plan(&self, many: bool) -> Result<Pictures, Failure> {
        if let Some(crop) = self.crop {
            if !CROP.contains(&crop) {
                let message = format!("--crop {crop}: must be {} to {}", CROP.start(), CROP.end());
                return Err(
                    usage(message).hint("--crop 4 shows a square four times the target's side")
                );
            }
            if many {
                return Err(usage(
                    "--crop shows the part around one target, and there are several",
                )
                .hint("leave it out, or track one target at a time"));
            }
        }
        let style = Style { panels: self.panel.unwrap_or(true), crop: self.crop };
        let (video, gif) = (self.video.clone(), self.gif.clone());
        Ok(Pictures { video, quality: self.quality, gif, gif_megabytes: self.gif_mb, style })
    }
}
