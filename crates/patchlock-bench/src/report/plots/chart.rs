//! What plots of shares have in common: axes, lines, and a ranked legend beside them.

use minijinja::context;

use super::{Axis, Plot, drawn, points};
use crate::Error;
use crate::report::palette::LineStyle;

const LEFT: f64 = 58.0;
const TOP: f64 = 54.0;
const BOTTOM: f64 = 52.0;
/// Width and smallest height of the area with the lines.
const AREA: [f64; 2] = [400.0, 330.0];
/// Space between this area and the legend.
const GAP: f64 = 22.0;
const LEGEND: f64 = 256.0;
const ROW: f64 = 21.0;

/// The SVG attributes of the line of a tracker without a name.
const PALE: &str = "class=\"other\" stroke-width=\"1\"";

/// A tracker in the plot.
pub struct Entry<'a> {
    pub name: &'a str,
    /// The number beside it in the legend.
    pub score: f64,
    /// The line style; `None` for a pale line without a name.
    pub style: Option<LineStyle>,
    /// The width of the line, if it is not that of the style.
    pub width: Option<f64>,
    pub tooltip: String,
    pub points: Vec<[f64; 2]>,
    /// Radius and number of frames of each point, if the points are drawn.
    pub dots: Vec<(f64, usize)>,
}

/// A plot of shares, 0 to 1.
pub struct Chart<'a> {
    /// Name of the plot's files, without extension.
    pub file: String,
    pub title: String,
    pub x_label: &'a str,
    /// Label of the shares.
    pub y_label: &'a str,
    /// Label of the scores, in the head of the legend.
    pub score_label: &'a str,
    /// The end of the x axis, which begins at 0.
    pub last: f64,
    /// Labelled positions on the x axis.
    pub ticks: &'a [f64],
    /// The ends on the x axis of a dashed line from the bottom to the top.
    pub mark: Option<[f64; 2]>,
    /// The trackers by rank.
    pub entries: Vec<Entry<'a>>,
    pub table: Vec<Vec<String>>,
}

impl Chart<'_> {
    /// Draws pale lines first, then the named ones from worst to best, the strong ones on top.
    ///
    /// # Errors
    /// As [`drawn`].
    pub fn plot(self) -> Result<Plot, Error> {
        let ranked = self.entries.iter().enumerate();
        let named = ranked.filter_map(|(rank, entry)| {
            let (look, strong) = (entry.style?.line(), entry.style?.strong);
            let score = format!("{:.3}", entry.score);
            Some(context! { rank => rank + 1, name => entry.name, look, strong, score })
        });
        let named: Vec<_> = named.collect();
        let others = self.entries.len() - named.len();
        // A long legend increases the height.
        let rows = named.len() + usize::from(others > 0) + 1;
        let (right, bottom) = (LEFT + AREA[0], TOP + AREA[1].max(ROW * rows as f64));
        let x = Axis { values: [0.0, self.last], pixels: [LEFT, right] };
        let y = Axis { values: [0.0, 1.0], pixels: [bottom, TOP] };
        let mut lowest_first: Vec<&Entry> = self.entries.iter().rev().collect();
        lowest_first.sort_by_key(|entry| entry.style.map(|style| style.strong));
        let line = |entry: &Entry| {
            let at = || entry.points.iter().map(|&[a, b]| [x.at(a), y.at(b)]);
            let dots = at().zip(&entry.dots);
            let dots = dots.map(|([x, y], (radius, frames))| context! { x, y, radius, frames });
            let look = entry.style.map_or(PALE.to_string(), |style| match entry.width {
                Some(width) => style.line_with_width(width),
                None => style.line(),
            });
            context! {
                look,
                points => points(at()),
                tooltip => &entry.tooltip,
                fill => entry.style.map(LineStyle::fill),
                dots => dots.collect::<Vec<_>>(),
            }
        };
        let values = context! {
            left => LEFT, right, top => TOP, bottom, x => x.function(), y => y.function(),
            legend => right + GAP, legend_width => LEGEND, row => ROW, pale => PALE,
            title => &self.title, mark => self.mark,
            ticks => self.ticks.iter().map(|tick| (*tick, tick.to_string())).collect::<Vec<_>>(),
            x_label => self.x_label, y_label => self.y_label, score_label => self.score_label,
            lines => lowest_first.into_iter().map(line).collect::<Vec<_>>(),
            named, others,
        };
        let body = drawn(include_str!("chart.xml"), values)?;
        let size = [right + GAP + LEGEND, bottom + BOTTOM];
        Ok(Plot { name: self.file, title: self.title, table: self.table, body, size, head: 0.0 })
    }
}
