//! Whether memory grows: bytes in use after a warm-up and later, which must be the same.
//!
//!     soak updates N PRESET     a tracker that follows a target for N frames
//!     soak cycles N PRESET      N trackers, one after the other, of which each follows a target for 3 frames
//!     soak server HOURS         clients of the studio that come and go: 120 visits stand for an hour
//!
//! It ends with 1 where memory has grown.

use std::ops::Range;
use std::process::ExitCode;
use std::{env, fmt};

use patchlock::{BoundingBox, Frame, Tracker, TrackerConfig};
use patchlock_fuzz::{Studio, quick};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

const WIDTH: usize = 64;
const HEIGHT: usize = 48;
/// Frames that are shown again and again.
const FRAMES: usize = 50;
const DIFFERENT: Range<usize> = 25..30;
const AWAY: Range<usize> = 40..48;
/// Updates, cycles or visits before the first count, until all buffers have grown: at least this
/// many, and one in so many of those that follow. Some buffers of the sparse coder are as large as
/// the hardest frame so far asks for.
const WARM_UP: usize = 300;
const WARM_UP_SHARE: usize = 50;
/// Counts that are printed.
const COUNTS: usize = 10;
const VISITS_PER_HOUR: usize = 120;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let number = |text: &str| text.parse::<usize>().ok().filter(|number| *number > 0);
    // One thread, so that the pool's own queues do not count.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let _pool = pool.expect("a pool of this thread");
    let flat = match arguments[..] {
        ["updates", count, preset] => number(count).zip(config(preset)).map(updates),
        ["cycles", count, preset] => number(count).zip(config(preset)).map(cycles),
        ["server", hours] => number(hours).map(server),
        _ => None,
    };
    match flat {
        Some(true) => ExitCode::SUCCESS,
        Some(false) => ExitCode::FAILURE,
        None => {
            eprintln!("soak updates N PRESET | soak cycles N PRESET | soak server HOURS");
            ExitCode::from(2)
        }
    }
}

/// A preset that is fast enough for many frames.
fn config(preset: &str) -> Option<TrackerConfig> {
    let small =
        [("robust", "patch", 32.0), ("paper", "particles", 12.0), ("paper", "small_step", 8.0)];
    Some(quick(preset.parse().ok()?, &small))
}

/// A bright target that moves to and fro over texture. For a while it looks different, and at the
/// end it is away, so that the tracker does all that it ever does.
fn frame(k: usize) -> (Vec<u8>, BoundingBox) {
    let left = 5 + (k % FRAMES).min(FRAMES - k % FRAMES);
    let pixel = |at: usize| {
        let (x, y) = (at % WIDTH, at / WIDTH);
        let texture = ((x * 7 + y * 13) % 32) as u8;
        let inside = (left..left + 18).contains(&x) && (14..30).contains(&y);
        match k % FRAMES {
            _ if !inside => 40 + texture,
            k if AWAY.contains(&k) => 40 + texture,
            k if DIFFERENT.contains(&k) => 180 + (x - left + y * 3) as u8 % 60,
            _ => 180 + ((x - left) * 3 + y) as u8 % 60,
        }
    };
    let bbox = BoundingBox { x: left as f64, y: 14.0, w: 18.0, h: 16.0 };
    ((0..WIDTH * HEIGHT).map(pixel).collect(), bbox)
}

/// Begins a tracker on the first frame.
fn begin(config: &TrackerConfig, frames: &[(Vec<u8>, BoundingBox)]) -> Tracker {
    let (pixels, bbox) = &frames[0];
    let first = Frame::grey8(pixels, WIDTH, HEIGHT).expect("is a frame");
    Tracker::start(config.clone(), &first, *bbox).expect("begins")
}

fn updates((count, config): (usize, TrackerConfig)) -> bool {
    let frames: Vec<_> = (0..FRAMES).map(frame).collect();
    let mut tracker = begin(&config, &frames);
    let mut next = (1..).map(|k| &frames[k % FRAMES].0);
    watch("updates", count, || {
        let pixels = next.next().expect("has no end");
        let frame = Frame::grey8(pixels, WIDTH, HEIGHT).expect("is a frame");
        tracker.update(&frame).expect("tracks");
    })
}

fn cycles((count, config): (usize, TrackerConfig)) -> bool {
    let frames: Vec<_> = (0..4).map(frame).collect();
    watch("cycles", count, || {
        let mut tracker = begin(&config, &frames);
        for (pixels, _) in &frames[1..] {
            let frame = Frame::grey8(pixels, WIDTH, HEIGHT).expect("is a frame");
            tracker.update(&frame).expect("tracks");
        }
    })
}

/// A client opens the page, draws, tracks, looks at frames, exports, and takes all of it back.
fn server(hours: usize) -> bool {
    let studio = Studio::begin();
    let send = |request: &str| {
        let (status, body) = studio.send(request.as_bytes()).expect("is a request");
        assert!(status.is_success(), "{request}: {status}, {}", String::from_utf8_lossy(&body));
        body
    };
    let add =
        r#"{"edit":"add_target","label":"target","frame":0,"box":{"x":5,"y":4,"w":12,"h":9}}"#;
    watch("visits", hours * VISITS_PER_HOUR, || {
        send("GET /");
        let clip: serde_json::Value =
            serde_json::from_slice(&send("GET /api/clips/1")).expect("JSON");
        let (revision, target) = (&clip["revision"], &clip["project"]["next_id"]);
        let edits = format!("{{\"revision\":{revision},\"edits\":[{add}]}}");
        send(&format!("POST /api/clips/1/edits\n\n{edits}"));
        let request = format!("{{\"target\":{target},\"from\":0,\"direction\":\"forward\"}}");
        send(&format!("POST /api/clips/1/track\n\n{request}"));
        while !send("GET /api/clips/1").windows(10).any(|ten| ten == b"\"job\":null") {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        for frame in 0..4 {
            send(&format!("GET /api/clips/1/frames/{frame}"));
        }
        send("GET /api/clips/1/export?format=coco");
        send("POST /api/clips/1/undo\n\n");
        send("POST /api/clips/1/undo\n\n");
    })
}

/// Does the work `count` times, and prints the bytes in use now and then. Returns whether the last
/// count is no larger than the first.
fn watch(what: impl fmt::Display, count: usize, mut work: impl FnMut()) -> bool {
    // The first line takes a buffer for the output.
    let warm_up = WARM_UP.max(count / WARM_UP_SHARE);
    println!("{warm_up} {what} to warm up");
    (0..warm_up).for_each(|_| work());
    let first = ALLOCATOR.current_usage();
    println!("after them: {first} bytes");
    let mut last = first;
    for k in 0..COUNTS {
        let (from, to) = (count * k / COUNTS, count * (k + 1) / COUNTS);
        // Threads of the server free some buffers a little later, so the least count is what is
        // held.
        let after_each = (from..to).map(|_| {
            work();
            ALLOCATOR.current_usage()
        });
        last = after_each.min().unwrap_or(last);
        println!("after {to} more {what}: {last} bytes");
    }
    last <= first
}
