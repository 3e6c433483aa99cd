//! A chart of overlap over time, as SVG and as PNG.

use std::fmt::Write;
use std::ops::Range;

use anyhow::Result;
use patchlock_bench::report::{FAMILY, png};

use crate::failure::Failure;

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 86.0;
const BOTTOM: f64 = 52.0;
/// Labels are above the plot, since the curves may be anywhere inside it.
const LABEL_GAP: f64 = 7.0;

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
    /// The chart as SVG text.
    pub fn svg(&self) -> String {
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" \
             height=\"{HEIGHT}\" font-family=\"{}, Menlo, Consolas, monospace\">\n",
            FAMILY
        );
        svg += &format!("<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\n");
        self.shade_hidden(&mut svg);
        self.axes(&mut svg);
        svg += &self.line(self.score, "#e07b27", "1.6", " stroke-dasharray=\"5 4\"");
        svg += &self.line(self.overlap, "#0f8f7c", "2.6", "");
        self.words(&mut svg);
        svg += "</svg>\n";
        svg
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
    fn shade_hidden(&self, svg: &mut String) {
        for (frame, hidden) in self.hidden.iter().enumerate().filter(|(_, hidden)| **hidden > 0.01)
        {
            let (from, to) = (
                self.x(frame as f64 - 0.5).max(LEFT),
                self.x(frame as f64 + 0.5).min(WIDTH - RIGHT),
            );
            put(
                svg,
                format_args!(
                    "<rect x=\"{from:.2}\" y=\"{TOP}\" width=\"{:.2}\" height=\"{}\" fill=\"#8494a8\" \
                     fill-opacity=\"{:.2}\" shape-rendering=\"crispEdges\"/>\n",
                    to - from,
                    HEIGHT - TOP - BOTTOM,
                    0.10 + 0.42 * hidden.min(1.0)
                ),
            );
        }
        for span in spans(self.hidden) {
            let most = self.hidden[span.clone()].iter().copied().fold(0.0, f64::max);
            let middle = self
                .x((span.start + span.end - 1) as f64 / 2.0)
                .clamp(LEFT + 75.0, WIDTH - RIGHT - 75.0);
            put(
                svg,
                format_args!(
                    "<text x=\"{middle:.1}\" y=\"{:.1}\" font-size=\"12\" fill=\"#45536a\" \
                     text-anchor=\"middle\">up to {:.0} % hidden</text>\n",
                    TOP - LABEL_GAP,
                    100.0 * most
                ),
            );
        }
    }

    fn axes(&self, svg: &mut String) {
        for tick in 0..=4 {
            let value = f64::from(tick) / 4.0;
            let y = y(value);
            put(
                svg,
                format_args!(
                    "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{y}\" y2=\"{y}\" stroke=\"#d9dfe6\"/>\n\
                     <text x=\"{}\" y=\"{}\" font-size=\"13\" fill=\"#5b6675\" \
                     text-anchor=\"end\">{value:.2}</text>\n",
                    WIDTH - RIGHT,
                    LEFT - 10.0,
                    y + 4.5
                ),
            );
        }
        let step = round_step(self.overlap.len() as f64 / 8.0);
        for frame in (0..self.overlap.len()).step_by(step) {
            let x = self.x(frame as f64);
            put(
                svg,
                format_args!(
                    "<text x=\"{x:.1}\" y=\"{}\" font-size=\"13\" fill=\"#5b6675\" \
                     text-anchor=\"middle\">{frame}</text>\n",
                    HEIGHT - BOTTOM + 20.0
                ),
            );
        }
        put(
            svg,
            format_args!(
                "<text x=\"{}\" y=\"{}\" font-size=\"13\" fill=\"#5b6675\" \
                 text-anchor=\"end\">frame</text>\n",
                WIDTH - RIGHT,
                HEIGHT - 10.0
            ),
        );
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

    fn words(&self, svg: &mut String) {
        put(
            svg,
            format_args!(
                "<text x=\"{LEFT}\" y=\"32\" font-size=\"19\" fill=\"#1c2530\">\
                 Overlap with the truth, frame by frame</text>\n\
                 <text x=\"{LEFT}\" y=\"56\" font-size=\"13\" fill=\"#5b6675\">{}</text>\n",
                self.subtitle
            ),
        );
        let x = WIDTH - RIGHT - 130.0;
        put(
            svg,
            format_args!(
                "<line x1=\"{x}\" x2=\"{}\" y1=\"28\" y2=\"28\" stroke=\"#0f8f7c\" stroke-width=\"2.6\"/>\n\
                 <text x=\"{}\" y=\"32.5\" font-size=\"13\" fill=\"#1c2530\">overlap</text>\n\
                 <line x1=\"{x}\" x2=\"{}\" y1=\"51\" y2=\"51\" stroke=\"#e07b27\" stroke-width=\"1.6\" \
                 stroke-dasharray=\"5 4\"/>\n\
                 <text x=\"{}\" y=\"55.5\" font-size=\"13\" fill=\"#1c2530\">score</text>\n",
                x + 34.0,
                x + 44.0,
                x + 34.0,
                x + 44.0
            ),
        );
    }
}

/// Writing to a string can't fail.
fn put(svg: &mut String, text: std::fmt::Arguments<'_>) {
    let _ = svg.write_fmt(text);
}

fn y(value: f64) -> f64 {
    TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - value.clamp(0.0, 1.0))
}

/// The smallest of 1, 2, 5, 10, 20, 50, ... that is at least `least`.
fn round_step(least: f64) -> usize {
    let steps = (0..7).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_usize.pow(power)));
    steps.into_iter().find(|&step| step as f64 >= least).unwrap_or(10_000_000)
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
        assert_eq!(round_step(13.0), 20);
    }
}
