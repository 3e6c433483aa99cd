//! What Python says of each error: it names keyword arguments, never options of the program. One value of
//! every variant is made here. A new variant does not compile until it has a place in these lists. The test is here
//! because the crate of Python would have to be compiled a second time, against another interpreter.

#[path = "../../../patchlock-py/src/advice.rs"]
mod advice;

use std::io;
use std::iter::successors;

use patchlock::NetworkError;
use patchlock_media::{Container, FrameFault, Limits, RangeError, SizeLimitError};
use patchlock_studio::project;

fn io_error() -> io::Error {
    io::ErrorKind::NotFound.into()
}

/// The sample after this one.
fn next_range(error: &RangeError) -> Option<RangeError> {
    Some(match error {
        RangeError::ZeroStride => RangeError::Empty { start: 3, end: 3 },
        RangeError::Empty { .. } => RangeError::Beyond { start: 9, length: None },
        RangeError::Beyond { length: None, .. } => RangeError::Beyond { start: 9, length: Some(3) },
        RangeError::Beyond { length: Some(_), .. } => return None,
    })
}

/// The container or fault after this one.
fn next_container(container: Option<Container>) -> Option<Container> {
    match container {
        None => Some(Container::Y4m),
        Some(Container::Y4m) => Some(Container::Mp4),
        Some(Container::Mp4) => Some(Container::Other),
        Some(Container::Other) => None,
    }
}

fn next_fault(fault: FrameFault) -> Option<FrameFault> {
    match fault {
        FrameFault::Unreadable => Some(FrameFault::Damaged),
        FrameFault::Damaged => Some(FrameFault::Unsupported),
        FrameFault::Unsupported => None,
    }
}

/// The sample after this one, of the errors that have no kinds below them.
fn next_media(error: &patchlock_media::Error) -> Option<patchlock_media::Error> {
    use patchlock_media::Error;
    let (name, reason) = ("v".to_string(), "why".to_string());
    let size = SizeLimitError { width: 9, height: 9, pixels: 81, limit: 80 };
    let frame = |fault| Error::Frame { index: 1, name: "v".into(), fault, reason: "why".into() };
    Some(match error {
        Error::Range(error) => match next_range(error) {
            Some(next) => next.into(),
            None => Error::Missing { name },
        },
        Error::Missing { .. } => Error::Endless("p".into()),
        Error::Endless(_) => Error::NoImages { folder: "f".into(), inner: None },
        Error::NoImages { inner: None, .. } => {
            Error::NoImages { folder: "f".into(), inner: Some("f/img".into()) }
        }
        Error::NoImages { inner: Some(_), .. } => Error::NoMatch { pattern: name, is_glob: false },
        Error::NoMatch { is_glob: false, .. } => Error::NoMatch { pattern: name, is_glob: true },
        Error::NoMatch { is_glob: true, .. } => Error::NoVideo(name),
        Error::NoVideo(_) => Error::Playlist("v".into()),
        Error::Playlist(_) => Error::NoFrames,
        Error::NoFrames => Error::TooLarge { what: name, size },
        Error::TooLarge { .. } => Error::TooManyPixels { name, limit: Limits::DEFAULT_PIXELS },
        Error::TooManyPixels { .. } => Error::FfmpegMissing { path: "v".into(), reason },
        Error::FfmpegMissing { .. } => Error::Unreadable { name, container: None, reason },
        Error::Unreadable { container, .. } => match next_container(*container) {
            Some(next) => Error::Unreadable { name, container: Some(next), reason },
            None => Error::Image { index: 1, file: "1.png".into(), reason },
        },
        Error::Image { .. } => frame(FrameFault::Unreadable),
        Error::Frame { fault, .. } => match next_fault(*fault) {
            Some(next) => frame(next),
            None => Error::DecoderEnded { after: None },
        },
        Error::DecoderEnded { .. } => Error::StreamEnd { name, reason },
        Error::StreamEnd { .. } => Error::StreamCopy { name, folder: "tmp".into(), reason },
        Error::StreamCopy { .. } => Error::Write(io_error()),
        Error::Write(_) => Error::Encode(reason),
        Error::Encode(_) => Error::Scheme(name),
        Error::Scheme(_) => Error::NotLive { name, is_camera: false, reason },
        Error::NotLive { is_camera: false, .. } => Error::NotLive { name, is_camera: true, reason },
        Error::NotLive { is_camera: true, .. } => Error::AddressList { name, format: reason },
        Error::AddressList { .. } => Error::Gone { name, reason },
        Error::Gone { .. } => return None,
    })
}

fn all_of_media() -> impl Iterator<Item = patchlock_media::Error> {
    successors(Some(RangeError::ZeroStride.into()), next_media)
}

/// Errors of the library for which Python has words.
fn all_of_tracker() -> [patchlock::Error; 3] {
    let other = NetworkError::Other { needed: "a".into(), given: Some("b".into()) };
    let incomplete =
        NetworkError::Incomplete { family: "NanoTrack", given: "head", missing: "backbone" };
    [NetworkError::None, other, incomplete].map(patchlock::Error::from)
}

/// The sample after this one. The errors of frame sources have a list of their own.
fn next_track(error: &patchlock_track::Error) -> Option<patchlock_track::Error> {
    use patchlock_track::Error;
    let (path, reason) = (|| "p".into(), "why".to_string());
    let unknown = |name: &str| patchlock::Error::UnknownSetting { name: name.into() };
    let incomplete =
        NetworkError::Incomplete { family: "NanoTrack", given: "head", missing: "backbone" };
    Some(match error {
        Error::Read(..) => Error::Line(path(), 1, reason),
        Error::Line(..) => Error::Write(path(), io_error()),
        Error::Write(..) => Error::Frame(path(), reason),
        Error::Frame(..) => Error::LinkOutside(path(), path()),
        Error::LinkOutside(..) => Error::Export(reason),
        Error::Export(_) => Error::Threads(reason),
        Error::Threads(_) => Error::TrackerInFrame(1, reason),
        Error::TrackerInFrame(..) => Error::StartBoxShape("1,2,0,4".into(), 65_536.0),
        Error::StartBoxShape(..) => Error::StartBoxOutside("9,9,1,1".into(), 0, [4, 3]),
        Error::StartBoxOutside(..) => Error::Preset("none".into()),
        Error::Preset(_) => Error::Settings(path(), io_error()),
        Error::Settings(..) => Error::NoToml(path(), 1, reason),
        Error::NoToml(..) => Error::ManyMethods(path(), Vec::new()),
        Error::ManyMethods(..) => Error::Assignment("x".into()),
        Error::Assignment(_) => Error::Setting(Some(path()), unknown("particels")),
        Error::Setting(Some(_), _) => Error::Setting(None, unknown("nothing like it")),
        Error::Setting(None, _) => Error::NoModel(path()),
        Error::NoModel(_) => Error::Model(path(), incomplete),
        Error::Model(_, NetworkError::Incomplete { .. }) => {
            Error::Model(path(), NetworkError::NotOnnx(reason))
        }
        Error::Model(..) => {
            Error::Runtime(NetworkError::Runtime { runtime: "onnxruntime".into(), reason })
        }
        Error::Runtime(_) => Error::MissingModel("network"),
        Error::MissingModel(_) => Error::UnusedModel(path(), "robust"),
        Error::UnusedModel(..) => Error::UnusedRuntime(path()),
        Error::UnusedRuntime(_) => Error::Media(patchlock_media::Error::NoFrames),
        Error::Media(_) => return None,
    })
}

fn all_of_track() -> impl Iterator<Item = patchlock_track::Error> {
    let first = patchlock_track::Error::Read("p".into(), io_error());
    successors(Some(first), next_track).chain(all_of_media().map(patchlock_track::Error::from))
}

fn next_bench(error: &patchlock_bench::Error) -> Option<patchlock_bench::Error> {
    use patchlock_bench::Error;
    let (path, reason) = (|| "p".into(), "why".to_string());
    Some(match error {
        Error::NoDataset { .. } => Error::NoResults { path: path(), reason },
        Error::NoResults { .. } => Error::NothingToCompare { reason },
        Error::NothingToCompare { .. } => Error::Picture { reason },
        Error::Picture { .. } => Error::Manifest { path: path(), reason },
        Error::Manifest { .. } => Error::Conflict { path: path(), difference: reason },
        Error::Conflict { .. } => Error::Sequence(reason),
        Error::Sequence(_) => Error::Tracker { path: path(), reason },
        Error::Tracker { .. } => Error::Subject(reason),
        Error::Subject(_) => Error::NoFrames { path: path() },
        Error::NoFrames { .. } => Error::CommandLine("'x".into()),
        Error::CommandLine(_) => Error::FolderName("a/b".into()),
        Error::FolderName(_) => Error::NoTarget("a".into(), Vec::new()),
        Error::NoTarget(_, near) if near.is_empty() => {
            Error::NoTarget("a".into(), vec!["b".into()])
        }
        Error::NoTarget(..) => Error::NoAttribute("IV".into(), Vec::new()),
        Error::NoAttribute(_, known) if known.is_empty() => {
            Error::NoAttribute("IV".into(), vec!["OCC".into()])
        }
        Error::NoAttribute(..) => Error::NothingSelected,
        Error::NothingSelected => Error::Track(patchlock_media::Error::NoFrames.into()),
        Error::Track(_) => return None,
    })
}

fn all_of_bench() -> impl Iterator<Item = patchlock_bench::Error> {
    let first = patchlock_bench::Error::NoDataset { path: "p".into(), reason: "why".into() };
    successors(Some(first), next_bench).chain(all_of_track().map(patchlock_bench::Error::from))
}

fn next_project(error: &project::Error) -> Option<project::Error> {
    use project::Error;
    let (path, reason) = (|| "p".into(), "why".to_string());
    Some(match error {
        Error::Invalid { .. } => Error::Labels { path: path(), reason },
        Error::Labels { .. } => Error::Version { path: path(), version: 9 },
        Error::Version { .. } => Error::InUse { path: path(), by: "another program".into() },
        Error::InUse { .. } => Error::Overtaken { path: path() },
        Error::Overtaken { .. } => {
            Error::OtherVideo { path: path(), expected: "a".into(), given: "b".into() }
        }
        Error::OtherVideo { .. } => Error::VideoOutside { path: path(), video: "../v".into() },
        Error::VideoOutside { .. } => Error::Edit(reason),
        Error::Edit(_) => Error::Import(reason),
        Error::Import(_) => Error::Track(patchlock_media::Error::NoFrames.into()),
        Error::Track(_) => return None,
    })
}

fn all_of_project() -> impl Iterator<Item = project::Error> {
    let first = project::Error::Invalid { path: "p".into(), reason: "why".into() };
    successors(Some(first), next_project).chain(all_of_track().map(project::Error::from))
}

/// Each text of the libraries and of Python.
fn texts() -> Vec<String> {
    let media = all_of_media().flat_map(|error| [error.to_string(), advice::media(&error)]);
    let track = all_of_track().flat_map(|error| [error.to_string(), advice::track(&error)]);
    let bench = all_of_bench().flat_map(|error| [error.to_string(), advice::bench(&error)]);
    let project = all_of_project().flat_map(|error| [error.to_string(), advice::project(&error)]);
    let errors = all_of_tracker();
    let tracker = errors.iter().flat_map(|error| [error.to_string(), advice::tracker(error)]);
    media.chain(track).chain(bench).chain(project).chain(tracker).collect()
}

#[test]
fn no_text_names_an_option_or_a_command() {
    let texts = texts();
    assert!(texts.len() > 200, "{}", texts.len());
    for text in &texts {
        assert!(!text.contains("--") && !text.contains("patchlock "), "{text}");
        assert!(!text.is_empty() && !text.contains('\n') && !text.contains("()"), "{text}");
    }
}

#[test]
fn ranges_and_names_are_named_by_keywords() {
    let said = texts();
    for expected in [
        "start=9 is beyond the end: the source has 3 frames (frames count from 0, so the last one is 2)",
        "end=3 is not after start=3",
        "stride is 0",
        "max_pixels=81 accepts it",
        "with reverse=False",
        "name=\"a/b\"",
        "name= or out=",
        "command 'x: ",
        "sequences: ",
        "attributes: ",
        "the method network needs a network (give its files with model=)",
        "has no effect without a network (the presets robust and network use one)",
        "runtime= takes the library",
        "given: b (give its files with model=)",
        "the backbone is missing (give both files, or their folder)",
        "p: unknown setting `particels` (did you mean particles?)",
    ] {
        assert!(said.iter().any(|text| text.contains(expected)), "{expected}");
    }
}
