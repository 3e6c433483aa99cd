//! What plots of shares have in common: axes, and a ranked legend beside them.

use super::Axis;
use crate::report::palette::LineStyle;
use crate::report::svg::{Anchor, Svg, escape};

const LEFT: f64 = 58.0;
const TOP: f64 = 54.0;
const BOTTOM: f64 = 52.0;
/// Width and smallest height of the area with the lines.
const AREA: [f64; 2] = [400.0, 330.0];
/// Space between this area and the legend.
const GAP: f64 = 22.0;
const LEGEND: f64 = 256.0;
const ROW: f64 = 21.0;
/// Room for a name in the legend, between its line and its score.
const NAME_WIDTH: f64 = LEGEND - 70.0 - 64.0;

/// The SVG attributes of the line of a tracker without a name.
pub const PALE: &str = "class=\"other\" stroke-width=\"1\"";

/// A tracker in the legend.
pub struct Entry<'a> {
    pub name: &'a str,
    /// The number beside it.
    pub score: f64,
    /// The line style; `None` for a tracker that is only counted.
    pub style: Option<LineStyle>,
}

/// A plot of shares, 0 to 1, without its lines.
pub struct Chart<'a> {
    pub title: &'a str,
    pub x_label: &'a str,
    /// Label of the shares.
    pub y_label: &'a str,
    /// Label of the scores, in the head of the legend.
    pub score_label: &'a str,
    /// The end of the x axis, which begins at 0.
    pub last: f64,
    /// Labelled positions on the x axis.
    pub ticks: &'a [f64],
    /// The trackers by rank.
    pub entries: Vec<Entry<'a>>,
}

impl Chart<'_> {
    /// Draws heading, axes and legend, and returns the axes.
    pub fn draw(&self, svg: &mut Svg) -> (Axis, Axis) {
        svg.text([LEFT, 28.0], 16.0, "ink", Anchor::Start, self.title);
        let x = Axis { values: [0.0, self.last], pixels: [LEFT, LEFT + AREA[0]] };
        let y = Axis { values: [0.0, 1.0], pixels: [TOP + self.height(), TOP] };
        self.axes(svg, x, y);
        self.legend(svg, LEFT + AREA[0] + GAP);
        (x, y)
    }

    pub fn size(&self) -> [f64; 2] {
        [LEFT + AREA[0] + GAP + LEGEND, TOP + self.height() + BOTTOM]
    }

    /// The height of the area with the lines: a long legend increases it.
    fn height(&self) -> f64 {
        let named = self.entries.iter().filter(|entry| entry.style.is_some()).count();
        let others = usize::from(named < self.entries.len());
        AREA[1].max(ROW * (named + others + 1) as f64)
    }

    fn axes(&self, svg: &mut Svg, x: Axis, y: Axis) {
        let [bottom, top] = y.pixels;
        let [left, right] = x.pixels;
        for tick in 0..=5 {
            y.grid_line(svg, f64::from(tick) / 5.0, x.pixels, 12.0);
        }
        for &value in self.ticks {
            let (at, label) = (x.at(value), value.to_string());
            svg.line("grid", [at, bottom], [at, top]);
            svg.text([at, bottom + 18.0], 12.0, "soft", Anchor::Middle, &label);
        }
        svg.line("axis", [left, bottom], [right, bottom]);
        svg.text([(left + right) / 2.0, bottom + 40.0], 13.0, "soft", Anchor::Middle, self.x_label);
        svg.put(format_args!(
            "<text class=\"soft\" font-size=\"13\" text-anchor=\"middle\" \
             transform=\"translate(16 {:.1}) rotate(-90)\">{}</text>",
            (top + bottom) / 2.0,
            escape(self.y_label)
        ));
    }

    fn legend(&self, svg: &mut Svg, left: f64) {
        let (mut y, right) = (TOP + 6.0, left + LEGEND - 8.0);
        let sample = |y: f64| [[left + 28.0, y - 4.5], [left + 62.0, y - 4.5]];
        svg.text([left, y], 12.0, "soft", Anchor::Start, "rank");
        svg.text([right, y], 12.0, "soft", Anchor::End, self.score_label);
        for (k, entry) in self.entries.iter().enumerate() {
            let Some(style) = entry.style else { continue };
            y += ROW;
            if style.strong {
                svg.rect("chosen", [left - 4.0, y - 15.0], [LEGEND, ROW - 1.0]);
            }
            svg.text([left + 20.0, y], 13.0, "soft", Anchor::End, &(k + 1).to_string());
            svg.polyline(&style.line(), &sample(y), entry.name);
            svg.name([left + 70.0, y], 13.0, NAME_WIDTH, entry.name);
            svg.text([right, y], 13.0, "ink", Anchor::End, &format!("[{:.3}]", entry.score));
        }
        let others = self.entries.iter().filter(|entry| entry.style.is_none()).count();
        if others > 0 {
            y += ROW;
            svg.polyline(PALE, &sample(y), "");
            svg.text([left + 70.0, y], 12.0, "soft", Anchor::Start, &format!("{others} more"));
        }
    }
}
