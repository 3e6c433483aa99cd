//! Words the errors of the libraries for Python: messages that name keyword arguments, each with its advice.
//! Every match over an error type is exhaustive where it chooses advice, so a new error cannot be forgotten.

use patchlock::Preset;
use patchlock_bench::dataset::selection::SelectionError;
use patchlock_media::image_file::EXTENSIONS;
use patchlock_media::{Container, FrameFault, RangeError};
use patchlock_studio::project;
use patchlock_track::settings::{SettingsError, near_names};

const CONVERT: &str = "convert the video to an MP4 with 8-bit 4:2:0 H.264 (yuv420p)";
const READ: &str = "check that the path is right and that you have permission to read it";
const WRITE: &str = "choose a folder that you can write to, and check the free disk space";
const BOX: &str =
    "a box is (x, y, w, h) in pixels: left and top edge counted from 0, width and height";

fn joined(message: String, advice: Option<String>) -> String {
    match advice {
        Some(advice) => format!("{message} ({advice})"),
        None => message,
    }
}

/// The text for an error of a frame source.
pub fn media(error: &patchlock_media::Error) -> String {
    joined(media_message(error), media_advice(error))
}

/// The text for an error of a session, a setting or an export.
pub fn track(error: &patchlock_track::Error) -> String {
    joined(track_message(error), track_advice(error))
}

/// The text for an error of the benchmark.
pub fn bench(error: &patchlock_bench::Error) -> String {
    joined(bench_message(error), bench_advice(error))
}

/// The text for an error of a project.
pub fn project(error: &project::Error) -> String {
    joined(project_message(error), project_advice(error))
}

fn media_message(error: &patchlock_media::Error) -> String {
    use patchlock_media::Error;
    match error {
        Error::Range(RangeError::ZeroStride) => "stride is 0; it must be at least 1".to_string(),
        Error::Range(RangeError::Empty { start, end }) => {
            format!("end={end} is not after start={start}: no frame is left to track")
        }
        Error::Range(RangeError::Beyond { start, length: Some(length) }) => {
            format!("start={start} is beyond the end: the source has {length} frames")
        }
        Error::Range(RangeError::Beyond { start, length: None }) => {
            format!("start={start} is beyond the end of the source")
        }
        error => error.to_string(),
    }
}

fn media_advice(error: &patchlock_media::Error) -> Option<String> {
    use patchlock_media::Error;
    let advice = match error {
        Error::Range(error) => return Some(range_advice(error)),
        Error::TooLarge { size, .. } => {
            return Some(format!(
                "if that is its true size, max_pixels={} accepts it; a frame then takes {} MB or more",
                size.pixels,
                size.megabytes()
            ));
        }
        Error::TooManyPixels { limit, .. } => {
            return Some(format!("max_pixels accepts more than {limit}"));
        }
        Error::NoImages { inner: Some(inner), .. } => {
            return Some(format!(
                "the folder {} has images: name that folder instead",
                inner.display()
            ));
        }
        Error::NoImages { inner: None, .. } => {
            return Some(format!("the image formats are {}", EXTENSIONS.join(", ")));
        }
        Error::Missing { .. } => {
            "name a folder of images, a pattern such as img/%04d.jpg, a glob, a video file, or \"-\" \
             for Y4M on standard input"
        }
        Error::Endless { .. } => "a program can write Y4M to standard input, which is \"-\"",
        Error::NoMatch { is_glob: true, .. } => "check the folder and the extension",
        Error::NoMatch { is_glob: false, .. } => {
            "%d stands for a number, %04d for one padded to four digits"
        }
        Error::NoVideo { .. } => "name a file with a video",
        Error::FfmpegMissing { .. } => {
            return Some(format!("install ffmpeg, or {CONVERT} elsewhere"));
        }
        Error::Unreadable { container: None, .. } => return None,
        Error::Unreadable { container: Some(Container::Y4m), .. } => {
            "this writes a supported stream: ffmpeg -i IN -f yuv4mpegpipe -pix_fmt yuv420p -"
        }
        Error::Unreadable { container: Some(Container::Mp4), .. } => {
            "the file may be truncated or still being written: copy it again"
        }
        Error::Unreadable { container: Some(Container::Other), .. }
        | Error::Frame { fault: FrameFault::Unsupported, .. }
        | Error::DecoderEnded { .. } => CONVERT,
        Error::Image { .. } => "replace or remove that file",
        Error::Frame { fault: FrameFault::Damaged, .. } => {
            "skip it with end before it and start after it"
        }
        Error::StreamEnd { .. } => "with reverse=False, the frames before the error can be used",
        Error::StreamCopy { .. } => {
            "make room there, or set TMPDIR to a folder with room for the uncompressed video"
        }
        Error::Frame { fault: FrameFault::Unreadable, .. }
        | Error::NoFrames
        | Error::Write(_)
        | Error::Encode(_) => return None,
    };
    Some(advice.to_string())
}

fn range_advice(error: &RangeError) -> String {
    match error {
        RangeError::ZeroStride => "stride=1 takes every frame".to_string(),
        RangeError::Empty { .. } => {
            "end is the first frame that is not tracked; without it, tracking goes to the last frame"
                .to_string()
        }
        RangeError::Beyond { length: None, .. } => "frames count from 0".to_string(),
        RangeError::Beyond { length: Some(length), .. } => {
            format!("frames count from 0, so the last one is {}", length.saturating_sub(1))
        }
    }
}

fn track_message(error: &patchlock_track::Error) -> String {
    match error {
        patchlock_track::Error::Media(error) => media_message(error),
        error => error.to_string(),
    }
}

fn track_advice(error: &patchlock_track::Error) -> Option<String> {
    use patchlock_track::Error;
    let advice = match error {
        Error::Settings(error) => return settings_advice(error),
        Error::Media(error) => return media_advice(error),
        Error::Export(_) | Error::Threads(_) | Error::TrackerInFrame { .. } => return None,
        Error::Read { .. } => READ,
        Error::Write { .. } => WRITE,
        Error::Frame { .. } => "replace the file",
        Error::Line { .. } => "a line is x,y,w,h; a missing box is NaN,NaN,NaN,NaN",
        Error::StartBoxShape { .. } => BOX,
        Error::StartBoxOutside { .. } => {
            "the box is for the first tracked frame; with reverse=True that is the last frame of the \
             range"
        }
    };
    Some(advice.to_string())
}

fn settings_advice(error: &SettingsError) -> Option<String> {
    let near = |name| Some(near_names(name)).filter(|near| !near.is_empty());
    match error {
        SettingsError::Preset { .. } => {
            Some(format!("the presets are {}", Preset::ALL.map(Preset::name).join(", ")))
        }
        SettingsError::NoToml { .. } => {
            Some("each line is name = value, with text values in quotes".to_string())
        }
        SettingsError::TwoMethods { .. } => Some("keep the table of one method".to_string()),
        SettingsError::Setting { error: patchlock::Error::UnknownSetting { name }, .. } => {
            near(name).map(|near| format!("did you mean {}?", near.join(" or ")))
        }
        SettingsError::Unreadable { .. }
        | SettingsError::Assignment { .. }
        | SettingsError::Setting { .. } => None,
    }
}

fn bench_message(error: &patchlock_bench::Error) -> String {
    use patchlock_bench::Error;
    match error {
        Error::CommandLine(command) => format!("command {command}: not a valid command line"),
        Error::FolderName(name) => format!("name={name:?}: not a valid folder name"),
        Error::Selection(error @ SelectionError::Name { .. }) => format!("sequences: {error}"),
        Error::Selection(error @ SelectionError::Attribute { .. }) => {
            format!("attributes: {error}")
        }
        Error::Selection(SelectionError::Nothing) => {
            "no target is selected: none of sequences has any of attributes".to_string()
        }
        Error::Track(error) => track_message(error),
        error => error.to_string(),
    }
}

fn bench_advice(error: &patchlock_bench::Error) -> Option<String> {
    use patchlock_bench::Error;
    let advice = match error {
        Error::Selection(error) => return selection_advice(error),
        Error::Track(error) => return track_advice(error),
        Error::Sequence(_) | Error::NothingToCompare { .. } => return None,
        Error::NoDataset { .. } | Error::NoFrames { .. } => "name the folder of the sequences",
        Error::NoResults { .. } => {
            "name a tracker's folder with one text file per target, or a folder of such folders"
        }
        Error::Manifest { .. } => "remove the file, so that the run is made again",
        Error::Conflict { .. } => "choose another folder with name= or out=",
        Error::Tracker { .. } | Error::Subject(_) => "the other sequences are not affected",
        Error::Picture { .. } => "this is a bug in Patchlock: please report it",
        Error::CommandLine(_) => "quote it as in a shell: command=\"python3 'my tracker.py'\"",
        Error::FolderName(_) => "use letters, digits, - and _, at most 200 of them",
    };
    Some(advice.to_string())
}

fn selection_advice(error: &SelectionError) -> Option<String> {
    match error {
        SelectionError::Name { near, .. } if near.is_empty() => None,
        SelectionError::Name { near, .. } => Some(format!("did you mean {}?", near.join(" or "))),
        SelectionError::Attribute { known, .. } if known.is_empty() => Some(
            "the attributes of this dataset are unknown; attributes.csv beside it can define them"
                .to_string(),
        ),
        SelectionError::Attribute { known, .. } => {
            Some(format!("the attributes are {}", known.join(", ")))
        }
        SelectionError::Nothing => None,
    }
}

fn project_message(error: &project::Error) -> String {
    match error {
        project::Error::Video(error) => media_message(error),
        project::Error::Export(error) => track_message(error),
        error => error.to_string(),
    }
}

fn project_advice(error: &project::Error) -> Option<String> {
    use project::Error;
    let advice = match error {
        Error::Video(error) => return media_advice(error),
        Error::Export(error) => return track_advice(error),
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
        Error::OtherVideo { .. } => "name another project file with path=",
        Error::Import(_) => "docs/annotating.md says what is read from each format",
    };
    Some(advice.to_string())
}
