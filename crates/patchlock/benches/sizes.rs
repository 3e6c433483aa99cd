//! How the cost of a frame grows with the size of the frame and of the target, on one thread.
//!
//! ```sh
//! cargo bench -p patchlock --bench sizes -- robust
//! ```
//!
//! The frames are views of one random texture, displaced a little from frame to frame, so that the
//! target in their middle is never lost. The first table has frames of several sizes with a target
//! of 64 x 64 pixels, the second targets of several sizes in frames of 3840 x 2160; both have the
//! median and the slowest frame, and the memory that the tracker holds.

use allocation_counter::measure;
use patchlock::{BoundingBox, Frame, Preset, Tracker};
use std::error::Error;
use std::time::Instant;

const SIZES: [[usize; 2]; 5] = [[320, 240], [640, 480], [1280, 720], [1920, 1080], [3840, 2160]];
const TARGETS: [usize; 8] = [10, 20, 40, 80, 160, 320, 640, 1000];
const TARGET: usize = 64;

/// Frames that are timed, after some that are not.
const FRAMES: usize = 200;
const WARM_UP: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo passes an option of its own.
    let preset = std::env::args().skip(1).find(|word| !word.starts_with("--"));
    let preset: Preset = preset.map_or(Ok(Preset::Robust), |preset| preset.parse())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let tables = pool.install(|| -> Result<(), patchlock::Error> {
        println!("| frame | median ms | slowest ms | MB |\n|---|---|---|---|");
        for size in SIZES {
            let [w, h] = size;
            println!("| {w} x {h} | {} |", cost(preset, size, TARGET)?);
        }
        println!("\n| target | median ms | slowest ms | MB |\n|---|---|---|---|");
        for target in TARGETS {
            println!("| {target} x {target} | {} |", cost(preset, [3840, 2160], target)?);
        }
        Ok(())
    });
    Ok(tables?)
}

/// Median and slowest frame in milliseconds, and the memory of the tracker in MB.
fn cost(preset: Preset, size: [usize; 2], target: usize) -> Result<String, patchlock::Error> {
    let (views, mut rgb) = (Views::new(size), vec![0; size[0] * size[1] * 3]);
    let mut followed = None;
    let held = measure(|| followed = Some(follow(preset, &views, &mut rgb, target)));
    let (_tracker, mut times) = followed.expect("has run")?;
    let times = &mut times[WARM_UP..];
    times.sort_by(f64::total_cmp);
    let (median, slowest) = (times[times.len() / 2], times[times.len() - 1]);
    Ok(format!("{median:.2} | {slowest:.2} | {:.1}", held.bytes_current as f64 / 1e6))
}

/// The tracker after all frames, and the milliseconds of each.
fn follow(
    preset: Preset,
    views: &Views,
    rgb: &mut [u8],
    target: usize,
) -> Result<(Tracker, Vec<f64>), patchlock::Error> {
    let (size, side) = (views.size, target as f64);
    let at = |frame: usize, axis: usize| {
        (size[axis] as f64 - side) / 2.0 - views.shift(frame)[axis] as f64
    };
    let truth = |frame: usize| BoundingBox { x: at(frame, 0), y: at(frame, 1), w: side, h: side };
    views.fill(0, rgb);
    let mut tracker = Tracker::start(preset, &Frame::rgb8(rgb, size[0], size[1])?, truth(0))?;
    let mut times = Vec::with_capacity(FRAMES);
    for frame in 1..WARM_UP + FRAMES {
        views.fill(frame, rgb);
        let view = Frame::rgb8(rgb, size[0], size[1])?;
        let begun = Instant::now();
        let estimate = tracker.update(&view)?;
        times.push(begun.elapsed().as_secs_f64() * 1e3);
        assert!(estimate.bbox.overlap(&truth(frame)) > 0.3, "frame {frame}: the target was lost");
    }
    Ok((tracker, times))
}

/// Views of a texture that is larger than a frame.
struct Views {
    size: [usize; 2],
    texture: Vec<u8>,
}

impl Views {
    /// How far the views move, in pixels.
    const REACH: usize = 16;

    fn new(size: [usize; 2]) -> Self {
        let [w, h] = size.map(|side| side + 2 * Self::REACH);
        // Blobs of several sizes, so that targets of any size have texture.
        let value = |x: usize, y: usize, c: usize| {
            let cell = |side: usize| {
                let key =
                    (x / side * 0x9e37_79b9) ^ (y / side * 0x85eb_ca6b) ^ (c * 0xc2b2_ae35) ^ side;
                (key.wrapping_mul(0x27d4_eb2f) >> 15) & 63
            };
            (cell(3) + cell(11) + cell(37) + cell(149)) as u8
        };
        let pixels = (0..w * h).flat_map(|k| (0..3).map(move |c| value(k % w, k / w, c)));
        Self { size, texture: pixels.collect() }
    }

    /// By how much a view is displaced: a slow ellipse.
    fn shift(&self, frame: usize) -> [usize; 2] {
        let (sin, cos) = (frame as f64 * 0.15).sin_cos();
        let reach = Self::REACH as f64;
        [(reach * (1.0 + cos)) as usize, (reach * (1.0 + sin)) as usize]
    }

    fn fill(&self, frame: usize, rgb: &mut [u8]) {
        let ([w, _], [dx, dy]) = (self.size, self.shift(frame));
        let stride = (w + 2 * Self::REACH) * 3;
        for (y, row) in rgb.chunks_exact_mut(w * 3).enumerate() {
            row.copy_from_slice(&self.texture[(y + dy) * stride + dx * 3..][..w * 3]);
        }
    }
}
