//! Words the errors of the libraries for the command line: messages and hints that name options or
//! commands. The other hints are the errors' own advice.

use patchlock::{NetworkError, Parameter};
use patchlock_media::{FrameFault, RangeError};
use patchlock_studio::project;
use patchlock_track::settings::allowed;

/// Describes the syntax of a box on the command line.
pub const BOX: &str = "a box is X,Y,W,H in pixels: left and top edge counted from 0, width and height, such \
                       as 120,80,64,48";
const KEPT: &str = "the frames tracked before it are kept";

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
            "cannot copy {name} to a temporary file in {folder}, which --reverse needs: {reason}"
        ),
        error => error.to_string(),
    }
}

pub fn media_hint(error: &patchlock_media::Error) -> Option<String> {
    use patchlock_media::Error;
    let hint = match error {
        Error::Range(RangeError::ZeroStride) => "--stride 1 takes every frame",
        Error::Range(RangeError::Empty { .. }) => {
            "--end is the first frame that is not tracked; without it, tracking goes to the last frame"
        }
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
        Error::Missing { .. } => {
            "name a folder of images, a pattern such as img/%04d.jpg, a glob, a video file, an address \
             such as rtsp://host/path, the number of a camera, or - for Y4M on stdin"
        }
        Error::Endless(_) => {
            "a program can write Y4M to standard input: PROGRAM | patchlock track - ...; of cameras, \
             only /dev/video0, /dev/video1 and so on are known"
        }
        Error::NoMatch { is_glob: true, .. } => {
            "quote the glob, so that the shell does not expand it"
        }
        Error::Image { .. } => {
            return error.advice().map(|advice| format!("{advice}; {KEPT}"));
        }
        Error::Frame { fault, .. } => return Some(frame_hint(*fault)),
        Error::AddressList { name, .. } => {
            // A quoted address is one word of a shell.
            let address = match name.contains(['\'', '*']) {
                true => "ADDRESS".to_string(),
                false => format!("'{name}'"),
            };
            return Some(format!(
                "if you trust the list: ffmpeg -i {address} -f yuv4mpegpipe -pix_fmt yuv420p - | patchlock \
                 track - ...; with --live for the newest frame of a live stream"
            ));
        }
        Error::DecoderEnded { .. } => "re-encode the video: ffmpeg -i IN -c:v libx264 OUT.mp4",
        Error::StreamEnd { .. } => {
            "without --reverse, the frames before the error are tracked and kept"
        }
        _ => return error.advice(),
    };
    Some(hint.to_string())
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

pub fn track_message(error: &patchlock_track::Error) -> String {
    use patchlock_track::Error;
    match error {
        Error::Media(error) => media_message(error),
        Error::Setting(None, error) => format!("--set: {error}"),
        Error::Assignment(_) => format!("--set: {error}"),
        error => error.to_string(),
    }
}

pub fn track_hint(error: &patchlock_track::Error) -> Option<String> {
    use patchlock_track::Error;
    let hint = match error {
        Error::Media(error) => return media_hint(error),
        Error::LinkOutside(..) => "look at what it leads to; --follow-links copies it",
        Error::Export(_) => "patchlock export --help describes what each format needs",
        Error::StartBoxShape(..) => BOX,
        Error::StartBoxOutside(..) => {
            "the box is for the first tracked frame; with --reverse that is the last frame of the range"
        }
        Error::Settings(..) => "patchlock config > my.toml writes one to start from",
        Error::Assignment(_) => "write it as search=7; patchlock config shows all settings",
        Error::Setting(_, patchlock::Error::UnknownSetting { .. }) => {
            let all = "patchlock config shows all settings";
            return Some(error.advice().map_or(all.to_string(), |near| format!("{near} {all}")));
        }
        Error::Setting(_, error) => return setting_hint(error),
        Error::MissingModel(_) => "leave out --model none, or give another network",
        Error::UnusedModel(..) | Error::UnusedRuntime(_) => {
            "the presets robust and network use one"
        }
        Error::Model(_, NetworkError::Family { .. }) => {
            "patchlock model --help lists the networks that can be used"
        }
        Error::Runtime(_) => {
            "--runtime takes the library of onnxruntime 1.17 or later; without it, the built-in \
             runtime is used"
        }
        _ => return error.advice(),
    };
    Some(hint.to_string())
}

fn setting_hint(error: &patchlock::Error) -> Option<String> {
    Some(match error {
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

pub fn bench_message(error: &patchlock_bench::Error) -> String {
    use patchlock_bench::Error;
    match error {
        Error::CommandLine(command) => format!("--cmd {command}: not a valid command line"),
        Error::FolderName(name) => format!("--name {name:?}: not a valid folder name"),
        Error::NoTarget(..) => format!("--sequences: {error}"),
        Error::NoAttribute(..) => format!("--attributes: {error}"),
        Error::NothingSelected => {
            "no target is selected: none of the --sequences has any of the --attributes".to_string()
        }
        Error::Track(error) => track_message(error),
        error => error.to_string(),
    }
}

pub fn bench_hint(error: &patchlock_bench::Error) -> Option<String> {
    use patchlock_bench::Error;
    let hint = match error {
        Error::NoTarget(_, near) if near.is_empty() => "patchlock dataset DIR lists the targets",
        Error::NothingSelected => "patchlock dataset DIR lists the targets with their attributes",
        Error::Track(error) => return track_hint(error),
        Error::NoDataset { .. } => {
            "name the folder of the sequences; patchlock dataset DIR lists what a folder holds"
        }
        Error::Conflict { .. } => "choose another name with --name, or another folder with --out",
        Error::Sequence(_) => "patchlock dataset DIR lists the problems of each sequence",
        Error::NothingToCompare { .. } => {
            "patchlock score RESULTS --truth DATASET lists the trackers and targets"
        }
        Error::NoFrames { .. } => {
            "name the folder of the sequences; patchlock dataset DIR shows what was detected"
        }
        Error::CommandLine(_) => "quote it as in a shell: --cmd \"python3 'my tracker.py'\"",
        _ => return error.advice(),
    };
    Some(hint.to_string())
}

pub fn project_message(error: &project::Error) -> String {
    match error {
        project::Error::Track(error) => track_message(error),
        error => error.to_string(),
    }
}

pub fn project_hint(error: &project::Error) -> Option<String> {
    match error {
        project::Error::Track(error) => track_hint(error),
        project::Error::OtherVideo { .. } => {
            Some("name another project file with --project".to_string())
        }
        _ => error.advice(),
    }
}
