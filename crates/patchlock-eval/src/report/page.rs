//! The page: what the parts of the report say, put into the template.

use std::ops::Range;

use minijinja::value::Serde;
use minijinja::{Environment, context};
use patchlock::BoundingBox;
use serde::Serialize;

use super::failures::{self, LOST, Moment, SHORTEST};
use super::field::{Entrant, Field};
use super::palette::{self, Ground};
use super::plots::Plot;
use super::plots::timeline::{Timeline, Track};
use super::{AttributePlots, Options, plain};
use crate::Error;
use crate::compare::{DRAWS, LEAST_TARGETS};
use crate::dataset::{Dataset, OTB_ATTRIBUTES, Sequence};
use crate::metrics::Curves;
use crate::score::{Measure, Pass, Scoreboard, TargetScore};

/// A sequence with more faults than this in its frames is not tried further.
const MOST_FAULTS: usize = 5;

/// Everything that the page shows.
pub struct Parts<'a> {
    /// All scores, for the notes.
    pub board: &'a Scoreboard,
    /// The truth.
    pub truth: &'a Dataset,
    /// The comparison.
    pub field: &'a Field<'a>,
    /// Plots over all targets.
    pub overall: &'a [Plot],
    /// Differences with their intervals.
    pub pairs: Option<&'a Plot>,
    /// Plots of each attribute.
    pub attributes: &'a [AttributePlots],
    /// The rows of the sequences.
    pub sequences: &'a [SequenceRow],
    /// Frames that could not be shown.
    pub faults: &'a [String],
}

/// One target: overlap over time, and where it fails.
pub struct SequenceRow {
    name: String,
    attributes: Vec<String>,
    auc: f64,
    dp20: f64,
    lost: usize,
    frames: usize,
    thumbnails: Vec<Thumbnail>,
    /// Overlap over time.
    pub plot: Plot,
}

#[derive(Serialize)]
struct Thumbnail {
    frame: usize,
    what: String,
    svg: String,
}

/// The rows of the sequences, and which frames could not be shown.
pub fn sequences(
    field: &Field,
    truth: &Dataset,
    options: &Options,
) -> (Vec<SequenceRow>, Vec<String>) {
    let mut faults = Vec::new();
    let row = |(place, name): (usize, &&str)| {
        let sequence = truth.sequences.iter().find(|sequence| sequence.name == **name)?;
        Some(sequence_row(field, sequence, place, options, &mut faults))
    };
    let rows = field.targets.iter().enumerate().filter_map(row).collect();
    (rows, faults)
}

fn sequence_row(
    field: &Field,
    sequence: &Sequence,
    place: usize,
    options: &Options,
    faults: &mut Vec<String>,
) -> SequenceRow {
    let about = field.about();
    let others = field.entrants.iter().enumerate().filter(|(rank, entrant)| {
        *rank != field.about && (*rank < options.best || field.is_shown(entrant))
    });
    let named: Vec<&Entrant> =
        [about].into_iter().chain(others.map(|(_, entrant)| entrant)).collect();
    let tracks: Vec<Track> =
        named.iter().map(|entrant| track(entrant, entrant.targets[place])).collect();
    let lost = failures::failures(&tracks[0].mean);
    let thumbnails = thumbnails(sequence, about, place, &tracks[0].mean, &lost, options, faults);
    let plot = Timeline {
        file: format!("overlap_{}", plain(&sequence.name)),
        title: sequence.name.clone(),
        tracks,
        failures: &lost,
    }
    .plot();
    let target = about.targets[place];
    SequenceRow {
        name: sequence.name.clone(),
        attributes: sequence.attributes.clone(),
        auc: about.mean(target, Curves::auc),
        dp20: about.mean(target, Curves::dp20),
        lost: lost.iter().map(Range::len).sum(),
        frames: sequence.truth.len(),
        thumbnails,
        plot,
    }
}

/// The passes over a target from its first frame and box, one a seed that counts.
fn passes<'a>(entrant: &Entrant, target: &'a TargetScore) -> Vec<&'a Pass> {
    let seeds = target.seeds.iter().filter(|seed| entrant.seeds.contains(&seed.seed));
    seeds.filter_map(|seed| seed.passes.iter().find(|pass| pass.first == 0)).collect()
}

/// Mean, least and most overlap over seeds, frame by frame.
fn track<'a>(entrant: &Entrant<'a>, target: &TargetScore) -> Track<'a> {
    let passes = passes(entrant, target);
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
        name: entrant.name,
        look: entrant.look,
        mean: (0..frames).map(|frame| mean(at(frame))).collect(),
        range: (passes.len() > 1).then(|| (0..frames).map(|frame| ends(at(frame))).collect()),
        auc: entrant.mean(target, Curves::auc),
    }
}

fn thumbnails(
    sequence: &Sequence,
    about: &Entrant,
    place: usize,
    overlaps: &[Option<f64>],
    lost: &[Range<usize>],
    options: &Options,
    faults: &mut Vec<String>,
) -> Vec<Thumbnail> {
    if sequence.frames.is_empty() || faults.len() > MOST_FAULTS {
        return Vec::new();
    }
    let mut thumbnails = Vec::new();
    for Moment { frame, what } in failures::moments(overlaps, lost, options.thumbnails) {
        let passes = passes(about, about.targets[place]);
        let boxes = passes.iter().filter_map(|pass| pass.boxes.get(frame).copied().flatten());
        let boxes: Vec<BoundingBox> = boxes.collect();
        match failures::thumbnail(sequence, frame, &boxes) {
            Ok(svg) => thumbnails.push(Thumbnail { frame, what, svg }),
            Err(reason) => faults.push(reason),
        }
    }
    thumbnails
}

#[derive(Serialize)]
struct TrackerRow<'a> {
    rank: usize,
    name: &'a str,
    about: bool,
    swatch: String,
    cells: Vec<Cell>,
}

/// A figure of the table: what it is sorted by, and what is shown.
#[derive(Serialize)]
struct Cell {
    value: Option<f64>,
    text: String,
    spread: Option<String>,
    best: bool,
}

fn tracker_rows<'a>(field: &'a Field) -> Vec<TrackerRow<'a>> {
    let cell = |measure: Option<Measure>, digits: usize| Cell {
        value: measure.map(|m| m.mean),
        text: measure.map_or("-".to_string(), |m| format!("{:.digits$}", m.mean)),
        spread: measure.and_then(|m| m.sd).map(|sd| format!("{sd:.digits$}")),
        best: false,
    };
    let row = |(rank, entrant): (usize, &'a Entrant)| {
        let all = &entrant.overall;
        let accuracy = [all.auc, all.dp20, all.success50, all.mean_overlap, all.norm_precision];
        let mut cells: Vec<Cell> = accuracy.into_iter().map(|m| cell(Some(m), 3)).collect();
        cells.push(cell(all.fps, 1));
        let seeds = entrant.seeds.len();
        cells.push(Cell {
            value: Some(seeds as f64),
            text: seeds.to_string(),
            spread: None,
            best: false,
        });
        let swatch =
            format!("<line {} x1=\"0\" x2=\"34\" y1=\"6\" y2=\"6\"/>", entrant.look.line());
        TrackerRow { rank: rank + 1, name: entrant.name, about: rank == field.about, swatch, cells }
    };
    let mut rows: Vec<TrackerRow> = field.entrants.iter().enumerate().map(row).collect();
    // All columns but the last one, the number of seeds, have a best value.
    for column in 0..rows.first().map_or(0, |row| row.cells.len() - 1) {
        let values = rows.iter().filter_map(|row| row.cells[column].value);
        let Some(best) = values.max_by(f64::total_cmp) else { continue };
        rows.iter_mut()
            .for_each(|row| row.cells[column].best = row.cells[column].value == Some(best));
    }
    rows
}

#[derive(Serialize)]
struct SequenceView<'a> {
    name: &'a str,
    attributes: &'a [String],
    auc: String,
    dp20: String,
    lost: usize,
    frames: usize,
    thumbnails: &'a [Thumbnail],
    picture: String,
}

impl<'a> From<&'a SequenceRow> for SequenceView<'a> {
    fn from(row: &'a SequenceRow) -> Self {
        Self {
            name: &row.name,
            attributes: &row.attributes,
            auc: format!("{:.3}", row.auc),
            dp20: format!("{:.3}", row.dp20),
            lost: row.lost,
            frames: row.frames,
            thumbnails: &row.thumbnails,
            picture: row.plot.inline(),
        }
    }
}

#[derive(Serialize)]
struct AttributeView<'a> {
    short: &'a str,
    pictures: Vec<String>,
}

/// What is left out, and what a reader should know of the trackers.
fn notes(parts: &Parts) -> Vec<String> {
    let refused = parts.board.refused.iter().map(|tracker| {
        format!("{} is left out: {}", tracker.name, crate::names::some_of(&tracker.reasons))
    });
    let mut notes: Vec<String> = refused.collect();
    notes.extend(parts.field.notes.iter().cloned());
    // No tracker is never off by anything.
    let exact =
        parts.field.entrants.iter().filter(|entrant| entrant.overall.mean_overlap.mean == 1.0);
    notes.extend(exact.map(|entrant| {
        format!("{}: every box is that of the truth: is this the truth itself?", entrant.name)
    }));
    notes.extend(shared_notes(parts.board));
    notes.extend(parts.faults.iter().map(|fault| format!("A frame is not shown: {fault}")));
    notes
}

/// What is to be said of trackers, once for all of whom it is true.
fn shared_notes(board: &Scoreboard) -> Vec<String> {
    let mut shared: Vec<(&str, Vec<&str>)> = Vec::new();
    for (note, name) in
        board.trackers.iter().flat_map(|t| t.notes.iter().map(|note| (note, &t.name)))
    {
        match shared.iter_mut().find(|(other, _)| other == note) {
            Some((_, names)) => names.push(name),
            None => shared.push((note, vec![name])),
        }
    }
    shared.iter().map(|(note, names)| format!("{}: {note}", names.join(", "))).collect()
}

/// Puts everything into the template.
///
/// # Errors
/// [`Error::Picture`] should the template not fit to the parts, which tests exclude.
pub fn render(parts: &Parts) -> Result<String, Error> {
    let mut environment = Environment::new();
    let broken = |error: minijinja::Error| Error::Picture { reason: error.to_string() };
    environment.add_template("page.html", include_str!("page.html")).map_err(broken)?;
    let (field, about) = (parts.field, parts.field.about());
    let attributes: Vec<AttributeView> = parts
        .attributes
        .iter()
        .map(|a| AttributeView {
            short: &a.short,
            pictures: a.plots.iter().map(Plot::inline).collect(),
        })
        .collect();
    let frames: usize = parts.sequences.iter().map(|row| row.frames).sum();
    let values = context! {
        style => include_str!("page.css"),
        light => palette::style(Ground::Light),
        dark => palette::style(Ground::Dark),
        script => include_str!("page.js"),
        version => env!("CARGO_PKG_VERSION"),
        kind => field.kind.name(),
        layout => parts.truth.layout.to_string(),
        targets => field.targets.len(),
        size => field.size(),
        frames => frames,
        about => about.name,
        about_rank => field.about + 1,
        about_auc => format!("{:.3}", about.overall.auc.mean),
        about_dp20 => format!("{:.3}", about.overall.dp20.mean),
        about_seeds => about.seeds.len(),
        notes => notes(parts),
        overall => parts.overall.iter().map(Plot::inline).collect::<Vec<_>>(),
        trackers => Serde(tracker_rows(field)),
        pairs => parts.pairs.map(Plot::inline),
        draws => DRAWS,
        least_targets => LEAST_TARGETS,
        attributes => Serde(attributes),
        attribute_names => Serde(OTB_ATTRIBUTES),
        sequences => Serde(parts.sequences.iter().map(SequenceView::from).collect::<Vec<_>>()),
        has_thumbnails => parts.sequences.iter().any(|row| !row.thumbnails.is_empty()),
        lost => LOST,
        shortest => SHORTEST,
    };
    environment.get_template("page.html").and_then(|page| page.render(values)).map_err(broken)
}
