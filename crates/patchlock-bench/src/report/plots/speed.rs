//! Plots accuracy against speed: one labelled point per tracker.

use minijinja::context;

use super::{Axis, Plot, drawn};
use crate::Error;
use crate::report::palette::LineStyle;
use crate::report::svg::{shorten, width};

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

/// Left, top, right, bottom.
type Area = [f64; 4];

/// The plot of the trackers with known times, best first. The speed axis is in powers of ten, and
/// the accuracy axis goes from 0 to a round number above all points.
///
/// # Errors
/// [`Error::Picture`], which is a bug.
pub fn plot(title: String, points: &[Point]) -> Result<Plot, Error> {
    let logs = || points.iter().map(|point| point.fps.log10());
    let low = logs().fold(f64::INFINITY, f64::min).floor();
    let high = logs().fold(f64::NEG_INFINITY, f64::max).ceil().max(low + 1.0);
    let most = points.iter().map(|point| point.auc).fold(0.0, f64::max);
    let fifths = ((most + 0.05) * 5.0).ceil().min(5.0);
    let [right, bottom] = [SIZE[0] - RIGHT, SIZE[1] - BOTTOM];
    let x = Axis { values: [low, high], pixels: [LEFT, right] };
    let y = Axis { values: [0.0, fifths / 5.0], pixels: [bottom, TOP] };
    // Every number has a mark, and 1, 2 and 5 have a line and a label.
    let ticks = (low as i32..=high as i32).flat_map(|power| {
        (1..10).map(move |times| {
            let value = f64::from(times) * 10_f64.powi(power);
            let label = matches!(times, 1 | 2 | 5).then(|| (value * 1e6).round() / 1e6);
            (value.log10(), label.map(|label| label.to_string()))
        })
    });
    let ticks = ticks.filter(|(log, _)| x.at(*log) <= right + 0.5);
    let ticks: Vec<_> = ticks.map(|(log, label)| context! { log, label }).collect();
    let position = |point: &Point| [x.at(point.fps.log10()), y.at(point.auc)];
    let mut taken: Vec<Area> = points.iter().map(|p| around(position(p))).collect();
    let labelled = |point: &Point| {
        let ([x, y], name) = (position(point), shorten(point.name, NAME_LETTERS));
        let area = free_area([x, y], width(&name, FONT_SIZE), &taken);
        taken.push(area);
        context! { x, y, name, fill => point.style.fill(), left => area[0], bottom => area[3] }
    };
    let labelled: Vec<_> = points.iter().map(labelled).collect();
    let values = context! {
        left => LEFT, right, top => TOP, bottom, x => x.function(), y => y.function(),
        radius => RADIUS, font_size => FONT_SIZE, title => &title, ticks, points => labelled,
        shares => (0..=fifths as u32).map(|tick| f64::from(tick) / 5.0).collect::<Vec<_>>(),
    };
    let body = drawn(include_str!("speed.xml"), values)?;
    let row =
        |p: &Point| vec![p.name.to_string(), format!("{:.3}", p.fps), format!("{:.6}", p.auc)];
    let head = ["tracker", "fps", "auc"].map(str::to_string).to_vec();
    let table = [head].into_iter().chain(points.iter().map(row)).collect();
    Ok(Plot { name: "speed".to_string(), title, table, body, size: SIZE, head: 0.0 })
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
        let all = names.iter().enumerate().map(|(k, name)| Point {
            name,
            fps: 20.0 + k as f64,
            auc: 0.5 + 0.002 * k as f64,
            style: LineStyle::FIRST,
        });
        let plot = plot("t".into(), &all.collect::<Vec<_>>()).unwrap();
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
        let svg = plot("t".into(), &[point]).unwrap().svg();
        for label in [">10</text>", ">20</text>", ">50</text>", ">100</text>"] {
            assert!(svg.contains(label), "{label}");
        }
        assert!(!svg.contains(">200</text>") && !svg.contains("NaN"));
    }
}
