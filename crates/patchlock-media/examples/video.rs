//! A video to boxes:
//!
//! ```sh
//! cargo run --release -p patchlock-media --example video -- video.mp4 120,80,64,48
//! ```

use patchlock::{Estimate, Preset, Tracker};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [video, numbers] = words.as_slice() else {
        return Err("usage: video VIDEO X,Y,W,H".into());
    };
    let numbers: Result<Vec<f64>, _> = numbers.split(',').map(str::parse).collect();
    let bbox: [f64; 4] = numbers?.try_into().map_err(|_| "a box is X,Y,W,H")?;
    track(video, bbox, |k, Estimate { bbox, status, .. }| println!("{k} {bbox:?} {status}"))
}

/// Calls `each` with the number of each frame and the estimate in it.
pub fn track(
    video: &str,
    target: [f64; 4],
    mut each: impl FnMut(usize, &Estimate),
) -> Result<(), Box<dyn Error>> {
    let mut source = patchlock_media::open(video, false)?;
    let Some(first) = source.frame(0)? else { return Err("the video has no frames".into()) };
    let mut tracker = Tracker::start(Preset::Robust, &first.frame()?, target)?;
    each(0, tracker.estimate());
    let mut k = 1;
    while let Some(picture) = source.frame(k)? {
        each(k, tracker.update(&picture.frame()?)?);
        k += 1;
    }
    Ok(())
}
