//! Renders the HTML page from the parts of the report.

use std::ops::Range;

use minijinja::value::Serde;
use minijinja::{Environment, context};
use patchlock::{BoundingBox, Status};
use serde::Serialize;

use super::comparison::{ComparedTracker, Comparison};
use super::failures::{self, MIN_FRAMES};
use super::palette::{self, Theme};
use super::plots::Plot;
use super::plots::timeline::{self, Track, middle};
use super::{Figures, Options, file_name, rows};
use crate::Error;
use crate::compare::{DRAWS, MIN_TARGETS};
use crate::dataset::{Dataset, OTB_ATTRIBUTES, Sequence};
use crate::metrics::Curves;
use crate::protocol::{HIT_OVERLAP, LOST_OVERLAP};
use crate::score::{Pass, Scoreboard, TargetScore};
use patchlock_track::names;

/// After more unreadable frames than this, no further thumbnails are attempted.
const MAX_FAULTS: usize = 5;

/// The row of one target: overlap over time, and failures.
#[derive(Serialize)]
pub struct SequenceRow {
    name: String,
    attributes: Vec<String>,
    auc: String,
    dp20: String,
    lost: usize,
    frames: usize,
    thumbnails: Vec<Thumbnail>,
    has_status: bool,
    /// Overlap over time.
    pub plot: Plot,
}

#[derive(Serialize)]
struct Thumbnail {
    frame: usize,
    what: String,
    svg: String,
}

/// The rows of the sequences, and the errors of frames that could not be read.
pub fn sequences(
    comparison: &Comparison,
    truth: &Dataset,
    options: &Options,
) -> Result<(Vec<SequenceRow>, Vec<String>), Error> {
    let mut faults = Vec::new();
    let row = |(index, name): (usize, &&str)| {
        let sequence = truth.sequences.iter().find(|sequence| sequence.name == **name)?;
        Some(sequence_row(comparison, sequence, index, options, &mut faults))
    };
    let rows = comparison.targets.iter().enumerate().filter_map(row).collect::<Result<_, _>>()?;
    Ok((rows, faults))
}

fn sequence_row(
    comparison: &Comparison,
    sequence: &Sequence,
    index: usize,
    options: &Options,
    faults: &mut Vec<String>,
) -> Result<SequenceRow, Error> {
    let about = comparison.about();
    let others = comparison.trackers.iter().enumerate().filter(|(rank, tracker)| {
        *rank != comparison.about && (*rank < options.best || tracker.style.strong)
    });
    let named: Vec<&ComparedTracker> =
        [about].into_iter().chain(others.map(|(_, tracker)| tracker)).collect();
    let tracks: Vec<Track> =
        named.iter().map(|tracker| track(tracker, tracker.targets[index])).collect();
    let lost = failures::failures(&tracks[0].mean);
    let thumbnails = thumbnails(sequence, about, index, &tracks[0].mean, &lost, options, faults);
    let has_status = tracks[0].statuses.is_some();
    let file = format!("overlap_{}", file_name(&sequence.name));
    let plot = timeline::plot(file, sequence.name.clone(), &tracks, &lost)?;
    let target = about.targets[index];
    Ok(SequenceRow {
        name: sequence.name.clone(),
        attributes: sequence.attributes.clone(),
        auc: format!("{:.3}", about.mean(target, Curves::auc)),
        dp20: format!("{:.3}", about.mean(target, Curves::dp20)),
        lost: lost.iter().map(Range::len).sum(),
        frames: sequence.truth.len(),
        thumbnails,
        has_status,
        plot,
    })
}

/// The passes over a target from its first frame, one per seed that counts.
fn passes<'a>(tracker: &ComparedTracker, target: &'a TargetScore) -> Vec<&'a Pass> {
    let seeds = target.seeds.iter().filter(|seed| tracker.seeds.contains(&seed.seed));
    seeds.filter_map(|seed| seed.passes.iter().find(|pass| pass.first == 0)).collect()
}

/// Mean, minimum and maximum of the overlap over seeds, frame by frame.
fn track<'a>(tracker: &ComparedTracker<'a>, target: &TargetScore) -> Track<'a> {
    let passes = passes(tracker, target);
    let frames = passes.first().map_or(0, |pass| pass.frames.overlaps.len());
    let at = |frame: usize| -> Vec<f64> {
        passes
            .iter()
            .filter_map(|pass| pass.frames.overlaps.get(frame).copied().flatten())
            .collect()
    };
    let mean = |values: Vec<f64>| {
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let ends = |values: Vec<f64>| {
        values.iter().map(|&value| [value; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    };
    Track {
        name: tracker.name,
        style: tracker.style,
        mean: (0..frames).map(|frame| mean(at(frame))).collect(),
        range: (passes.len() > 1).then(|| (0..frames).map(|frame| ends(at(frame))).collect()),
        auc: tracker.mean(target, Curves::auc),
        statuses: statuses(&passes, frames),
    }
}

/// The status of each frame, the middle one over seeds (the worse of two); `None` unless all passes
/// have statuses.
fn statuses(passes: &[&Pass], frames: usize) -> Option<Vec<Option<Status>>> {
    let known: Option<Vec<&[Status]>> =
        passes.iter().map(|pass| pass.statuses.as_deref()).collect();
    let known = known.filter(|known| !known.is_empty())?;
    let at = |frame: usize| -> Vec<Status> {
        known.iter().filter_map(|statuses| statuses.get(frame).copied()).collect()
    };
    Some((0..frames).map(|frame| middle(&at(frame))).collect())
}

fn thumbnails(
    sequence: &Sequence,
    about: &ComparedTracker,
    index: usize,
    overlaps: &[Option<f64>],
    lost: &[Range<usize>],
    options: &Options,
    faults: &mut Vec<String>,
) -> Vec<Thumbnail> {
    if sequence.frames.is_empty() || faults.len() > MAX_FAULTS {
        return Vec::new();
    }
    let mut thumbnails = Vec::new();
    for (frame, what) in failures::captioned_frames(overlaps, lost, options.thumbnails) {
        let passes = passes(about, about.targets[index]);
        let boxes = passes.iter().filter_map(|pass| pass.boxes.get(frame).copied().flatten());
        let boxes: Vec<BoundingBox> = boxes.collect();
        match failures::thumbnail(sequence, frame, &boxes) {
            Ok(svg) => thumbnails.push(Thumbnail { frame, what, svg }),
            Err(reason) => faults.push(reason),
        }
    }
    thumbnails
}

/// Notes on what was left out and on the trackers.
fn notes(board: &Scoreboard, comparison: &Comparison, faults: &[String]) -> Vec<String> {
    let refused = board.refused.iter().map(|tracker| {
        format!("{} is left out: {}", tracker.name, names::some_of(&tracker.reasons))
    });
    let mut notes: Vec<String> = refused.collect();
    notes.extend(comparison.notes.iter().cloned());
    // No tracker matches every true box exactly.
    let exact =
        comparison.trackers.iter().filter(|tracker| tracker.overall.mean_overlap.mean == 1.0);
    notes.extend(exact.map(|tracker| {
        format!("{}: every box equals the truth: is this the truth itself?", tracker.name)
    }));
    let shared = board.notes().into_iter();
    notes.extend(shared.map(|(note, trackers)| format!("{}: {note}", trackers.join(", "))));
    notes.extend(faults.iter().map(|fault| format!("A frame cannot be shown: {fault}")));
    notes
}

/// Renders the template. `faults` are the errors of frames that could not be read.
///
/// # Errors
/// [`Error::Picture`] if the template and the values do not match, which is a bug.
pub fn render(
    board: &Scoreboard,
    truth: &Dataset,
    comparison: &Comparison,
    figures: &Figures,
    faults: &[String],
) -> Result<String, Error> {
    let mut environment = Environment::new();
    let broken = |error: minijinja::Error| Error::Picture { reason: error.to_string() };
    environment.add_template("page.html", include_str!("page.html")).map_err(broken)?;
    let (about, sequences) = (comparison.about(), &figures.sequences);
    let values = context! {
        style => include_str!("page.css"),
        light => palette::style(Theme::Light),
        dark => palette::style(Theme::Dark),
        script => include_str!("page.js"),
        version => env!("CARGO_PKG_VERSION"),
        kind => comparison.scheme.title(),
        layout => truth.layout.to_string(),
        targets => comparison.targets.len(),
        size => comparison.size(),
        frames => sequences.iter().map(|row| row.frames).sum::<usize>(),
        about => about.name,
        about_rank => comparison.about + 1,
        about_auc => format!("{:.3}", about.overall.auc.mean),
        about_dp20 => format!("{:.3}", about.overall.dp20.mean),
        about_seeds => about.seeds.len(),
        notes => notes(board, comparison, faults),
        overall => Serde(&figures.overall),
        trackers => Serde(rows::accuracy(comparison)),
        said => Serde(rows::said(comparison)),
        reliability => Serde(&figures.reliability),
        pairs => Serde(&figures.pairs),
        draws => DRAWS,
        min_targets => MIN_TARGETS,
        attributes => Serde(&figures.attributes),
        attribute_names => Serde(OTB_ATTRIBUTES),
        sequences => Serde(sequences),
        has_thumbnails => sequences.iter().any(|row| !row.thumbnails.is_empty()),
        has_status => sequences.iter().any(|row| row.has_status),
        lost => LOST_OVERLAP,
        hit => HIT_OVERLAP,
        shortest => MIN_FRAMES,
    };
    let page = environment.get_template("page.html").and_then(|page| page.render(values));
    // Names may have control characters, which HTML forbids.
    let page = page.map_err(broken)?;
    Ok(page.replace(|c: char| c.is_control() && c != '\n', " "))
}
