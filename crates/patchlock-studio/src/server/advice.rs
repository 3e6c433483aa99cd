//! Words hints for the page. The user of the page has the program's window beside it, but gives no
//! options.

use patchlock_media::image_file::EXTENSIONS;
use patchlock_media::{Container, FrameFault};

use crate::project;

const CONVERT: &str = "convert the video to an MP4 with 8-bit 4:2:0 H.264 (yuv420p)";
const READ: &str = "check that the path is right and that you have permission to read it";
const WRITE: &str = "choose a folder that you can write to, and check the free disk space";

/// The hint for an error of a video.
pub fn media(error: &patchlock_media::Error) -> Option<String> {
    use patchlock_media::Error;
    let hint = match error {
        Error::NoImages { inner: Some(inner), .. } => {
            return Some(format!("the folder {} has images", inner.display()));
        }
        Error::NoImages { inner: None, .. } => {
            return Some(format!("the image formats are {}", EXTENSIONS.join(", ")));
        }
        Error::TooLarge { .. } | Error::TooManyPixels { .. } => {
            "scale the video down, or start the studio with a higher limit of pixels"
        }
        Error::Missing { .. } => "check that the file has not been moved or removed",
        Error::Endless { .. } | Error::NoVideo { .. } => "open a file with a video",
        Error::FfmpegMissing { .. } => {
            return Some(format!("install ffmpeg, or {CONVERT} elsewhere"));
        }
        Error::Unreadable { container: Some(Container::Mp4), .. } => {
            "the file may be truncated or still being written: copy it again"
        }
        Error::Unreadable { container: Some(Container::Y4m | Container::Other), .. }
        | Error::Frame { fault: FrameFault::Unsupported, .. }
        | Error::DecoderEnded { .. } => CONVERT,
        Error::Image { .. } => "replace that file",
        Error::Frame { fault: FrameFault::Damaged | FrameFault::Unreadable, .. } => {
            "the frames before it can be used"
        }
        Error::StreamCopy { .. } => {
            "make room there, or set TMPDIR to a folder with room for the uncompressed video"
        }
        Error::Range(_)
        | Error::NoMatch { .. }
        | Error::NoFrames
        | Error::Unreadable { container: None, .. }
        | Error::StreamEnd { .. }
        | Error::Write(_)
        | Error::Encode(_) => return None,
    };
    Some(hint.to_string())
}

/// The hint for an error of an export.
pub fn track(error: &patchlock_track::Error) -> Option<String> {
    use patchlock_track::Error;
    let hint = match error {
        Error::Media(error) => return media(error),
        Error::Read { .. } => READ,
        Error::Write { .. } => WRITE,
        Error::Frame { .. } => "replace the file",
        Error::Export(_) => "docs/annotating.md says what each format holds",
        Error::Line { .. }
        | Error::Threads(_)
        | Error::TrackerInFrame { .. }
        | Error::StartBoxShape { .. }
        | Error::StartBoxOutside { .. }
        | Error::Settings(_) => return None,
    };
    Some(hint.to_string())
}

/// The hint for an error of a project.
pub fn project(error: &project::Error) -> Option<String> {
    use project::Error;
    let hint = match error {
        Error::Video(error) => return media(error),
        Error::Export(error) => return track(error),
        Error::Edit(_) => return None,
        Error::Read { .. } => READ,
        Error::Write { .. } => WRITE,
        Error::Invalid { .. } => {
            "docs/project-file.md describes the file; it is never written in part, so another program \
             changed it"
        }
        Error::Version { .. } => "use the version of Patchlock that wrote it, or a newer one",
        Error::Exists { .. } => "open it, or name another file",
        Error::InUse { .. } => "close it there, or work there",
        Error::Overtaken { .. } => "open it again, and repeat the changes",
        Error::OtherVideo { .. } => "start the studio with another project file",
        Error::Import(_) => "docs/annotating.md says what is read from each format",
    };
    Some(hint.to_string())
}
