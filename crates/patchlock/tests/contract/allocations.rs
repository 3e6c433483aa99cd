//! The tracker allocates nothing once its buffers have grown, even on frames on which it learns.
//!
//! Counted on one thread. With several threads, `rayon` occasionally allocates for its task queues.

use crate::methods::{all, default_settings};
use crate::sequence::SIMPLE;
use patchlock::appearance::model::{LookScratch, PatchModel, cut_candidate};
use patchlock::vision::frame::GreyImage;
use patchlock::{Estimate, PatchwiseConfig, State, Tracker, TrackerConfig, Visibility};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, with two counters per thread.
struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
    static HELD: Cell<i64> = const { Cell::new(0) };
}

fn count(calls: u64, bytes: i64) {
    CALLS.set(CALLS.get() + calls);
    HELD.set(HELD.get() + bytes);
}

// SAFETY: every call is passed on to the system's allocator unchanged. The counters are plain numbers,
// initialised at compile time: accessing them neither allocates nor runs a destructor.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(1, layout.size() as i64);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(0, -(layout.size() as i64));
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(1, size as i64 - layout.size() as i64);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// What one frame did: the number of allocations, and the change of the number of bytes held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Counted {
    frame: usize,
    calls: u64,
    held: i64,
}

/// A tracker that runs forwards and backwards over the sequence, so that the target never jumps.
struct Endless {
    tracker: Tracker,
    estimate: Estimate,
    frame: usize,
}

impl Endless {
    fn new(config: &TrackerConfig) -> Self {
        let mut tracker = Tracker::new(config.clone()).unwrap();
        let estimate = tracker.init(&SIMPLE.frame(0), SIMPLE.truth(0)).unwrap();
        Self { tracker, estimate, frame: 0 }
    }

    fn step(&mut self) -> Counted {
        self.frame += 1;
        let last = SIMPLE.len() - 1;
        let position = self.frame % (2 * last);
        let frame = SIMPLE.frame(position.min(2 * last - position));
        let before = (CALLS.get(), HELD.get());
        self.tracker.update_into(&frame, &mut self.estimate).unwrap();
        Counted { frame: self.frame, calls: CALLS.get() - before.0, held: HELD.get() - before.1 }
    }
}

/// Runs in a pool of one thread, which does all the work.
fn on_one_thread<T: Send>(run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run)
}

#[test]
fn no_frame_allocates() {
    for (config, warm_up) in all().iter().map(|config| default_settings(config.method)) {
        let frames: Vec<Counted> = on_one_thread(|| {
            let mut endless = Endless::new(&config);
            let first = endless.step();
            assert!(first.calls > 0, "the first frame must allocate: {first:?}");
            (1..2 * warm_up).map(|_| endless.step()).skip(warm_up - 1).collect()
        });
        for counted in frames {
            assert_eq!((counted.calls, counted.held), (0, 0), "{counted:?}");
        }
    }
}

/// The bytes that a tracker holds, measured every `every` frames.
fn held(config: &TrackerConfig, count: usize, every: usize) -> Vec<i64> {
    on_one_thread(|| {
        let before = HELD.get();
        let mut endless = Endless::new(config);
        let mut held = Vec::with_capacity(count / every);
        for _ in 0..count / every {
            for _ in 0..every {
                endless.step();
            }
            held.push(HELD.get() - before);
        }
        held
    })
}

#[test]
fn memory_does_not_grow_with_the_video() {
    for config in all() {
        let held = held(&config, 3000, 100);
        println!("bytes held: {held:?}");
        // How much some buffers grow depends on which candidates are similar; their capacity doubles a few
        // times at most.
        let late = &held[held.len() / 2..];
        assert!(late.iter().all(|&bytes| bytes == late[0]), "{held:?}");
    }
}

/// `cargo test --release -p patchlock --test contract -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn memory_does_not_grow_over_100_000_frames() {
    for config in all() {
        let held = held(&config, 100_000, 1000);
        println!("bytes held every 1000 frames: {held:?}");
        if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
            let lines = status.lines().filter(|line| line.starts_with("Vm"));
            lines.for_each(|line| println!("{line}"));
        }
        let late = &held[held.len() / 2..];
        assert!(late.iter().all(|&bytes| bytes == late[0]), "{held:?}");
    }
}

/// The patch model, asked about one candidate after another.
#[test]
fn no_look_allocates() {
    let config = PatchwiseConfig::default();
    let rules = config.patch_rules();
    let mut image = GreyImage::default();
    image.fill(&SIMPLE.frame(0)).unwrap();
    let bbox = SIMPLE.truth(0);
    let state = State::from_box(bbox.centre(), bbox.w, bbox.h, config.template_side);
    on_one_thread(|| {
        let model = PatchModel::begin(&image, &state.matrix(), rules);
        let (mut scratch, mut visibility) = (LookScratch::default(), Visibility::default());
        let mut candidate = vec![0.0; config.template_side * config.template_side];
        for k in 0..40 {
            let near = State { x: state.x + f64::from(k % 7) - 3.0, ..state };
            cut_candidate(&image, &near.matrix(), &rules, &mut candidate);
            let before = (CALLS.get(), HELD.get());
            model.look(&candidate, &mut scratch, &mut visibility);
            let after = (CALLS.get(), HELD.get());
            assert!(k < 7 || before == after, "look {k}: {before:?}, {after:?}");
        }
    });
}
