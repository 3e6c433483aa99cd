//! Another program as the tracker under test, through TraX ([`crate::trax`]), protocols 1 to 4: lines of text on its standard input and output.
//!
//! The program says `hello` with what it can do; it is given `initialize` with the path of an image and a box, then `frame` with the path of
//! the next image, and answers each with `state` and a box. Protocol 4, which knows several targets, takes the box and the first image in two messages. Boxes are `left,top,width,height`, pixels counted from 0, or a polygon. Its time is
//! that from our line to its answer: reading the image is in it, because it does that itself.

mod process;

use std::path::Path;
use std::time::Duration;

use patchlock::BoundingBox;

use super::clock;
use super::subject::{Answer, Subject};
use crate::Error;
use crate::trax::image::{self, Image};
use crate::trax::message::Message;
use crate::trax::region::{POLYGON, RECTANGLE, Region};
use process::{Process, Silence};

/// The newest version of the protocol that is spoken here. Versions 1 to 3 differ in nothing that is used.
const NEWEST: u32 = 4;
/// The variable of the environment that tells the program its seed.
pub const SEED_VARIABLE: &str = "PATCHLOCK_SEED";

/// What a program said of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Abilities {
    version: u32,
    /// Regions must be polygons: it does not take boxes.
    polygons: bool,
}

/// A program that has said hello.
pub struct Trax {
    process: Process,
    abilities: Abilities,
}

impl Trax {
    /// Starts the program and waits for its greeting, so long at most.
    ///
    /// # Errors
    /// [`Error::Subject`] where it can't be started, says nothing, or can't do what is needed.
    pub fn start(command: &[String], seed: u64, patience: Duration) -> Result<Self, Error> {
        let subject = |reason: String| Error::Subject(reason);
        let mut process = Process::start(command, (SEED_VARIABLE, &seed.to_string()), patience)
            .map_err(subject)?;
        let hello = next(&mut process, "its greeting").map_err(subject)?;
        if hello.name != "hello" {
            return Err(subject(format!(
                "the tracker begins with the message {} instead of hello",
                hello.name
            )));
        }
        let abilities = abilities(&hello).map_err(subject)?;
        Ok(Self { process, abilities })
    }

    fn ask(&mut self, file: &Path, lines: &str) -> Result<Answer, Error> {
        let error = |reason| Error::Tracker { path: file.to_path_buf(), reason };
        let (state, seconds) = clock::timed(|| {
            self.process.write(lines)?;
            next(&mut self.process, "its answer")
        });
        let state = state.map_err(error)?;
        match (state.name.as_str(), state.arguments.first()) {
            ("state", Some(region)) => {
                let region = Region::parse(region)
                    .map_err(|reason| error(format!("its state \"{region}\": {reason}")))?;
                Ok(Answer { bbox: region.bbox(), seconds })
            }
            ("state", None) => Err(error("its state has no region".to_string())),
            ("quit", _) => Err(error(format!("the tracker gave up (quit){}", reason_of(&state)))),
            (other, _) => {
                Err(error(format!("the tracker answers with the message {other} instead of state")))
            }
        }
    }
}

/// What a tracker that quits may say of it.
fn reason_of(quit: &Message) -> String {
    quit.get("trax.reason").map(|reason| format!(": {reason}")).unwrap_or_default()
}

/// The next message; other lines are chatter.
fn next(process: &mut Process, what: &str) -> Result<Message, String> {
    let line = process.next(|line| Message::parse(line).is_some());
    match line {
        Ok(line) => match Message::parse(&line) {
            Some(Ok(message)) => Ok(message),
            Some(Err(reason)) => Err(format!("the tracker's message \"{line}\": {reason}")),
            None => Err(format!("no message: {line}")),
        },
        Err(Silence::TooLong(seconds)) => Err(format!(
            "the tracker kept waiting for {what} for {seconds} s{}",
            process.last_words()
        )),
        Err(Silence::Ended(status)) => Err(format!(
            "the tracker ended ({status}) instead of giving {what}{}",
            process.last_words()
        )),
    }
}

/// Whether the program speaks what is spoken here, and how it wants regions.
fn abilities(hello: &Message) -> Result<Abilities, String> {
    let version = hello.get("trax.version").unwrap_or("1");
    let known = version.parse().ok().filter(|version| (1..=NEWEST).contains(version));
    let Some(version) = known else {
        return Err(format!(
            "the tracker speaks version {version} of TraX; 1 to {NEWEST} are understood"
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
        return Err(format!(
            "the tracker takes images as {}; only path can be given",
            images.join(", ")
        ));
    }
    let regions = list("trax.region", RECTANGLE);
    let takes = |name: &str| regions.iter().any(|region| region == name);
    if !takes(RECTANGLE) && !takes(POLYGON) {
        let regions = regions.join(", ");
        return Err(format!(
            "the tracker takes regions as {regions}; {RECTANGLE} and {POLYGON} can be given"
        ));
    }
    Ok(Abilities { version, polygons: !takes(RECTANGLE) })
}

/// The path as the protocol has it.
fn url(file: &Path) -> Result<String, Error> {
    let whole = file.canonicalize().map_err(|error| Error::read(file, error))?;
    Ok(Image::of_path(&whole))
}

impl Subject for Trax {
    fn begin(&mut self, frame: &Path, bbox: BoundingBox) -> Result<Answer, Error> {
        let image = url(frame)?;
        let region = match self.abilities.polygons {
            true => Region::corners_of(&bbox),
            false => Region::Rectangle(bbox),
        };
        let region = region.to_string();
        let initialize = |arguments: &[&str]| Message::new("initialize", arguments).to_string();
        let lines = match self.abilities.version {
            ..=3 => initialize(&[&image, &region]),
            _ => initialize(&[&region]) + &Message::new("frame", &[&image]).to_string(),
        };
        let answer = self.ask(frame, &lines)?;
        // The first line of a trajectory is the box as given.
        Ok(Answer { bbox: Some(bbox), ..answer })
    }

    fn follow(&mut self, frame: &Path) -> Result<Answer, Error> {
        let line = Message::new("frame", &[&url(frame)?]).to_string();
        self.ask(frame, &line)
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

    fn greet(line: &str) -> Result<Abilities, String> {
        abilities(&Message::parse(line).unwrap().unwrap())
    }

    #[test]
    fn greetings() {
        let plain = Abilities { version: 1, polygons: false };
        assert_eq!(greet("@@TRAX:hello"), Ok(plain));
        let polygon =
            "@@TRAX:hello trax.version=3 trax.image=memory;path; trax.region=mask;polygon;";
        assert_eq!(greet(polygon), Ok(Abilities { version: 3, polygons: true }));
        for bad in ["trax.version=5", "trax.version=x", "trax.image=memory", "trax.region=mask"] {
            assert!(greet(&format!("@@TRAX:hello {bad}")).is_err(), "{bad}");
        }
    }
}
