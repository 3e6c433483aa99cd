//! Words the errors of the libraries for the command line: messages that name options, and hints.
//! Every match over an error type is exhaustive where it chooses a hint, so a new error cannot be
//! forgotten.

use patchlock::{Parameter, Preset};
use patchlock_bench::dataset::selection::SelectionError;
use patchlock_media::image_file::EXTENSIONS;
use patchlock_media::{Container, FrameFault, RangeError};
use patchlock_studio::project;
use patchlock_track::settings::{Origin, SettingsError, allowed, near_names};

/// Describes the syntax of a box on the command line.
pub const BOX: &str = "a box is X,Y,W,H in pixels: left and top edge counted from 0, width and height, such \
                       as 120,80,64,48";
const READ: &str = "check that the path is right and that you have permission to read it";
const WRITE: &str = "choose a folder that you can write to, and check the free disk space";
const KEPT: &str = "the frames tracked before it are kept";

/// The message of an error of a frame source.
pub fn media_message(error: &patchlock_media::Error) -> String {
    use patchlock_media::Error;
    match error {
        Error::Range(RangeError::ZeroStride) => "--stride is 0; it must be at least 1".to_string(),
        Error::Range(RangeError::Empty { start, end }) => {
            format!("--end {end} is not after --start {start}: no frame is left to track")
        }
        Error::Range(RangeError::Beyond { start, length: Some(length) }) => {
            format!("--start {start} is beyond the end: the source has {length} frames")
        }
        Error::Range(RangeError::Beyond { start, length: None }) => {
            format!("--start {start} is beyond the end of the source")
        }
        Error::StreamEnd { name, reason } => {
            format!("cannot read {name} to its end, which --reverse needs: {reason}")
        }
        Error::StreamCopy { name, folder, reason } => format!(
            "cannot copy {name} to a temporary file in {}, which --reverse needs: {reason}",
            folder.display()
        ),
        error => error.to_string(),
    }
}

/// The hint for an error of a frame source.
pub fn media_hint(error: &patchlock_media::Error) -> Option<String> {
    use patchlock_media::Error;
    let hint = match error {
        Error::Range(error) => return Some(range_hint(error)),
        Error::TooLarge { size, .. } => {
            return Some(format!(
                "if that is its true size, --max-pixels {} accepts it; a frame then takes {} MB or more",
                size.pixels,
                size.megabytes()
            ));
        }
        Error::TooManyPixels { limit, .. } => {
            return Some(format!("--max-pixels accepts more than {limit}"));
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
            "name a folder of images, a pattern such as img/%04d.jpg, a glob, a video file, or - for \
             Y4M on stdin"
        }
        Error::Endless { .. } => {
            "a program can write Y4M to standard input: PROGRAM | patchlock track - ..."
        }
        Error::NoMatch { is_glob: true, .. } => {
            "quote the glob, so that the shell does not expand it"
        }
        Error::NoMatch { is_glob: false, .. } => {
            "%d stands for a number, %04d for one padded to four digits"
        }
        Error::NoVideo { .. } => "name a file with a video",
        Error::FfmpegMissing { .. } => {
            "install ffmpeg, or convert the video elsewhere to an MP4 with 8-bit 4:2:0 H.264 (yuv420p)"
        }
        Error::Unreadable { container, .. } => return container.map(container_hint),
        Error::Image { .. } => {
            return Some(format!("replace or remove that file; {KEPT}"));
        }
        Error::Frame { fault, .. } => return Some(frame_hint(*fault)),
        Error::DecoderEnded { .. } => "re-encode the video: ffmpeg -i IN -c:v libx264 OUT.mp4",
        Error::StreamEnd { .. } => {
            "without --reverse, the frames before the error are tracked and kept"
        }
        Error::StreamCopy { .. } => {
            "make room there, or set TMPDIR to a folder with room for the uncompressed video"
        }
        Error::NoFrames | Error::Write(_) | Error::Encode(_) => return None,
    };
    Some(hint.to_string())
}

fn range_hint(error: &RangeError) -> String {
    match error {
        RangeError::ZeroStride => "--stride 1 takes every frame".to_string(),
        RangeError::Empty { .. } => {
            "--end is the first frame that is not tracked; without it, tracking goes to the last frame"
                .to_string()
        }
        RangeError::Beyond { length: None, .. } => "frames count from 0".to_string(),
        RangeError::Beyond { length: Some(length), .. } => {
            format!("frames count from 0, so the last one is {}", length.saturating_sub(1))
        }
    }
}

/// The hint for a source in this container that cannot be opened.
fn container_hint(container: Container) -> String {
    let hint = match container {
        Container::Y4m => {
            "this writes a supported stream: ffmpeg -i IN -f yuv4mpegpipe -pix_fmt yuv420p -"
        }
        Container::Mp4 => "the file may be truncated or still being written: copy it again",
        Container::Other => {
            "convert the video to an MP4 with 8-bit 4:2:0 H.264 (yuv420p), and track that"
        }
    };
    hint.to_string()
}

/// The hint for a frame of a video that cannot be read.
fn frame_hint(fault: FrameFault) -> String {
    match fault {
        FrameFault::Unreadable => KEPT.to_string(),
        FrameFault::Damaged => {
            format!("{KEPT}; skip it with --end before it and --start after it")
        }
        FrameFault::Unsupported => format!(
            "{KEPT}; to convert the video: ffmpeg -i IN -c:v libx264 -pix_fmt yuv420p OUT.mp4"
        ),
    }
}

/// The message of an error of a session, a setting or an export.
pub fn track_message(error: &patchlock_track::Error) -> String {
    match error {
        patchlock_track::Error::Media(error) => media_message(error),
        patchlock_track::Error::Settings(error) => settings_message(error),
        error => error.to_string(),
    }
}

/// The message of an error of settings.
fn settings_message(error: &SettingsError) -> String {
    match error {
        SettingsError::Setting { origin: Origin::Single, error } => format!("--set: {error}"),
        SettingsError::Assignment { .. } => format!("--set: {error}"),
        error => error.to_string(),
    }
}

/// The hint for an error of a session, a setting or an export.
pub fn track_hint(error: &patchlock_track::Error) -> Option<String> {
    use patchlock_track::Error;
    let hint = match error {
        Error::Settings(error) => return settings_hint(error),
        Error::Media(error) => return media_hint(error),
        Error::Threads(_) | Error::TrackerInFrame { .. } => return None,
        Error::Read { .. } => READ,
        Error::Write { .. } => WRITE,
        Error::Frame { .. } => "replace the file",
        Error::Export(_) => "patchlock export --help describes what each format needs",
        Error::Line { .. } => "a line is x,y,w,h; a missing box is NaN,NaN,NaN,NaN",
        Error::StartBoxShape { .. } => BOX,
        Error::StartBoxOutside { .. } => {
            "the box is for the first tracked frame; with --reverse that is the last frame of the range"
        }
    };
    Some(hint.to_string())
}

/// The hint for an error of settings.
fn settings_hint(error: &SettingsError) -> Option<String> {
    Some(match error {
        SettingsError::Preset { .. } => {
            format!("the presets are {}", Preset::ALL.map(Preset::name).join(", "))
        }
        SettingsError::Unreadable { .. } => {
            "patchlock config > my.toml writes one to start from".to_string()
        }
        SettingsError::NoToml { .. } => {
            "each line is name = value, with text values in quotes".to_string()
        }
        SettingsError::TwoMethods { .. } => "keep the table of one method".to_string(),
        SettingsError::Assignment { .. } => {
            "write it as search=7; patchlock config shows all settings".to_string()
        }
        SettingsError::Setting { error, .. } => return setting_hint(error),
    })
}

fn setting_hint(error: &patchlock::Error) -> Option<String> {
    Some(match error {
        patchlock::Error::UnknownSetting { name } => match near_names(name) {
            near if near.is_empty() => "patchlock config shows all settings".to_string(),
            near => {
                format!("did you mean {}? patchlock config shows all settings", near.join(" or "))
            }
        },
        patchlock::Error::UnusedSetting { owner, .. } => {
            format!("--preset {owner} chooses the method that uses it")
        }
        patchlock::Error::SettingKind { name, .. } => {
            let parameter = Parameter::named(name)?;
            format!("{name} takes: {}", allowed(parameter))
        }
        patchlock::Error::Config { .. } => {
            "patchlock config shows every setting with its range".to_string()
        }
        _ => return None,
    })
}

/// The message of an error of the benchmark.
pub fn bench_message(error: &patchlock_bench::Error) -> String {
    use patchlock_bench::Error;
    match error {
        Error::CommandLine(command) => format!("--cmd {command}: not a valid command line"),
        Error::FolderName(name) => format!("--name {name:?}: not a valid folder name"),
        Error::Selection(error @ SelectionError::Name { .. }) => format!("--sequences: {error}"),
        Error::Selection(error @ SelectionError::Attribute { .. }) => {
            format!("--attributes: {error}")
        }
        Error::Selection(SelectionError::Nothing) => {
            "no target is selected: none of the --sequences has any of the --attributes".to_string()
        }
        Error::Track(error) => track_message(error),
        error => error.to_string(),
    }
}

/// The hint for an error of the benchmark.
pub fn bench_hint(error: &patchlock_bench::Error) -> Option<String> {
    use patchlock_bench::Error;
    let hint = match error {
        Error::Selection(error) => return Some(selection_hint(error)),
        Error::Track(error) => return track_hint(error),
        Error::NoDataset { .. } => {
            "name the folder of the sequences; patchlock dataset DIR lists what a folder holds"
        }
        Error::NoResults { .. } => {
            "name a tracker's folder with one text file per target, or a folder of such folders"
        }
        Error::Manifest { .. } => "remove the file, so that the run is made again",
        Error::Conflict { .. } => "choose another name with --name, or another folder with --out",
        Error::Sequence(_) => "patchlock dataset DIR lists the problems of each sequence",
        Error::Tracker { .. } | Error::Subject(_) => "the other sequences are not affected",
        Error::NothingToCompare { .. } => {
            "patchlock score RESULTS --truth DATASET lists the trackers and targets"
        }
        Error::Picture { .. } => "this is a bug in Patchlock: please report it",
        Error::NoFrames { .. } => {
            "name the folder of the sequences; patchlock dataset DIR shows what was detected"
        }
        Error::CommandLine(_) => "quote it as in a shell: --cmd \"python3 'my tracker.py'\"",
        Error::FolderName(_) => "use letters, digits, - and _, at most 200 of them",
    };
    Some(hint.to_string())
}

fn selection_hint(error: &SelectionError) -> String {
    match error {
        SelectionError::Name { near, .. } if near.is_empty() => {
            "patchlock dataset DIR lists the targets".to_string()
        }
        SelectionError::Name { near, .. } => format!("did you mean {}?", near.join(" or ")),
        SelectionError::Attribute { known, .. } if known.is_empty() => {
            "the attributes of this dataset are unknown; attributes.csv beside it can define them"
                .to_string()
        }
        SelectionError::Attribute { known, .. } => {
            format!("the attributes are {}", known.join(", "))
        }
        SelectionError::Nothing => {
            "patchlock dataset DIR lists the targets with their attributes".to_string()
        }
    }
}

/// The message of an error of a project.
pub fn project_message(error: &project::Error) -> String {
    match error {
        project::Error::Video(error) => media_message(error),
        project::Error::Export(error) => track_message(error),
        error => error.to_string(),
    }
}

/// The hint for an error of a project.
pub fn project_hint(error: &project::Error) -> Option<String> {
    use project::Error;
    let hint = match error {
        Error::Video(error) => return media_hint(error),
        Error::Export(error) => return track_hint(error),
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
        Error::OtherVideo { .. } => "name another project file with --project",
        Error::Import(_) => "docs/annotating.md says what is read from each format",
    };
    Some(hint.to_string())
}
