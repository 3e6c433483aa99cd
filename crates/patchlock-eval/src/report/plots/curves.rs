//! Precision and success plots: one line per tracker. The best are named in a ranked legend; the others are
//! pale lines in the background.

use super::{Axis, Plot};
use crate::report::palette::Look;
use crate::report::svg::{Anchor, Svg, shorten};

const LEFT: f64 = 58.0;
const TOP: f64 = 54.0;
const BOTTOM: f64 = 52.0;
/// Width and smallest height of the area with the lines.
const AREA: [f64; 2] = [400.0, 330.0];
/// Space between this area and the legend.
const GAP: f64 = 22.0;
const LEGEND: f64 = 236.0;
const ROW: f64 = 21.0;
const NAME_LETTERS: usize = 15;

/// The line of one tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    /// Name of the tracker.
    pub name: &'a str,
    /// Shares of frames, 0 to 1, one for each threshold.
    pub values: &'a [f64],
    /// The score, by which trackers are ranked.
    pub score: f64,
    /// The line style; `None` for a pale line without a name.
    pub look: Option<Look>,
}

/// The contents of the plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves<'a> {
    /// Name of the plot's files, without extension.
    pub file: String,
    /// Heading.
    pub title: String,
    /// Label of the thresholds.
    pub x_label: &'a str,
    /// Label of the values.
    pub y_label: &'a str,
    /// Label of the score, in the head of the legend.
    pub score_label: &'a str,
    /// The thresholds.
    pub thresholds: &'a [f64],
    /// Labelled positions on the x axis.
    pub ticks: &'a [f64],
    /// The threshold at which the score is taken; `None` if the score is the mean of the values.
    pub mark: Option<f64>,
    /// The lines, best tracker first.
    pub lines: Vec<Line<'a>>,
}

impl Curves<'_> {
    /// Draws the plot.
    pub fn plot(&self) -> Plot {
        let named = self.lines.iter().filter(|line| line.look.is_some()).count();
        let others = usize::from(named < self.lines.len());
        let legend_height = ROW * (named + others + 1) as f64;
        let height = AREA[1].max(legend_height);
        let size = [LEFT + AREA[0] + GAP + LEGEND, TOP + height + BOTTOM];
        let mut svg = Svg::default();
        svg.text([LEFT, 28.0], 16.0, "ink", Anchor::Start, &self.title);
        let last = self.thresholds.last().copied().unwrap_or(1.0);
        let x = Axis { values: [0.0, last], pixels: [LEFT, LEFT + AREA[0]] };
        let y = Axis { values: [0.0, 1.0], pixels: [TOP + height, TOP] };
        self.axes(&mut svg, x, y);
        self.draw_lines(&mut svg, x, y);
        self.legend(&mut svg, LEFT + AREA[0] + GAP);
        Plot {
            name: self.file.clone(),
            title: self.title.clone(),
            table: self.table(),
            picture: svg,
            size,
            head: 0.0,
        }
    }

    fn axes(&self, svg: &mut Svg, x: Axis, y: Axis) {
        let [bottom, top] = y.pixels;
        let [left, right] = x.pixels;
        for tick in 0..=5 {
            let value = f64::from(tick) / 5.0;
            svg.line("grid", [left, y.at(value)], [right, y.at(value)]);
            svg.text(
                [left - 8.0, y.at(value) + 4.0],
                12.0,
                "soft",
                Anchor::End,
                &format!("{value:.1}"),
            );
        }
        for &value in self.ticks {
            svg.line("grid", [x.at(value), bottom], [x.at(value), top]);
            svg.text(
                [x.at(value), bottom + 18.0],
                12.0,
                "soft",
                Anchor::Middle,
                &format!("{value}"),
            );
        }
        svg.line("axis", [left, bottom], [right, bottom]);
        if let Some(mark) = self.mark {
            svg.put(format_args!(
                "<line class=\"axis\" stroke-dasharray=\"3 3\" x1=\"{0:.1}\" x2=\"{0:.1}\" \
                 y1=\"{bottom:.1}\" y2=\"{top:.1}\"/>",
                x.at(mark)
            ));
        }
        svg.text([(left + right) / 2.0, bottom + 40.0], 13.0, "soft", Anchor::Middle, self.x_label);
        svg.put(format_args!(
            "<text class=\"soft\" font-size=\"13\" text-anchor=\"middle\" \
             transform=\"translate(16 {:.1}) rotate(-90)\">{}</text>",
            (top + bottom) / 2.0,
            crate::report::svg::escape(self.y_label)
        ));
    }

    /// Draws pale lines first, then the named ones from worst to best, the strong ones on top.
    fn draw_lines(&self, svg: &mut Svg, x: Axis, y: Axis) {
        let depth = |line: &Line| line.look.map_or(0, |look| if look.strong { 2 } else { 1 });
        for layer in 0..=2 {
            for line in self.lines.iter().rev().filter(|line| depth(line) == layer) {
                let points: Vec<[f64; 2]> = self
                    .thresholds
                    .iter()
                    .zip(line.values)
                    .map(|(&t, &v)| [x.at(t), y.at(v)])
                    .collect();
                let pale = || "class=\"other\" stroke-width=\"1\"".to_string();
                let attributes = line.look.map_or_else(pale, Look::line);
                svg.polyline(&attributes, &points, &format!("{} [{:.3}]", line.name, line.score));
            }
        }
    }

    fn legend(&self, svg: &mut Svg, left: f64) {
        let mut y = TOP + 6.0;
        svg.text([left, y], 12.0, "soft", Anchor::Start, "rank");
        svg.text([left + LEGEND - 8.0, y], 12.0, "soft", Anchor::End, self.score_label);
        for (k, line) in self.lines.iter().enumerate() {
            let Some(look) = line.look else { continue };
            y += ROW;
            if look.strong {
                svg.rect("chosen", [left - 4.0, y - 15.0], [LEGEND, ROW - 1.0]);
            }
            svg.text([left + 20.0, y], 13.0, "soft", Anchor::End, &format!("{}", k + 1));
            svg.polyline(
                &look.line(),
                &[[left + 28.0, y - 4.5], [left + 62.0, y - 4.5]],
                line.name,
            );
            svg.text(
                [left + 70.0, y],
                13.0,
                "ink",
                Anchor::Start,
                &shorten(line.name, NAME_LETTERS),
            );
            svg.text(
                [left + LEGEND - 8.0, y],
                13.0,
                "ink",
                Anchor::End,
                &format!("[{:.3}]", line.score),
            );
        }
        let others = self.lines.iter().filter(|line| line.look.is_none()).count();
        if others > 0 {
            y += ROW;
            svg.polyline(
                "class=\"other\" stroke-width=\"1\"",
                &[[left + 28.0, y - 4.5], [left + 62.0, y - 4.5]],
                "",
            );
            svg.text([left + 70.0, y], 12.0, "soft", Anchor::Start, &format!("{others} more"));
        }
    }

    fn table(&self) -> Vec<Vec<String>> {
        let names = self.lines.iter().map(|line| line.name.to_string());
        let mut table =
            vec![["threshold".to_string()].into_iter().chain(names).collect::<Vec<_>>()];
        for (k, threshold) in self.thresholds.iter().enumerate() {
            let values = self
                .lines
                .iter()
                .map(|line| line.values.get(k).map_or(String::new(), |v| format!("{v:.6}")));
            table.push([format!("{threshold}")].into_iter().chain(values).collect());
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::svg::Rasteriser;

    fn curves<'a>(names: &'a [String], values: &'a [f64]) -> Curves<'a> {
        let look =
            |k: usize| (k < 2).then(|| if k == 0 { Look::FIRST } else { Look::other(k, false) });
        Curves {
            file: "success".into(),
            title: "Success".into(),
            x_label: "overlap",
            y_label: "share",
            score_label: "AUC",
            thresholds: &[0.0, 0.5, 1.0],
            ticks: &[0.0, 1.0],
            mark: None,
            lines: names
                .iter()
                .enumerate()
                .map(|(k, name)| Line { name, values, score: 0.5, look: look(k) })
                .collect(),
        }
    }

    #[test]
    fn the_legend_names_some_lines_and_counts_the_others() {
        let names: Vec<String> = ["ours & co", "b", "c", "d"].map(String::from).to_vec();
        let plot = curves(&names, &[1.0, 0.5, 0.0]).plot();
        let svg = plot.svg();
        assert!(svg.contains(">ours &amp; co</text>") && svg.contains(">b</text>"));
        assert!(!svg.contains(">c</text>") && svg.contains(">2 more</text>"));
        assert_eq!(svg.matches("[0.500]</text>").count(), 2);
        assert_eq!(plot.csv().lines().nth(2), Some("0.5,0.500000,0.500000,0.500000,0.500000"));
        assert!(plot.png(&Rasteriser::new()).unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn a_long_legend_increases_the_height() {
        let names: Vec<String> = (0..30).map(|k| format!("tracker {k}")).collect();
        let mut many = curves(&names, &[1.0, 0.5, 0.0]);
        many.lines
            .iter_mut()
            .enumerate()
            .for_each(|(k, line)| line.look = Some(Look::other(k, false)));
        assert!(many.plot().size[1] > curves(&names, &[1.0]).plot().size[1]);
    }
}
