//! Plots overlap over time on one target: a line with its range over seeds for the tracker that the
//! report is about, with a strip of its status where that is known, and a coloured strip for each
//! named tracker.

use std::fmt::Write;
use std::ops::Range;

use patchlock::Status;

use super::{Axis, Plot, round_step};
use crate::report::palette::{self, LineStyle};
use crate::report::svg::{Anchor, Svg, width};

const LEFT: f64 = 136.0;
const WIDTH: f64 = 640.0;
const RIGHT: f64 = 62.0;
const TOP: f64 = 46.0;
const HEAD: f64 = 34.0;
const CHART: f64 = 84.0;
const STRIP: f64 = 17.0;
/// Width of the legend of overlaps, with the space to its left.
const KEY: f64 = 196.0;
/// Height of the strip of the status, with the space above it.
const STATUS: f64 = 18.0;
/// Longer sequences are binned to at most this number of means.
const MAX_POINTS: usize = 640;

/// The overlaps of one tracker on the target.
#[derive(Debug, Clone, PartialEq)]
pub struct Track<'a> {
    pub name: &'a str,
    pub style: LineStyle,
    /// The overlap in each frame, averaged over seeds; `None` where the frame does not count.
    pub mean: Vec<Option<f64>>,
    /// Minimum and maximum over seeds in each frame, if there are several seeds.
    pub range: Option<Vec<Option<[f64; 2]>>>,
    pub auc: f64,
    /// The status in each frame, if it is known.
    pub statuses: Option<Vec<Option<Status>>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Timeline<'a> {
    /// Name of the plot's files, without extension.
    pub file: String,
    pub title: String,
    /// The trackers; the first is drawn as a line.
    pub tracks: Vec<Track<'a>>,
    /// Ranges of frames in which the first tracker has lost the target.
    pub failures: &'a [Range<usize>],
}

impl Timeline<'_> {
    pub fn plot(self) -> Plot {
        let statuses = self.tracks.first().and_then(|track| track.statuses.as_ref());
        let status_height = if statuses.is_some() { STATUS } else { 0.0 };
        let strips = status_height + STRIP * self.tracks.len() as f64;
        let size = [LEFT + WIDTH + RIGHT, TOP + CHART + 14.0 + strips + 28.0];
        let mut svg = Svg::default();
        svg.text([12.0, 24.0], 15.0, "ink", Anchor::Start, &self.title);
        key(&mut svg, [LEFT + WIDTH, 24.0]);
        let frames = self.tracks.first().map_or(0, |track| track.mean.len());
        let x = Axis { values: [0.0, frames.max(1) as f64], pixels: [LEFT, LEFT + WIDTH] };
        if let Some(first) = self.tracks.first() {
            self.chart(&mut svg, x, first);
        }
        if let Some(statuses) = statuses {
            status_key(&mut svg, [LEFT + WIDTH - KEY, 24.0]);
            status_strip(&mut svg, x, TOP + CHART, statuses);
        }
        let mut y = TOP + CHART + status_height;
        let right = LEFT + WIDTH + RIGHT - 12.0;
        svg.text([right, y + 8.0], 11.0, "soft", Anchor::End, "AUC");
        y += 14.0;
        for track in &self.tracks {
            strip(&mut svg, x, y, track);
            y += STRIP;
        }
        ticks(&mut svg, x, y + 14.0, frames);
        let table = self.table();
        Plot { name: self.file, title: self.title, table, picture: svg, size, head: HEAD }
    }

    fn chart(&self, svg: &mut Svg, x: Axis, track: &Track) {
        let y = Axis { values: [0.0, 1.0], pixels: [TOP + CHART, TOP] };
        for failure in self.failures {
            let (from, to) = (x.at(failure.start as f64), x.at(failure.end as f64));
            svg.rect("failed", [from, TOP], [(to - from).max(1.0), CHART]);
        }
        for value in [0.0, 0.5, 1.0] {
            y.grid_line(svg, value, x.pixels, 11.0);
        }
        svg.text([12.0, y.at(0.5) + 4.0], 12.0, "soft", Anchor::Start, "overlap");
        if let Some(range) = &track.range {
            band(svg, x, y, track.style, range);
        }
        for run in runs(&track.mean, MAX_POINTS) {
            let points: Vec<[f64; 2]> =
                run.iter().map(|&(frame, v)| [x.at(frame), y.at(v)]).collect();
            svg.polyline(&track.style.line_with_width(1.7), &points, track.name);
        }
    }

    fn table(&self) -> Vec<Vec<String>> {
        let names = self.tracks.iter().map(|track| track.name.to_string());
        let mut table = vec![["frame".to_string()].into_iter().chain(names).collect::<Vec<_>>()];
        let statuses = self.tracks.first().and_then(|track| track.statuses.as_ref());
        table[0].extend(statuses.map(|_| format!("status of {}", self.tracks[0].name)));
        for frame in 0..self.tracks.first().map_or(0, |track| track.mean.len()) {
            let cell = |track: &Track| match track.mean.get(frame).copied().flatten() {
                Some(overlap) => format!("{overlap:.4}"),
                None => String::new(),
            };
            let status = statuses.map(|statuses| statuses.get(frame).copied().flatten());
            let status = status.map(|status| status.map_or_else(String::new, |s| s.to_string()));
            let overlaps = self.tracks.iter().map(cell);
            table.push([frame.to_string()].into_iter().chain(overlaps).chain(status).collect());
        }
        table
    }
}

/// The legend of the strip colours, right-aligned in the heading, since the page has a legend of
/// its own.
fn key(svg: &mut Svg, [right, y]: [f64; 2]) {
    let (wide, left) = (18.0, right - 18.0 * (palette::LEVEL_COUNT + 1) as f64);
    svg.text([left - 8.0, y], 11.5, "soft", Anchor::End, "overlap 0");
    for level in 0..palette::LEVEL_COUNT {
        let (x, middle) = (left + wide * level as f64, y - 4.0);
        svg.put(format_args!(
            "<path class=\"h{level}\" stroke-width=\"11\" d=\"M{x:.1} {middle:.1}h{wide}\"/>"
        ));
    }
    svg.text([right - 10.0, y], 11.5, "soft", Anchor::Start, "1");
}

/// Splits values into runs without gaps, binned to at most `most` points. Each point is the middle
/// of its bin and the mean of its values.
fn runs(values: &[Option<f64>], most: usize) -> Vec<Vec<(f64, f64)>> {
    let size = values.len().div_ceil(most).max(1);
    let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut open = false;
    for (k, bin) in values.chunks(size).enumerate() {
        let given: Vec<f64> = bin.iter().copied().flatten().collect();
        if given.is_empty() {
            open = false;
            continue;
        }
        if !open {
            runs.push(Vec::new());
            open = true;
        }
        let middle = (k * size) as f64 + bin.len() as f64 / 2.0;
        let mean = given.iter().sum::<f64>() / given.len() as f64;
        if let Some(run) = runs.last_mut() {
            run.push((middle, mean));
        }
    }
    runs
}

/// The area between minimum and maximum over seeds.
fn band(svg: &mut Svg, x: Axis, y: Axis, style: LineStyle, range: &[Option<[f64; 2]>]) {
    let part = |k: usize| -> Vec<Option<f64>> { range.iter().map(|r| r.map(|r| r[k])).collect() };
    for (low, high) in runs(&part(0), MAX_POINTS).iter().zip(&runs(&part(1), MAX_POINTS)) {
        let mut points = String::new();
        for (frame, value) in high.iter().chain(low.iter().rev()) {
            let _ = write!(points, "{:.1},{:.1} ", x.at(*frame), y.at(*value));
        }
        svg.put(format_args!(
            "<polygon class=\"band {}\" points=\"{}\"/>",
            style.fill(),
            points.trim_end()
        ));
    }
}

/// Draws the strip of a tracker: its name, overlaps as colours, and the AUC.
fn strip(svg: &mut Svg, x: Axis, top: f64, track: &Track) {
    let (middle, height) = (top + STRIP / 2.0, STRIP - 4.0);
    svg.name([12.0, middle + 4.0], 11.5, LEFT - 20.0, track.name);
    svg.rect("none", [LEFT, top + 2.0], [WIDTH, height]);
    let level = |values: &[f64]| palette::level(values.iter().sum::<f64>() / values.len() as f64);
    let runs = class_runs(&track.mean, level);
    bars(svg, x, middle, height, ('h', palette::LEVEL_COUNT), &runs);
    let auc = format!("{:.3}", track.auc);
    svg.text([LEFT + WIDTH + RIGHT - 12.0, middle + 4.0], 11.5, "ink", Anchor::End, &auc);
}

/// The legend of the statuses, right-aligned in the heading.
fn status_key(svg: &mut Svg, [right, y]: [f64; 2]) {
    let mut x = right;
    for (class, name) in Status::NAMES.iter().enumerate().rev() {
        svg.text([x, y], 11.5, "soft", Anchor::End, name);
        x -= width(name, 11.5) + 22.0;
        let (middle, wide) = (y - 4.0, 16.0);
        svg.put(format_args!(
            "<path class=\"s{class}\" stroke-width=\"11\" d=\"M{x:.1} {middle:.1}h{wide}\"/>"
        ));
        x -= 10.0;
    }
}

/// Draws the strip of the status below the chart that ends at `top`.
fn status_strip(svg: &mut Svg, x: Axis, top: f64, statuses: &[Option<Status>]) {
    let at = top + STATUS / 2.0 + 1.0;
    svg.text([12.0, at + 4.0], 11.5, "soft", Anchor::Start, "status");
    let class = |statuses: &[Status]| middle(statuses).map_or(0, |status| status as usize);
    let runs = class_runs(statuses, class);
    bars(svg, x, at, STATUS - 8.0, ('s', palette::STATUS_COUNT), &runs);
}

/// The middle one of some statuses, from tracked to lost; the worse of two. `None` without
/// statuses.
pub fn middle(statuses: &[Status]) -> Option<Status> {
    let up_to = |worst: Status| {
        statuses.iter().filter(|&&status| status as usize <= worst as usize).count()
    };
    let all = [Status::Tracked, Status::Uncertain, Status::Lost];
    all.into_iter().find(|&worst| up_to(worst) > statuses.len() / 2)
}

/// Draws ranges of frames as thick lines, each class in its colour: one path for each of the
/// `count` classes, which are named by a letter and their number.
fn bars(
    svg: &mut Svg,
    x: Axis,
    middle: f64,
    height: f64,
    (letter, count): (char, usize),
    runs: &[(usize, Range<usize>)],
) {
    let mut paths: Vec<String> = vec![String::new(); count];
    for (class, frames) in runs {
        let (from, to) = (x.at(frames.start as f64), x.at(frames.end as f64));
        let _ = write!(paths[*class], "M{from:.1} {middle:.1}H{to:.1}");
    }
    for (class, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
        svg.put(format_args!(
            "<path class=\"{letter}{class}\" stroke-width=\"{height}\" d=\"{path}\"/>"
        ));
    }
}

/// Runs of adjacent bins of the same class, as ranges of frames. `class` is given the values of a
/// bin, of which there is at least one.
fn class_runs<T: Copy>(
    values: &[Option<T>],
    class: impl Fn(&[T]) -> usize,
) -> Vec<(usize, Range<usize>)> {
    let size = values.len().div_ceil(MAX_POINTS).max(1);
    let mut all: Vec<(usize, Range<usize>)> = Vec::new();
    for (k, bin) in values.chunks(size).enumerate() {
        let given: Vec<T> = bin.iter().copied().flatten().collect();
        if given.is_empty() {
            continue;
        }
        let class = class(&given);
        let frames = k * size..k * size + bin.len();
        match all.last_mut() {
            Some((last, range)) if *last == class && range.end == frames.start => {
                range.end = frames.end
            }
            _ => all.push((class, frames)),
        }
    }
    all
}

/// Draws frame numbers at round steps.
fn ticks(svg: &mut Svg, x: Axis, y: f64, frames: usize) {
    for frame in (0..frames).step_by(round_step(frames as f64 / 8.0)) {
        svg.text([x.at(frame as f64), y], 11.0, "soft", Anchor::Middle, &frame.to_string());
    }
    svg.text([12.0, y], 11.0, "soft", Anchor::Start, "frame");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_break_the_line_and_long_tracks_are_averaged() {
        assert_eq!(
            runs(&[Some(1.0), Some(0.5), None, Some(0.2)], 10),
            [vec![(0.5, 1.0), (1.5, 0.5)], vec![(3.5, 0.2)]]
        );
        assert_eq!(
            runs(&[Some(1.0), Some(0.5), None, Some(0.2), Some(0.0)], 3),
            [vec![(1.0, 0.75), (3.0, 0.2), (4.5, 0.0)]]
        );
    }

    #[test]
    fn equal_levels_are_joined() {
        let values = [Some(0.9), Some(0.85), None, Some(0.9), Some(0.1), Some(0.0)];
        let level = |values: &[f64]| palette::level(values[0]);
        assert_eq!(class_runs(&values, level), [(4, 0..2), (4, 3..4), (0, 4..6)]);
    }

    #[test]
    fn the_table_has_one_row_per_frame_and_is_empty_without_truth() {
        let mean = vec![Some(1.0), None, Some(0.25)];
        let range = Some(vec![Some([0.9, 1.0]), None, Some([0.0, 0.5])]);
        let track =
            Track { name: "a", style: LineStyle::FIRST, mean, range, auc: 0.5, statuses: None };
        let plot = Timeline {
            file: "f".into(),
            title: "t".into(),
            tracks: vec![track],
            failures: &[0..1, 2..3],
        }
        .plot();
        assert_eq!(plot.csv(), "frame,a\n0,1.0000\n1,\n2,0.2500\n");
        assert!(
            plot.svg().matches("class=\"failed\"").count() == 2
                && plot.svg().contains("class=\"band f0\"")
        );
    }

    #[test]
    fn a_known_status_is_a_strip_and_a_column() {
        let statuses = [Status::Tracked, Status::Lost, Status::Lost].map(Some).to_vec();
        let (mean, statuses) = (vec![Some(1.0), None, Some(0.0)], Some(statuses));
        let track =
            Track { name: "a", style: LineStyle::FIRST, mean, range: None, auc: 0.5, statuses };
        let timeline =
            Timeline { file: "f".into(), title: "t".into(), tracks: vec![track], failures: &[] };
        let plot = timeline.plot();
        let svg = plot.svg();
        assert_eq!(plot.csv(), "frame,a,status of a\n0,1.0000,tracked\n1,,lost\n2,0.0000,lost\n");
        assert!(svg.contains(">status</text>") && svg.contains(">uncertain</text>"));
        assert_eq!(svg.matches("class=\"s1\"").count(), 1, "only in the legend");
        // The second and third of three frames are the right two thirds of the strip.
        let lost = "class=\"s2\" stroke-width=\"10\" d=\"M349.3 140.0H776.0\"";
        assert!(svg.contains(lost), "{svg}");
    }

    #[test]
    fn the_middle_status_is_the_worse_of_two() {
        use Status::{Lost, Tracked, Uncertain};
        assert_eq!(middle(&[Lost, Tracked, Tracked]), Some(Tracked));
        assert_eq!(middle(&[Lost, Tracked, Uncertain]), Some(Uncertain));
        assert_eq!(middle(&[Lost, Tracked]), Some(Lost));
        assert_eq!(middle(&[]), None);
    }
}
