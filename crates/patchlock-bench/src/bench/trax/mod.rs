//! An external program as the tracker under test. It speaks TraX ([`crate::trax`]), versions 1 to
//! 4, on its standard input and output.
//!
//! The program sends `hello` with its capabilities. It is sent `initialize` with the path of an
//! image and a box, then `frame` with the path of each following image, and answers each message
//! with `state` and a region. In version 4, which supports several targets, the box and the first
//! image are sent in two messages. Regions are `left,top,width,height` in pixels counted from 0, or
//! polygons. The measured time is that from our message to its answer; it includes reading the
//! image, which the program does itself.

mod process;

use std::path::Path;
use std::time::Duration;

use patchlock::BoundingBox;

use super::subject::{Answer, Subject};
use crate::Error;
use crate::trax::image::{self, Image};
use crate::trax::message::Message;
use crate::trax::region::{POLYGON, RECTANGLE, Region};
use patchlock_track::names::beginning;
use patchlock_track::session;
use process::Process;

/// The newest supported version of the protocol. Versions 1 to 3 do not differ in anything used
/// here.
const NEWEST_VERSION: u32 = 4;
/// The environment variable that holds the seed.
pub const SEED_VARIABLE: &str = "PATCHLOCK_SEED";

/// The capabilities of a program, from its `hello`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Capabilities {
    version: u32,
    /// Regions have to be polygons: the program does not accept boxes.
    polygons: bool,
}

/// A running tracker, after its `hello`.
pub struct Trax {
    process: Process,
    capabilities: Capabilities,
}

impl Trax {
    /// Starts a program and waits for its `hello`. `patience` is the time limit for this and for
    /// every later answer.
    ///
    /// # Errors
    /// [`Error::Subject`] if the program cannot be started, does not answer, or lacks a required
    /// capability.
    pub fn start(command: &[String], seed: u64, patience: Duration) -> Result<Self, Error> {
        let subject = |reason: String| Error::Subject(reason);
        let mut process = Process::start(command, (SEED_VARIABLE, &seed.to_string()), patience)
            .map_err(subject)?;
        let hello = next(&mut process, "hello").map_err(subject)?;
        if hello.name != "hello" {
            return Err(subject(format!(
                "the tracker sent the message {} instead of hello",
                beginning(&hello.name)
            )));
        }
        let capabilities = capabilities(&hello).map_err(subject)?;
        Ok(Self { process, capabilities })
    }

    fn ask(&mut self, file: &Path, lines: &str) -> Result<Answer, Error> {
        let error = |reason| Error::Tracker { path: file.to_path_buf(), reason };
        let (state, seconds) = session::timed(|| {
            self.process.write(lines)?;
            next(&mut self.process, "state")
        });
        let state = state.map_err(error)?;
        match (state.name.as_str(), state.arguments.first()) {
            ("state", Some(region)) => {
                let region = Region::parse(region)
                    .map_err(|reason| format!("invalid region \"{}\": {reason}", beginning(region)))
                    .map_err(error)?;
                Ok(Answer::of_box(region.bbox(), seconds))
            }
            ("state", None) => Err(error("the message state has no region".to_string())),
            ("quit", _) => Err(error(format!("the tracker quit{}", reason_of(&state)))),
            (other, _) => Err(error(format!(
                "the tracker sent the message {} instead of state",
                beginning(other)
            ))),
        }
    }
}

/// The reason that a tracker gives for quitting, if any.
fn reason_of(quit: &Message) -> String {
    quit.get("trax.reason").map(|reason| format!(": {}", beginning(reason))).unwrap_or_default()
}

/// Waits for the next message; lines that are not messages are skipped. `what` is the expected
/// message.
fn next(process: &mut Process, what: &str) -> Result<Message, String> {
    let line = process.next(what, |line| Message::parse(line).is_some())?;
    match Message::parse(&line) {
        Some(Ok(message)) => Ok(message),
        Some(Err(reason)) => Err(format!("invalid message \"{}\": {reason}", beginning(&line))),
        None => Err(format!("not a message: {}", beginning(&line))),
    }
}

/// Checks that the program is compatible, and which regions it accepts.
fn capabilities(hello: &Message) -> Result<Capabilities, String> {
    let version = hello.get("trax.version").unwrap_or("1");
    let known = version.parse().ok().filter(|version| (1..=NEWEST_VERSION).contains(version));
    let Some(version) = known else {
        return Err(format!(
            "the tracker speaks version {} of TraX; versions 1 to {NEWEST_VERSION} are supported",
            beginning(version)
        ));
    };
    let list = |key: &str, default: &str| -> Vec<String> {
        hello
            .get(key)
            .unwrap_or(default)
            .split(';')
            .filter(|s| !s.is_empty())
            .map(str::to_string)
            .collect()
    };
    let images = list("trax.image", image::PATH);
    if !images.iter().any(|image| image == image::PATH) {
        let images = beginning(&images.join(", "));
        return Err(format!("the tracker accepts images as {images}; only path is supported"));
    }
    let regions = list("trax.region", RECTANGLE);
    let accepts = |name: &str| regions.iter().any(|region| region == name);
    if !accepts(RECTANGLE) && !accepts(POLYGON) {
        let regions = beginning(&regions.join(", "));
        return Err(format!(
            "the tracker accepts regions as {regions}; {RECTANGLE} and {POLYGON} are supported"
        ));
    }
    Ok(Capabilities { version, polygons: !accepts(RECTANGLE) })
}

/// The argument for an image file.
fn url(file: &Path) -> Result<String, Error> {
    let whole = dunce::canonicalize(file).map_err(|error| Error::read(file, error))?;
    Ok(Image::of_path(&whole))
}

impl Subject for Trax {
    fn step(&mut self, frame: &Path, start: Option<BoundingBox>) -> Result<Answer, Error> {
        let image = url(frame)?;
        let message = |name, arguments: &[&str]| Message::new(name, arguments).to_string();
        let Some(bbox) = start else { return self.ask(frame, &message("frame", &[&image])) };
        let region = match self.capabilities.polygons {
            true => Region::corners_of(&bbox),
            false => Region::Rectangle(bbox),
        };
        let region = region.to_string();
        let lines = match self.capabilities.version {
            ..=3 => message("initialize", &[&image, &region]),
            _ => message("initialize", &[&region]) + &message("frame", &[&image]),
        };
        let answer = self.ask(frame, &lines)?;
        // The first line of a trajectory is the box as given.
        Ok(Answer { bbox: Some(bbox), ..answer })
    }
}

impl Drop for Trax {
    fn drop(&mut self) {
        let _ = self.process.write(&Message::new("quit", &[]).to_string());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Capabilities, String> {
        capabilities(&Message::parse(line).unwrap().unwrap())
    }

    #[test]
    fn hello_messages() {
        let plain = Capabilities { version: 1, polygons: false };
        assert_eq!(parsed("@@TRAX:hello"), Ok(plain));
        let polygon =
            "@@TRAX:hello trax.version=3 trax.image=memory;path; trax.region=mask;polygon;";
        assert_eq!(parsed(polygon), Ok(Capabilities { version: 3, polygons: true }));
        for bad in ["trax.version=5", "trax.version=x", "trax.image=memory", "trax.region=mask"] {
            assert!(parsed(&format!("@@TRAX:hello {bad}")).is_err(), "{bad}");
        }
    }
}
