//! Checks the ground truth against the size of the frames.

use patchlock::BoundingBox;
use patchlock_media::image_file;

use super::{Dataset, Remark, Sequence, Severity};

/// The result of [`Dataset::inspect`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// Width and height of the frames of each sequence in pixels, in the order of the dataset;
    /// `None` if the first frame cannot be read.
    pub sizes: Vec<Option<(usize, usize)>>,
    /// Anything unusual.
    pub remarks: Vec<Remark>,
}

impl Dataset {
    /// Checks the ground truth against the frame sizes. Reads the header of each sequence's first
    /// image.
    pub fn inspect(&self) -> Findings {
        let mut findings = Findings::default();
        for sequence in &self.sequences {
            let mut remark = |severity, text: String| {
                let target = Some(sequence.name.clone());
                findings.remarks.push(Remark { target, severity, text });
            };
            let size = sequence.frames.first().and_then(|first| match image_file::size(first) {
                Ok(size) => Some(size),
                Err(error) => {
                    remark(Severity::NoFrames, format!("cannot read {}: {error}", first.display()));
                    None
                }
            });
            if let Some(size) = size {
                outside(sequence, size).into_iter().for_each(|text| remark(Severity::Note, text));
            }
            findings.sizes.push(size);
        }
        findings
    }
}

/// Remarks on boxes that are partly or entirely outside the frame.
fn outside(sequence: &Sequence, (width, height): (usize, usize)) -> Vec<String> {
    let boxes: Vec<_> = sequence.truth.iter().flatten().collect();
    let (all, w, h) = (boxes.len(), width as f64, height as f64);
    let entirely = |b: &&&BoundingBox| b.x >= w || b.y >= h || b.x + b.w <= 0.0 || b.y + b.h <= 0.0;
    let entirely = boxes.iter().filter(entirely).count();
    let partly_or_entirely =
        |b: &&&BoundingBox| b.x < -1.0 || b.y < -1.0 || b.x + b.w > w + 1.0 || b.y + b.h > h + 1.0;
    let partly = boxes.iter().filter(partly_or_entirely).count().saturating_sub(entirely);
    let frame = format!("the frame of {width} x {height} pixels");
    let mut remarks = Vec::new();
    if entirely > 0 {
        remarks.push(format!("{entirely} of {all} boxes lie entirely outside {frame}"));
    }
    if partly > 0 {
        remarks.push(format!("{partly} of {all} boxes reach beyond {frame}"));
    }
    remarks
}
