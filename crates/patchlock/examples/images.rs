//! Images to boxes, decoded with the crate `image`:
//!
//! ```sh
//! cargo run --release -p patchlock --example images -- 120,80,64,48 frames/*.png
//! ```

use patchlock::{BoundingBox, Frame, Preset, Tracker};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let numbers = words.next().ok_or("usage: images X,Y,W,H IMAGE...")?;
    let numbers: Result<Vec<f64>, _> = numbers.split(',').map(str::parse).collect();
    let bbox: [f64; 4] = numbers?.try_into().map_err(|_| "a box is X,Y,W,H")?;
    track(bbox.into(), words)?.iter().for_each(|bbox| println!("{bbox:?}"));
    Ok(())
}

/// The box of the target in each image; it is in this box of the first one.
pub fn track(
    target: BoundingBox,
    files: impl Iterator<Item = String>,
) -> Result<Vec<BoundingBox>, Box<dyn Error>> {
    let mut tracker: Option<Tracker> = None;
    let mut boxes = Vec::new();
    for file in files {
        let image = image::open(file)?.into_rgb8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let frame = Frame::rgb8(image.as_raw(), width, height)?;
        let estimate = match &mut tracker {
            Some(tracker) => tracker.update(&frame)?,
            None => tracker.insert(Tracker::start(Preset::Robust, &frame, target)?).estimate(),
        };
        boxes.push(estimate.bbox);
    }
    Ok(boxes)
}
