//! The tracker allocates nothing once its buffers have grown, even on frames on which it learns.
//!
//! Counted on one thread. With several threads, `rayon` occasionally allocates for its task queues.
//! So it does for the runtime of a network, which computes on threads of its own and allocates there
//! in each frame; `tests/network_memory.rs` is about these.

use allocation_counter::measure;

use crate::methods::{all_without_network, begun, network};
use crate::sequence::SIMPLE;
use patchlock::patch_model::model::{PatchErrorScratch, PatchModel, cut_candidate};
use patchlock::vision::frame::GreyImage;
use patchlock::{PaperConfig, Preset, State, Tracker, TrackerConfig, Visibility};
use patchlock_testdata::slow;

/// What one frame did: the number of allocations, and the change of the number of bytes held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct AllocationCount {
    frame: usize,
    calls: u64,
    held: i64,
}

/// A tracker that runs forwards and backwards over the sequence, so that the target never jumps.
struct BackAndForthTracker {
    tracker: Tracker,
    frame: usize,
}

impl BackAndForthTracker {
    fn new(config: &TrackerConfig) -> Self {
        Self { tracker: SIMPLE.begin(config, 0), frame: 0 }
    }

    fn step(&mut self) -> AllocationCount {
        self.frame += 1;
        let last = SIMPLE.len() - 1;
        let position = self.frame % (2 * last);
        let frame = SIMPLE.frame(position.min(2 * last - position));
        let info = measure(|| {
            self.tracker.update(&frame).unwrap();
        });
        AllocationCount { frame: self.frame, calls: info.count_total, held: info.bytes_current }
    }
}

/// Runs in a pool of one thread, which does all the work.
fn on_one_thread<T: Send>(run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run)
}

/// The number of frames after which all buffers have grown and every learning step has occurred.
const WARM_UP: usize = 60;

/// The frames after the warm-up.
fn warm_frames(config: &TrackerConfig) -> Vec<AllocationCount> {
    on_one_thread(|| {
        let mut endless = BackAndForthTracker::new(config);
        let first = endless.step();
        assert!(first.calls > 0, "the first frame must allocate: {first:?}");
        (1..2 * WARM_UP).map(|_| endless.step()).skip(WARM_UP - 1).collect()
    })
}

#[test]
fn no_frame_allocates() {
    let all = Preset::ALL.map(begun);
    for config in all.iter().filter(|config| config.network.is_none()) {
        for counted in warm_frames(config) {
            assert_eq!((counted.calls, counted.held), (0, 0), "{counted:?}");
        }
    }
}

/// What a network needs is asked of the runtime through a queue, which grows by a block now and then.
#[test]
fn with_a_network_only_the_queue_of_the_runtime_allocates_here() {
    let frames = warm_frames(&network());
    let calls: Vec<u64> = frames.iter().map(|counted| counted.calls).collect();
    assert!(calls.iter().all(|&calls| calls <= 1), "{calls:?}");
    assert!(calls.iter().sum::<u64>() <= calls.len() as u64 / 8, "{calls:?}");
}

/// The bytes that a tracker holds, measured every `every` frames.
fn held(config: &TrackerConfig, count: usize, every: usize) -> Vec<i64> {
    on_one_thread(|| {
        let mut endless = None;
        let mut held = measure(|| endless = Some(BackAndForthTracker::new(config))).bytes_current;
        let mut endless = endless.unwrap();
        let mut after = |steps| (0..steps).map(|_| endless.step().held).sum::<i64>();
        (0..count / every)
            .map(|_| {
                held += after(every);
                held
            })
            .collect()
    })
}

#[test]
fn memory_does_not_grow_with_the_video() {
    let frames = if slow("memory_does_not_grow_with_the_video", 20) { 3000 } else { 600 };
    for config in all_without_network() {
        let held = held(&config, frames, 100);
        println!("bytes held: {held:?}");
        // How much some buffers grow depends on which candidates are similar; their capacity
        // doubles a few times at most.
        let late = &held[held.len() / 2..];
        assert!(late.iter().all(|&bytes| bytes == late[0]), "{held:?}");
    }
}

/// `cargo test --release -p patchlock --test contract -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn memory_does_not_grow_over_100_000_frames() {
    for config in all_without_network() {
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
    let config = PaperConfig::default();
    let (params, side) = (config.patch_params(), config.patches.template_side);
    let mut image = GreyImage::default();
    image.fill(&SIMPLE.frame(0)).unwrap();
    let bbox = SIMPLE.truth(0);
    let state = State::from_box(bbox.centre(), bbox.w, bbox.h, side);
    on_one_thread(|| {
        let model = PatchModel::begin(&image, &state.matrix(), params);
        let (mut scratch, mut visibility) = (PatchErrorScratch::default(), Visibility::default());
        let mut candidate = vec![0.0; side * side];
        for k in 0..40 {
            let near = State { x: state.x + f64::from(k % 7) - 3.0, ..state };
            cut_candidate(&image, &near.matrix(), &params, &mut candidate);
            let info = measure(|| {
                let errors = model.look(&candidate, &mut scratch);
                errors.visibility(params.likelihood.epsilon, &mut visibility);
            });
            assert!(k < 7 || info.count_total == 0, "look {k}: {info:?}");
        }
    });
}
