//! Parses the client's messages into requests.

use std::io::{BufRead, Read as _};

use patchlock_bench::trax::image::Image;
use patchlock_bench::trax::message::Message;
use patchlock_bench::trax::region::Region;
use patchlock_track::names::beginning;

use super::Protocol;

/// The longest accepted line, in bytes: enough for a colour image of 8000 x 6000 pixels.
const LONGEST_LINE: u64 = 200_000_000;

/// The most targets that a client can begin before a frame.
const MOST_TARGETS: usize = 10_000;

#[derive(Debug, PartialEq)]
pub enum Request {
    /// Track the targets in an image.
    Frame {
        /// Whether to remove all earlier targets first.
        reset: bool,
        /// Targets that start in this image.
        begin: Vec<Region>,
        image: Image,
    },
    /// The client quits or has closed the connection.
    Quit,
}

pub struct Requests<R> {
    input: R,
    protocol: Protocol,
}

impl<R: BufRead> Requests<R> {
    pub fn new(input: R, protocol: Protocol) -> Self {
        Self { input, protocol }
    }

    /// The next request. In protocol 4 it consists of several messages: an `initialize` for each
    /// new target (without a region it removes all targets), then `frame`.
    ///
    /// # Errors
    /// An invalid message.
    pub fn next(&mut self) -> Result<Request, String> {
        let (mut reset, mut begin) = (false, Vec::new());
        loop {
            let Some(message) = self.message()? else { return Ok(Request::Quit) };
            let arguments: Vec<&str> = message.arguments.iter().map(String::as_str).collect();
            match (message.name.as_str(), self.protocol, arguments.as_slice()) {
                ("quit", ..) => return Ok(Request::Quit),
                ("frame", _, [image]) => {
                    return Ok(Request::Frame { reset, begin, image: Image::parse(image)? });
                }
                ("initialize", Protocol::Three, [image, region]) => {
                    let (image, begin) = (Image::parse(image)?, vec![target(region)?]);
                    return Ok(Request::Frame { reset: true, begin, image });
                }
                ("initialize", Protocol::Four, []) => {
                    reset = true;
                    begin.clear();
                }
                ("initialize", Protocol::Four, [_]) if begin.len() == MOST_TARGETS => {
                    return Err(format!("more than {MOST_TARGETS} targets begin before a frame"));
                }
                ("initialize", Protocol::Four, [region]) => begin.push(target(region)?),
                (name, protocol, arguments) => {
                    return Err(unexpected(name, protocol, arguments.len()));
                }
            }
        }
    }

    /// The next message, skipping other lines; `None` at the end of the input.
    fn message(&mut self) -> Result<Option<Message>, String> {
        loop {
            let mut line = Vec::new();
            let read = self.input.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
            let read = read.map_err(|error| format!("cannot read from the client: {error}"))?;
            if read as u64 == LONGEST_LINE {
                return Err(format!("a message has more than {LONGEST_LINE} bytes"));
            }
            if read == 0 {
                return Ok(None);
            }
            let line = String::from_utf8_lossy(&line);
            if let Some(message) = Message::parse(&line) {
                let shown = || beginning(line.trim_end());
                return message
                    .map(Some)
                    .map_err(|reason| format!("the message \"{}\": {reason}", shown()));
            }
        }
    }
}

/// Parses the region of a new target.
fn target(text: &str) -> Result<Region, String> {
    let shown = || beginning(text);
    match Region::parse(text) {
        Ok(Region::Nothing) => Err(format!("the region \"{}\" does not contain a target", shown())),
        Ok(region) => Ok(region),
        Err(reason) => Err(format!("the region \"{}\": {reason}", shown())),
    }
}

fn unexpected(name: &str, protocol: Protocol, count: usize) -> String {
    let wanted = match (name, protocol) {
        ("frame", _) => "one image",
        ("initialize", Protocol::Three) => "one image and one region",
        ("initialize", Protocol::Four) => "one region, or nothing to remove all targets",
        _ => {
            return format!(
                "the message {} is unknown; the messages are initialize, frame and quit",
                beginning(name)
            );
        }
    };
    format!("the message {name} takes {wanted} in protocol {protocol}; it has {count} arguments")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn requests(protocol: Protocol, text: &str) -> Vec<Result<Request, String>> {
        let mut requests = Requests::new(text.as_bytes(), protocol);
        let mut all = Vec::new();
        loop {
            match requests.next() {
                Ok(Request::Quit) => return all,
                Err(reason) => return all.into_iter().chain([Err(reason)]).collect(),
                Ok(request) => all.push(Ok(request)),
            }
        }
    }

    fn region(x: f64) -> Region {
        Region::parse(&format!("{x},2,3,4")).unwrap()
    }

    fn frame(reset: bool, begin: &[Region], image: &str) -> Result<Request, String> {
        Ok(Request::Frame { reset, begin: begin.to_vec(), image: Image::Path(image.into()) })
    }

    #[test]
    fn one_target() {
        let text = "hello?\n@@TRAX:initialize \"file:///1\" \"1,2,3,4\" a=b\n\
                    @@TRAX:frame \"file:///2\"\n@@TRAX:quit\n@@TRAX:frame";
        let expected = [frame(true, &[region(1.0)], "/1"), frame(false, &[], "/2")];
        assert_eq!(requests(Protocol::Three, text), expected);
    }

    #[test]
    fn many_targets() {
        let text = "@@TRAX:initialize 1,2,3,4\n@@TRAX:initialize 2,2,3,4 object=x\n@@TRAX:frame /1\n\
                    @@TRAX:initialize 3,2,3,4\n@@TRAX:frame /2\n\
                    @@TRAX:initialize\n@@TRAX:initialize 4,2,3,4\n@@TRAX:frame /3";
        let expected = [
            frame(false, &[region(1.0), region(2.0)], "/1"),
            frame(false, &[region(3.0)], "/2"),
            frame(true, &[region(4.0)], "/3"),
        ];
        assert_eq!(requests(Protocol::Four, text), expected);
    }

    /// A client that sends no line end, or no frame, does not fill the memory.
    #[test]
    fn endless_requests_are_refused() {
        let endless = std::io::BufReader::new(std::io::repeat(b'x'));
        let error = Requests::new(endless, Protocol::Four).next().unwrap_err();
        assert_eq!(error, "a message has more than 200000000 bytes");
        let mut long = vec![b'x'; 1_000_000];
        long[..7].copy_from_slice(b"@@TRAX:");
        long[8] = 0x1b;
        long.push(b'\n');
        let error = Requests::new(&long[..], Protocol::Four).next().unwrap_err();
        assert!(
            error.starts_with("the message \"@@TRAX:x\\u{1b}xx") && error.len() < 400,
            "{error}"
        );
        let text = "@@TRAX:initialize 1,2,3,4\n".repeat(MOST_TARGETS + 1);
        let error = requests(Protocol::Four, &text).pop().unwrap().unwrap_err();
        assert_eq!(error, "more than 10000 targets begin before a frame");
        let far = "@@TRAX:initialize 1e308,2,3,4\n";
        let error = requests(Protocol::Four, far).pop().unwrap().unwrap_err();
        assert!(error.contains("1e308 is not a coordinate"), "{error}");
    }

    #[test]
    fn invalid_messages_are_refused() {
        use Protocol::{Four, Three};
        for (protocol, text, why) in [
            (
                Three,
                "@@TRAX:initialize /1",
                "takes one image and one region in protocol 3; it has 1 arguments",
            ),
            (Four, "@@TRAX:initialize /1 1,2,3,4", "takes one region"),
            (Three, "@@TRAX:frame", "takes one image in protocol 3; it has 0"),
            (Three, "@@TRAX:state 1,2,3,4", "the message state is unknown"),
            (Three, "@@TRAX:initialize /1 0", "does not contain a target"),
            (Four, "@@TRAX:initialize NaN,NaN,NaN,NaN", "does not contain a target"),
            (Four, "@@TRAX:initialize mask:1,2,3,4,5", "not mask"),
            (Four, "@@TRAX:initialize here", "\"here\" is not a number"),
            (Three, "@@TRAX:frame \"a", "a quote is not closed"),
            (Three, "@@TRAX:frame http://x/1.jpg", "images by http:// are not supported"),
        ] {
            let reason = requests(protocol, text).pop().unwrap().unwrap_err();
            assert!(reason.contains(why), "{text}: {reason}");
        }
    }
}
