//! The process that wants frames.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use rustix::buffer::spare_capacity;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::{read, retry_on_intr};
use rustix::pipe::fcntl_setpipe_size;
use tempfile::TempDir;

use super::wire::{self, Kind, Reply, Request};
use crate::child::{ChildGuard, own_process_group};
use crate::confine::{self, SandboxPolicy};
use crate::find::OpenedSource;
use crate::image_file::is_image;
use crate::limits::{self, Limits, MOST_FRAMES};
use crate::{Error, FrameFault, FrameRate, FrameSource, Helper, Note, Picture, Pixels, SourceInfo};

/// What the pipe holds, if the system allows it: a frame of 640 x 480 pixels.
const PIPE: usize = 1 << 20;

/// Opens a file or a folder in a helper; `None` without one, for what is no path, and if the helper
/// cannot be started.
pub fn find(name: &OsStr, reverse: bool, limits: Limits) -> Option<Result<OpenedSource, Error>> {
    let helper = limits.helper.filter(|_| Path::new(name).exists())?;
    let request = OpenRequest { helper, name: name.to_os_string(), reverse, limits };
    let mut session = Session::start(&request).ok()?;
    Some(session.open(&request).map(|opened| match opened {
        OpenedSource::Source((info, notes)) => {
            OpenedSource::source(Source { request, info, notes, session: Some(session) })
        }
        OpenedSource::ForFfmpeg { reason, times } => OpenedSource::ForFfmpeg { reason, times },
    }))
}

/// What a helper is to open.
struct OpenRequest {
    helper: &'static Helper,
    name: OsString,
    reverse: bool,
    limits: Limits,
}

impl OpenRequest {
    /// What it has to read: also the images to which links in a folder lead.
    fn files(&self) -> Vec<PathBuf> {
        let path = PathBuf::from(&self.name);
        let entries = fs::read_dir(&path).into_iter().flatten().flatten();
        let links = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_symlink()));
        let links = links.map(|entry| entry.path());
        let links: Vec<_> = links.filter(|link| is_image(link) && link.is_file()).collect();
        [path].into_iter().chain(links).collect()
    }

    /// Another helper in place of one that has failed.
    fn again(&self) -> Result<Session, Error> {
        let unreadable = |reason| Error::unreadable(self.shown(), reason);
        let mut session = Session::start(self).map_err(|error| {
            unreadable(format!("the process that decodes it does not start: {error}"))
        })?;
        match session.open(self)? {
            OpenedSource::Source(_) => Ok(session),
            OpenedSource::ForFfmpeg { .. } => Err(unreadable("the file has changed".to_string())),
        }
    }

    fn shown(&self) -> String {
        self.name.display().to_string()
    }
}

/// What a reader says, or the error of a helper that has failed.
type Answer<T> = io::Result<Result<T, Error>>;

/// What a helper has opened, with what a user should know of it.
type OpenedFile = OpenedSource<(SourceInfo, Vec<Note>)>;

/// A file that a helper decodes.
struct Source {
    request: OpenRequest,
    info: SourceInfo,
    notes: Vec<Note>,
    /// `None` after the helper has failed. The next frame starts another one.
    session: Option<Session>,
}

impl FrameSource for Source {
    fn info(&self) -> SourceInfo {
        self.info
    }

    fn notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    fn announce(&mut self, first: usize, span: usize) {
        if let Some(session) = &mut self.session {
            // A helper that has failed is noticed at the next frame.
            let _ = wire::send(&mut session.input, &Request::Announce { first, span }, &[]);
        }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        let mut session = match self.session.take() {
            Some(session) => session,
            None => self.request.again()?,
        };
        match session.frame(index, self.request.limits) {
            Ok(frame) => {
                self.session = Some(session);
                frame
            }
            Err(error) => {
                let (name, fault) = (self.request.shown(), FrameFault::Unreadable);
                Err(Error::Frame { index, name, fault, reason: session.lost(&error) })
            }
        }
    }
}

/// A running helper. What it says is not trusted.
struct Session {
    process: ChildGuard,
    input: ChildStdin,
    output: PipeReader,
    /// Its folder of temporary files, removed after its end.
    _folder: TempDir,
}

impl Session {
    /// Starts a helper that may read what is asked for.
    fn start(request: &OpenRequest) -> io::Result<Self> {
        let folder = tempfile::tempdir()?;
        let files = request.files();
        let mut command = Command::new(&request.helper.program);
        // What it would print could command the terminal.
        command.args(&request.helper.arguments).env("TMPDIR", folder.path()).stderr(Stdio::null());
        own_process_group(command.stdin(Stdio::piped()).stdout(Stdio::piped()));
        let policy = SandboxPolicy {
            reads: files.iter().map(PathBuf::as_path).collect(),
            is_ours: true,
            changes: vec![folder.path()],
            pixels: request.limits.pixels,
        };
        let mut child = confine::spawn(&mut command, &policy)?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let process = ChildGuard::new(child);
        let (Some(input), Some(output)) = (input, output) else {
            return Err(io::Error::other("it has no pipes"));
        };
        // It then waits less often.
        let _ = fcntl_setpipe_size(&output, PIPE);
        let mut output = PipeReader { pipe: output, timeout: request.helper.timeout };
        let mut hello = [0; wire::HELLO.len()];
        output.read_exact(&mut hello)?;
        if hello != wire::HELLO {
            return Err(ErrorKind::InvalidData.into());
        }
        Ok(Self { process, input, output, _folder: folder })
    }

    fn open(&mut self, request: &OpenRequest) -> Result<OpenedFile, Error> {
        self.try_open(request)
            .unwrap_or_else(|error| Err(Error::unreadable(request.shown(), self.lost(&error))))
    }

    fn try_open(&mut self, request: &OpenRequest) -> Answer<OpenedFile> {
        let (name, reverse) = (request.name.clone(), request.reverse);
        let open = Request::Open { name, reverse, pixels: request.limits.pixels };
        match self.ask(&open)? {
            Reply::Opened { info, notes } => {
                if info.length.is_some_and(|length| length > MOST_FRAMES) {
                    return Err(nonsense());
                }
                let rate = info.rate.and_then(|rate| FrameRate::new(rate.frames, rate.seconds));
                Ok(Ok(OpenedSource::Source((SourceInfo { rate, ..info }, notes))))
            }
            Reply::ForFfmpeg { reason, times } => {
                let bytes = fs::metadata(&request.name)?.len();
                let times = match times {
                    Some(count) if count as u64 > limits::frames(bytes) => return Err(nonsense()),
                    Some(count) => Some(self.output.read_times(count)?),
                    None => None,
                };
                Ok(Ok(OpenedSource::ForFfmpeg { reason, times }))
            }
            Reply::Failed(error) => Ok(Err(error)),
            Reply::Frame { .. } | Reply::End => Err(nonsense()),
        }
    }

    fn frame(&mut self, index: usize, limits: Limits) -> Answer<Option<Picture>> {
        let (width, height, kind, time) = match self.ask(&Request::Frame(index))? {
            Reply::Frame { width, height, kind, time } => (width, height, kind, time),
            Reply::End => return Ok(Ok(None)),
            Reply::Failed(error) => return Ok(Err(error)),
            Reply::Opened { .. } | Reply::ForFfmpeg { .. } => return Err(nonsense()),
        };
        if width == 0 || height == 0 || limits.check(width, height).is_err() {
            return Err(nonsense());
        }
        let bytes = self.output.read_bytes((width * height).saturating_mul(kind.bytes()))?;
        let pixels = match kind {
            Kind::Grey8 => Pixels::Grey8(bytes),
            Kind::Rgb8 => Pixels::Rgb8(bytes),
            Kind::Grey16 => {
                let (pairs, _) = bytes.as_chunks();
                Pixels::Grey16(pairs.iter().map(|&pair| u16::from_ne_bytes(pair)).collect())
            }
        };
        Ok(Ok(Some(Picture::new(width, height, pixels).at(time))))
    }

    fn ask(&mut self, request: &Request) -> io::Result<Reply> {
        wire::send(&mut self.input, request, &[])?;
        wire::receive(&mut self.output)
    }

    /// Ends a helper that has failed, and says how it did.
    fn lost(&self, error: &io::Error) -> String {
        let status = self.process.stop();
        let timeout = self.output.timeout.as_secs_f64();
        let what = match error.kind() {
            ErrorKind::TimedOut => format!("wrote nothing for {timeout} s and was stopped"),
            ErrorKind::UnexpectedEof | ErrorKind::BrokenPipe => match status {
                Ok(status) => format!("has ended: {status}"),
                Err(error) => format!("has ended: {error}"),
            },
            _ => format!("gave no valid answer: {error}"),
        };
        format!("the process that decodes it {what}")
    }
}

fn nonsense() -> io::Error {
    io::Error::new(ErrorKind::InvalidData, "it claims too much")
}

/// The output of a process. A time without a byte is an error of the kind `TimedOut`.
struct PipeReader {
    pipe: ChildStdout,
    timeout: Duration,
}

impl PipeReader {
    /// Reads so many bytes. Memory is taken as they come.
    fn read_bytes(&mut self, count: usize) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(count)?;
        while bytes.len() < count {
            self.wait()?;
            if retry_on_intr(|| read(&self.pipe, spare_capacity(&mut bytes)))? == 0 {
                return Err(ErrorKind::UnexpectedEof.into());
            }
        }
        // Nothing may follow what was asked for.
        if bytes.len() > count { Err(ErrorKind::InvalidData.into()) } else { Ok(bytes) }
    }

    /// Reads so many times.
    fn read_times(&mut self, count: usize) -> io::Result<Vec<i64>> {
        let bytes = self.read_bytes(count.saturating_mul(size_of::<i64>()))?;
        let (times, _) = bytes.as_chunks();
        Ok(times.iter().map(|&time| i64::from_ne_bytes(time)).collect())
    }

    /// Waits until there is something to read, or the end.
    fn wait(&self) -> io::Result<()> {
        let timeout = Timespec::try_from(self.timeout).map_err(io::Error::other)?;
        let mut pipes = [PollFd::new(&self.pipe, PollFlags::IN)];
        match retry_on_intr(|| poll(&mut pipes, Some(&timeout)))? {
            0 => Err(ErrorKind::TimedOut.into()),
            _ => Ok(()),
        }
    }
}

impl Read for PipeReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.wait()?;
        self.pipe.read(buffer)
    }
}

/// Tests with scripts in place of a helper. The tests of the program have a true one.
#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::os::unix::fs::symlink;
    use std::{slice, thread};

    use super::*;
    use crate::confine::tests::files_are_kept;
    use crate::open_within;

    const HELLO: &str = "printf 'patchlock helper'";

    /// Limits with this script as the helper.
    fn limits(script: &str) -> Limits {
        let helper = Helper::new("/bin/bash", ["-c", script]);
        let helper = Box::leak(Box::new(Helper { timeout: Duration::from_secs(3), ..helper }));
        Limits { helper: Some(helper), ..Limits::default() }
    }

    /// The error of a file with this script.
    fn error(file: &Path, script: &str) -> String {
        match find(file.as_os_str(), false, limits(script)) {
            Some(Ok(OpenedSource::Source(mut source))) => source.frame(0).unwrap_err().to_string(),
            Some(Err(error)) => error.to_string(),
            _ => panic!("the helper was not started"),
        }
    }

    #[test]
    fn a_helper_reads_one_file_changes_none_and_connects_to_nothing() {
        if !files_are_kept() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["clip", "secret"] {
            fs::write(at(name), name).unwrap();
        }
        let server = TcpListener::bind("127.0.0.1:0").unwrap();
        let script = format!(
            "cd {}; n=0; exec 2> /dev/null
             cat clip > /dev/null && n=1
             cat secret > /dev/null && n=$((n + 2))
             (echo x > new) && n=$((n + 4))
             (echo > /dev/tcp/127.0.0.1/{}) && n=$((n + 8))
             {HELLO}; exit $n",
            folder.path().display(),
            server.local_addr().unwrap().port()
        );
        let error = error(&at("clip"), &script);
        assert!(
            error.ends_with("the process that decodes it has ended: exit status: 1"),
            "{error}"
        );
        let free = Command::new("/bin/bash").args(["-c", &script]).output().unwrap();
        assert_eq!(free.status.code(), Some(15), "without a sandbox, the script does all of it");
    }

    #[test]
    fn a_helper_reads_a_folder_and_the_images_to_which_its_links_lead() {
        if !files_are_kept() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("f")).unwrap();
        for name in ["f/0.png", "1.png", "key"] {
            fs::write(at(name), name).unwrap();
        }
        for name in ["1.png", "key"] {
            symlink(at(name), at("f").join(name)).unwrap();
        }
        let script = format!(
            "cd {}; n=0; exec 2> /dev/null
             cat f/0.png > /dev/null && n=1
             cat f/1.png > /dev/null && n=$((n + 2))
             cat f/key > /dev/null && n=$((n + 4))
             {HELLO}; exit $n",
            at("").display()
        );
        let error = error(&at("f"), &script);
        assert!(error.ends_with("exit status: 3"), "{error}");
    }

    #[test]
    fn a_silent_helper_is_stopped_with_what_it_has_started() {
        let folder = tempfile::tempdir().unwrap();
        let clip = folder.path().join("clip");
        fs::write(&clip, "clip").unwrap();
        // The name of the clip tells the process apart from all others.
        let started = format!("tail -f '{}'", clip.display());
        let error = error(&clip, &format!("{HELLO}; {started} > /dev/null & wait"));
        assert!(error.ends_with("decodes it wrote nothing for 3 s and was stopped"), "{error}");
        let name = clip.as_os_str().as_encoded_bytes();
        let runs = || {
            fs::read_dir("/proc").unwrap().flatten().any(|entry| {
                let line = fs::read(entry.path().join("cmdline")).unwrap_or_default();
                line.starts_with(b"tail") && line.windows(name.len()).any(|part| part == name)
            })
        };
        // It ends soon after the signal, not at once.
        for _ in 0..600 {
            if !runs() {
                return;
            }
            thread::sleep(Duration::from_millis(100));
        }
        panic!("{started} goes on");
    }

    #[test]
    fn what_a_helper_claims_is_not_believed() {
        let folder = tempfile::tempdir().unwrap();
        let clip = folder.path().join("clip");
        // The file is what the helper says.
        let script = format!("{HELLO}; cat '{}'; exec sleep 60", clip.display());
        let said = |replies: &[Reply], after: &[u8]| {
            let mut bytes = Vec::new();
            for reply in replies {
                wire::send(&mut bytes, reply, &[]).unwrap();
            }
            fs::write(&clip, [&bytes, after].concat()).unwrap();
            error(&clip, &script)
        };
        let opened = |length| {
            let (length, rate) = (Some(length), Some(FrameRate { frames: 0, seconds: 0 }));
            Reply::Opened { info: SourceInfo { length, rate, sound: true }, notes: Vec::new() }
        };
        let frame = |width, height| Reply::Frame { width, height, kind: Kind::Rgb8, time: None };
        let times = Reply::ForFfmpeg { reason: "is odd".into(), times: Some(1 << 40) };
        let failed = Reply::Failed(Error::Endless("a".into()));
        assert_eq!(said(slice::from_ref(&failed), &[]), "a is a pipe or a device, not a file");
        let lies: [(&[Reply], &[u8]); 7] = [
            (&[opened(usize::MAX)], &[]),
            (&[times], &[]),
            (&[Reply::End], &[]),
            (&[], &[255; 9]),
            (&[], b"\x02\0\0\0[]"),
            (&[opened(9), frame(1 << 20, 1 << 20)], &[]),
            (&[opened(9), frame(0, 7)], &[]),
        ];
        for (number, (replies, after)) in lies.into_iter().enumerate() {
            let error = said(replies, after);
            assert!(error.contains("decodes it gave no valid answer"), "{number}: {error}");
        }
    }

    #[test]
    fn without_a_helper_that_starts_files_are_decoded_here() {
        let folder = tempfile::tempdir().unwrap();
        let image = folder.path().join("a.png");
        image::GrayImage::new(3, 2).save(&image).unwrap();
        let nowhere = Box::leak(Box::new(Helper::new("/nowhere", ["a"])));
        let nowhere = Limits { helper: Some(nowhere), ..Limits::default() };
        for limits in [nowhere, limits("exit 1"), limits("echo something else than it should")] {
            assert!(find(image.as_os_str(), false, limits).is_none());
            let frame = open_within(&image, false, limits).unwrap().frame(0).unwrap().unwrap();
            assert_eq!((frame.width, frame.height), (3, 2));
        }
    }
}
