//! H.264 of an MP4 file by an installed ffmpeg: several times as fast as the decoder in Rust, and
//! by the standard with the same pixels.

use std::process::Stdio;
use std::time::Duration;

use crate::child::{ChildGuard, TimeoutReader, own_process_group};
use crate::ffmpeg::{DecoderLog, EVERY_FRAME_ONCE, Program, TIMES};
use crate::limits::Limits;
use crate::y4m::Y4mStream;

/// In which a program that has closed its output must end.
const END: Duration = Duration::from_secs(1);

/// A file whose pictures ffmpeg decodes, in the order in which they are shown.
pub struct ExternalDecoder {
    frames: Y4mStream<TimeoutReader>,
    log: DecoderLog,
    /// The number of the first picture.
    first: usize,
    next: usize,
    _process: ChildGuard,
}

/// What to decode.
pub struct DecodeRequest<'a> {
    /// The file.
    pub path: &'a std::path::Path,
    /// The number of the first picture.
    pub first: usize,
    /// When a picture is shown from which ffmpeg can begin, and a time between the first picture and
    /// the one before it, in millionths of a second. `None` begins with the file.
    pub from: Option<(i64, i64)>,
    /// Width and height.
    pub size: [usize; 2],
}

/// What became of a start.
enum StartOutcome {
    Decoder(Box<ExternalDecoder>),
    /// It does not know an option, or cannot read the file.
    Ended,
}

impl ExternalDecoder {
    /// Starts ffmpeg; `None` if there is none that can do this.
    pub fn start(program: &Program, request: &DecodeRequest<'_>, limits: Limits) -> Option<Self> {
        for sync in EVERY_FRAME_ONCE {
            match Self::run(program, request, limits, sync)? {
                StartOutcome::Decoder(decoder) => return Some(*decoder),
                StartOutcome::Ended => {}
            }
        }
        None
    }

    /// It ends at the first picture that it would have to mend. Rotation, edits and colours are
    /// left to the reader of the file.
    fn run(
        program: &Program,
        request: &DecodeRequest<'_>,
        limits: Limits,
        sync: [&str; 2],
    ) -> Option<StartOutcome> {
        let input = [
            ["-err_detect", "explode"],
            ["-strict", "1"],
            ["-export_side_data", "film_grain"],
            ["-ignore_editlist", "1"],
        ];
        let mut command = program.empty("quiet", limits);
        command.args(["-xerror", "-noautorotate"]).args(input.as_flattened());
        if let Some((seek, _)) = request.from {
            // Where ffmpeg itself cuts depends on when the file begins.
            command.args(["-noaccurate_seek", "-seek_timestamp", "1", "-ss", &format!("{seek}us")]);
        }
        Program::add_input(&mut command, request.path, None).ok()?;
        let cut = request.from.map(|(_, cut)| format!("settb=AVTB,trim=start_pts={cut},"));
        let cut = cut.unwrap_or_default();
        // Written at equal distances, since times that are uneven would count as an error.
        let filters = format!("{cut}{TIMES},setpts=N/TB,format=yuv420p|yuvj420p");
        command.args(sync).args(["-vf", &filters]);
        command.args(["-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        if !program.is_of_group {
            own_process_group(&mut command);
        }
        let started = program.spawn(&mut command, request.path, limits);
        let mut child = started.ok()?;
        let (output, errors) = (child.stdout.take(), child.stderr.take());
        let process = ChildGuard::new(child);
        let output = TimeoutReader::new(output?, program.timeout);
        let Ok(frames) = Y4mStream::begin(output, "ffmpeg", limits, None, request.first) else {
            // One that hangs would hang again.
            return process.end(END).is_ok().then_some(StartOutcome::Ended);
        };
        let log = DecoderLog::listen(errors?, program.timeout);
        let [width, height] = request.size;
        let header = frames.header();
        let fits = header.size() == request.size && header.frame_bytes() == width * height * 3 / 2;
        let first = request.first;
        let decoder = Self { frames, log, first, next: first, _process: process };
        let decoder = Box::new(decoder);
        fits.then_some(StartOutcome::Decoder(decoder))
    }

    /// The number of the picture that comes next.
    pub fn next(&self) -> usize {
        self.next
    }

    /// The planes of the next picture, one after the other; `None` if it is not the one that is
    /// shown at this time, in millionths of a second.
    pub fn read(&mut self, time: i64) -> Option<Vec<u8>> {
        let planes = self.frames.read_next().ok()??;
        let shown = self.log.time(self.next - self.first)?;
        self.next += 1;
        (shown.abs_diff(time) <= 1).then_some(planes)
    }
}
