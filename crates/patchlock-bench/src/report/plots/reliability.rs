//! The reliability diagram: how often the box is on the target, for each bin of the score that the
//! tracker gives. Where the score is the probability of that, the points are on the diagonal.

use super::Plot;
use super::chart::{Chart, Entry};
use crate::Error;
use crate::metrics::{BINS, Bin};
use crate::report::palette::LineStyle;

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

/// The plot of the trackers with known scores, best first.
///
/// # Errors
/// [`Error::Picture`], which is a bug.
pub fn plot(title: String, lines: &[Line]) -> Result<Plot, Error> {
    let chart = Chart {
        file: "reliability".to_string(),
        title,
        x_label: "mean score of the frames in a bin",
        y_label: "share with an overlap of 0.5 or more",
        score_label: "pooled ECE",
        last: 1.0,
        ticks: &[0.0, 0.2, 0.4, 0.6, 0.8, 1.0],
        mark: Some([0.0, 1.0]),
        entries: lines.iter().map(Line::entry).collect(),
        table: table(lines),
    };
    chart.plot()
}

fn table(lines: &[Line]) -> Vec<Vec<String>> {
    let head = ["tracker", "from", "to", "frames", "score", "share"];
    let mut table = vec![head.map(str::to_string).to_vec()];
    for line in lines {
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

impl<'a> Line<'a> {
    /// A point for each bin that has frames, with an area by their number, and a line through them.
    fn entry(&self) -> Entry<'a> {
        let filled = || self.bins.iter().filter(|bin| bin.frames > 0);
        let frames: usize = filled().map(|bin| bin.frames).sum();
        let radius = |bin: &Bin| {
            let share = bin.frames as f64 / frames as f64;
            ((RADIUS[0] * share.sqrt()).max(RADIUS[1]), bin.frames)
        };
        Entry {
            name: self.name,
            score: self.ece,
            style: Some(self.style),
            width: Some(1.4),
            tooltip: self.name.to_string(),
            points: filled().map(|bin| [bin.score, bin.share]).collect(),
            dots: filled().map(radius).collect(),
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
        let plot = plot("t".into(), &[line]).unwrap();
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
