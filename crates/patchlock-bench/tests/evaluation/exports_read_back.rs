//! Exports of benchmarks, read by our own readers.

use std::fs;

use image::RgbImage;
use patchlock::BoundingBox;
use patchlock_bench::dataset::{Dataset, Layout};
use patchlock_track::export::{self, Entry, Format, Options, Track};

use crate::support::Folder;

/// Target 1 is in frames 0, 2 and 6, target 3 in frames 2 and 4.
fn track() -> Track {
    let entry = |(id, frame, x)| Entry {
        frame,
        id,
        bbox: Some(BoundingBox { x, y: 5.0, w: 20.0, h: 10.0 }),
        ..Entry::default()
    };
    let boxes = [(1, 0, 10.0), (1, 2, 11.0), (3, 2, 3.0), (3, 4, 4.0), (1, 6, 14.0)];
    Track::new(boxes.map(entry).to_vec()).unwrap()
}

#[test]
fn benchmarks_are_read_back() {
    let names = [["toy car-1", "toy car-3"], ["film_000001", "film_000003"]];
    for (layout, names) in [Layout::Lasot, Layout::Got10k].into_iter().zip(names) {
        let folder = Folder::new();
        let images = folder.path().join("frames");
        fs::create_dir(&images).unwrap();
        for k in 0..7 {
            RgbImage::new(40, 30).save(images.join(format!("{k}.png"))).unwrap();
        }
        let name = if layout == Layout::Lasot { "lasot" } else { "got10k" };
        let format = Format::named(name, false);
        let options = Options {
            label: "toy car".into(),
            images: Some(images),
            ..Options::new(format.unwrap(), "film")
        };
        let out = folder.path().join("out");
        export::write(&track(), &options, &out, false).unwrap();
        let dataset = Dataset::open(&out).unwrap();
        assert_eq!(dataset.layout, layout);
        let [first, second] = &dataset.sequences[..] else { panic!("{layout:?}") };
        assert_eq!([&first.name, &second.name], names);
        // The frames in which a target is tracked, from its first to its last.
        let x: Vec<_> = first.truth.iter().map(|bbox| bbox.map(|bbox| bbox.x)).collect();
        assert_eq!(x, [Some(10.0), Some(11.0), None, Some(14.0)]);
        assert_eq!([first.frames.len(), second.frames.len()], [4, 2]);
    }
}
