//! Videos that were cut, torn or damaged and that ffmpeg decodes: the frames are those that ffmpeg
//! and OpenCV show, in any order of reading, and a note says that something is wrong. A frame that
//! is missing between others is an error. The brightness of a frame tells its number.

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use patchlock_media::{Error, FrameFault, Note, Picture, Pixels, open};
use support::ffmpeg::{ffmpeg, ffmpeg_is_there};
use tempfile::TempDir;

/// Frames of a whole video.
const FRAMES: usize = 100;

struct Videos {
    folder: TempDir,
}

impl Videos {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs ffmpeg on what was made before.
    fn make(&self, from: &[&str], options: &[&str], name: &str) -> PathBuf {
        let file = self.path(name);
        let path = |word: &&str| match self.path(word) {
            known if known.is_file() => known.to_str().unwrap().to_string(),
            _ => word.to_string(),
        };
        let from: Vec<String> = from.iter().map(path).collect();
        let words = from.iter().map(String::as_str).chain(options.iter().copied());
        ffmpeg(&words.chain([file.to_str().unwrap()]).collect::<Vec<_>>());
        file
    }

    fn encode(&self, options: &[&str], name: &str) -> PathBuf {
        let source = format!(
            "color=c=black:s=160x120:r=25:d={},format=yuv420p,\
             geq=lum='20+2*N+random(0)*12':cb=128:cr=128",
            FRAMES / 25
        );
        self.make(&["-f", "lavfi", "-i", &source], options, name)
    }

    /// The file with other bytes.
    fn changed(&self, from: &str, name: &str, change: impl FnOnce(&mut Vec<u8>)) -> PathBuf {
        let mut bytes = fs::read(self.path(from)).unwrap();
        change(&mut bytes);
        let file = self.path(name);
        fs::write(&file, bytes).unwrap();
        file
    }
}

/// The mean of a picture.
fn level(picture: &Picture) -> f64 {
    let bytes = match &picture.pixels {
        Pixels::Rgb8(bytes) | Pixels::Grey8(bytes) => bytes,
        Pixels::Grey16(_) => panic!("video has 8 bits"),
    };
    bytes.iter().map(|&byte| f64::from(byte)).sum::<f64>() / bytes.len() as f64
}

/// The number of a frame that was not damaged.
fn number(picture: &Picture) -> usize {
    ((level(picture) * 219.0 / 255.0 + 16.0 - 26.0) / 2.0).round() as usize
}

/// The means of the frames that ffmpeg itself shows, in RGB.
fn shown(file: &Path) -> Vec<f64> {
    let name = file.to_str().unwrap();
    let args = ["-i", name, "-map", "0:v:0", "-fps_mode", "passthrough", "-pix_fmt", "rgb24"];
    let bytes = ffmpeg(&[&args[..], &["-f", "rawvideo", "-"]].concat());
    let mean = |frame: &[u8]| frame.iter().map(|&byte| f64::from(byte)).sum::<f64>();
    let size = 160 * 120 * 3;
    bytes.chunks_exact(size).map(|frame| mean(frame) / size as f64).collect()
}

/// Asserts that the frames are those that ffmpeg shows, in any order; returns the notes. What a
/// decoder conceals need not look the same each time.
fn assert_shown(file: &Path, is_concealed: bool) -> Vec<Note> {
    let expected = shown(file);
    let about = file.file_name().unwrap().display().to_string();
    let is_near = |picture: &Picture, index: usize| (level(picture) - expected[index]).abs() < 2.0;
    let mut video = open(file, false).unwrap();
    let frames: Vec<Picture> = (0..).map_while(|k| video.frame(k).unwrap()).collect();
    assert_eq!(frames.len(), expected.len(), "{about}");
    for (k, frame) in frames.iter().enumerate() {
        assert!(is_near(frame, k), "{about}: frame {k} has {}, not {}", level(frame), expected[k]);
    }
    let notes = video.notes();
    let assert_same = |found: Option<Picture>, k: usize, how: &str| {
        let found = found.unwrap_or_else(|| panic!("{about}: frame {k} {how} is not there"));
        assert_eq!(found.time, frames[k].time, "{about}: frame {k} {how}");
        assert!(is_concealed || found == frames[k], "{about}: frame {k} {how}");
    };
    let mut video = open(file, false).unwrap();
    assert_eq!(video.count().unwrap(), frames.len(), "{about} is counted");
    for k in [frames.len() - 1, 0, 52, 3].into_iter().filter(|&k| k < frames.len()) {
        assert_same(video.frame(k).unwrap(), k, "after a jump");
    }
    assert_eq!(video.frame(frames.len()).unwrap(), None, "{about}");
    let late = frames.len() - 4;
    assert_same(open(file, false).unwrap().frame(late).unwrap(), late, "at first");
    let mut back = open(file, true).unwrap();
    assert_eq!(back.length(), Some(frames.len()), "{about} backwards");
    for k in (0..frames.len()).rev() {
        assert_same(back.frame(k).unwrap(), k, "backwards");
    }
    notes
}

fn texts(notes: &[Note]) -> String {
    notes.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

const H264: [&str; 4] =
    ["-c:v", "libx264", "-x264-params", "open-gop=1:keyint=20:min-keyint=20:bframes=3:scenecut=0"];
const H265: [&str; 4] =
    ["-c:v", "libx265", "-x265-params", "log-level=none:open-gop=1:keyint=20:bframes=3"];

#[test]
fn a_cut_video_has_the_frames_that_can_be_shown() {
    if !ffmpeg_is_there("cut videos") {
        return;
    }
    let videos = Videos::new();
    for (codec, whole) in [(&H264, "h264.ts"), (&H265, "h265.ts")] {
        videos.encode(codec, whole);
        for container in ["mkv", "ts", "mp4"] {
            let name = format!("{whole}.{container}");
            let file = videos.make(&["-ss", "1", "-i", whole], &["-c", "copy"], &name);
            assert_shown(&file, false);
            let mut video = open(&file, false).unwrap();
            let first = number(&video.frame(0).unwrap().unwrap());
            assert!((20..=40).contains(&first), "{name} begins with frame {first}");
            let count = video.count().unwrap();
            let last = number(&video.frame(count - 1).unwrap().unwrap());
            assert_eq!((last, count), (99, FRAMES - first), "{name}");
        }
    }
}

/// As a stream that was recorded from the middle on, and until the middle of a packet.
#[test]
fn a_piece_of_a_stream_has_the_frames_that_can_be_shown() {
    if !ffmpeg_is_there("pieces of streams") {
        return;
    }
    let videos = Videos::new();
    let codecs: [(&[&str], &str); 3] =
        [(&H264, "h264.ts"), (&H265, "h265.ts"), (&["-c:v", "mpeg2video", "-bf", "2"], "mpeg2.ts")];
    let mut noted = 0;
    for (codec, whole) in codecs {
        videos.encode(codec, whole);
        for (k, part) in [0.11, 0.36].into_iter().enumerate() {
            let piece = videos.changed(whole, &format!("{k}{whole}"), |bytes| {
                let begin = (bytes.len() as f64 * part) as usize;
                bytes.truncate(bytes.len() - 1000);
                bytes.drain(..begin);
            });
            noted += usize::from(!assert_shown(&piece, true).is_empty());
        }
    }
    assert!(noted > 0, "ffmpeg complains of some");
}

#[test]
fn a_recording_that_was_cut_off_has_the_frames_before_and_a_note() {
    if !ffmpeg_is_there("recordings that were cut off") {
        return;
    }
    let videos = Videos::new();
    let kinds: [(&[&str], &str); 6] = [
        (&["-c:v", "libx264", "-g", "20", "-bf", "2"], "h264.mkv"),
        (&["-c:v", "libvpx-vp9", "-g", "20"], "vp9.webm"),
        (&["-c:v", "libvpx", "-g", "20"], "vp8.webm"),
        (&["-c:v", "mpeg4", "-bf", "2", "-g", "12"], "mpeg4.avi"),
        (&["-c:v", "mjpeg", "-q:v", "2"], "mjpeg.avi"),
        (&["-c:v", "ffv1"], "ffv1.mkv"),
    ];
    for (codec, whole) in kinds {
        videos.encode(codec, whole);
        let file = videos.changed(whole, &format!("crash_{whole}"), |bytes| {
            bytes.truncate(bytes.len() * 2 / 3);
        });
        let notes = texts(&assert_shown(&file, true));
        let count = open(&file, false).unwrap().count().unwrap();
        assert!((40..90).contains(&count), "{whole}: {count}");
        let is_matroska = whole.ends_with("mkv") || whole.ends_with("webm");
        let words = "File ended prematurely; all frames that it can decode are used";
        assert!(!is_matroska || notes.contains(words), "{whole}: {notes}");
    }
}

/// Bytes that are wrong in the middle: decoders conceal it.
#[test]
fn damage_that_a_decoder_conceals_is_only_noted() {
    if !ffmpeg_is_there("damaged videos") {
        return;
    }
    let videos = Videos::new();
    let kinds: [(&[&str], &str); 4] = [
        (&["-c:v", "libx264", "-g", "20", "-bf", "2"], "h264.mkv"),
        (&["-c:v", "mpeg2video", "-bf", "2"], "mpeg2.ts"),
        (&["-c:v", "mpeg4", "-bf", "2", "-g", "12"], "mpeg4.avi"),
        (&["-c:v", "mjpeg", "-q:v", "2"], "mjpeg.avi"),
    ];
    let mut noted = 0;
    for (codec, whole) in kinds {
        videos.encode(codec, whole);
        let file = videos.changed(whole, &format!("damaged_{whole}"), |bytes| {
            let middle = bytes.len() / 2;
            for byte in &mut bytes[middle..middle + 40] {
                *byte = byte.wrapping_add(77);
            }
        });
        let notes = assert_shown(&file, true);
        noted += usize::from(matches!(notes[..], [Note::Damage { .. }, ..]));
    }
    assert!(noted >= 2, "ffmpeg complains of {noted}");
}

/// A camera may write EXIF that ffmpeg does not understand into each frame.
#[test]
fn complaints_about_what_is_no_picture_are_only_noted() {
    if !ffmpeg_is_there("odd MJPEG") {
        return;
    }
    let videos = Videos::new();
    videos.encode(&["-c:v", "mjpeg", "-q:v", "2", "-f", "mjpeg"], "plain.mjpeg");
    let file = videos.changed("plain.mjpeg", "odd.mjpeg", |bytes| {
        let exif = b"\xff\xe1\x00\x10Exif\0\0II\x2a\0\xff\xff";
        let mut odd = Vec::new();
        let mut rest = bytes.as_slice();
        while let Some(at) = rest[2.min(rest.len())..].windows(2).position(|w| w == [0xff, 0xd8]) {
            odd.extend([&rest[..2], exif, &rest[2..at + 2]].concat());
            rest = &rest[at + 2..];
        }
        odd.extend([&rest[..2], exif, &rest[2..]].concat());
        *bytes = odd;
    });
    let notes = assert_shown(&file, false);
    assert!(matches!(notes[..], [Note::Damage { frame: 0, .. }]), "{}", texts(&notes));
    assert_eq!(open(&file, false).unwrap().count().unwrap(), FRAMES);
}

/// The data of this packet of a Matroska file are unlike any picture.
fn without_packet(
    videos: &Videos,
    whole: &str,
    name: &str,
    packets: std::ops::Range<usize>,
) -> PathBuf {
    let listed = ffmpeg(&[
        "-i",
        videos.path(whole).to_str().unwrap(),
        "-c",
        "copy",
        "-f",
        "framemd5",
        "-hash",
        "md5",
        "-",
    ]);
    let sizes: Vec<usize> = String::from_utf8_lossy(&listed)
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').nth(4).unwrap().trim().parse().unwrap())
        .collect();
    let raw = ffmpeg(&[
        "-i",
        videos.path(whole).to_str().unwrap(),
        "-c",
        "copy",
        "-f",
        "data",
        "-map",
        "0:v",
        "-",
    ]);
    videos.changed(whole, name, |bytes| {
        for packet in packets {
            let begin: usize = sizes[..packet].iter().sum();
            let data = &raw[begin..begin + sizes[packet]];
            let at = bytes.windows(data.len()).position(|window| window == data).unwrap();
            bytes[at..at + data.len()].fill(0xff);
        }
    })
}

#[test]
fn frames_that_are_missing_between_others_are_errors_that_name_the_next_one() {
    if !ffmpeg_is_there("missing frames") {
        return;
    }
    let videos = Videos::new();
    let kinds: [(&[&str], &str); 2] = [
        (&["-c:v", "libvpx-vp9", "-lossless", "1", "-g", "10"], "vp9.webm"),
        (&["-c:v", "ffv1", "-g", "1"], "ffv1.mkv"),
    ];
    for (codec, whole) in kinds {
        videos.encode(codec, whole);
        let file = without_packet(&videos, whole, &format!("hole_{whole}"), 57..60);
        assert_eq!(shown(&file).len(), FRAMES - 3, "{whole}");
        let check = |index: usize, found: Result<Option<Picture>, Error>| match found {
            Ok(Some(picture)) => {
                assert!(!(57..60).contains(&index), "{whole}: frame {index}");
                assert_eq!(number(&picture), index, "{whole}");
            }
            Err(Error::Frame { index: named, fault: FrameFault::Damaged, reason, .. }) => {
                assert_eq!(named, index);
                assert!((57..60).contains(&index), "{whole}: frame {index}: {reason}");
                assert!(reason.ends_with("the next good frame is 60"), "{reason}");
            }
            other => panic!("{whole}: frame {index}: {other:?}"),
        };
        let mut video = open(&file, false).unwrap();
        for k in 0..FRAMES {
            check(k, video.frame(k));
        }
        assert_eq!(video.frame(FRAMES).unwrap(), None);
        let mut video = open(&file, false).unwrap();
        assert_eq!(video.count().unwrap(), FRAMES, "{whole}");
        for k in [58, 99, 60, 57, 56, 3, 59] {
            check(k, video.frame(k));
        }
        let mut video = open(&file, true).unwrap();
        for k in (0..FRAMES).rev() {
            check(k, video.frame(k));
        }
    }
}

/// What a frame tells beside its time, such as the time code of MPEG-2, is no damage.
#[test]
fn a_whole_video_has_no_note() {
    if !ffmpeg_is_there("whole videos") {
        return;
    }
    let videos = Videos::new();
    for (codec, name) in [
        ("mpeg2video", "v.ts"),
        ("mpeg1video", "v.mpg"),
        ("mpeg4", "v.avi"),
        ("mjpeg", "j.avi"),
        ("libx264", "v.mkv"),
        ("ffv1", "f.mkv"),
    ] {
        let file = videos.encode(&["-c:v", codec, "-q:v", "2"], name);
        assert_eq!(assert_shown(&file, false), [], "{name}");
    }
}

#[test]
fn frames_of_another_size_are_noted() {
    if !ffmpeg_is_there("frames of several sizes") {
        return;
    }
    let videos = Videos::new();
    let half = "color=c=gray:s=160x120:r=25:d=1";
    let other = "color=c=gray:s=320x240:r=25:d=1";
    for (source, options, name) in
        [(half, vec![], "a.ts"), (other, vec!["-output_ts_offset", "1"], "b.ts")]
    {
        let codec = ["-c:v", "libx264", "-bf", "0"];
        videos.make(&["-f", "lavfi", "-i", source], &[&codec[..], &options].concat(), name);
    }
    let second = fs::read(videos.path("b.ts")).unwrap();
    let file = videos.changed("a.ts", "ab.ts", |bytes| bytes.extend(second));
    let mut video = open(&file, false).unwrap();
    let sizes: Vec<_> = (0..).map_while(|k| video.frame(k).unwrap()).map(|p| p.width).collect();
    assert_eq!(sizes, [160; 50]);
    let name = file.display().to_string();
    let expected = Note::Scaled { name, frame: 25, size: [160, 120] };
    let notes = video.notes();
    assert!(notes.contains(&expected), "{notes:?}");
    let mut jumping = open(&file, false).unwrap();
    assert_eq!(jumping.count().unwrap(), 50);
    assert!(jumping.frame(45).unwrap() == video.frame(45).unwrap());
    let times = (0..50).map(|k| video.frame(k).unwrap().unwrap().time.unwrap());
    assert!(times.enumerate().all(|(k, time)| (time - k as f64 / 25.0).abs() < 0.03));
}

/// A GIF whose frames last differently long.
#[test]
fn the_rate_of_uneven_frames_is_their_average() {
    if !ffmpeg_is_there("the rate of a GIF") {
        return;
    }
    let videos = Videos::new();
    let source = "testsrc=s=64x48:r=10:d=3,settb=1/100,setpts='N*10+mod(N,3)'";
    let options = ["-fps_mode", "passthrough"];
    let file = videos.make(&["-f", "lavfi", "-i", source], &options, "uneven.gif");
    let rate = open(&file, false).unwrap().rate().unwrap();
    let rate = f64::from(rate.frames) / f64::from(rate.seconds);
    assert!((9.0..11.0).contains(&rate), "{rate}");
}
