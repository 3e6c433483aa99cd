//! Lines of TraX: messages, regions and images, and whole conversations with the server.

use patchlock::Preset;
use patchlock_bench::trax::image::Image;
use patchlock_bench::trax::message::Message;
use patchlock_bench::trax::region::Region;
use patchlock_cli::trax::{Protocol, Targets, serve};
use patchlock_track::session;

use crate::check::{accepted, finite, picture};
use crate::choice;
use crate::library::small;

/// The first byte chooses the protocol; the rest are the lines of a client.
pub fn trax(data: &[u8]) {
    let (first, lines) = choice(data);
    let protocol = if first % 2 == 0 { Protocol::Three } else { Protocol::Four };
    let text = String::from_utf8_lossy(lines);
    let messages = text.split('\n').filter_map(Message::parse);
    let messages: Vec<Message> = messages.filter_map(accepted).collect();
    let paths = messages.iter().map(parsed).filter(|names_path| *names_path).count();
    // Paths are opened with the rights of whoever runs the server, so they are not followed here.
    if paths == 0 {
        answered(lines, protocol);
    }
}

/// Reads a message and its arguments. Returns whether one of them is a path of an image.
fn parsed(message: &Message) -> bool {
    let line = message.to_string();
    assert_eq!(line.matches('\n').count(), 1, "{line:?}");
    let again = Message::parse(&line).expect("is a message").expect("is a valid one");
    assert_eq!(again.name, message.name);
    let mut path = false;
    for argument in &message.arguments {
        if let Some(region) = accepted(Region::parse(argument)) {
            region.bbox().into_iter().for_each(finite);
            assert_eq!(Region::parse(&region.to_string()), Ok(region));
        }
        match accepted(Image::parse(argument)) {
            Some(Image::Path(_)) => path = true,
            Some(image) => accepted(image.picture()).iter().for_each(picture),
            None => {}
        }
    }
    path
}

/// Has the server answer: every line is a message.
fn answered(lines: &[u8], protocol: Protocol) {
    let pool = session::pool(Some(1)).expect("starts");
    let targets = Targets::new(small(Preset::Robust), pool).expect("is valid");
    let mut answer = Vec::new();
    let served = serve(lines, &mut answer, protocol, targets);
    let quit = served.map_err(|error| crate::check::said(format!("{error:#}"))).is_err();
    let text = String::from_utf8(answer).expect("answers are text");
    let answers: Vec<Message> = text
        .lines()
        .map(|line| Message::parse(line).expect("is a message").expect("is a valid one"))
        .collect();
    assert_eq!(answers.first().map(|message| message.name.as_str()), Some("hello"));
    let said_quit = answers.last().is_some_and(|message| message.name == "quit");
    assert_eq!(quit, said_quit, "{text}");
    for state in answers.iter().filter(|message| message.name == "state") {
        let region = Region::parse(&state.arguments[0]).expect("a region");
        finite(region.bbox().expect("a box"));
    }
}
