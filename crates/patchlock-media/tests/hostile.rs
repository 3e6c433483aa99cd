//! Files that claim more than they hold, or are damaged: reading them ends with an error, soon and
//! with little memory, and never with a panic. Random damage is what the surfaces `mp4` and `h264` of patchlock-fuzz
//! try.

mod support;

use std::fs;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use patchlock_media::{Error, FrameSource, Limits, image_file, open, open_within};
use peak_alloc::PeakAlloc;
use support::bits::ue;
use support::images::{Tiff, TiffLayout, chunk, jpeg, jpeg_that_claims, webp_canvas, webp_picture};
use support::{boxed, change, parameter_set, put, small_mp4, with_parameter_set};

const TABLES: &str = "moov/trak/mdia/minf/stbl";

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// The tests run one after another: each counts the memory of the process.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    patchlock_media::silence_decoders();
    ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Opens a file with these bytes and reads up to ten frames of it. Returns the first error, the
/// time and the most memory.
fn read(bytes: &[u8], extension: &str, reverse: bool) -> (Option<String>, Duration, usize) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(format!("v.{extension}"));
    fs::write(&file, bytes).unwrap();
    ALLOCATOR.reset_peak_usage();
    let (before, start) = (ALLOCATOR.current_usage(), Instant::now());
    let error = open(file.to_str().unwrap(), reverse)
        .map_err(|error| error.to_string())
        .and_then(|mut source| ten_frames(&mut *source, reverse));
    (error.err(), start.elapsed(), ALLOCATOR.peak_usage() - before)
}

fn ten_frames(source: &mut dyn FrameSource, reverse: bool) -> Result<(), String> {
    let length = source.length().unwrap_or(10);
    for k in 0..length.min(10) {
        let index = if reverse { length - 1 - k } else { k };
        source.frame(index).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// The error of a file that must be refused at once, without memory for what it claims.
fn refused(bytes: &[u8], extension: &str) -> String {
    let (error, time, memory) = read(bytes, extension, false);
    assert!(time < Duration::from_secs(2), "took {time:?}");
    assert!(memory < 8 << 20, "took {memory} bytes");
    error.expect("the file is refused")
}

/// A table that claims `count` samples: all with this size, delta and entry.
fn claim(file: &[u8], path: &str, count: u32) -> Vec<u8> {
    let stbl = |name: &str| format!("{path}/{name}");
    let file = change(file, &stbl("stts"), &|table| {
        *table = [0, 1, count, 1].iter().flat_map(|v: &u32| v.to_be_bytes()).collect();
    });
    let file = change(&file, &stbl("stsc"), &|table| {
        *table = [0, 1, 1, count, 1].iter().flat_map(|v: &u32| v.to_be_bytes()).collect();
    });
    change(&file, &stbl("stsz"), &|table| {
        *table = [0, 1, count].iter().flat_map(|v: &u32| v.to_be_bytes()).collect();
    })
}

#[test]
fn a_sample_table_is_not_believed() {
    let _alone = alone();
    for count in [1000, 60_000_000, u32::MAX] {
        let error = refused(&claim(&small_mp4(64, 48, 5), TABLES, count), "mp4");
        assert!(error.contains(&format!("claims {count} frames")), "{error}");
    }
    let more_chunks = change(&small_mp4(64, 48, 5), &format!("{TABLES}/stsz"), &|table| {
        put(table, 8, 6);
        table.extend([0; 4]);
    });
    let error = refused(&more_chunks, "mp4");
    assert!(error.contains("its tables do not fit each other"), "{error}");
    let endless = change(&small_mp4(64, 48, 5), &format!("{TABLES}/stsz"), &|table| {
        put(table, 8, u32::MAX);
    });
    assert!(refused(&endless, "mp4").contains("the index is damaged"));
}

#[test]
fn another_track_is_not_believed_either() {
    let _alone = alone();
    let plain = small_mp4(64, 48, 5);
    let claiming = claim(&plain, TABLES, u32::MAX);
    let at = claiming.windows(4).position(|four| four == b"trak").unwrap() - 4;
    let size = u32::from_be_bytes(claiming[at..at + 4].try_into().unwrap()) as usize;
    let second = &claiming[at..at + size];
    let file = change(&plain, "moov", &|content| content.extend(second));
    let (error, time, memory) = read(&file, "mp4", false);
    assert_eq!(error, None, "the first track is whole");
    assert!(time < Duration::from_secs(2) && memory < 8 << 20, "{time:?}, {memory} bytes");
}

#[test]
fn samples_that_share_their_bytes_are_refused() {
    let _alone = alone();
    let plain = small_mp4(64, 48, 5);
    let file = change(&plain, &format!("{TABLES}/stsz"), &|table| {
        for k in 0..5 {
            put(table, 12 + 4 * k, plain.len() as u32 / 2);
        }
    });
    let file = change(&file, &format!("{TABLES}/stsc"), &|table| put(table, 12, 1));
    let file = change(&file, &format!("{TABLES}/stco"), &|table| {
        put(table, 4, 5);
        table.truncate(8);
        table.extend([40_u32; 5].iter().flat_map(|at| at.to_be_bytes()));
    });
    assert!(refused(&file, "mp4").contains("overlap"), "{}", refused(&file, "mp4"));
}

#[test]
fn frames_of_too_many_pixels_are_refused_before_they_are_decoded() {
    let _alone = alone();
    let plain = small_mp4(64, 48, 3);
    let error = refused(&with_parameter_set(&plain, &parameter_set(1000, 500, 1, &[])), "mp4");
    assert!(error.contains("16000 x 8000 pixels are more than the 36000000"), "{error}");
    // What this decoder does not take is left to ffmpeg, if that is there.
    let left = |set: &[u8], words: &str| {
        let error = refused(&with_parameter_set(&plain, set), "mp4");
        assert!(error.contains(words) || error.contains("ffmpeg"), "{error}");
    };
    left(&parameter_set(512, 270, 6, &[]), "6 references of 8192 x 4320 pixels");
    left(&parameter_set(4, 3, 4_000_000, &[]), "4000000 references");
    let crop = [(1, 1), ue(1 << 30), ue(1 << 30), ue(0), ue(0), (0, 1)];
    left(&parameter_set(4, 3, 1, &crop), "without a readable parameter set");
}

/// The parameter set is in the data of the second frame, behind a start code within another unit.
#[test]
fn a_parameter_set_within_a_frame_is_checked_too() {
    let _alone = alone();
    let mut unit = vec![6, 0, 0, 1];
    unit.extend(parameter_set(1000, 500, 1, &[]));
    let data = [&(unit.len() as u32).to_be_bytes()[..], &unit].concat();
    let plain = small_mp4(64, 48, 3);
    let at = plain.len() as u32 + 8;
    let file = change(&plain, &format!("{TABLES}/stsz"), &|t| put(t, 16, data.len() as u32));
    let file = change(&file, &format!("{TABLES}/stsc"), &|table| {
        *table =
            [0, 3, 1, 1, 1, 2, 1, 1, 3, 1, 1].iter().flat_map(|v: &u32| v.to_be_bytes()).collect();
    });
    let mut file = change(&file, &format!("{TABLES}/stco"), &|table| {
        let first = u32::from_be_bytes(table[8..12].try_into().unwrap());
        put(table, 4, 3);
        table.truncate(8);
        table.extend([first, at, first].iter().flat_map(|at| at.to_be_bytes()));
    });
    // The tables have grown by 32 bytes.
    let grown = file.len() as u32 - plain.len() as u32;
    file = change(&file, &format!("{TABLES}/stco"), &|table| put(table, 12, at + grown));
    file.extend(boxed("mdat", &data));
    let error = refused(&file, "mp4");
    assert!(error.contains("frame 1 of") && error.contains("16000 x 8000"), "{error}");
}

#[test]
fn more_pixels_are_accepted_if_the_user_says_so() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("v.mp4");
    fs::write(&file, small_mp4(64, 48, 3)).unwrap();
    let open =
        |pixels| open_within(file.to_str().unwrap(), false, Limits { pixels, ..Limits::default() });
    let error = open(64 * 48 - 1).err().expect("one pixel too many");
    assert!(matches!(error, Error::TooLarge { size, .. } if size.pixels == 3072), "{error}");
    assert!(open(64 * 48).is_ok());
}

#[test]
fn headers_of_images_and_y4m_are_not_believed() {
    let _alone = alone();
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [&30_000_u32.to_be_bytes()[..], &30_000_u32.to_be_bytes(), &[8, 2, 0, 0, 0]];
    png.extend([0, 0, 0, 13].iter().chain(b"IHDR").chain(&header.concat()));
    png.extend(0xf1dd_4a5c_u32.to_be_bytes());
    assert!(!refused(&png, "png").is_empty());
    let mut bmp = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bmp.extend([30_000_u32, 30_000].iter().flat_map(|side| side.to_le_bytes()));
    bmp.extend([1, 0, 24, 0].iter().chain(&[0; 24]));
    let error = refused(&bmp, "bmp");
    assert!(error.contains("30000 x 30000 pixels are more than"), "{error}");
    let error = refused(b"YUV4MPEG2 W30000 H30000\nFRAME\n", "y4m");
    assert!(error.contains("30000 x 30000 pixels are more than"), "{error}");
}

/// A TIFF of one pixel, or of one column, with these strips, each of one row, in `data`.
fn jpeg_tiff(size: (u32, u32), data: &[u8], parts: &[(u32, u32)]) -> Vec<u8> {
    Tiff { size, compression: 7, place: TiffLayout::Strip(1), data, parts }.bytes()
}

#[test]
fn a_picture_within_a_tiff_is_not_larger_than_its_place() {
    let _alone = alone();
    let huge = jpeg_that_claims(16_384, 16_384);
    let whole = [(0, huge.len() as u32)];
    let error = refused(&jpeg_tiff((1, 1), &huge, &whole), "tiff");
    let words = "a picture of 16384 x 16384 pixels where there is place for 1 x 1";
    assert!(error.contains(words), "{error}");
    let tile = Tiff {
        size: (9, 9),
        compression: 7,
        place: TiffLayout::Tile(16, 16),
        data: &huge,
        parts: &whole,
    };
    let error = refused(&tile.bytes(), "tiff");
    assert!(error.contains("where there is place for 16 x 16"), "{error}");
    // Each strip would be decoded anew.
    let strip = jpeg(300, 16);
    let same = vec![(0, strip.len() as u32); 2000];
    let error = refused(&jpeg_tiff((300, 2000), &strip, &same), "tiff");
    assert!(error.contains("its parts share their bytes"), "{error}");
    let (error, ..) = read(&jpeg_tiff((300, 1), &strip, &same[..1]), "tiff", false);
    assert_eq!(error, None);
}

/// What the decoder skips to the right of the image, it unpacks first.
#[test]
fn tiles_are_not_far_larger_than_their_image() {
    let _alone = alone();
    let tiff = |side: u32, data: &[u8]| {
        let (place, parts) = (TiffLayout::Tile(side, 16), &[(0, data.len() as u32)][..]);
        Tiff { size: (16, 16), compression: 1, place, data, parts }.bytes()
    };
    let error = refused(&tiff(1 << 30, &[0; 999]), "tiff");
    assert!(error.contains("its tiles of 1073741824 x 16 pixels are far larger"), "{error}");
    assert_eq!(read(&tiff(32, &[0; 32 * 16]), "tiff", false).0, None);
}

#[test]
fn a_picture_within_a_webp_is_not_larger_than_its_canvas() {
    let _alone = alone();
    let (small, large) = (webp_picture(40, 30), webp_picture(600, 500));
    let moving = |picture: &[u8]| {
        let frame = [&[0; 6][..], &[39, 0, 0, 29, 0, 0], &[0; 4], picture].concat();
        [chunk(b"ANIM", &[0; 6]), chunk(b"ANMF", &frame)].concat()
    };
    for (flags, chunks) in [(0, large.clone()), (2, moving(&large))] {
        let error = refused(&webp_canvas(40, 30, flags, &chunks), "webp");
        let words = "a picture of 600 x 500 pixels where there is place for 40 x 30";
        assert!(error.contains(words), "{error}");
    }
    for (flags, chunks) in [(0, small.clone()), (2, moving(&small))] {
        assert_eq!(read(&webp_canvas(40, 30, flags, &chunks), "webp", false).0, None);
    }
}

#[test]
fn a_list_of_files_is_not_followed() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let private = folder.path().join("private.ts");
    fs::write(&private, small_mp4(64, 48, 3)).unwrap();
    let private = private.display();
    let lists = [
        format!("#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nfile://{private}\n#EXT-X-ENDLIST\n"),
        format!("<?xml version=\"1.0\"?><MPD><BaseURL>file://{private}</BaseURL></MPD>"),
        "ffconcat version 1.0\nfile private.ts\n".to_string(),
    ];
    for (k, list) in lists.iter().enumerate() {
        for extension in ["webm", "mp4", "m3u8"] {
            let file = folder.path().join(format!("{k}.{extension}"));
            fs::write(&file, list).unwrap();
            let error = open(&file, false).err().expect("a list");
            assert!(matches!(error, Error::Playlist(_)), "{error}");
        }
    }
}

/// A sound, a drawing with links, and subtitles: ffmpeg knows them and might, in some version,
/// follow what they name.
#[test]
fn ffmpeg_reads_no_other_formats_than_videos() {
    let _alone = alone();
    let found = std::process::Command::new("ffmpeg").arg("-version").output();
    if !found.is_ok_and(|output| output.status.success()) {
        return println!("skipped: there is no ffmpeg");
    }
    let mut wave = b"RIFF\x24\x10\0\0WAVEfmt \x10\0\0\0\x01\0\x01\0\x40\x1f\0\0\x80\x3e\0\0\x02\0\x10\0data\0\x10\0\0".to_vec();
    wave.extend([0; 4096]);
    let words =
        b"1\n00:00:01,000 --> 00:00:02,000\nwords\n\n2\n00:00:03,000 --> 00:00:04,000\nmore\n";
    for (bytes, extension) in [(&wave[..], "webm"), (words, "mkv")] {
        let error = read(bytes, extension, false).0.expect("no video");
        assert!(error.contains("in none of the formats that ffmpeg may read here"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn names_need_not_be_text() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let odd = folder.path().join(OsStr::from_bytes(b"a\xff"));
    fs::create_dir(&odd).unwrap();
    let video = odd.join(OsStr::from_bytes(b"\xfe.mp4"));
    fs::write(&video, small_mp4(64, 48, 3)).unwrap();
    image::GrayImage::new(9, 9).save(odd.join("0.png")).unwrap();
    for (source, frames) in [(&video, 3), (&odd, 1), (&odd.join("%d.png"), 1)] {
        let mut source = open(source, false).unwrap();
        assert_eq!(source.count().unwrap(), frames);
    }
    let error = open(odd.join(OsStr::from_bytes(b"\xfd*")), false).err().unwrap();
    assert!(matches!(error, Error::Missing { .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_is_refused_without_reading_it() {
    let _alone = alone();
    for name in ["/dev/zero", "/dev/null"].into_iter().filter(|name| Path::new(name).exists()) {
        let error = open(name, false).err().expect("a device");
        assert!(error.to_string().contains("is a pipe or a device"), "{error}");
        assert!(matches!(error, Error::Endless(_)));
        let error = image_file::size(Path::new(name)).unwrap_err();
        assert!(error.to_string().contains("a pipe or a device"), "{error}");
        assert!(image_file::load(Path::new(name)).is_err());
    }
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("p.mp4");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    if !made.is_ok_and(|status| status.success()) {
        return println!("skipped the named pipe: there is no mkfifo");
    }
    let error = open(pipe.to_str().unwrap(), false).err().expect("a pipe nobody writes to");
    assert!(error.to_string().contains("is a pipe or a device"), "{error}");
    let image = folder.path().join("0001.png");
    fs::rename(&pipe, &image).unwrap();
    let mut frames = open(folder.path().to_str().unwrap(), false).unwrap();
    let error = frames.frame(0).unwrap_err();
    assert!(error.to_string().contains("it is a pipe or a device"), "{error}");
}
