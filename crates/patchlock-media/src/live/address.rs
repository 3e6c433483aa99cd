//! What a live source is called, and how ffmpeg opens it.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use crate::Error;
use crate::ffmpeg::CONTAINERS;

/// The address of a live source: a camera, a stream of the network, or a pipe. It is made only of
/// what the user has typed as the source, never of what a file says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    kind: Kind,
    name: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Kind {
    Network(&'static Scheme),
    /// The cameras of this machine count from 0.
    Numbered(usize),
    /// A camera by the name that the system has for it.
    Named(PathBuf),
    Pipe,
}

/// A protocol of the network.
#[derive(Debug, PartialEq, Eq)]
struct Scheme {
    name: &'static str,
    /// The protocols of ffmpeg that it takes, and those that it is carried by.
    protocols: &'static str,
    /// The formats that may come that way, beside the containers of videos.
    formats: &'static str,
    options: &'static [&'static str],
}

const fn scheme(name: &'static str, protocols: &'static str, formats: &'static str) -> Scheme {
    Scheme { name, protocols, formats, options: &[] }
}

impl Scheme {
    /// What ffmpeg is told of an input that comes this way, up to and with `-i`.
    fn input(&self, name: &str) -> Vec<OsString> {
        let formats = format!("{CONTAINERS}{}", self.formats);
        let allowed = ["-protocol_whitelist", self.protocols, "-format_whitelist", &formats];
        words(&[&allowed, self.options, &["-i", name]].concat())
    }
}

fn words(words: &[&str]) -> Vec<OsString> {
    words.iter().map(OsString::from).collect()
}

/// Lists of addresses, such as those of HLS and DASH, are not among the formats: what they name was
/// not typed by the user.
const SCHEMES: [Scheme; 9] = [
    Scheme { options: RTSP, ..scheme("rtsp", "rtp,udp,tcp", ",rtsp") },
    Scheme { options: RTSP, ..scheme("rtsps", "rtp,udp,tcp,tls", ",rtsp") },
    scheme("rtmp", "rtmp,tcp", ",live_flv"),
    scheme("rtmps", "rtmps,tls,tcp", ",live_flv"),
    scheme("http", "http,https,httpproxy,tls,tcp", ",mpjpeg"),
    scheme("https", "http,https,httpproxy,tls,tcp", ",mpjpeg"),
    scheme("udp", "udp", ""),
    scheme("tcp", "tcp", ",mpjpeg"),
    scheme("srt", "srt", ""),
];
/// What comes through a pipe.
const PIPE: Scheme = scheme("pipe", "pipe", ",mpjpeg");
/// Over TCP no part of a picture is lost; what cannot do that sends over UDP.
const RTSP: &[&str] = &["-rtsp_flags", "prefer_tcp"];

/// The protocols that are known, for messages.
pub(crate) fn schemes() -> String {
    let names = SCHEMES.iter().map(|scheme| format!("{}://", scheme.name));
    names.collect::<Vec<_>>().join(", ")
}

/// Systems whose cameras ffmpeg opens by other means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum System {
    Windows,
    Mac,
    /// Linux and others with Video4Linux.
    Unix,
}

impl System {
    /// The system of this program.
    pub const HERE: Self = if cfg!(windows) {
        Self::Windows
    } else if cfg!(target_os = "macos") {
        Self::Mac
    } else {
        Self::Unix
    };
}

impl Address {
    /// The live source of this name: a number (the camera of this number), a device such as
    /// `/dev/video0`, or an address such as `rtsp://host/path`. `None` for anything else, which may
    /// be a file. A file of the name of a camera's number takes precedence.
    ///
    /// # Errors
    /// [`Error::Scheme`] for an address of another protocol.
    pub fn parse(name: impl AsRef<OsStr>) -> Result<Option<Self>, Error> {
        Self::on(System::HERE, name.as_ref())
    }

    fn on(system: System, name: &OsStr) -> Result<Option<Self>, Error> {
        let of = |kind| Ok(Some(Self { kind, name: name.display().to_string() }));
        let path = Path::new(name);
        if system == System::Unix && is_camera(path) {
            return of(Kind::Named(path.to_path_buf()));
        }
        let Some(text) = name.to_str() else { return Ok(None) };
        let is_number = (1..=3).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
        if is_number && !path.exists() {
            return of(Kind::Numbered(text.parse().unwrap_or(0)));
        }
        if system == System::Windows && text.starts_with("video=") {
            return of(Kind::Named(path.to_path_buf()));
        }
        let Some((scheme, _)) = text.split_once("://").filter(|(scheme, _)| is_word(scheme)) else {
            return Ok(None);
        };
        match SCHEMES.iter().find(|known| known.name.eq_ignore_ascii_case(scheme)) {
            Some(known) => of(Kind::Network(known)),
            None if path.exists() => Ok(None),
            None => Err(Error::Scheme(without_password(text))),
        }
    }

    /// A camera of this machine; they count from 0.
    pub fn camera(number: usize) -> Self {
        Self { kind: Kind::Numbered(number), name: number.to_string() }
    }

    /// Standard input.
    pub fn pipe() -> Self {
        Self { kind: Kind::Pipe, name: "standard input".to_string() }
    }

    /// What messages call it: the address without the password that it may hold.
    pub fn shown(&self) -> String {
        without_password(&self.name)
    }

    /// Whether it may come back after it was lost.
    pub(super) fn is_network(&self) -> bool {
        matches!(self.kind, Kind::Network(_))
    }

    pub(super) fn is_pipe(&self) -> bool {
        self.kind == Kind::Pipe
    }

    /// The number of a camera that ffmpeg knows only by its name.
    pub(super) fn needs_name(&self, system: System) -> Option<usize> {
        match self.kind {
            Kind::Numbered(number) if system == System::Windows => Some(number),
            _ => None,
        }
    }

    /// The camera of this name.
    pub(super) fn named(&self, name: &str) -> Self {
        Self { kind: Kind::Named(format!("video={name}").into()), name: self.name.clone() }
    }

    /// What ffmpeg is told of its input, up to and with `-i`.
    pub(super) fn input(&self, system: System) -> Vec<OsString> {
        match &self.kind {
            Kind::Network(scheme) => scheme.input(&self.name),
            Kind::Pipe => PIPE.input("pipe:0"),
            Kind::Numbered(number) => match system {
                System::Unix => words(&["-f", "v4l2", "-i", &format!("/dev/video{number}")]),
                // Without a rate, ffmpeg asks for 29.97 frames per second, which many cameras do not
                // have.
                System::Mac => {
                    let camera = format!("{number}:none");
                    words(&["-f", "avfoundation", "-framerate", "30", "-i", &camera])
                }
                System::Windows => words(&["-f", "dshow", "-i", &format!("video={number}")]),
            },
            Kind::Named(name) => {
                let format = if system == System::Windows { "dshow" } else { "v4l2" };
                let mut input = words(&["-f", format, "-i"]);
                input.push(name.into());
                input
            }
        }
    }
}

/// Whether this is a device of Video4Linux, or the name of one, whether or not it is there.
fn is_camera(path: &Path) -> bool {
    let is_named = |path: &Path| {
        path.to_str().and_then(|text| text.strip_prefix("/dev/video")).is_some_and(|number| {
            !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
        })
    };
    // Links in /dev/v4l lead to them.
    is_named(path)
        || path.starts_with("/dev") && path.canonicalize().is_ok_and(|path| is_named(&path))
}

fn is_word(text: &str) -> bool {
    let mut bytes = text.bytes();
    bytes.next().is_some_and(|first| first.is_ascii_alphabetic())
        && bytes.all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte))
}

/// An address without its password, for messages.
pub(super) fn without_password(address: &str) -> String {
    let hidden = || {
        let (scheme, rest) = address.split_once("://")?;
        let host_ends = rest.find(['/', '?', '#']).unwrap_or(rest.len());
        let at = rest[..host_ends].rfind('@')?;
        let (user, _) = rest[..at].split_once(':')?;
        Some(format!("{scheme}://{user}:***{}", &rest[at..]))
    };
    hidden().unwrap_or_else(|| address.to_string())
}

/// The name of the camera of this number in what ffmpeg prints for `-list_devices true -f dshow`.
pub(super) fn listed_camera(printed: &str, number: usize) -> Option<&str> {
    let cameras = printed.lines().filter_map(|line| {
        let (before, _) = line.rsplit_once("\" (video)")?;
        before.split_once('"').map(|(_, name)| name)
    });
    { cameras }.nth(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(system: System, name: &str) -> String {
        let address = Address::on(system, OsStr::new(name)).unwrap().expect(name);
        let words = address.input(system);
        words.iter().map(|word| word.to_str().unwrap()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn cameras_are_opened_by_the_means_of_each_system() {
        assert_eq!(input(System::Unix, "0"), "-f v4l2 -i /dev/video0");
        assert_eq!(input(System::Unix, "/dev/video12"), "-f v4l2 -i /dev/video12");
        assert_eq!(input(System::Mac, "1"), "-f avfoundation -framerate 30 -i 1:none");
        let typed = "-f dshow -i video=A camera";
        assert_eq!(input(System::Windows, "video=A camera"), typed);
        let numbered = Address::on(System::Windows, OsStr::new("0")).unwrap().unwrap();
        assert_eq!(numbered.needs_name(System::Windows), Some(0));
        assert_eq!(numbered.named("A camera").input(System::Windows).join(OsStr::new(" ")), typed);
        let lines = [
            "[dshow @ 0x1] [info] \"Microphone\" (audio)",
            "[dshow @ 0x1] [info] \"USB \"HD\" Camera\" (video)",
            "[dshow @ 0x1] [info]   Alternative name \"@device_pnp\"",
            "[dshow @ 0x1] [info] \"Second\" (video)",
        ];
        let lines = lines.join("\n");
        assert_eq!(listed_camera(&lines, 0), Some("USB \"HD\" Camera"));
        assert_eq!(listed_camera(&lines, 1), Some("Second"));
        assert_eq!(listed_camera(&lines, 2), None);
    }

    /// Each protocol may use those that carry it, never files; lists of addresses are no format.
    #[test]
    fn an_address_leads_to_no_file_and_no_list() {
        for name in SCHEMES.iter().map(|scheme| scheme.name) {
            let input = input(System::Unix, &format!("{}://host/v", name.to_uppercase()));
            let (_, rest) = input.split_once("-protocol_whitelist ").unwrap();
            let (protocols, rest) = rest.split_once(" -format_whitelist ").unwrap();
            let formats: Vec<&str> = rest.split(' ').next().unwrap().split(',').collect();
            for other in ["file", "pipe", "concat", "subfile", "data", "crypto", "hls", "fd"] {
                assert!(!protocols.split(',').any(|protocol| protocol == other), "{name} {other}");
            }
            for other in ["hls", "dash", "concat", "image2", "sdp", "lavfi", "imf"] {
                assert!(!formats.contains(&other), "{name} {other}");
            }
            assert!(input.ends_with("://host/v"));
        }
    }

    #[test]
    fn what_may_be_a_file_is_no_address() {
        let address = |name: &str| Address::on(System::Unix, OsStr::new(name));
        for name in
            ["v.mp4", "-", "", "img/%04d.jpg", "1234", "0x", "/dev/zero", "/dev/video", "a:b"]
        {
            assert_eq!(address(name).unwrap(), None, "{name}");
        }
        let error = address("file:///etc/passwd").unwrap_err().to_string();
        assert!(error.contains("file:///etc/passwd"), "{error}");
        assert!(address("ftp://host/v.mp4").is_err());
    }

    #[test]
    fn messages_hide_the_password() {
        for (address, shown) in [
            ("rtsp://user:secret@host/a", "rtsp://user:***@host/a"),
            ("rtsp://user:se@cret@host/a", "rtsp://user:***@host/a"),
            ("http://host/a:b@c", "http://host/a:b@c"),
            ("udp://user@host", "udp://user@host"),
        ] {
            assert_eq!(without_password(address), shown);
        }
    }
}
