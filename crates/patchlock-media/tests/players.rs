//! Frames, times, orientation and colours are those of other programs. What OpenCV shows is in a
//! golden file; tests that need ffmpeg say so where it is missing, and pass.

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use patchlock_media::{Picture, Pixels, open};
use support::ffmpeg::{ffmpeg, ffmpeg_is_there};
use support::{change, small_mp4};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn rgb(picture: &Picture) -> &[u8] {
    match &picture.pixels {
        Pixels::Rgb8(rgb) => rgb,
        other => panic!("video has colours: {other:?}"),
    }
}

fn all_frames(file: &Path) -> Vec<Picture> {
    let mut video = open(file.to_str().unwrap(), false).unwrap();
    (0..).map_while(|k| video.frame(k).unwrap()).collect()
}

/// Mean red, green and blue of 3 x 3 cells, row by row.
fn cells(picture: &Picture) -> Vec<f64> {
    let (mut sums, mut counts) = (vec![0.0; 27], vec![0.0; 27]);
    for (at, pixel) in rgb(picture).chunks_exact(3).enumerate() {
        let (x, y) = (at % picture.width, at / picture.width);
        let cell = (y * 3 / picture.height * 3 + x * 3 / picture.width) * 3;
        for (k, &value) in pixel.iter().enumerate() {
            sums[cell + k] += f64::from(value);
            counts[cell + k] += 1.0;
        }
    }
    sums.iter().zip(counts).map(|(sum, count)| sum / count).collect()
}

/// The file begins with lines on what made it. `tools/oracles/videos.py` makes it again.
#[test]
fn videos_are_shown_as_by_opencv() {
    let golden = fs::read_to_string(data("shown.txt")).unwrap();
    let mut lines = golden.lines().filter(|line| !line.starts_with('#'));
    let mut tried = 0;
    while let Some(head) = lines.next() {
        let words: Vec<&str> = head.split(' ').collect();
        let [count, width, height] = [1, 2, 3].map(|k: usize| words[k].parse::<usize>().unwrap());
        let rows: Vec<&str> = lines.by_ref().take(count).collect();
        let ours = !["fragments.mp4", "deep.mp4", "odd.mp4"].contains(&words[0]);
        if !ours && !ffmpeg_is_there(words[0]) {
            continue;
        }
        tried += 1;
        let frames = all_frames(&data(words[0]));
        assert_eq!(frames.len(), count, "{head}");
        for (k, (frame, row)) in frames.iter().zip(rows).enumerate() {
            let values: Vec<f64> = row.split(' ').map(|word| word.parse().unwrap()).collect();
            assert_eq!((frame.width, frame.height), (width, height), "{head}");
            let time = frame.time.unwrap() * 1000.0;
            assert!(
                (time - values[0]).abs() < 1.0,
                "{head}: frame {k} at {time}, not {}",
                values[0]
            );
            // Programs differ in how they enlarge the chroma planes.
            let means = cells(frame);
            for (mean, expected) in means.iter().zip(&values[1..]) {
                assert!((mean - expected).abs() < 6.0, "{head}, frame {k}: {means:?}, not {row}");
            }
        }
    }
    assert!(tried >= 3);
}

/// Matroska files are read through ffmpeg, MP4 files with H.264 are not.
#[test]
fn h264_has_the_same_pixels_and_times_through_ffmpeg() {
    if !ffmpeg_is_there("the comparison with ffmpeg") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let tag = |codes: &str| format!("h264_metadata={codes}");
    let tags = [
        "",
        "matrix_coefficients=1:colour_primaries=1:transfer_characteristics=1",
        "matrix_coefficients=6:colour_primaries=6:transfer_characteristics=6",
        "video_full_range_flag=1:matrix_coefficients=9:colour_primaries=9:transfer_characteristics=1",
    ];
    for (width, height) in [(64, 48), (1280, 720)] {
        let mut looks = Vec::new();
        for tags in tags {
            // Without the colour box, so that only the tags of the stream count.
            let plain = change(
                &small_mp4(width, height, 3),
                "moov/trak/mdia/minf/stbl/stsd/avc1/colr",
                &|content| content[..4].copy_from_slice(b"none"),
            );
            fs::write(path("plain.mp4"), plain).unwrap();
            let bsf = if tags.is_empty() { "null".into() } else { tag(tags) };
            let copy = ["-i", &path("plain.mp4"), "-c", "copy", "-bsf:v", &bsf];
            ffmpeg(&[&copy[..], &[&path("v.mp4")]].concat());
            ffmpeg(&[&copy[..], &[&path("v.mkv")]].concat());
            let (ours, theirs) =
                (all_frames(path("v.mp4").as_ref()), all_frames(path("v.mkv").as_ref()));
            assert_eq!((ours.len(), theirs.len()), (3, 3));
            for (ours, theirs) in ours.iter().zip(&theirs) {
                assert!(rgb(ours) == rgb(theirs), "{tags} {width} x {height}");
                assert!((ours.time.unwrap() - theirs.time.unwrap()).abs() < 1e-3);
            }
            looks.push(cells(&ours[0]));
        }
        let [none, hd, sd, full] = &looks[..] else { panic!("four kinds of tags") };
        assert_eq!(none, if height < 720 { sd } else { hd }, "what is usual for the size");
        assert!(hd != sd && full != hd && full != sd, "the tags matter");
    }
}

/// ffmpeg's own conversion to RGB follows the tags.
#[test]
fn tagged_colours_are_those_of_ffmpeg() {
    if !ffmpeg_is_there("the colours of ffmpeg") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    fs::write(path("plain.mp4"), small_mp4(64, 48, 1)).unwrap();
    for (range, matrix, name) in
        [(0, 1, "bt709"), (1, 1, "bt709"), (0, 6, "bt601"), (0, 9, "bt2020")]
    {
        let tags =
            format!("h264_metadata=video_full_range_flag={range}:matrix_coefficients={matrix}");
        let tags = format!("{tags}:colour_primaries=1:transfer_characteristics=1");
        ffmpeg(&["-i", &path("plain.mp4"), "-c", "copy", "-bsf:v", &tags, &path("v.mp4")]);
        let from = if range == 1 { "full" } else { "limited" };
        let scale =
            format!("scale=in_color_matrix={name}:in_range={from}:flags=neighbor+accurate_rnd");
        let args =
            ["-i", &path("v.mp4"), "-vf", &scale, "-pix_fmt", "rgb24", "-f", "rawvideo", "-"];
        let expected = ffmpeg(&args);
        let frames = all_frames(path("v.mp4").as_ref());
        let found = rgb(&frames[0]);
        assert_eq!(found.len(), expected.len());
        let worst = found.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(3), "{name} {from}: differs by {worst:?}");
    }
}

#[test]
fn a_video_has_sound_or_not() {
    let sound = |file: &Path| open(file.to_str().unwrap(), false).unwrap().has_sound();
    assert!(sound(&data("turned.mov")));
    assert!(!sound(&data("uneven.mp4")));
    if ffmpeg_is_there("the sound of a fragmented video") {
        assert!(sound(&data("fragments.mp4")));
        assert!(!sound(&data("deep.mp4")));
    }
}

/// The same frames come out wherever reading starts; only what is needed for it is decoded. The
/// keyframes of `open.mp4` (x264 with open-gop) are followed by frames that are shown before them.
#[test]
fn a_later_start_gives_the_same_frames() {
    let names = ["turned.mov", "trimmed.mp4", "uneven.mp4", "bframes.mp4", "open.mp4"];
    let others = ["fragments.mp4", "deep.mp4", "odd.mp4"];
    let others = others.iter().filter(|name| ffmpeg_is_there(name));
    for name in names.iter().chain(others) {
        let file = data(name);
        let straight = all_frames(&file);
        for start in 0..straight.len() {
            let mut video = open(file.to_str().unwrap(), false).unwrap();
            for (k, expected) in straight.iter().enumerate().skip(start).take(3) {
                let picture = video.frame(k).unwrap();
                assert!(picture.as_ref() == Some(expected), "frame {k} of {name} from {start}");
            }
        }
    }
}

/// Whatever the order of reading, and whether ffmpeg has to start again for a frame or not.
#[test]
fn frames_of_ffmpeg_do_not_depend_on_the_order_of_reading() {
    if !ffmpeg_is_there("frames in any order") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    fs::write(path("plain.mp4"), small_mp4(64, 48, 150)).unwrap();
    let refreshed = ["-c:v", "libx264", "-x264-params", "intra-refresh=1:keyint=50:bframes=0"];
    // Packets that tell the times, and those that do not; and key frames that are refreshed piece
    // by piece from there on.
    let kinds: [(&str, &[&str]); 4] = [
        ("known.mkv", &["-c", "copy", "-bsf:v", "setts=ts=TS+90000"]),
        ("unknown.avi", &["-c:v", "mpeg4", "-bf", "2", "-g", "60"]),
        ("refreshed.mp4", &refreshed),
        ("refreshed.mkv", &refreshed),
    ];
    for (name, options) in kinds {
        let file = path(name);
        ffmpeg(&[&["-i", &path("plain.mp4")][..], options, &[&file]].concat());
        let straight = all_frames(file.as_ref());
        for reverse in [false, true] {
            let mut video = open(&file, reverse).unwrap();
            assert_eq!(video.count().unwrap(), straight.len(), "{name}");
            for k in [100, 101, 99, 3, 149, 148, 30] {
                let picture = video.frame(k).unwrap();
                assert!(picture.as_ref() == Some(&straight[k]), "frame {k} of {name}");
            }
            assert_eq!(video.frame(straight.len()).unwrap(), None);
            assert!(video.frame(149).unwrap().as_ref() == Some(&straight[149]));
        }
    }
}

/// Later parts of a video that ffmpeg decodes do not wait for the parts before them.
#[test]
fn ffmpeg_starts_near_the_first_frame_that_is_read() {
    if !ffmpeg_is_there("the start within a long video") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("long.mp4");
    let source = "testsrc=size=640x360:rate=25:duration=40";
    let name = file.to_str().unwrap();
    ffmpeg(&["-f", "lavfi", "-i", source, "-c:v", "mpeg4", "-g", "25", "-b:v", "300k", name]);
    let seconds = |index: usize| {
        let start = std::time::Instant::now();
        let picture = open(name, false).unwrap().frame(index).unwrap().unwrap();
        assert!((picture.time.unwrap() - index as f64 / 25.0).abs() < 1e-5);
        start.elapsed().as_secs_f64()
    };
    let (first, last) = (seconds(0), seconds(990));
    let start = std::time::Instant::now();
    all_frames(&file);
    let whole = start.elapsed().as_secs_f64();
    println!("first {first:.2} s, last {last:.2} s, all {whole:.2} s");
    assert!(last < first + whole / 3.0, "{first} {last} {whole}");
}
