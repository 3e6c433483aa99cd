//! Plots accuracy against speed: one labelled point per tracker.

use super::{Axis, Plot};
use crate::report::palette::LineStyle;
use crate::report::svg::{Anchor, Svg, shorten, width};

const SIZE: [f64; 2] = [716.0, 436.0];
const LEFT: f64 = 58.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 54.0;
const BOTTOM: f64 = 52.0;
const FONT_SIZE: f64 = 12.5;
const NAME_LETTERS: usize = 40;
const RADIUS: f64 = 5.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Point<'a> {
    pub name: &'a str,
    /// Frames per second, greater than 0.
    pub fps: f64,
    pub auc: f64,
    pub style: LineStyle,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Speed<'a> {
    pub title: String,
    /// The trackers with known times, best first.
    pub points: Vec<Point<'a>>,
}

/// Left, top, right, bottom.
type Area = [f64; 4];

impl Speed<'_> {
    pub fn plot(self) -> Plot {
        let mut svg = Svg::default();
        svg.text([LEFT, 28.0], 16.0, "ink", Anchor::Start, &self.title);
        let (x, y) = self.axes(&mut svg);
        let position = |point: &Point| [x.at(point.fps.log10()), y.at(point.auc)];
        let mut taken: Vec<Area> = self.points.iter().map(|p| around(position(p))).collect();
        for point in &self.points {
            let [px, py] = position(point);
            svg.put(format_args!(
                "<circle class=\"{}\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"{RADIUS}\"/>",
                point.style.fill()
            ));
            let name = shorten(point.name, NAME_LETTERS);
            let area = free_area([px, py], width(&name, FONT_SIZE), &taken);
            taken.push(area);
            svg.text([area[0], area[3] - 4.0], FONT_SIZE, "ink", Anchor::Start, &name);
        }
        let (name, table) = ("speed".to_string(), self.table());
        Plot { name, title: self.title, table, picture: svg, size: SIZE, head: 0.0 }
    }

    /// The speed axis in powers of ten, and the accuracy axis from 0 to a round number above all
    /// points.
    fn axes(&self, svg: &mut Svg) -> (Axis, Axis) {
        let logs = || self.points.iter().map(|point| point.fps.log10());
        let low = logs().fold(f64::INFINITY, f64::min).floor();
        let high = logs().fold(f64::NEG_INFINITY, f64::max).ceil().max(low + 1.0);
        let most = self.points.iter().map(|point| point.auc).fold(0.0, f64::max);
        let top = ((most + 0.05) * 5.0).ceil().min(5.0) / 5.0;
        let [right, bottom] = [SIZE[0] - RIGHT, SIZE[1] - BOTTOM];
        let x = Axis { values: [low, high], pixels: [LEFT, right] };
        let y = Axis { values: [0.0, top], pixels: [bottom, TOP] };
        for tick in 0..=(top * 5.0).round() as usize {
            y.grid_line(svg, tick as f64 / 5.0, x.pixels, 12.0);
        }
        for power in low as i32..=high as i32 {
            for times in 1..10 {
                let value = f64::from(times) * 10_f64.powi(power);
                let at = x.at(value.log10());
                if at > right + 0.5 {
                    break;
                }
                // Every number has a mark, and 1, 2 and 5 have a line and a label.
                let labelled = matches!(times, 1 | 2 | 5);
                let end = if labelled { TOP } else { bottom + 5.0 };
                svg.line(if labelled { "grid" } else { "axis" }, [at, bottom], [at, end]);
                if labelled {
                    svg.line("axis", [at, bottom], [at, bottom + 5.0]);
                    let label = format!("{}", (value * 1e6).round() / 1e6);
                    svg.text([at, bottom + 18.0], 12.0, "soft", Anchor::Middle, &label);
                }
            }
        }
        svg.line("axis", [LEFT, bottom], [right, bottom]);
        let middle = (LEFT + right) / 2.0;
        svg.text([middle, bottom + 40.0], 13.0, "soft", Anchor::Middle, "frames per second");
        svg.text([LEFT, TOP - 8.0], 12.0, "soft", Anchor::Middle, "AUC");
        (x, y)
    }

    fn table(&self) -> Vec<Vec<String>> {
        let row =
            |p: &Point| vec![p.name.to_string(), format!("{:.3}", p.fps), format!("{:.6}", p.auc)];
        let head = ["tracker", "fps", "auc"].map(str::to_string).to_vec();
        [head].into_iter().chain(self.points.iter().map(row)).collect()
    }
}

/// The area that a point covers.
fn around([x, y]: [f64; 2]) -> Area {
    [x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS]
}

/// The position of a label: right of its point, left, above, below, then the same further away; the
/// first that is inside the plot and free.
fn free_area([x, y]: [f64; 2], wide: f64, taken: &[Area]) -> Area {
    let high = FONT_SIZE + 3.0;
    let beside =
        |left: f64, middle: f64| [left, middle - high / 2.0, left + wide, middle + high / 2.0];
    let mut candidates = Vec::new();
    for far in 0..4 {
        let step = high * f64::from(far);
        let (right, left) = (x + RADIUS + 5.0, x - RADIUS - 5.0 - wide);
        candidates.extend([beside(right, y - step), beside(right, y + step)]);
        candidates.extend([beside(left, y - step), beside(left, y + step)]);
        let (above, below) =
            (y - RADIUS - high / 2.0 - 2.0 - step, y + RADIUS + high / 2.0 + 2.0 + step);
        candidates.extend([beside(x - wide / 2.0, above), beside(x - wide / 2.0, below)]);
    }
    let inside =
        |a: &Area| a[0] >= LEFT && a[1] >= TOP && a[2] <= SIZE[0] - 4.0 && a[3] <= SIZE[1] - BOTTOM;
    let is_free =
        |a: &Area| !taken.iter().any(|b| a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]);
    candidates.iter().find(|area| inside(area) && is_free(area)).copied().unwrap_or(candidates[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_close_points_do_not_overlap() {
        let names: Vec<String> = (0..12).map(|k| format!("tracker {k}")).collect();
        let points = names.iter().enumerate().map(|(k, name)| Point {
            name,
            fps: 20.0 + k as f64,
            auc: 0.5 + 0.002 * k as f64,
            style: LineStyle::FIRST,
        });
        let plot = Speed { title: "t".into(), points: points.collect() }.plot();
        let mut taken = Vec::new();
        for k in 0..12 {
            let area = free_area([300.0 + f64::from(k), 200.0], 70.0, &taken);
            let apart =
                |b: &Area| area[2] <= b[0] || b[2] <= area[0] || area[3] <= b[1] || b[3] <= area[1];
            assert!(taken.iter().all(apart), "label {k}");
            taken.push(area);
        }
        assert!(plot.svg().contains(">tracker 11</text>"));
        assert_eq!(plot.table[1], ["tracker 0", "20.000", "0.500000"]);
    }

    #[test]
    fn a_single_speed_still_has_an_axis() {
        let point = Point { name: "a", fps: 10.0, auc: 0.4, style: LineStyle::FIRST };
        let svg = Speed { title: "t".into(), points: vec![point] }.plot().svg();
        for label in [">10</text>", ">20</text>", ">50</text>", ">100</text>"] {
            assert!(svg.contains(label), "{label}");
        }
        assert!(!svg.contains(">200</text>") && !svg.contains("NaN"));
    }
}
