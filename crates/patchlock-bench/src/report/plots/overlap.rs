//! A chart of overlap over time, with the tracker's score and the hidden share of the target.

use std::ops::Range;

use minijinja::context;

use super::{Axis, drawn, round_step};
use crate::Error;
use crate::report::svg;

const SIZE: [f64; 2] = [960.0, 400.0];
const LEFT: f64 = 64.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 86.0;
const BOTTOM: f64 = 52.0;

/// The chart as an SVG file: the overlap of box and truth, the tracker's own score and the hidden
/// share of the target, 0 to 1, in each frame. `subtitle` is the line below the title.
///
/// # Errors
/// [`Error::Picture`], which is a bug.
pub fn overlap(
    overlap: &[f64],
    score: &[f64],
    hidden: &[f64],
    subtitle: &str,
) -> Result<String, Error> {
    let frames = overlap.len();
    let [right, bottom] = [SIZE[0] - RIGHT, SIZE[1] - BOTTOM];
    let last = frames.saturating_sub(1).max(1) as f64;
    let x = Axis { values: [0.0, last], pixels: [LEFT, right] };
    let y = Axis { values: [0.0, 1.0], pixels: [bottom, TOP] };
    let line = |values: &[f64]| {
        let at =
            |(k, v): (usize, &f64)| format!("{:.2},{:.2}", x.at(k as f64), y.at(v.clamp(0.0, 1.0)));
        values.iter().enumerate().map(at).collect::<Vec<_>>().join(" ")
    };
    let span = |span: Range<usize>| {
        let most = hidden[span.clone()].iter().copied().fold(0.0, f64::max);
        let middle = (span.start + span.end - 1) as f64 / 2.0;
        context! { middle, most => format!("{:.0}", 100.0 * most) }
    };
    let values = context! {
        left => LEFT, right, top => TOP, bottom, x => x.function(), y => y.function(),
        hidden => hidden.to_vec(), subtitle,
        spans => spans(hidden).into_iter().map(span).collect::<Vec<_>>(),
        ticks => (0..frames).step_by(round_step(frames as f64 / 8.0)).collect::<Vec<_>>(),
        score => line(score),
        overlap => line(overlap),
    };
    Ok(svg::file(&drawn(include_str!("overlap.xml"), values)?, SIZE))
}

/// The ranges of frames in which part of the target is hidden.
fn spans(hidden: &[f64]) -> Vec<Range<usize>> {
    let mut spans: Vec<Range<usize>> = Vec::new();
    for frame in (0..hidden.len()).filter(|&frame| hidden[frame] > 0.01) {
        match spans.last_mut() {
            Some(span) if span.end == frame => span.end += 1,
            _ => spans.push(frame..frame + 1),
        }
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_as_svg_and_as_png() {
        let (overlaps, scores) = ([1.0, 0.9, 0.8], [1.0, 0.7, f64::NAN]);
        let svg = overlap(&overlaps, &scores, &[0.0, 0.5, 0.0], "mean 0.90").unwrap();
        let label = svg.split("<text ").find(|text| text.contains("up to 50 % hidden"));
        assert!(label.unwrap().contains("y=\"79.0\""), "above the plot: {svg}");
        assert!(svg::png(&svg).unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn spans_are_contiguous_ranges() {
        assert_eq!(spans(&[0.0, 0.2, 0.3, 0.0, 0.1]), [1..3, 4..5]);
    }
}
