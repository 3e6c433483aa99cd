//! Decodes all other video formats with an `ffmpeg` process, whose Y4M output is read through a
//! pipe. The times of the frames and its messages come through standard error, each in front of
//! the frame that it is about.

mod decoder_log;
mod process;
mod video;

use std::ffi::OsString;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::child::{ChildGuard, TimeoutReader};
use crate::colour::Matrix;
use crate::confine::{self, SandboxPolicy};
use crate::limits::{self, Limits};
use crate::{Container, Error, FrameRate, FrameSource, y4m};

pub(crate) use decoder_log::{DecoderLog, without_address};
use process::Task;
use video::Video;

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
/// Writes the time of each frame, in millionths of a second, to standard error before the frame
/// itself, and nothing else of what a frame may tell, such as a time code.
pub(crate) const TIMES: &str =
    "settb=AVTB,metadata=mode=add:key=n:value=0,metadata=mode=print:key=n:direct=1:file=pipe\\\\:2";

/// Which program is run, and how long it may write nothing.
#[derive(Debug, Clone)]
pub struct Program {
    pub(crate) name: PathBuf,
    pub(crate) timeout: Duration,
    /// A folder that it may change. Tests have one.
    pub(crate) folder: Option<PathBuf>,
    /// Whether it ends with the group of this process, which somebody else ends.
    pub(crate) is_of_group: bool,
}

impl Default for Program {
    fn default() -> Self {
        Self { name: "ffmpeg".into(), timeout: limits::SILENCE, folder: None, is_of_group: false }
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
    let (path, reason) = (path.to_path_buf(), reason.to_string());
    let mut task = Task { program, path, reason, limits, matrix: None };
    let info = VideoInfo::of(&task)?;
    task.matrix = info.matrix;
    Ok(Box::new(Video::open(task, info, times, reverse)?))
}

impl Program {
    /// A command line without an input.
    pub(crate) fn empty(&self, level: &str, limits: Limits) -> Command {
        let mut command = Command::new(&self.name);
        command
            .args(["-hide_banner", "-v", level, "-nostdin", "-protocol_whitelist", "file"])
            .args(["-format_whitelist", CONTAINERS])
            .args(["-max_pixels", &limits.pixels.to_string()]);
        command
    }

    /// Adds a file as the input. With `from`, decoding starts there. Times are those of the file.
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

    /// Starts a command that reads this file.
    pub(crate) fn spawn(
        &self,
        command: &mut Command,
        reads: &Path,
        limits: Limits,
    ) -> io::Result<Child> {
        let changes = self.folder.as_deref().into_iter().collect();
        let reads = vec![reads];
        confine::spawn(
            command,
            &SandboxPolicy { reads, is_ours: false, changes, pixels: limits.pixels },
        )
    }
}

/// What the frames of Y4M do not tell of a video.
#[derive(Default)]
struct VideoInfo {
    /// The matrix of the colours; `None` if the video does not say.
    matrix: Option<Matrix>,
    sound: bool,
    /// Pixels of a frame, 0 if that is not known.
    pixels: usize,
    /// Whether each packet of the file is a frame that is shown.
    is_countable: bool,
    /// Frames per second on average, rounded to hundredths.
    mean_rate: Option<FrameRate>,
}

impl VideoInfo {
    /// Decodes one frame. Errors but silence are left to the process that decodes all.
    fn of(task: &Task) -> Result<Self, Error> {
        let mut command = task.command("info", None)?;
        command
            .args(["-frames:v", "1", "-vf", "showinfo", "-f", "null", "-"])
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = task.spawn(&mut command)?;
        let errors = child.stderr.take();
        // What it prints is all that matters; it is killed in the end.
        let _process = ChildGuard::new(child);
        let mut info = Self::default();
        let mut one_each = false;
        let Some(errors) = errors else { return Ok(info) };
        let mut errors = BufReader::new(TimeoutReader::new(errors, task.program.timeout));
        loop {
            let line = match y4m::piece_of_line(&mut errors) {
                Ok(Some(line)) => line,
                Err(error) if error.kind() == io::ErrorKind::TimedOut => {
                    return Err(Error::unreadable_in(Container::Other, task.name(), error));
                }
                Ok(None) | Err(_) => return Ok(info),
            };
            let is_stream = line.contains("Stream #");
            info.mean_rate = info.mean_rate.or(mean_rate(&line).filter(|_| is_stream));
            info.sound |= is_stream && line.contains(": Audio:");
            one_each |= is_stream && ONE_FRAME_EACH.iter().any(|codec| line.contains(codec));
            // Other containers than MP4 may store the two fields of an interlaced frame apart.
            info.is_countable |= one_each && line.contains(" i:P ");
            let size = line.split(' ').find_map(|word| word.strip_prefix("s:"));
            info.pixels = size.and_then(area).unwrap_or(info.pixels);
            let space = line.split(' ').find_map(|word| word.strip_prefix("color_space:"));
            info.matrix = info.matrix.or(space.and_then(matrix));
        }
    }
}

/// Width times height of a size such as `640x480`.
fn area(size: &str) -> Option<usize> {
    let (width, height) = size.split_once('x')?;
    width.parse::<usize>().ok()?.checked_mul(height.parse().ok()?)
}

/// The average rate in the description of a stream, such as `25 fps, 50 tbr`.
fn mean_rate(line: &str) -> Option<FrameRate> {
    let (before, _) = line.split_once(" fps,")?;
    let per_second: f64 = before.rsplit(' ').next()?.parse().ok()?;
    FrameRate::new((per_second * 100.0).round() as u32, 100)
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

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use crate::confine::tests::files_are_kept;
    use crate::fake_ffmpeg::FakeFfmpeg;
    use std::{fs, thread};

    /// Opens a video with a script in place of ffmpeg.
    fn open_with(fake: &FakeFfmpeg, reverse: bool) -> Result<Box<dyn FrameSource>, Error> {
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
        let fake = FakeFfmpeg::new(&format!("{COLOURS}\nexec sleep 1000"));
        let error = open_with(&fake, false).err().unwrap().to_string();
        assert!(error.contains("v.webm") && error.contains(STUCK), "{error}");
        assert!(fake.has_ended());
    }

    #[test]
    fn a_process_that_hangs_before_the_colours_is_stopped() {
        let fake = FakeFfmpeg::new("echo $$ > id\nexec sleep 1000");
        let error = open_with(&fake, false).err().unwrap();
        assert!(error.to_string().contains(STUCK), "{error}");
        assert!(matches!(error, Error::Unreadable { container: Some(Container::Other), .. }));
        assert!(fake.has_ended());
    }

    #[test]
    fn only_containers_that_hold_their_video_are_allowed() {
        let fake = FakeFfmpeg::new(&format!("echo \"$*\" >> asked\n{FRAMES}"));
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
        let fake = FakeFfmpeg::new(&format!("{tries}\n{FRAMES}"));
        let mut video = open_with(&fake, false).unwrap();
        assert_eq!(video.count().unwrap(), 2);
        assert!(fs::read_to_string(fake.file("runs")).unwrap().lines().count() >= 2);
        assert!(!file.exists());
    }

    #[test]
    fn frames_before_a_hang_are_kept() {
        let fake =
            FakeFfmpeg::new(&format!("{COLOURS}\n{FRAMES}\nprintf 'FRAME'\nexec sleep 1000"));
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
        let fake = FakeFfmpeg::new(&stays);
        let mut video = open_with(&fake, false).unwrap();
        video.frame(1).unwrap();
        let error = video.frame(2).unwrap_err().to_string();
        assert!(error.contains(STUCK), "{error}");
        assert!(fake.has_ended());
    }

    #[test]
    fn time_without_a_reader_does_not_count_and_nothing_outlives_the_video() {
        let fake =
            FakeFfmpeg::new(&format!("{COLOURS}\n{FRAMES}\nsleep 0.1\nprintf 'FRAME\\nijkl'"));
        let mut video = open_with(&fake, false).unwrap();
        thread::sleep(Duration::from_millis(900));
        assert_eq!((0..).map_while(|k| video.frame(k).unwrap()).count(), 3);
        let fake = FakeFfmpeg::new(&format!("{COLOURS}\n{FRAMES}\nexec sleep 1000"));
        let video = open_with(&fake, false).unwrap();
        assert!(!fake.has_ended());
        drop(video);
        assert!(fake.has_ended());
    }
}
