//! Words the errors of the libraries for Python: messages and advice that name keyword arguments. The other
//! advice is that of the errors themselves.

use patchlock::NetworkError;
use patchlock_media::{FrameFault, RangeError};
use patchlock_studio::project;

const BOX: &str =
    "a box is (x, y, w, h) in pixels: left and top edge counted from 0, width and height";

const MODEL: &str = "give its files with model=";

fn joined(message: String, advice: Option<String>) -> String {
    match advice {
        Some(advice) => format!("{message} ({advice})"),
        None => message,
    }
}

/// The text for an error of the tracker.
pub fn tracker(error: &patchlock::Error) -> String {
    let advice = match error {
        patchlock::Error::Network(NetworkError::None | NetworkError::Other { .. }) => Some(MODEL),
        patchlock::Error::Network(NetworkError::Incomplete { .. }) => {
            Some("give both files, or their folder")
        }
        _ => None,
    };
    joined(error.to_string(), advice.map(str::to_owned))
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
        Error::Range(RangeError::ZeroStride) => "stride=1 takes every frame",
        Error::Range(RangeError::Empty { .. }) => {
            "end is the first frame that is not tracked; without it, tracking goes to the last frame"
        }
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
        Error::Missing { .. } => {
            "name a folder of images, a pattern such as img/%04d.jpg, a glob, a video file, or \"-\" \
             for Y4M on standard input"
        }
        Error::Endless(_) => "a program can write Y4M to standard input, which is \"-\"",
        Error::Frame { fault: FrameFault::Damaged, .. } => {
            "skip it with end before it and start after it"
        }
        Error::StreamEnd { .. } => "with reverse=False, the frames before the error can be used",
        _ => return error.advice(),
    };
    Some(advice.to_string())
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
        Error::Media(error) => return media_advice(error),
        Error::StartBoxShape(..) => BOX,
        Error::StartBoxOutside(..) => {
            "the box is for the first tracked frame; with reverse=True that is the last frame of the \
             range"
        }
        Error::MissingModel(_) => MODEL,
        Error::UnusedModel(..) | Error::UnusedRuntime(_) => {
            "the presets robust and network use one"
        }
        Error::Runtime(_) => {
            "runtime= takes the library of onnxruntime 1.17 or later; without it, the built-in runtime \
             is used"
        }
        _ => return error.advice(),
    };
    Some(advice.to_string())
}

fn bench_message(error: &patchlock_bench::Error) -> String {
    use patchlock_bench::Error;
    match error {
        Error::CommandLine(command) => format!("command {command}: not a valid command line"),
        Error::FolderName(name) => format!("name={name:?}: not a valid folder name"),
        Error::NoTarget(..) => format!("sequences: {error}"),
        Error::NoAttribute(..) => format!("attributes: {error}"),
        Error::NothingSelected => {
            "no target is selected: none of sequences has any of attributes".to_string()
        }
        Error::Track(error) => track_message(error),
        error => error.to_string(),
    }
}

fn bench_advice(error: &patchlock_bench::Error) -> Option<String> {
    use patchlock_bench::Error;
    let advice = match error {
        Error::Track(error) => return track_advice(error),
        Error::Conflict { .. } => "choose another folder with name= or out=",
        Error::CommandLine(_) => "quote it as in a shell: command=\"python3 'my tracker.py'\"",
        _ => return error.advice(),
    };
    Some(advice.to_string())
}

fn project_message(error: &project::Error) -> String {
    match error {
        project::Error::Track(error) => track_message(error),
        error => error.to_string(),
    }
}

fn project_advice(error: &project::Error) -> Option<String> {
    match error {
        project::Error::Track(error) => track_advice(error),
        project::Error::OtherVideo { .. } => {
            Some("name another project file with path=".to_string())
        }
        project::Error::VideoOutside { .. } => {
            Some("name the video with video=, if the file is to be trusted".to_string())
        }
        _ => error.advice(),
    }
}
