//! Pictures of the file that an installed ffmpeg decodes ahead: several times as fast as the decoder
//! in Rust, and by the standard with the same pixels. Whatever it does not decode as that decoder
//! would is left to it; it goes on where ffmpeg has stopped.

use std::process::Stdio;
use std::time::Duration;

use super::{Mp4, StreamInfo, micros};
use crate::child::{ChildGuard, TimeoutReader, own_process_group};
use crate::ffmpeg::{DecoderLog, EVERY_FRAME_ONCE, Program, TIMES};
use crate::y4m::Y4mStream;

/// From this many pixels of all frames together, it is worth starting ffmpeg.
pub const LONG: usize = 30_000_000;
/// As many pictures may be between two that are wanted, for ffmpeg to decode them all.
const NEAR: usize = 256;
/// In which a program that has closed its output must end.
const END: Duration = Duration::from_secs(1);

/// A running ffmpeg, which decodes the pictures in the order in which they are shown.
pub struct ExternalReader {
    run: DecodeRun,
    /// The number of the first picture.
    first: usize,
    next: usize,
    /// When each picture is shown, in millionths of a second.
    times: Vec<i64>,
    /// The first sample whose data have not been checked.
    checked: usize,
    /// The parameters of all pictures.
    info: StreamInfo,
}

struct DecodeRun {
    pictures: Y4mStream<TimeoutReader>,
    log: DecoderLog,
    _process: ChildGuard,
}

impl Mp4 {
    /// Starts ffmpeg at a frame; `None` if that is not sure to give the frames of the decoder.
    pub(super) fn start_ffmpeg(&mut self, first: usize) -> Option<ExternalReader> {
        let program = self.program.clone()?;
        // ffmpeg rounds a crop at the left.
        if (self.info.crop_left, self.info.crop_top) != (0, 0) {
            return None;
        }
        let time = |&at: &usize| micros(self.pictures.samples[at].time, self.timescale);
        let times: Vec<i64> = self.pictures.stored.iter().map(time).collect::<Option<_>>()?;
        // Pictures are known by their times.
        if !times.is_sorted_by(|a, b| b - a > 2) {
            return None;
        }
        let first = self.frames.get(first)?.picture;
        let checked = self.entrance(first);
        let from = first.checked_sub(1).map(|before| {
            let cut = times[before] + (times[first] - times[before]) / 2;
            (times[self.pictures.shown[checked]], cut)
        });
        for sync in EVERY_FRAME_ONCE {
            if let Some(run) = self.run_ffmpeg(&program, from, sync)? {
                let info = self.info;
                return Some(ExternalReader { run, first, next: first, times, checked, info });
            }
        }
        None
    }

    /// Starts ffmpeg: with `from`, at the first of two times in millionths of a second, when a
    /// picture is shown from which it can begin, and without the pictures before the second. It
    /// ends at the first picture that it would have to mend. Rotation, edits and colours are left to
    /// the reader of the file. `Some(None)` if it does not know an option, or cannot read the file.
    fn run_ffmpeg(
        &self,
        program: &Program,
        from: Option<(i64, i64)>,
        sync: [&str; 2],
    ) -> Option<Option<DecodeRun>> {
        let input = [
            ["-err_detect", "explode"],
            ["-strict", "1"],
            ["-export_side_data", "film_grain"],
            ["-ignore_editlist", "1"],
        ];
        let mut command = program.empty("quiet", self.limits);
        command.args(["-xerror", "-noautorotate"]).args(input.as_flattened());
        if let Some((seek, _)) = from {
            // Where ffmpeg itself cuts depends on when the file begins.
            command.args(["-noaccurate_seek", "-seek_timestamp", "1", "-ss", &format!("{seek}us")]);
        }
        Program::add_input(&mut command, &self.path, None).ok()?;
        let cut = from.map(|(_, cut)| format!("settb=AVTB,trim=start_pts={cut},"));
        let cut = cut.unwrap_or_default();
        // Written at equal distances, since times that are uneven would count as an error.
        let filters = format!("{cut}{TIMES},setpts=N/TB,format=yuv420p|yuvj420p");
        command.args(sync).args(["-vf", &filters]);
        command.args(["-strict", "-1", "-f", "yuv4mpegpipe", "-"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        if !program.is_of_group {
            own_process_group(&mut command);
        }
        let mut child = program.spawn(&mut command, &self.path, self.limits).ok()?;
        let (output, errors) = (child.stdout.take(), child.stderr.take());
        let process = ChildGuard::new(child);
        let output = TimeoutReader::new(output?, program.timeout);
        let Ok(pictures) = Y4mStream::begin(output, "ffmpeg", self.limits, None) else {
            // One that hangs would hang again.
            return process.end(END).is_ok().then_some(None);
        };
        let log = DecoderLog::listen(errors?, program.timeout);
        let (header, [width, height]) = (pictures.header(), self.info.shown());
        let fits =
            header.size() == [width, height] && header.frame_bytes() == width * height * 3 / 2;
        fits.then_some(Some(DecodeRun { pictures, log, _process: process }))
    }

    /// The planes of a picture that ffmpeg decodes, and their parameters. After `None`, the decoder
    /// goes on.
    pub(super) fn by_ffmpeg(&mut self, picture: usize) -> Option<(Vec<u8>, StreamInfo)> {
        let mut external = self.external.take()?;
        let skipped = picture.checked_sub(external.next)?;
        let mut planes = None;
        for next in (external.next..=picture).filter(|_| skipped <= NEAR) {
            // What the decoder would refuse is left to it.
            while external.checked <= self.pictures.stored[next] {
                self.read_sample(external.checked).ok()?;
                external.checked += 1;
            }
            planes = external.read();
            planes.as_ref().filter(|_| self.info == external.info)?;
        }
        let found = planes.map(|planes| (planes, external.info));
        self.external = Some(external).filter(|_| found.is_some());
        found
    }
}

impl ExternalReader {
    /// The planes of the next picture, one after the other; `None` if it is not the one that is
    /// shown next.
    fn read(&mut self) -> Option<Vec<u8>> {
        let planes = self.run.pictures.read_next().ok()??;
        let shown = self.run.log.time(self.next - self.first)?;
        let time = self.times[self.next];
        self.next += 1;
        (shown.abs_diff(time) <= 1).then_some(planes)
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::path::{Path, PathBuf};
    use std::process::Command;

    use super::*;
    use crate::confine::tests::files_are_kept;
    use crate::fake_ffmpeg::FakeFfmpeg;
    use crate::{Error, FrameSource, Limits, Picture};

    const FRAMES: usize = 40;

    /// A video that x264 has encoded with these options; `None` where there is no ffmpeg.
    fn encoded(folder: &Path, name: &str, size: &str, options: &[&str]) -> Option<PathBuf> {
        let file = folder.join(name);
        let source = format!("testsrc2=size={size}:rate=25,noise=alls=12:allf=t");
        let mut command = Command::new("ffmpeg");
        command.args(["-v", "error", "-y", "-f", "lavfi", "-i", &source, "-pix_fmt", "yuv420p"]);
        command
            .args(["-frames:v", &FRAMES.to_string(), "-c:v", "libx264"])
            .args(options)
            .arg(&file);
        let Ok(made) = command.output() else {
            println!("skipped the comparison with ffmpeg: ffmpeg is not on the PATH");
            return None;
        };
        assert!(made.status.success(), "{name}: {}", String::from_utf8_lossy(&made.stderr));
        Some(file)
    }

    fn opened(file: &Path, program: Option<Program>) -> Mp4 {
        Mp4::open(file, false, Limits::default(), program).ok().expect("can be read")
    }

    /// These frames of a video by a program, and how many of them it has decoded.
    fn by(
        program: &Program,
        file: &Path,
        frames: impl IntoIterator<Item = usize>,
    ) -> (Vec<Result<Option<Picture>, Error>>, usize) {
        let mut frames = frames.into_iter().peekable();
        let mut video = opened(file, Some(program.clone()));
        video.external = video.start_ffmpeg(*frames.peek().expect("there are frames"));
        let (mut read, mut count) = (Vec::new(), 0);
        for index in frames {
            read.push(video.frame(index));
            count += usize::from(video.external.is_some());
        }
        (read, count)
    }

    fn by_decoder(file: &Path) -> Vec<Picture> {
        let mut video = opened(file, None);
        (0..).map_while(|k| video.frame(k).expect("can be decoded")).collect()
    }

    /// Asserts that these are the frames of the decoder.
    fn assert_same(
        read: &[Result<Option<Picture>, Error>],
        expected: &[Picture],
        frames: impl IntoIterator<Item = usize>,
    ) {
        for (index, found) in frames.into_iter().zip(read) {
            assert!(found.as_ref().unwrap().as_ref() == expected.get(index), "frame {index}");
        }
    }

    #[test]
    fn frames_by_ffmpeg_are_those_of_the_decoder() {
        let kinds: [(&str, &[&str]); 8] = [
            ("96x80", &["-profile:v", "baseline"]),
            ("100x70", &["-x264-params", "bframes=3:b-pyramid=normal:ref=4:keyint=16"]),
            ("96x80", &["-x264-params", "open-gop=1:keyint=8:bframes=3"]),
            ("96x80", &["-x264-params", "slices=4:cabac=0:bframes=2"]),
            ("130x96", &["-x264-params", "weightp=2:weightb=1:bframes=4:direct=temporal"]),
            ("96x80", &["-x264-params", "intra-refresh=1:keyint=10:bframes=0"]),
            ("96x80", &["-color_range", "pc", "-crf", "40", "-movflags", "negative_cts_offsets"]),
            ("96x80", &["-use_editlist", "0", "-bf", "2", "-movflags", "faststart"]),
        ];
        let folder = tempfile::tempdir().unwrap();
        for (size, options) in kinds {
            let Some(file) = encoded(folder.path(), "v.mp4", size, options) else { return };
            let expected = by_decoder(&file);
            assert_eq!(expected.len(), FRAMES);
            // A decoder can begin only with the first frame if there are no whole key frames.
            let only_first = options.concat().contains("intra-refresh");
            let starts = [(0, 1), (0, 3), (13, 1), (21, 2)];
            for (first, stride) in starts.into_iter().filter(|start| start.0 == 0 || !only_first) {
                let frames = || (first..FRAMES).step_by(stride);
                let (read, count) = by(&Program::default(), &file, frames());
                assert_same(&read, &expected, frames());
                // Within open groups of pictures, ffmpeg may mend the first ones, and is not used.
                let is_open = options.concat().contains("open-gop") && first > 0;
                assert!(count == read.len() || is_open, "{options:?} from {first}: {count}");
            }
        }
    }

    /// Their rotation, edit lists and uneven times are those of the reader.
    #[test]
    fn files_of_cameras_and_editors_have_the_same_frames() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
        for name in ["turned.mov", "trimmed.mp4", "uneven.mp4", "bframes.mp4", "open.mp4"] {
            let file = data.join(name);
            let expected = by_decoder(&file);
            let (read, count) = by(&Program::default(), &file, 0..expected.len() + 1);
            assert_same(&read, &expected, 0..expected.len() + 1);
            println!("{name}: {count} of {} frames by ffmpeg", expected.len());
        }
    }

    /// What ffmpeg does not give comes from the decoder.
    #[test]
    fn a_program_that_fails_changes_no_frame() {
        let folder = tempfile::tempdir().unwrap();
        let Some(file) = encoded(folder.path(), "v.mp4", "96x80", &["-bf", "2"]) else { return };
        let expected = by_decoder(&file);
        let bytes = 96 * 80 * 3 / 2;
        let fails = [
            ("exit 1".to_string(), 0),
            ("exec sleep 1000".to_string(), 0),
            ("printf 'YUV4MPEG2 W98 H80 F25:1 C420jpeg\\n'".to_string(), 0),
            (format!("exec 3>&1; real \"$@\" | head -c {} >&3", 10 * bytes + 200), 10),
            (format!("real \"$@\" | head -c {}; exec sleep 1000", 7 * bytes + 150), 7),
            // Frames that are shown at other times than the file says.
            ("real \"$@\" > all 2> times; grep -v 'frame:5 ' times >&2; cat all".to_string(), 5),
        ];
        for (script, by_program) in fails {
            let real = "real() { ffmpeg \"$@\"; }";
            let fake = FakeFfmpeg::new(&format!("{real}\n{script}"));
            let timeout =
                Duration::from_millis(if script.contains("sleep") { 3000 } else { 20_000 });
            let program = Program { timeout, ..fake.program.clone() };
            let (read, count) = by(&program, &file, 0..FRAMES + 1);
            assert_same(&read, &expected, 0..FRAMES + 1);
            assert_eq!(count, by_program, "{script}");
        }
    }

    #[test]
    fn ffmpeg_in_place_of_the_decoder_changes_no_file_elsewhere() {
        let folder = tempfile::tempdir().unwrap();
        let Some(file) = encoded(folder.path(), "v.mp4", "96x80", &[]) else { return };
        let elsewhere = folder.path().join("file");
        let tries = format!("(echo x > '{}') 2> /dev/null", elsewhere.display());
        let fake = FakeFfmpeg::new(&format!("{tries}\nexec ffmpeg \"$@\""));
        let program = Program { timeout: Duration::from_secs(20), ..fake.program.clone() };
        let (_, count) = by(&program, &file, 0..FRAMES);
        assert_eq!(count, FRAMES);
        assert!(!elsewhere.exists() || !files_are_kept());
    }

    #[test]
    fn short_videos_and_readers_that_go_backwards_start_no_ffmpeg() {
        let folder = tempfile::tempdir().unwrap();
        let Some(file) = encoded(folder.path(), "v.mp4", "96x80", &[]) else { return };
        let fake = FakeFfmpeg::new("echo x >> runs\nexit 1");
        let mut video = opened(&file, Some(fake.program.clone()));
        video.announce(0, usize::MAX);
        let limits = Limits::default();
        let mut back = Mp4::open(&file, true, limits, Some(fake.program.clone())).ok().unwrap();
        back.info.width = 1 << 20;
        back.announce(0, FRAMES);
        assert!(!fake.file("runs").exists());
        video.info.width = 1 << 20;
        video.announce(0, FRAMES);
        assert!(fake.file("runs").exists());
    }

    /// Damage is an error at the same frame, whatever decodes.
    #[test]
    fn a_damaged_video_ends_with_the_same_frame() {
        let folder = tempfile::tempdir().unwrap();
        let options = ["-x264-params", "bframes=2:keyint=10"];
        let Some(file) = encoded(folder.path(), "v.mp4", "96x80", &options) else { return };
        let whole = std::fs::read(&file).unwrap();
        let sample = opened(&file, None).pictures.samples[17];
        let mut errors = 0;
        for (at, bytes) in [(0, vec![255; 4]), (5, vec![0; 60]), (40, vec![0x55; 200])] {
            let mut damaged = whole.clone();
            let at = sample.offset as usize + at;
            damaged[at..at + bytes.len()].copy_from_slice(&bytes);
            std::fs::write(&file, damaged).unwrap();
            let mut decoder = opened(&file, None);
            let expected: Vec<_> = (0..FRAMES).map(|k| decoder.frame(k)).collect();
            let program = Program { timeout: Duration::from_secs(20), ..Program::default() };
            let (read, _) = by(&program, &file, 0..FRAMES);
            for (k, (found, expected)) in read.iter().zip(&expected).enumerate() {
                let [found, expected] =
                    [found, expected].map(|frame| frame.as_ref().map_err(Error::to_string));
                assert!(found == expected, "frame {k}: {:?} {:?}", found.err(), expected.err());
            }
            for error in expected.iter().filter_map(|frame| frame.as_ref().err()).take(1) {
                assert!(error.to_string().ends_with("; the next key frame is 20"), "{error}");
                errors += 1;
            }
        }
        assert!(errors > 0);
    }
}
