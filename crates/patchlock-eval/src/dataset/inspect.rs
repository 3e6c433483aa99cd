//! A closer look: the truth against the size of the frames.

use patchlock_media::image_file;

use super::{Dataset, Remark, Sequence, Severity};

/// What a closer look found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// Width and height of the frames of each sequence, in the order of the dataset; `None` where there is no frame to be read.
    pub sizes: Vec<Option<(usize, usize)>>,
    /// What is odd.
    pub remarks: Vec<Remark>,
}

/// Looks at every sequence.
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

/// What is odd about boxes that leave the frame.
fn outside(sequence: &Sequence, (width, height): (usize, usize)) -> Vec<String> {
    let boxes = || sequence.truth.iter().flatten();
    let wholly = boxes()
        .filter(|b| {
            b.x >= width as f64 || b.y >= height as f64 || b.x + b.w <= 0.0 || b.y + b.h <= 0.0
        })
        .count();
    let leaving = boxes()
        .filter(|b| {
            b.x < -1.0
                || b.y < -1.0
                || b.x + b.w > width as f64 + 1.0
                || b.y + b.h > height as f64 + 1.0
        })
        .count();
    let frame = format!("the frame of {width} x {height} pixels");
    let mut said = Vec::new();
    if wholly > 0 {
        said.push(format!("{wholly} of {} boxes lie wholly outside {frame}", boxes().count()));
    }
    if leaving > wholly {
        said.push(format!(
            "{} of {} boxes reach beyond {frame}",
            leaving - wholly,
            boxes().count()
        ));
    }
    said
}
