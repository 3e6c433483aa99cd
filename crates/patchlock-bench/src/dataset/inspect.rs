//! Checks the ground truth against the size of the frames.

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

/// Inspects every sequence.
pub fn inspect(dataset: &Dataset) -> Findings {
    let mut findings = Findings::default();
    for sequence in &dataset.sequences {
        let mut remark = |severity, text: String| {
            findings.remarks.push(Remark { target: Some(sequence.name.clone()), severity, text });
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

/// Remarks on boxes that are partly or entirely outside the frame.
fn outside(sequence: &Sequence, (width, height): (usize, usize)) -> Vec<String> {
    let boxes = || sequence.truth.iter().flatten();
    let entirely = boxes()
        .filter(|b| {
            b.x >= width as f64 || b.y >= height as f64 || b.x + b.w <= 0.0 || b.y + b.h <= 0.0
        })
        .count();
    let partly_or_entirely = boxes()
        .filter(|b| {
            b.x < -1.0
                || b.y < -1.0
                || b.x + b.w > width as f64 + 1.0
                || b.y + b.h > height as f64 + 1.0
        })
        .count();
    let frame = format!("the frame of {width} x {height} pixels");
    let mut remarks = Vec::new();
    if entirely > 0 {
        remarks
            .push(format!("{entirely} of {} boxes lie entirely outside {frame}", boxes().count()));
    }
    if partly_or_entirely > entirely {
        remarks.push(format!(
            "{} of {} boxes reach beyond {frame}",
            partly_or_entirely - entirely,
            boxes().count()
        ));
    }
    remarks
}
