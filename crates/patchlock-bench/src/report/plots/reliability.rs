//! The reliability diagram: how often the box is on the target, for each bin of the score that the
//! tracker gives. Where the score is the probability of that, the points are on the diagonal.

use super::chart::{Chart, Entry};
use super::{Axis, Plot};
use crate::metrics::{BINS, Bin};
use crate::report::palette::LineStyle;
use crate::report::svg::Svg;

const TICKS: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];
/// Radius of a point for all frames of a tracker, and of one for hardly any.
const RADIUS: [f64; 2] = [16.0, 1.5];

#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    pub name: &'a str,
    /// The frames by score.
    pub bins: [Bin; BINS],
    /// The expected calibration error of these bins.
    pub ece: f64,
    pub style: LineStyle,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Reliability<'a> {
    pub title: String,
    /// The trackers with known scores, best first.
    pub lines: Vec<Line<'a>>,
}

impl Reliability<'_> {
    pub fn plot(self) -> Plot {
        let entries = self.lines.iter().map(|line| Entry {
            name: line.name,
            score: line.ece,
            style: Some(line.style),
        });
        let chart = Chart {
            title: &self.title,
            x_label: "mean score of the frames in a bin",
            y_label: "share with an overlap of 0.5 or more",
            score_label: "pooled ECE",
            last: 1.0,
            ticks: &TICKS,
            entries: entries.collect(),
        };
        let mut svg = Svg::default();
        let (x, y) = chart.draw(&mut svg);
        svg.put(format_args!(
            "<line class=\"axis\" stroke-dasharray=\"3 3\" x1=\"{:.1}\" y1=\"{:.1}\" \
             x2=\"{:.1}\" y2=\"{:.1}\"/>",
            x.at(0.0),
            y.at(0.0),
            x.at(1.0),
            y.at(1.0)
        ));
        // The strong lines on top.
        for is_strong in [false, true] {
            for line in self.lines.iter().rev().filter(|line| line.style.strong == is_strong) {
                line.draw(&mut svg, x, y);
            }
        }
        let (size, name, table) = (chart.size(), "reliability".to_string(), self.table());
        Plot { name, title: self.title, table, picture: svg, size, head: 0.0 }
    }

    fn table(&self) -> Vec<Vec<String>> {
        let head = ["tracker", "from", "to", "frames", "score", "share"];
        let mut table = vec![head.map(str::to_string).to_vec()];
        for line in &self.lines {
            for (k, bin) in line.bins.iter().enumerate() {
                let end = |k: usize| format!("{:.1}", k as f64 / BINS as f64);
                let mut row = vec![line.name.to_string(), end(k), end(k + 1)];
                row.push(bin.frames.to_string());
                let means = [bin.score, bin.share];
                row.extend(means.map(|mean| match bin.frames {
                    0 => String::new(),
                    _ => format!("{mean:.6}"),
                }));
                table.push(row);
            }
        }
        table
    }
}

impl Line<'_> {
    /// Draws a point for each bin that has frames, with an area by their number, and a line through
    /// them.
    fn draw(&self, svg: &mut Svg, x: Axis, y: Axis) {
        let filled: Vec<&Bin> = self.bins.iter().filter(|bin| bin.frames > 0).collect();
        let frames: usize = filled.iter().map(|bin| bin.frames).sum();
        let at = |bin: &&Bin| [x.at(bin.score), y.at(bin.share)];
        let points: Vec<[f64; 2]> = filled.iter().map(at).collect();
        svg.polyline(&self.style.line_with_width(1.4), &points, self.name);
        for (bin, [px, py]) in filled.iter().zip(points) {
            let share = bin.frames as f64 / frames as f64;
            let radius = (RADIUS[0] * share.sqrt()).max(RADIUS[1]);
            svg.put(format_args!(
                "<circle class=\"{}\" fill-opacity=\".7\" cx=\"{px:.1}\" cy=\"{py:.1}\" \
                 r=\"{radius:.1}\"><title>{} frames</title></circle>",
                self.style.fill(),
                bin.frames
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_bin_with_frames_is_a_point_at_its_means() {
        let mut bins = [Bin::default(); BINS];
        bins[0] = Bin { frames: 1, score: 0.0, share: 1.0 };
        bins[9] = Bin { frames: 99, score: 1.0, share: 0.0 };
        let line = Line { name: "a", bins, ece: 1.0, style: LineStyle::FIRST };
        let plot = Reliability { title: "t".into(), lines: vec![line] }.plot();
        let svg = plot.svg();
        // The area of the plot is 58 to 458 from left to right and 54 to 384 from top to bottom.
        assert!(svg.contains("cx=\"58.0\" cy=\"54.0\" r=\"1.6\"><title>1 frames"), "{svg}");
        assert!(svg.contains("cx=\"458.0\" cy=\"384.0\" r=\"15.9\"><title>99 frames"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains(">pooled ECE</text>") && svg.contains(">[1.000]</text>"));
        assert_eq!(plot.csv().lines().nth(1), Some("a,0.0,0.1,1,0.000000,1.000000"));
        assert_eq!(plot.csv().lines().nth(2), Some("a,0.1,0.2,0,,"));
        assert_eq!(plot.csv().lines().count(), 1 + BINS);
    }
}
