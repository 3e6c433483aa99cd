//! A chart of overlap over time, as SVG and as PNG.

use std::fmt::Display;
use std::ops::Range;

use anyhow::Result;
use patchlock_bench::report::{FAMILY, png, round_step};

use crate::failure::Failure;

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 86.0;
const BOTTOM: f64 = 52.0;
/// Labels are above the plot, since the curves may be anywhere inside it.
const LABEL_GAP: f64 = 7.0;
const INK: &str = "#1c2530";
const SOFT: &str = "#5b6675";
/// Where a text has its place, if that is not its beginning.
const MIDDLE: &str = " text-anchor=\"middle\"";
const END: &str = " text-anchor=\"end\"";

/// The data of the chart, one value per frame.
pub struct Chart<'a> {
    /// Overlap of box and truth, 0 to 1.
    pub overlap: &'a [f64],
    /// The tracker's own score, 0 to 1.
    pub score: &'a [f64],
    /// Hidden share of the target, 0 to 1.
    pub hidden: &'a [f64],
    /// The line below the title.
    pub subtitle: String,
}

impl Chart<'_> {
    pub fn svg(&self) -> String {
        let parts = [
            self.shades(),
            self.shade_labels(),
            self.axes(),
            self.line(self.score, "#e07b27", "1.6", " stroke-dasharray=\"5 4\""),
            self.line(self.overlap, "#0f8f7c", "2.6", ""),
            self.words(),
        ];
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" \
             height=\"{HEIGHT}\" font-family=\"{FAMILY}, Menlo, Consolas, monospace\">\n\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            parts.concat()
        )
    }

    /// The chart as PNG bytes, drawn with the embedded font.
    pub fn png(&self) -> Result<Vec<u8>> {
        Ok(png(&self.svg()).map_err(Failure::from)?)
    }

    fn x(&self, frame: f64) -> f64 {
        let last = self.overlap.len().saturating_sub(1).max(1) as f64;
        LEFT + (WIDTH - LEFT - RIGHT) * frame / last
    }

    /// Shades the frames in which part of the target is hidden; darker means more hidden.
    fn shades(&self) -> String {
        let hidden = self.hidden.iter().enumerate().filter(|(_, hidden)| **hidden > 0.01);
        let shade = |(frame, hidden): (usize, &f64)| {
            let from = self.x(frame as f64 - 0.5).max(LEFT);
            let width = self.x(frame as f64 + 0.5).min(WIDTH - RIGHT) - from;
            let (height, opacity) = (HEIGHT - TOP - BOTTOM, 0.10 + 0.42 * hidden.min(1.0));
            format!(
                "<rect x=\"{from:.2}\" y=\"{TOP}\" width=\"{width:.2}\" height=\"{height}\" fill=\"#8494a8\" \
                 fill-opacity=\"{opacity:.2}\" shape-rendering=\"crispEdges\"/>\n"
            )
        };
        hidden.map(shade).collect()
    }

    /// How much of the target is hidden, above each stretch of such frames.
    fn shade_labels(&self) -> String {
        let label = |span: Range<usize>| {
            let most = self.hidden[span.clone()].iter().copied().fold(0.0, f64::max);
            let middle = self.x((span.start + span.end - 1) as f64 / 2.0);
            let middle = middle.clamp(LEFT + 75.0, WIDTH - RIGHT - 75.0);
            let place = [format!("{middle:.1}"), format!("{:.1}", TOP - LABEL_GAP)];
            let words = format!("up to {:.0} % hidden", 100.0 * most);
            text(place, 12, "#45536a", MIDDLE, &words)
        };
        spans(self.hidden).into_iter().map(label).collect()
    }

    fn axes(&self) -> String {
        let (mut svg, right) = (String::new(), WIDTH - RIGHT);
        for tick in 0..=4 {
            let value = f64::from(tick) / 4.0;
            let y = y(value);
            svg += &format!(
                "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{y}\" y2=\"{y}\" stroke=\"#d9dfe6\"/>\n"
            );
            svg += &text([LEFT - 10.0, y + 4.5], 13, SOFT, END, &format!("{value:.2}"));
        }
        let step = round_step(self.overlap.len() as f64 / 8.0);
        for frame in (0..self.overlap.len()).step_by(step) {
            let place =
                [format!("{:.1}", self.x(frame as f64)), (HEIGHT - BOTTOM + 20.0).to_string()];
            svg += &text(place, 13, SOFT, MIDDLE, &frame.to_string());
        }
        svg + &text([right, HEIGHT - 10.0], 13, SOFT, END, "frame")
    }

    fn line(&self, values: &[f64], colour: &str, width: &str, more: &str) -> String {
        let points: Vec<String> = values
            .iter()
            .enumerate()
            .map(|(k, &v)| format!("{:.2},{:.2}", self.x(k as f64), y(v)))
            .collect();
        format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\"{more}/>\n",
            points.join(" ")
        )
    }

    /// Title, subtitle and legend.
    fn words(&self) -> String {
        let x = WIDTH - RIGHT - 130.0;
        let end = x + 34.0;
        let title = "Overlap with the truth, frame by frame";
        [
            text([LEFT, 32.0], 19, INK, "", title),
            text([LEFT, 56.0], 13, SOFT, "", &self.subtitle),
            format!("<line x1=\"{x}\" x2=\"{end}\" y1=\"28\" y2=\"28\" stroke=\"#0f8f7c\" stroke-width=\"2.6\"/>\n"),
            text([x + 44.0, 32.5], 13, INK, "", "overlap"),
            format!(
                "<line x1=\"{x}\" x2=\"{end}\" y1=\"51\" y2=\"51\" stroke=\"#e07b27\" stroke-width=\"1.6\" \
                 stroke-dasharray=\"5 4\"/>\n"
            ),
            text([x + 44.0, 55.5], 13, INK, "", "score"),
        ]
        .concat()
    }
}

fn text([x, y]: [impl Display; 2], size: u8, fill: &str, anchor: &str, text: &str) -> String {
    format!(
        "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" fill=\"{fill}\"{anchor}>{text}</text>\n"
    )
}

fn y(value: f64) -> f64 {
    TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - value.clamp(0.0, 1.0))
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
        let chart = Chart {
            overlap: &[1.0, 0.9, 0.8],
            score: &[1.0, 0.7, f64::NAN],
            hidden: &[0.0, 0.5, 0.0],
            subtitle: "mean 0.90".into(),
        };
        let svg = chart.svg();
        let label = svg.split("<text ").find(|text| text.contains("up to 50 % hidden"));
        assert!(label.expect("a label").contains("y=\"79.0\""), "above the plot: {svg}");
        assert!(chart.png().expect("draws").starts_with(b"\x89PNG"));
    }

    #[test]
    fn spans_are_contiguous_ranges() {
        assert_eq!(spans(&[0.0, 0.2, 0.3, 0.0, 0.1]), [1..3, 4..5]);
    }
}
