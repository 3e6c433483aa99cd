//! `patchlock dataset`: lists what a folder of sequences holds.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use patchlock_bench::dataset::{Dataset, Findings, Remark, Severity};
use patchlock_track::names::counted;
use serde_json::{Value, json};

use crate::failure::{Failure, failed};
use crate::output::printed::print;
use crate::output::text_table::TextTable;

const EXAMPLES: &str = "\
EXAMPLES:
  patchlock dataset OTB
      lists the targets with their frames, truth and attributes, and anything
      unusual
  patchlock dataset OTB --json > otb.json

Supported layouts:
  OTB          <Name>/img/0001.jpg, <Name>/groundtruth_rect.txt, or
               groundtruth_rect.1.txt and so on
  GOT-10k      <Name>/00000001.jpg, <Name>/groundtruth.txt, <Name>/absence.label
  LaSOT        <Name>/img/00000001.jpg, <Name>/groundtruth.txt, also in a folder
               for each class
  UAV123       data_seq/UAV123/<name>/000001.jpg, anno/UAV123/<name>.txt
  VOT          <name>/color/00000001.jpg, <name>/groundtruth.txt with boxes or
               polygons
  TrackingNet  frames/<name>/0.jpg, anno/<name>.txt, also in TEST, TRAIN_0 and
               so on
A folder of text files, <name>.txt, that contain only the truth is enough for
patchlock score.

The attributes of OTB-2013 are built in. Others are read from attributes.csv in
or beside the folder: a header with sequence and the short names of the
attributes, then one line per target with 0 or 1.";

/// Lists the sequences of a dataset and reports anything unusual
///
/// The exit code is 1 if a target can't be tracked or scored.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DatasetArgs {
    /// The folder
    dir: PathBuf,

    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

pub fn run(args: &DatasetArgs) -> Result<()> {
    let dataset = Dataset::open(&args.dir).map_err(Failure::from)?;
    let findings = dataset.inspect();
    let remarks: Vec<&Remark> = dataset.remarks.iter().chain(&findings.remarks).collect();
    let text = if args.json {
        serde_json::to_string_pretty(&json_of(&dataset, &findings, &remarks))? + "\n"
    } else {
        text_of(&dataset, &findings, &remarks)
    };
    print(&text)?;
    // Missing frames are a fault only if the layout has frames.
    let faults = remarks.iter().filter(|remark| remark.severity > Severity::Note).count();
    if faults > 0 {
        return Err(failed(format!("{} found", counted(faults, "fault")))
            .hint("faults are marked with ! above; the other targets can be used")
            .into());
    }
    Ok(())
}

fn text_of(dataset: &Dataset, findings: &Findings, remarks: &[&Remark]) -> String {
    let frames: usize = dataset.sequences.iter().map(|s| s.frames.len()).sum();
    let rows: usize = dataset.sequences.iter().map(|s| s.truth.len()).sum();
    let known: usize = dataset.sequences.iter().map(|s| s.truth.iter().flatten().count()).sum();
    let mut text = format!(
        "{}: layout {}, {} targets, {frames} frames, {rows} rows of truth, {known} with a box\n\n",
        dataset.root.display(),
        dataset.layout,
        dataset.sequences.len()
    );
    let mut table = TextTable::new(&[
        "target",
        "frames",
        "size",
        "rows",
        "with a box",
        "first file",
        "attributes",
    ]);
    for (sequence, size) in dataset.sequences.iter().zip(&findings.sizes) {
        let first = sequence.frames.first().and_then(|path| path.file_name());
        table.row(&[
            sequence.name.clone(),
            sequence.frames.len().to_string(),
            size.map_or("-".to_string(), |(w, h)| format!("{w} x {h}")),
            sequence.truth.len().to_string(),
            sequence.truth.iter().flatten().count().to_string(),
            first.map_or("-".to_string(), |name| name.to_string_lossy().into_owned()),
            sequence.attributes.join(" "),
        ]);
    }
    text += &table.text();
    text += match remarks.is_empty() {
        true => "\nNothing unusual.\n",
        false => "\nUnusual (! marks a fault: the target can't be tracked or scored):\n",
    };
    for remark in remarks {
        let mark = if remark.severity > Severity::Note { "!" } else { " " };
        text += &format!("{mark} {remark}\n");
    }
    text
}

fn json_of(dataset: &Dataset, findings: &Findings, remarks: &[&Remark]) -> Value {
    let target = |(k, size): (usize, &Option<(usize, usize)>)| {
        let sequence = &dataset.sequences[k];
        json!({
            "name": sequence.name,
            "frames": sequence.frames.len(),
            "width": size.map(|size| size.0),
            "height": size.map(|size| size.1),
            "rows": sequence.truth.len(),
            "boxes": sequence.truth.iter().flatten().count(),
            "attributes": sequence.attributes,
        })
    };
    json!({
        "layout": dataset.layout.to_string(),
        "targets": findings.sizes.iter().enumerate().map(target).collect::<Vec<_>>(),
        "remarks": remarks,
    })
}
