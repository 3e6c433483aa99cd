//! How fast frames of a large video come, and how much memory that takes. These tests measure, so
//! they are run alone, with `--ignored --nocapture`.

use std::path::Path;
use std::time::{Duration, Instant};

use patchlock_media::{FrameRate, Mp4Writer};

use crate::support::TestServer;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;
/// Ten minutes, of images; the MP4 is shorter, since it has to be encoded.
const IMAGES: usize = 18_000;
const FRAMES: usize = 300;

/// A frame with a moving texture, which is not easy to compress.
fn picture(k: usize) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(WIDTH * HEIGHT * 3);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let (u, v) = ((x + 3 * k) as u32, (y + k) as u32);
            let cell = (u / 24).wrapping_mul(0x9e37_79b9) ^ (v / 24).wrapping_mul(0x85eb_ca6b);
            let grain = (u.wrapping_mul(31) ^ v.wrapping_mul(17)) & 15;
            let base = 60 + ((cell >> 9) & 127) + grain;
            rgb.extend([base as u8, (base / 2 + (u / 8) % 64) as u8, (200 - base / 2) as u8]);
        }
    }
    rgb
}

fn video(file: &Path, frames: usize) {
    let out = std::fs::File::create(file).expect("creates");
    let rate = FrameRate::DEFAULT;
    let mut writer = Mp4Writer::new(out, WIDTH, HEIGHT, rate, Some(frames)).expect("begins");
    (0..frames).for_each(|k| writer.push(&picture(k)).expect("encodes"));
    writer.finish().expect("completes");
}

/// The most memory that this process had, in MB.
fn most_memory() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kb| kb.parse::<usize>().ok()).unwrap_or(0) / 1024
}

fn timed(server: &TestServer, frame: usize) -> Duration {
    let begun = Instant::now();
    let answer = server.get(&format!("/api/clips/1/frames/{frame}"));
    assert_eq!(answer.status, 200, "{}", answer.text());
    begun.elapsed()
}

/// Times of steps from one frame to another, with the pause of a person who looks.
fn steps(server: &TestServer, frames: impl Iterator<Item = usize>) -> Vec<Duration> {
    let step = |frame| {
        std::thread::sleep(Duration::from_millis(100));
        timed(server, frame)
    };
    let mut times: Vec<Duration> = frames.map(step).collect();
    times.sort();
    times
}

fn report(what: &str, times: &[Duration]) {
    let (median, most) = (times[times.len() / 2], times[times.len() - 1]);
    println!("{what}: median {median:.1?}, largest {most:.1?}");
}

#[test]
#[ignore = "measures, and needs a machine that does nothing else"]
fn a_large_video() {
    let folder = tempfile::tempdir().expect("a folder");
    video(&folder.path().join("clip.mp4"), FRAMES);
    println!("before: {} MB", most_memory());
    let begun = Instant::now();
    let server = TestServer::serving(folder, Vec::new(), &["clip.mp4"]);
    timed(&server, 0);
    println!("first frame after {:.1?}", begun.elapsed());
    report("steps forward", &steps(&server, 1..60));
    report("steps backward", &steps(&server, (30..59).rev()));
    println!("jump: {:.1?}", timed(&server, FRAMES - 50));
    let back = steps(&server, (FRAMES - 100..FRAMES - 50).rev());
    report("steps backward after it", &back);
    report("steps forward again", &steps(&server, FRAMES - 49..FRAMES - 20));
    let mut jumps: Vec<Duration> = (0..100).map(|k| timed(&server, k * 7919 % FRAMES)).collect();
    jumps.sort();
    report("jumps", &jumps);
    println!("most memory: {} MB", most_memory());
    assert!(back[back.len() / 2] < Duration::from_millis(50));
}

#[test]
#[ignore = "measures, and needs a machine that does nothing else"]
fn ten_minutes_of_images() {
    let folder = tempfile::tempdir().expect("a folder");
    let images = folder.path().join("frames");
    std::fs::create_dir(&images).expect("creates");
    for k in 0..10 {
        let image = image::RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, picture(k));
        image.expect("is complete").save(images.join(format!("{k:05}.jpg"))).expect("writes");
    }
    for k in 10..IMAGES {
        let first = images.join(format!("{:05}.jpg", k % 10));
        std::fs::hard_link(first, images.join(format!("{k:05}.jpg"))).expect("links");
    }
    let begun = Instant::now();
    let server = TestServer::serving(folder, Vec::new(), &["frames"]);
    timed(&server, 0);
    println!("first frame after {:.1?}", begun.elapsed());
    let mut jumps: Vec<Duration> = (0..1000).map(|k| timed(&server, k * 7919 % IMAGES)).collect();
    jumps.sort();
    report("jumps", &jumps);
    println!("most memory after 1000 jumps: {} MB", most_memory());
}
