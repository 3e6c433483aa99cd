//! A project as a table, which can be imported again.

use std::borrow::Cow;
use std::io;

use patchlock::{BoundingBox, Status};
use patchlock_track::export::TargetMetadata;
use patchlock_track::text::as_cell;
use serde::Serialize;

use super::{check_rows, metadata, refused, rows};
use crate::project::{Error, Project};

/// A line of the table.
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

/// What the names of columns with attributes begin with.
pub(crate) const ATTRIBUTE: &str = "attribute:";

/// The table of a project, ordered by target and frame: CSV with the columns that
/// [`Format::Csv`](crate::import::Format::Csv) lists, and one for each attribute.
///
/// # Errors
/// As [`track`](super::track).
pub fn table(project: &Project) -> Result<String, Error> {
    check_rows(project)?;
    let metadata: Vec<TargetMetadata> =
        project.targets.iter().map(|it| metadata(project, it)).collect();
    let names = metadata.iter().flat_map(|it| it.attributes.keys().chain(it.changes.keys()));
    let mut names: Vec<&String> = names.collect();
    names.sort_unstable();
    names.dedup();
    let mut out = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    let of_attributes = names.iter().map(|name| format!("{ATTRIBUTE}{name}"));
    let header = COLUMNS.split(',').map(ToOwned::to_owned).chain(of_attributes);
    out.write_record(header).map_err(|error| refused(error.to_string()))?;
    let mut count = 0;
    for (target, metadata) in project.targets.iter().zip(&metadata) {
        for row in rows(target) {
            let values = metadata.at(row.frame);
            let value = |name: &&String| values.iter().find(|(known, _)| known == name);
            let value = |name| as_cell(value(name).map_or("", |(_, value)| value));
            let values: Vec<Cow<'_, str>> = names.iter().map(value).collect();
            count += usize::from(row.bbox.is_some());
            let manual = row.manual.unwrap_or_default();
            let side = |of: fn(BoundingBox) -> f64| row.bbox.map(of);
            let line = Line {
                frame: row.frame,
                id: target.id,
                label: as_cell(&target.label),
                x: side(|b| b.x),
                y: side(|b| b.y),
                w: side(|b| b.w),
                h: side(|b| b.h),
                score: row.score,
                status: row.status,
                key: row.manual.is_some() && !manual.hidden,
                occluded: manual.occluded,
                truncated: manual.truncated,
                hidden: manual.hidden,
                visible: row.visible,
                agreement: row.agreement,
                frame_w: project.video.width,
                frame_h: project.video.height,
                outline: row.outline.map(ToString::to_string),
            };
            out.serialize((line, values)).map_err(|error| refused(error.to_string()))?;
        }
    }
    if count == 0 {
        return Err(refused("the project has no boxes"));
    }
    let bytes = out.into_inner().map_err(|error| refused(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| refused(io::Error::other(error).to_string()))
}
