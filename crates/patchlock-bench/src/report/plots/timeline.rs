//! Plots overlap over time on one target: a line with its range over seeds for the tracker that the
//! report is about, with a strip of its status where that is known, and a coloured strip for each
//! named tracker.

use std::fmt::Write;
use std::ops::Range;

use minijinja::{Value, context};
use patchlock::Status;

use super::{Axis, Plot, drawn, points, round_step};
use crate::Error;
use crate::report::palette::{self, LineStyle};
use crate::report::svg::width;

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

/// The plot of some trackers, the first of which is drawn as a line. `failures` are the ranges of
/// frames in which it has lost the target; `name` is that of the plot's files.
///
/// # Errors
/// [`Error::Picture`], which is a bug.
pub fn plot(
    name: String,
    title: String,
    tracks: &[Track],
    failures: &[Range<usize>],
) -> Result<Plot, Error> {
    let first = &tracks[0];
    let statuses = first.statuses.as_ref();
    let (right, bottom) = (LEFT + WIDTH, TOP + CHART);
    let strips = bottom + statuses.map_or(0.0, |_| STATUS) + 14.0;
    let frames = first.mean.len();
    let x = Axis { values: [0.0, frames.max(1) as f64], pixels: [LEFT, right] };
    let y = Axis { values: [0.0, 1.0], pixels: [bottom, TOP] };
    let line = |run: &[(f64, f64)]| points(run.iter().map(|&(f, v)| [x.at(f), y.at(v)]));
    let level = |values: &[f64]| palette::level(values.iter().sum::<f64>() / values.len() as f64);
    let strip = |track: &Track| {
        let levels = bars(x, palette::LEVEL_COUNT, &track.mean, level);
        context! { name => track.name, auc => format!("{:.3}", track.auc), levels }
    };
    let class = |statuses: &[Status]| middle(statuses).map_or(0, |status| status as usize);
    let values = context! {
        left => LEFT, right, top => TOP, bottom, x => x.function(), y => y.function(),
        strips, strip => STRIP, title => &title,
        failures => failures.iter().map(|lost| (lost.start, lost.end)).collect::<Vec<_>>(),
        look => first.style.line_with_width(1.7),
        fill => first.style.fill(),
        runs => runs(&first.mean, MAX_POINTS).iter().map(|run| line(run)).collect::<Vec<_>>(),
        band => first.range.as_ref().map(|range| band(range, line)),
        status_key => status_key(right - KEY),
        statuses => statuses.map(|known| bars(x, palette::STATUS_COUNT, known, class)),
        tracks => tracks.iter().map(strip).collect::<Vec<_>>(),
        ticks => (0..frames).step_by(round_step(frames as f64 / 8.0)).collect::<Vec<_>>(),
    };
    let body = drawn(include_str!("timeline.xml"), values)?;
    let size = [right + RIGHT, strips + STRIP * tracks.len() as f64 + 28.0];
    Ok(Plot { name, title, table: table(tracks), body, size, head: HEAD })
}

fn table(tracks: &[Track]) -> Vec<Vec<String>> {
    let names = tracks.iter().map(|track| track.name.to_string());
    let mut table = vec![["frame".to_string()].into_iter().chain(names).collect::<Vec<_>>()];
    let statuses = tracks[0].statuses.as_ref();
    table[0].extend(statuses.map(|_| format!("status of {}", tracks[0].name)));
    for frame in 0..tracks[0].mean.len() {
        let cell = |track: &Track| match track.mean.get(frame).copied().flatten() {
            Some(overlap) => format!("{overlap:.4}"),
            None => String::new(),
        };
        let status = statuses.map(|statuses| statuses.get(frame).copied().flatten());
        let status = status.map(|status| status.map_or_else(String::new, |s| s.to_string()));
        let overlaps = tracks.iter().map(cell);
        table.push([frame.to_string()].into_iter().chain(overlaps).chain(status).collect());
    }
    table
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

/// The areas between minimum and maximum over seeds.
fn band(range: &[Option<[f64; 2]>], line: impl Fn(&[(f64, f64)]) -> String) -> Vec<String> {
    let part =
        |k: usize| runs(&range.iter().map(|r| r.map(|r| r[k])).collect::<Vec<_>>(), MAX_POINTS);
    let (low, high) = (part(0), part(1));
    let area = |(low, high): (&Vec<_>, &Vec<_>)| {
        line(high) + &line(&low.iter().rev().copied().collect::<Vec<_>>())
    };
    low.iter().zip(&high).map(area).collect()
}

/// The legend of the statuses, which ends at `right`.
fn status_key(mut right: f64) -> Vec<Value> {
    let entry = |(class, name): (usize, &&str)| {
        let left = right - width(name, 11.5) - 22.0;
        let entry = context! { class, name => *name, left, right };
        right = left - 10.0;
        entry
    };
    Status::NAMES.iter().enumerate().rev().map(entry).collect()
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

/// The frames of each of `count` classes as the path of a thick line.
fn bars<T: Copy>(
    x: Axis,
    count: usize,
    values: &[Option<T>],
    class: impl Fn(&[T]) -> usize,
) -> Vec<String> {
    let mut paths = vec![String::new(); count];
    for (class, frames) in class_runs(values, class) {
        let (from, to) = (x.at(frames.start as f64), x.at(frames.end as f64));
        let _ = write!(paths[class], "M{from:.1} 0H{to:.1}");
    }
    paths
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
        let plot = plot("f".into(), "t".into(), &[track], &[0..1, 2..3]).unwrap();
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
        let plot = plot("f".into(), "t".into(), &[track], &[]).unwrap();
        let svg = plot.svg();
        assert_eq!(plot.csv(), "frame,a,status of a\n0,1.0000,tracked\n1,,lost\n2,0.0000,lost\n");
        assert!(svg.contains(">status</text>") && svg.contains(">uncertain</text>"));
        assert_eq!(svg.matches("class=\"s1\"").count(), 1, "only in the legend");
        // The second and third of three frames are the right two thirds of the strip.
        let lost = "stroke-width=\"10\" transform=\"translate(0 140.0)\" d=\"M349.3 0H776.0\"";
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
