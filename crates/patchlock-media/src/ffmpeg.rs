//! Decodes all other video formats with an `ffmpeg` process, whose Y4M output is read through a
//! pipe.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Duration;

use tempfile::TempDir;

use crate::child::{Running, Watched, silent};
use crate::colour::Matrix;
use crate::confine::{self, Allowed};
use crate::limits::{self, Limits};
use crate::source::count_by_reading;
use crate::{Container, Error, FrameRate, FrameSource, Picture, y4m};

/// The option for "every frame exactly once", as spelled by new and by old versions of ffmpeg.
pub(crate) const EVERY_FRAME_ONCE: [[&str; 2]; 2] = [["-fps_mode", "passthrough"], ["-vsync", "0"]];

/// Formats in which frames are taken as they are; others are converted to the nearest. All have 8
/// bits. Those with a `j` are what older versions of ffmpeg call the full range.
pub(crate) const FORMATS: &str =
    "format=yuv420p|yuvj420p|yuv422p|yuvj422p|yuv444p|yuvj444p|yuv411p|gray";
/// The containers that ffmpeg may read: those that hold their video themselves. Others name further
/// files, or have a parser that we do not want to meet a stranger's file.
pub(crate) const CONTAINERS: &str = "matroska,webm,mov,mp4,avi,flv,mpeg,mpegts,mpegvideo,m4v,h261,h263,h264,hevc,vvc,av1,\
                          obu,ivf,vc1,vc1test,dirac,avs2,avs3,cavsvideo,ogg,nut,nsv,asf,rm,dv,mxf,gxf,wtv,\
                          mjpeg,gif,apng,webp,yuv4mpegpipe,flic,roq,smk,bink,swf,\
                          bmp_pipe,dpx_pipe,exr_pipe,gif_pipe,j2k_pipe,jpeg_pipe,jpegxl_pipe,jpegxl_anim,\
                          pam_pipe,pbm_pipe,pgm_pipe,ppm_pipe,pfm_pipe,png_pipe,psd_pipe,qoi_pipe,\
                          sgi_pipe,tiff_pipe,webp_pipe,pcx_pipe,jpegls_pipe";
/// Writes the time of each frame, in millionths of a second, to a file before the frame itself.
pub(crate) const TIMES: &str =
    "settb=AVTB,metadata=mode=add:key=n:value=0,metadata=mode=print:direct=1:file=";
pub(crate) const TIMES_FILE: &str = "times.txt";

/// Which program is run, and how long it may write nothing.
#[derive(Debug, Clone)]
pub struct Program {
    pub(crate) name: PathBuf,
    pub(crate) patience: Duration,
    /// A folder that it may change besides that of the times. Tests have one.
    pub(crate) folder: Option<PathBuf>,
    /// Whether it ends with the group of this process, which somebody else ends.
    pub(crate) is_of_group: bool,
}

impl Default for Program {
    fn default() -> Self {
        Self { name: "ffmpeg".into(), patience: limits::SILENCE, folder: None, is_of_group: false }
    }
}

/// Opens a video with ffmpeg. `reason` explains why ffmpeg is needed, for the message if it is
/// missing: a predicate of which the file is the subject, such as `holds VP9 video`. `times` are
/// those of all frames, in millionths of a second, if the file tells them.
pub fn open(
    path: &Path,
    reason: &str,
    reverse: bool,
    limits: Limits,
    times: Option<Vec<i64>>,
    program: Program,
) -> Result<Box<dyn FrameSource>, Error> {
    let about = About::of(path, reason, limits, &program)?;
    let About { sound, pixels, .. } = about;
    let places = match times {
        Some(times) => Places::of(times),
        None if about.is_countable => Places::NotRead,
        None => Places::Unknown,
    };
    let (path, reason) = (path.to_path_buf(), reason.to_string());
    let task = Task { program, path, reason, limits, matrix: about.matrix };
    let part = task.start(None, false)?;
    let (kept, length) = (BTreeMap::new(), None);
    let mut video = Video { task, part, next: 0, places, kept, reverse, length, pixels, sound };
    if reverse {
        video.prepare_reverse()?;
    }
    Ok(Box::new(video))
}

/// How to decode a video.
struct Task {
    program: Program,
    path: PathBuf,
    reason: String,
    limits: Limits,
    matrix: Option<Matrix>,
}

impl Task {
    /// Starts ffmpeg: at the beginning, or with the frame of this number, which is the first one
    /// shown at this time, in millionths of a second, or later. With `whole`, the frames are copied
    /// to a temporary file, in which they can be read in any order.
    fn start(&self, from: Option<(usize, i64)>, whole: bool) -> Result<Part, Error> {
        let (first, from) = (from.map_or(0, |(first, _)| first), from.map(|(_, time)| time));
        let name = self.path.display().to_string();
        let folder = tempfile::tempdir().map_err(|error| {
            Error::unreadable(&name, format!("ffmpeg needs a temporary folder: {error}"))
        })?;
        let mut last_error = None;
        for sync in EVERY_FRAME_ONCE {
            let mut command = self.decoding(from, sync)?;
            command.current_dir(folder.path());
            let pipe = Pipe::start(&mut command, self, Some(folder.path()))?;
            match y4m::open_stream(pipe, &name, whole, self.limits, self.matrix, first) {
                Ok(frames) => {
                    let times = Times::new(folder, first);
                    return Ok(Part { frames, times });
                }
                Err(error) if messages_in(&error).contains("max pixel count") => {
                    return Err(Error::TooManyPixels { name, limit: self.limits.pixels });
                }
                Err(error) if messages_in(&error).contains("not on whitelist") => {
                    let reason = "it is in none of the formats that ffmpeg may read here";
                    return Err(Error::unreadable_in(Container::Other, &name, reason));
                }
                Err(error) => {
                    let old_version = messages_in(&error).contains("fps_mode");
                    last_error = Some(error);
                    if !old_version {
                        break;
                    }
                }
            }
        }
        Err(last_error.map_or_else(|| Error::unreadable(&name, "ffmpeg did not start"), of_ffmpeg))
    }

    /// Decodes all frames. `-xerror` is not used: it also rejects intact videos with unevenly
    /// spaced frames. Dithering would make the pixels of a frame depend on how many were decoded
    /// before it.
    fn decoding(&self, from: Option<i64>, sync: [&str; 2]) -> Result<Command, Error> {
        let mut command = self.program.command(&self.path, "error", from, self.limits)?;
        let filters = format!("{TIMES}{TIMES_FILE},{FORMATS}");
        command.args(sync).args(["-sws_dither", "none", "-vf", &filters]);
        command.args(["-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
        Ok(command)
    }

    /// When the frames are shown, from the packets of the file, which are read but not decoded;
    /// `None` if they do not tell.
    fn packet_times(&self) -> Option<Vec<i64>> {
        let most = limits::frames(self.path.metadata().ok()?.len()) as usize;
        let mut command = self.program.command(&self.path, "error", None, self.limits).ok()?;
        command.args(["-c", "copy", "-f", "framecrc", "-"]);
        let mut lines = BufReader::new(Pipe::start(&mut command, self, None).ok()?);
        let (mut unit, mut times) = (None, Vec::new());
        while let Some(line) = y4m::piece_of_line(&mut lines).ok()? {
            if let Some(text) = line.strip_prefix("#tb 0: ") {
                let (over, under) = text.trim().split_once('/')?;
                unit = Some((over.parse::<i128>().ok()?, under.parse::<i128>().ok()?));
            } else if !line.starts_with('#') {
                let ticks: i64 = line.split(',').nth(2)?.trim().parse().ok()?;
                let (over, under) = unit.filter(|&(over, under)| over > 0 && under > 0)?;
                let micros = 1_000_000 * over * i128::from(ticks);
                times.push(i64::try_from((micros + under / 2).div_euclid(under)).ok()?);
            }
            if times.len() > most {
                return None;
            }
        }
        // Packets are in the order of decoding.
        times.sort_unstable();
        Some(times)
    }
}

/// When each frame is shown, in millionths of a second: where ffmpeg has to begin to start with
/// that frame.
enum Places {
    /// The packets of the file have not been read yet.
    NotRead,
    Known(Vec<i64>),
    /// All frames before a frame have to be decoded.
    Unknown,
}

impl Places {
    /// Frames that are shown twice, or at the same time, have no certain place.
    fn of(times: Vec<i64>) -> Self {
        match !times.is_empty() && times.is_sorted_by(|a, b| a < b) {
            true => Self::Known(times),
            false => Self::Unknown,
        }
    }
}

/// Frames from one run of ffmpeg, with their times.
struct Part {
    frames: Box<dyn FrameSource>,
    times: Times,
}

impl Program {
    /// A command line up to the input. With `from`, decoding starts there. Times are those of the
    /// file.
    fn command(
        &self,
        path: &Path,
        level: &str,
        from: Option<i64>,
        limits: Limits,
    ) -> Result<Command, Error> {
        let mut command = self.empty(level, limits);
        Self::add_input(&mut command, path, from)?;
        Ok(command)
    }

    /// A command line without an input.
    pub(crate) fn empty(&self, level: &str, limits: Limits) -> Command {
        let mut command = Command::new(&self.name);
        command
            .args(["-hide_banner", "-v", level, "-nostdin", "-protocol_whitelist", "file"])
            .args(["-format_whitelist", CONTAINERS])
            .args(["-max_pixels", &limits.pixels.to_string()]);
        command
    }

    /// Adds a file as the input.
    pub(crate) fn add_input(
        command: &mut Command,
        path: &Path,
        from: Option<i64>,
    ) -> Result<(), Error> {
        // A file may name others, on this machine or on others: ffmpeg must not follow that. The
        // prefix keeps it from taking a part of the name for a protocol.
        let mut input = OsString::from("file:");
        let path =
            std::path::absolute(path).map_err(|error| Error::unreadable(path.display(), error))?;
        input.push(path);
        command.arg("-copyts");
        if let Some(from) = from {
            command.args(["-seek_timestamp", "1", "-ss", &format!("{from}us")]);
        }
        command.arg("-i").arg(input).args(["-map", "0:v:0"]).stdin(Stdio::null());
        Ok(())
    }

    /// Starts a command that reads this file, and may write in this folder.
    pub(crate) fn spawn(
        &self,
        command: &mut Command,
        reads: &Path,
        folder: Option<&Path>,
        limits: Limits,
    ) -> io::Result<Child> {
        let changes = folder.into_iter().chain(self.folder.as_deref()).collect();
        let reads = vec![reads];
        confine::spawn(command, &Allowed { reads, is_ours: false, changes, pixels: limits.pixels })
    }
}

/// What the frames of Y4M do not tell of a video.
struct About {
    /// The matrix of the colours; `None` if the video does not say.
    matrix: Option<Matrix>,
    sound: bool,
    /// Pixels of a frame, 0 if that is not known.
    pixels: usize,
    /// Whether each packet of the file is a frame that is shown.
    is_countable: bool,
}

impl About {
    /// Decodes one frame. Errors but silence are left to the process that decodes all.
    fn of(path: &Path, reason: &str, limits: Limits, program: &Program) -> Result<Self, Error> {
        let mut command = program.command(path, "info", None, limits)?;
        command
            .args(["-frames:v", "1", "-vf", "showinfo", "-f", "null", "-"])
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let started = program.spawn(&mut command, path, None, limits);
        let mut child = started.map_err(|error| cannot_start(error, path, reason))?;
        let errors = child.stderr.take();
        // What it prints is all that matters; it is killed in the end.
        let _running = Running::new(child);
        let mut about = Self { matrix: None, sound: false, pixels: 0, is_countable: false };
        let mut one_each = false;
        let Some(errors) = errors else { return Ok(about) };
        let mut errors = BufReader::new(Watched::new(errors, program.patience));
        loop {
            let line = match y4m::piece_of_line(&mut errors) {
                Ok(Some(line)) => line,
                Err(error) if error.kind() == io::ErrorKind::TimedOut => {
                    return Err(Error::unreadable_in(Container::Other, path.display(), error));
                }
                Ok(None) | Err(_) => return Ok(about),
            };
            let is_stream = line.contains("Stream #");
            about.sound |= is_stream && line.contains(": Audio:");
            one_each |= is_stream && ONE_FRAME_EACH.iter().any(|codec| line.contains(codec));
            // Other containers than MP4 may store the two fields of an interlaced frame apart.
            about.is_countable |= one_each && line.contains(" i:P ");
            let size = line.split(' ').find_map(|word| word.strip_prefix("s:"));
            about.pixels = size.and_then(area).unwrap_or(about.pixels);
            let space = line.split(' ').find_map(|word| word.strip_prefix("color_space:"));
            about.matrix = about.matrix.or(space.and_then(matrix));
        }
    }
}

/// Width times height of a size such as `640x480`.
fn area(size: &str) -> Option<usize> {
    let (width, height) = size.split_once('x')?;
    width.parse::<usize>().ok()?.checked_mul(height.parse().ok()?)
}

/// Encodings in which each packet holds one frame that is shown. VP8 and MPEG-4, for example, have
/// others.
const ONE_FRAME_EACH: [&str; 7] = [
    "Video: h264",
    "Video: hevc",
    "Video: vp9",
    "Video: av1",
    "Video: mjpeg",
    "Video: prores",
    "Video: ffv1",
];

/// The matrix with this name in ffmpeg; `None` if the video does not say.
pub(crate) fn matrix(name: &str) -> Option<Matrix> {
    match name {
        "bt709" => Some(Matrix::Bt709),
        // What has no luma (`gbr`) is converted by ffmpeg, which then uses BT.601.
        "bt470bg" | "smpte170m" | "fcc" | "gbr" => Some(Matrix::Bt601),
        "bt2020nc" | "bt2020c" => Some(Matrix::Bt2020),
        _ => None,
    }
}

/// Frames kept when reading backwards, if they are not too large.
const BACKWARD_WINDOW: usize = 32;
/// To reach a frame that is not farther ahead, ffmpeg is not started again.
const NEAR: usize = 48;

/// A video that ffmpeg decodes.
struct Video {
    task: Task,
    part: Part,
    /// The frame that the part gives next.
    next: usize,
    places: Places,
    /// Frames that were read in advance.
    kept: BTreeMap<usize, Picture>,
    /// Whether frames before the wanted one are kept, since they may be wanted next.
    reverse: bool,
    /// The number of frames, if it had to be known.
    length: Option<usize>,
    /// Pixels of a frame.
    pixels: usize,
    sound: bool,
}

impl Video {
    /// When all frames are shown, if that is certain enough to start at any of them.
    fn places(&mut self) -> Option<&[i64]> {
        if let Places::NotRead = self.places {
            self.places = self.task.packet_times().map_or(Places::Unknown, Places::of);
        }
        match &self.places {
            Places::Known(times) => Some(times),
            Places::NotRead | Places::Unknown => None,
        }
    }

    /// Reading backwards takes places of the frames, or else a copy of the decoded video.
    fn prepare_reverse(&mut self) -> Result<(), Error> {
        self.length = match self.places().map(<[i64]>::len) {
            Some(length) => Some(length),
            None => {
                self.reverse = false;
                self.part = self.task.start(None, true)?;
                self.part.frames.length()
            }
        };
        Ok(())
    }

    /// Sees to it that the part gives this frame next, or one not far before it.
    fn approach(&mut self, index: usize) -> Result<(), Error> {
        if (self.next..=self.next + NEAR).contains(&index) || self.part.frames.length().is_some() {
            return Ok(());
        }
        if self.start_at(index).is_some() {
            return Ok(());
        }
        // A start that failed shows that the places are wrong.
        self.places = Places::Unknown;
        if index < self.next {
            (self.part, self.next) = (self.task.start(None, false)?, 0);
        }
        Ok(())
    }

    /// Starts with this frame, if it is certain that ffmpeg then begins with that one.
    fn start_at(&mut self, index: usize) -> Option<()> {
        let times = self.places()?;
        let (first, wanted) = (*times.first()?, *times.get(index)?);
        let before = index.checked_sub(1).map(|before| times[before]);
        let from = before.map(|before| (index, before + (wanted - before) / 2));
        let mut part = self.task.start(from, false).ok()?;
        let picture = part.frames.frame(index).ok()??;
        if (part.times.absolute(index)? - wanted).abs() > 1 {
            return None;
        }
        part.times.start = Some(first);
        (self.part, self.next) = (part, index + 1);
        self.kept.insert(index, picture);
        Some(())
    }

    /// Reads a frame that is kept, or one at or after the next one of the part.
    fn read(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if let Some(picture) = self.kept.remove(&index) {
            return Ok(Some(picture));
        }
        let picture = self.part.frames.frame(index)?;
        self.next = index + 1;
        // A frame that comes at another time than the packets say has another number.
        if let (Places::Known(times), Some(now)) = (&self.places, self.part.times.absolute(index))
            && times.get(index).is_none_or(|time| time.abs_diff(now) > 1)
        {
            self.places = Places::Unknown;
        }
        Ok(picture)
    }

    /// The first frame to read for this one.
    fn window(&self, index: usize) -> usize {
        let held = self.task.limits.held_frames(self.pixels, BACKWARD_WINDOW);
        (index + 1).saturating_sub(if self.reverse { held } else { 1 })
    }
}

impl FrameSource for Video {
    fn length(&self) -> Option<usize> {
        self.length
    }

    fn rate(&self) -> Option<FrameRate> {
        self.part.frames.rate()
    }

    fn has_sound(&self) -> bool {
        self.sound
    }

    fn count(&mut self) -> Result<usize, Error> {
        if let Some(length) = self.length {
            return Ok(length);
        }
        // The places are wrong if the first frame comes at another time.
        let first = self.frame(0)?;
        self.kept.extend(first.map(|picture| (0, picture)));
        match self.places().map(<[i64]>::len) {
            Some(length) => Ok(length),
            None => count_by_reading(self, 1),
        }
    }

    fn frame(&mut self, index: usize) -> Result<Option<Picture>, Error> {
        if self.length.is_some_and(|length| index >= length) {
            return Ok(None);
        }
        if !self.kept.contains_key(&index) {
            self.kept.clear();
            let first = self.window(index);
            self.approach(first)?;
            for before in first..index {
                let picture = self.read(before)?;
                self.kept.extend(picture.map(|picture| (before, picture)));
            }
        }
        // A frame without a time has that of an even rate.
        Ok(self.read(index)?.map(|picture| {
            let time = self.part.times.of(index).or(picture.time);
            picture.at(time)
        }))
    }
}

/// The times of the frames, in a file that ffmpeg writes ahead of them.
pub(crate) struct Times {
    folder: TempDir,
    lines: Option<BufReader<File>>,
    /// The number of the first frame in the file.
    first: usize,
    /// In millionths of a second; `None` for a frame without a time.
    read: Vec<Option<i64>>,
    /// The time of frame 0, if that is not in the file.
    start: Option<i64>,
}

impl Times {
    /// The times of the frames from this number on, in a file in this folder.
    pub(crate) fn new(folder: TempDir, first: usize) -> Self {
        Self { folder, lines: None, first, read: Vec::new(), start: None }
    }

    /// The time of a frame in the video; `None` if ffmpeg has not told.
    pub(crate) fn absolute(&mut self, index: usize) -> Option<i64> {
        let at = index.checked_sub(self.first)?;
        if self.lines.is_none() {
            let file = File::open(self.folder.path().join(TIMES_FILE)).ok()?;
            self.lines = Some(BufReader::new(file));
        }
        while self.read.len() <= at {
            let line = y4m::piece_of_line(self.lines.as_mut()?).ok()??;
            if let Some((_, after)) = line.split_once(" pts:") {
                let time = after.split_whitespace().next().and_then(|text| text.parse().ok());
                self.read.push(time);
            }
        }
        self.read[at]
    }

    /// When a frame is shown, in seconds from the first frame of the video.
    fn of(&mut self, index: usize) -> Option<f64> {
        let time = self.absolute(index)?;
        let start = self.start.or(*self.read.first()?)?;
        Some((time - start) as f64 / 1e6)
    }
}

/// What ffmpeg wrote to standard error before it failed to write a header. Its exit codes do not
/// tell why.
fn messages_in(error: &Error) -> &str {
    match error {
        Error::Unreadable { reason, .. } | Error::StreamEnd { reason, .. } => reason,
        _ => "",
    }
}

/// The error of the video, as opposed to one of the Y4M stream that ffmpeg makes of it.
fn of_ffmpeg(error: Error) -> Error {
    match error {
        Error::Unreadable { name, reason, .. } => {
            Error::Unreadable { name, container: Some(Container::Other), reason }
        }
        error => error,
    }
}

/// The error for a process that did not start.
fn cannot_start(error: io::Error, path: &Path, reason: &str) -> Error {
    match error.kind() {
        io::ErrorKind::NotFound => {
            Error::FfmpegMissing { path: path.to_path_buf(), reason: reason.to_string() }
        }
        _ => Error::unreadable(path.display(), format!("ffmpeg does not start: {error}")),
    }
}

/// Summarises what ffmpeg wrote to standard error: the first line, which usually names the cause,
/// and the last line. Empty if ffmpeg wrote nothing.
fn messages(errors: impl Read) -> String {
    let (mut first, mut last) = (None, None);
    let mut errors = BufReader::new(errors);
    while let Some(line) = y4m::piece_of_line(&mut errors).ok().flatten() {
        let line = without_address(&line);
        if !line.is_empty() {
            *if first.is_none() { &mut first } else { &mut last } = Some(line);
        }
    }
    first.into_iter().chain(last).collect::<Vec<_>>().join(" ... ")
}

/// Removes a leading memory address such as `[hevc @ 0x55e5cc57e4c0] `. Returns an empty string for
/// a line that only counts repetitions.
pub(crate) fn without_address(line: &str) -> String {
    let line = line.trim();
    let text =
        line.split_once("] ").filter(|_| line.starts_with('[')).map_or(line, |(_, text)| text);
    if text.starts_with("Last message repeated") { String::new() } else { text.to_string() }
}

/// The output of ffmpeg. At the end of the output, a failed exit or a message on standard error
/// becomes a read error.
struct Pipe {
    child: Running,
    output: Watched,
    messages: Option<Receiver<String>>,
    patience: Duration,
}

impl Pipe {
    /// Starts ffmpeg, which may write in this folder.
    fn start(command: &mut Command, task: &Task, folder: Option<&Path>) -> Result<Self, Error> {
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let started = task.program.spawn(command, &task.path, folder, task.limits);
        let mut child = started.map_err(|error| cannot_start(error, &task.path, &task.reason))?;
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(Error::unreadable(
                task.path.display(),
                "ffmpeg started without its output",
            ));
        };
        let (sender, messages) = mpsc::channel();
        // Nobody waits for the messages of a process that was stopped.
        thread::spawn(move || drop(sender.send(self::messages(errors))));
        let patience = task.program.patience;
        let output = Watched::new(output, patience);
        Ok(Self { child: Running::new(child), output, messages: Some(messages), patience })
    }

    /// Checks that the output ended where the video ends. ffmpeg skips what it cannot decode and
    /// still exits with success, so standard error has to be checked as well.
    fn check_end(&mut self) -> io::Result<()> {
        let status = self.child.end(self.patience)?;
        let messages = match self.messages.take() {
            Some(sent) => sent.recv_timeout(self.patience).map_err(|_| silent(self.patience))?,
            None => String::new(),
        };
        if !status.success() {
            let reason = if messages.is_empty() { "no reason given" } else { &messages };
            return Err(io::Error::other(format!("ffmpeg failed: {reason}")));
        }
        if !messages.is_empty() {
            return Err(io::Error::other(format!(
                "ffmpeg stopped and reported damage, possibly in earlier frames too: {messages}"
            )));
        }
        Ok(())
    }
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.output.read(buffer).inspect_err(|_| self.child.kill())?;
        if count == 0 && !buffer.is_empty() {
            self.check_end()?;
        }
        Ok(count)
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use crate::confine::tests::files_are_kept;
    use crate::fake_ffmpeg::Fake;
    use std::fs;

    /// Opens a video with a script in place of ffmpeg.
    fn open_with(fake: &Fake, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
        let program = fake.program.clone();
        open(&fake.file("v.webm"), "holds VP9", reverse, Limits::default(), None, program)
    }

    /// Two frames of two by two grey pixels.
    const FRAMES: &str = "printf 'YUV4MPEG2 W2 H2 F25:1 Cmono\\nFRAME\\nabcdFRAME\\nefgh'";
    /// Ends the run that asks for the colours.
    const COLOURS: &str = "case \"$*\" in *showinfo*) exit 0;; esac\necho $$ > id";
    const STUCK: &str = "ffmpeg wrote nothing for 0.5 s and was stopped";

    #[test]
    fn a_process_that_hangs_is_stopped() {
        let fake = Fake::new(&format!("{COLOURS}\nexec sleep 1000"));
        let error = open_with(&fake, false).err().unwrap().to_string();
        assert!(error.contains("v.webm") && error.contains(STUCK), "{error}");
        assert!(fake.has_ended());
    }

    #[test]
    fn a_process_that_hangs_before_the_colours_is_stopped() {
        let fake = Fake::new("echo $$ > id\nexec sleep 1000");
        let error = open_with(&fake, false).err().unwrap();
        assert!(error.to_string().contains(STUCK), "{error}");
        assert!(matches!(error, Error::Unreadable { container: Some(Container::Other), .. }));
        assert!(fake.has_ended());
    }

    #[test]
    fn only_containers_that_hold_their_video_are_allowed() {
        let fake = Fake::new(&format!("echo \"$*\" >> asked\n{FRAMES}"));
        open_with(&fake, false).unwrap();
        let asked = fs::read_to_string(fake.file("asked")).unwrap();
        assert_eq!(asked.lines().count(), 2);
        for line in asked.lines() {
            let (before, _) = line.split_once(" -i ").unwrap();
            let (_, list) = before.split_once("-format_whitelist ").unwrap();
            let list: Vec<&str> = list.split(' ').next().unwrap().split(',').collect();
            assert!(list.contains(&"matroska") && list.contains(&"mov"), "{list:?}");
            for other in ["hls", "dash", "concat", "image2", "imf", "svg_pipe", "sdp", "lavfi"] {
                assert!(!list.contains(&other), "{other}");
            }
        }
    }

    #[test]
    fn no_run_of_ffmpeg_changes_a_file_elsewhere() {
        if !files_are_kept() {
            return;
        }
        let elsewhere = tempfile::tempdir().unwrap();
        let file = elsewhere.path().join("file");
        let tries = format!("(echo x > '{}') 2> /dev/null\necho x >> runs", file.display());
        let fake = Fake::new(&format!("{tries}\n{FRAMES}"));
        let mut video = open_with(&fake, false).unwrap();
        assert_eq!(video.count().unwrap(), 2);
        assert!(fs::read_to_string(fake.file("runs")).unwrap().lines().count() >= 2);
        assert!(!file.exists());
    }

    #[test]
    fn frames_before_a_hang_are_kept() {
        let fake = Fake::new(&format!("{COLOURS}\n{FRAMES}\nprintf 'FRAME'\nexec sleep 1000"));
        let mut video = open_with(&fake, false).unwrap();
        assert!(video.frame(0).unwrap().is_some() && video.frame(1).unwrap().is_some());
        let error = video.frame(2).unwrap_err().to_string();
        assert!(error.contains("frame 2") && error.contains(STUCK), "{error}");
        assert!(fake.has_ended());
        assert!(open_with(&fake, true).err().unwrap().to_string().contains(STUCK));
    }

    #[test]
    fn a_process_that_closes_its_output_and_stays_is_stopped() {
        let stays = format!("{COLOURS}\n{FRAMES}\nexec >&- 2>&-\nexec sleep 1000");
        let fake = Fake::new(&stays);
        let mut video = open_with(&fake, false).unwrap();
        video.frame(1).unwrap();
        let error = video.frame(2).unwrap_err().to_string();
        assert!(error.contains(STUCK), "{error}");
        assert!(fake.has_ended());
    }

    #[test]
    fn time_without_a_reader_does_not_count_and_nothing_outlives_the_video() {
        let fake = Fake::new(&format!("{COLOURS}\n{FRAMES}\nsleep 0.1\nprintf 'FRAME\\nijkl'"));
        let mut video = open_with(&fake, false).unwrap();
        thread::sleep(Duration::from_millis(900));
        assert_eq!((0..).map_while(|k| video.frame(k).unwrap()).count(), 3);
        let fake = Fake::new(&format!("{COLOURS}\n{FRAMES}\nexec sleep 1000"));
        let video = open_with(&fake, false).unwrap();
        assert!(!fake.has_ended());
        drop(video);
        assert!(fake.has_ended());
    }
}
