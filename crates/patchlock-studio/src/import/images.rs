//! Which frame the image of an annotation is. Images of a folder are known by their names; the frames
//! of a video have none, so that files of other programs can only number them.

use std::collections::HashMap;
use std::path::Path;

use patchlock_media::image_file::is_image;
use patchlock_track::files;

use super::Outcome;

/// The names of the images of a folder, in the order of the frames; empty for a video.
pub fn names_of(video: &Path) -> Vec<String> {
    let images = files::images(video).unwrap_or_default();
    images.iter().map(|image| files::name_of(image)).collect()
}

/// The images of a clip.
pub struct Images {
    /// Frames by the names of their images, with and without ending; `None` for a name that several
    /// have.
    frames: HashMap<String, Option<usize>>,
    /// The same by the numbers that names without ending are: `0042` is 42.
    numbers: HashMap<u64, Option<usize>>,
    /// The number of the image that is frame 0, if images are known by the numbers at the ends of
    /// their names.
    first: Option<usize>,
}

impl Images {
    pub fn new(names: &[String]) -> Self {
        let (mut frames, mut numbers) = (HashMap::new(), HashMap::new());
        let stems = names.iter().map(|name| stem(name));
        for (frame, stem) in stems.enumerate() {
            let forget = |known: &mut Option<usize>| *known = None;
            frames.entry(stem.to_owned()).and_modify(forget).or_insert(Some(frame));
            if let Ok(number) = stem.parse() {
                numbers.entry(number).and_modify(forget).or_insert(Some(frame));
            }
        }
        // A whole name is that of one image.
        frames.extend(names.iter().enumerate().map(|(frame, name)| (name.clone(), Some(frame))));
        Self { frames, numbers, first: None }
    }

    /// Whether the frames have names.
    pub fn have_names(&self) -> bool {
        !self.frames.is_empty()
    }

    /// The frame of an image with this name, which may have a path, another ending, and what Roboflow
    /// and Label Studio add to it.
    pub fn named(&self, name: &str) -> Outcome<usize> {
        let base = base(name);
        let own = stem(base);
        let candidates = [base, own, without_hash(own), without_prefix(own)];
        let found = candidates.iter().find_map(|name| self.frames.get(*name).copied().flatten());
        found.ok_or_else(|| {
            format!("no image of the folder has the name {name:?}, with or without ending")
        })
    }

    /// Takes the numbers at the ends of these names of images for those of the frames, which have no
    /// names, of which there are so many. Names such as `frame_000012`, which we and CVAT give to
    /// frames, count from 0. Others count from 0 or 1, or from the lowest number if the highest is
    /// beyond the video. Returns what is to be said of it.
    pub fn number<'n>(
        &mut self,
        names: impl Iterator<Item = &'n str>,
        frames: usize,
    ) -> Outcome<Option<String>> {
        if self.have_names() {
            return Ok(None);
        }
        let mut lowest: Option<(usize, &str)> = None;
        let mut highest = 0;
        let mut from_zero = true;
        for name in names {
            let number = number(name)?;
            from_zero &= is_name_of_frame(stem_of(name));
            highest = highest.max(number);
            if lowest.is_none_or(|(least, _)| number < least) {
                lowest = Some((number, name));
            }
        }
        let Some((lowest, name)) = lowest else { return Ok(None) };
        let (first, name) = if from_zero {
            (0, "frame_000000")
        } else if lowest > 1 && highest <= frames {
            // Files leave out images without boxes, also the first ones.
            (1, "1")
        } else {
            (lowest, stem_of(name))
        };
        self.first = Some(first);
        Ok(Some(format!(
            "The images are matched with the frames by the numbers at the ends of their names: {name} is \
             frame 0"
        )))
    }

    /// The frame of an image of the file, by its number or its name.
    pub fn frame(&self, name: &str) -> Outcome<usize> {
        match self.first {
            Some(first) => Ok(number(name)?.saturating_sub(first)),
            None => self.named(name),
        }
    }

    /// The frame of the only image whose name is this number.
    pub fn numbered(&self, number: u64) -> Option<usize> {
        self.numbers.get(&number).copied().flatten()
    }
}

/// The number at the end of a name without its ending, and without a hash.
fn number(name: &str) -> Outcome<usize> {
    let own = stem_of(name);
    let digits = own.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    own[digits..].parse().map_err(|_| {
        format!("the image {name:?} has no number at the end of its name, and the frames of a video no names")
    })
}

/// Whether it is a name that we and CVAT give to a frame.
fn is_name_of_frame(stem: &str) -> bool {
    let digits = stem.strip_prefix("frame_");
    digits.is_some_and(|digits| digits.len() == 6 && digits.bytes().all(|it| it.is_ascii_digit()))
}

/// The name without folders, ending and hash.
fn stem_of(name: &str) -> &str {
    without_hash(stem(base(name)))
}

/// The name without the folders before it.
fn base(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// The name without the ending of an image or of a file of labels.
fn stem(name: &str) -> &str {
    let is_known = |end: &str| is_image(Path::new(name)) || matches!(end, "txt" | "xml");
    match name.rsplit_once('.') {
        Some((stem, end)) if !stem.is_empty() && is_known(end) => stem,
        _ => name,
    }
}

/// `0001` of `0001_jpg.rf.8a1b9`, as Roboflow names images.
fn without_hash(stem: &str) -> &str {
    let Some((before, _)) = stem.split_once(".rf.") else { return stem };
    before.rsplit_once('_').map_or(before, |(name, _)| name)
}

/// `0001` of `8a1b9c2d-0001`, as Label Studio names uploaded images.
fn without_prefix(stem: &str) -> &str {
    let is_hash = |prefix: &str| prefix.len() == 8 && prefix.chars().all(|c| c.is_ascii_hexdigit());
    stem.split_once('-').filter(|(prefix, _)| is_hash(prefix)).map_or(stem, |(_, name)| name)
}
