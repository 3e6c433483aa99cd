//! A table with one row per target and frame: all that a project says of its targets, which
//! `patchlock studio` reads again.

use std::borrow::Cow;

use patchlock::{BoundingBox, Status};
use serde::Serialize;

use super::format::ImageUse;
use super::{Entry, Error, Format, Job};
use crate::text::as_cell;

pub const FORMAT: Format = Format {
    name: "csv",
    title: "Patchlock table",
    content: "one line per frame and target, with score and status",
    lost: Some("the column status"),
    images: ImageUse::Unused,
    is_of_project: true,
    file: Some(("csv", text)),
    ..Format::BASE
};

/// What the names of columns with attributes begin with.
pub const ATTRIBUTE: &str = "attribute:";

/// A line of the table, without the attributes.
#[derive(Serialize)]
struct Line<'a> {
    frame: usize,
    id: u64,
    label: Cow<'a, str>,
    x: Option<f64>,
    y: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    score: Option<f64>,
    status: Option<Status>,
    key: bool,
    occluded: bool,
    truncated: bool,
    hidden: bool,
    visible: Option<f64>,
    agreement: Option<f64>,
    frame_w: usize,
    frame_h: usize,
    outline: Option<String>,
}

/// The columns of a [`Line`].
const COLUMNS: &str = "frame,id,label,x,y,w,h,score,status,key,occluded,truncated,hidden,visible,\
                       agreement,frame_w,frame_h,outline";

/// The contents of the file, ordered by target and frame.
fn text(job: &Job<'_>) -> Result<String, Error> {
    let names = job.track.attributes();
    let mut out = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    let of_attributes = names.iter().map(|name| format!("{ATTRIBUTE}{name}"));
    let header = COLUMNS.split(',').map(ToOwned::to_owned).chain(of_attributes);
    out.write_record(header).map_err(refused)?;
    for entry in job.track.by_target().into_values().flatten() {
        let values = job.values(entry.id, entry.frame);
        let value = |name: &&str| values.iter().find(|(known, _)| known == name);
        let value = |name| as_cell(value(name).map_or("", |(_, value)| value));
        let values: Vec<Cow<'_, str>> = names.iter().map(value).collect();
        out.serialize((line(job, entry), values)).map_err(refused)?;
    }
    String::from_utf8(out.into_inner().map_err(refused)?).map_err(refused)
}

fn line<'a>(job: &Job<'a>, entry: &Entry) -> Line<'a> {
    let manual = entry.manual.unwrap_or_default();
    let side = |of: fn(BoundingBox) -> f64| entry.bbox.map(of);
    // Outlines between those that a person has drawn follow from them.
    let outline = entry.manual.and_then(|_| job.track.outline(entry));
    Line {
        frame: entry.frame,
        id: entry.id,
        label: as_cell(job.label(entry.id)),
        x: side(|b| b.x),
        y: side(|b| b.y),
        w: side(|b| b.w),
        h: side(|b| b.h),
        score: entry.score,
        status: entry.status,
        key: entry.manual.is_some() && !manual.hidden,
        occluded: manual.occluded,
        truncated: manual.truncated,
        hidden: manual.hidden,
        visible: entry.visible,
        agreement: entry.agreement,
        frame_w: job.frames.size.0,
        frame_h: job.frames.size.1,
        outline: outline.map(ToString::to_string),
    }
}

fn refused(error: impl ToString) -> Error {
    Error::Export(error.to_string())
}
