//! The memory of the process with a network does not grow with the video. The runtime allocates in
//! each frame, on threads of its own, so all threads are counted, and no other test runs here.

use patchlock::{BoundingBox, Frame, Network, Preset, Tracker, TrackerConfig};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

const SIDE: usize = 96;

/// Blocks of grey that move.
fn picture(k: usize) -> Vec<u8> {
    let grey = |at: usize| ((at % SIDE + k) / 11 * 40 + (at / SIDE + k) / 9 * 70) as u8;
    (0..SIDE * SIDE).map(grey).collect()
}

fn network() -> TrackerConfig {
    let files: [&[u8]; 2] = [
        include_bytes!("golden/network/nanotrack_backbone.onnx"),
        include_bytes!("golden/network/nanotrack_head.onnx"),
    ];
    let mut config = TrackerConfig::from(Preset::Network);
    config.network = Some(Network::from_bytes(&files).unwrap());
    config
}

#[test]
fn memory_does_not_grow_with_the_video() {
    let count =
        if patchlock_testdata::slow("memory_does_not_grow_with_the_video", 5) { 400 } else { 100 };
    let pictures: Vec<Vec<u8>> = (0..20).map(picture).collect();
    let frame = |k: usize| Frame::grey8(&pictures[k % 20], SIDE, SIDE).unwrap();
    let bbox = BoundingBox { x: 30.0, y: 20.0, w: 25.0, h: 18.0 };
    let mut tracker = Tracker::start(network(), &frame(0), bbox).unwrap();
    let mut after = |frames: usize| {
        for k in 0..frames {
            tracker.update(&frame(k)).unwrap();
        }
        // Freed by another thread a little later.
        std::thread::sleep(std::time::Duration::from_millis(50));
        ALLOCATOR.current_usage()
    };
    let held = [after(count), after(count), after(2 * count)];
    println!("bytes held after 1, 2 and 4 times {count} frames: {held:?}");
    // A queue between threads holds a block more or less.
    const BLOCKS: usize = 8 << 10;
    assert!(held.iter().all(|&bytes| bytes.abs_diff(held[0]) <= BLOCKS), "{held:?}");
}
