//! Runs as messages, for the engines of `patchlock.batch`: planned and kept here, made wherever an engine
//! sends them.

use std::path::{Path, PathBuf};
use std::time::Duration;

use patchlock::{BoundingBox, TrackerConfig};
use patchlock_eval::bench::job::{self, BenchJobs, Frames, Job};
use patchlock_eval::bench::plan::{Entrant, MOST_SECONDS, MOST_SEEDS, Options};
use patchlock_eval::bench::schemes::{Scheme, Start};
use patchlock_eval::bench::store::{self, Clip, Identity, Series, Written};
use patchlock_eval::text;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::{errors, settings};

/// What the text files of clips call the first pixel, as `patchlock track` does.
const ORIGIN: f64 = 1.0;

/// The folder of one tracker, with runs as `patchlock bench` writes them.
#[pyclass(frozen, module = "patchlock")]
pub struct Store {
    store: store::Store,
    first_seed: u64,
}

#[pymethods]
impl Store {
    /// Opens the folder `name` in `out` for clips. With settings of their own it is called
    /// `name-<first digits of their hash>`.
    #[new]
    #[pyo3(signature = (out, name, *, preset, config, base, own))]
    fn new(
        out: PathBuf,
        name: &str,
        preset: &str,
        config: Option<PathBuf>,
        base: &Bound<'_, PyDict>,
        own: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let common = patchlock_eval::settings::resolve(preset, config.as_deref(), None)
            .map_err(|error| errors::of_eval(error.into()))?;
        let common = settings::changed(common, base)?;
        let configuration = settings::changed(common.clone(), own)?;
        let subject = Identity::patchlock(&configuration, preset);
        let tracker = match Identity::patchlock(&common, preset) == subject {
            true => name.to_string(),
            false => format!("{name}-{}", &subject.hash()[..8]),
        };
        let series = Series { tracker, scheme: Scheme::Ope, subject, origin: ORIGIN };
        Self::open(&out, series, &configuration)
    }

    /// The folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.store.folder().to_path_buf()
    }

    /// The seed of clips that have none of their own.
    #[getter]
    fn first_seed(&self) -> u64 {
        self.first_seed
    }

    /// The run on a clip. `source` is what its manifest says, `path` where it is found from any working
    /// directory.
    #[pyo3(signature = (target, seed, bbox, *, source, path, start, end, stride, threads, side_by_side))]
    #[expect(clippy::too_many_arguments, reason = "each is a field of the message")]
    fn clip(
        &self,
        target: String,
        seed: u64,
        bbox: [f64; 4],
        source: String,
        path: String,
        start: usize,
        end: Option<usize>,
        stride: usize,
        threads: usize,
        side_by_side: usize,
    ) -> PyResult<String> {
        let [x, y, w, h] = bbox;
        let bbox = BoundingBox { x, y, w, h };
        message(&Job {
            series: self.store.series().clone(),
            target,
            seed,
            start: Start { variant: 0, first: 0, bbox },
            frames: Frames::Clip { path, clip: Clip { source, start, end, stride } },
            threads,
            side_by_side,
            patience: Duration::ZERO,
        })
    }

    /// Whether the run is there, complete.
    fn holds(&self, py: Python<'_>, job: &str) -> PyResult<bool> {
        py.detach(|| self.store.holds(&read(job)?.run()).map_err(errors::of_eval))
    }

    /// Puts the two files of a run in their place.
    fn keep(&self, py: Python<'_>, job: &str, boxes: String, manifest: String) -> PyResult<()> {
        let written = Written { boxes, manifest };
        py.detach(|| self.store.keep(&read(job)?.run(), &written).map_err(errors::of_eval))
    }
}

impl Store {
    fn open(out: &Path, series: Series, configuration: &TrackerConfig) -> PyResult<Self> {
        let store = store::Store::open(out, series).map_err(errors::of_eval)?;
        Ok(Self { store, first_seed: configuration.seed })
    }
}

fn message(job: &Job) -> PyResult<String> {
    serde_json::to_string(job).map_err(|error| PyValueError::new_err(error.to_string()))
}

fn read(job: &str) -> PyResult<Job> {
    serde_json::from_str(job).map_err(|error| {
        PyValueError::new_err(format!("{error}: is the same version of Patchlock everywhere?"))
    })
}

/// Makes a run; gives its text of boxes and its manifest.
#[pyfunction]
pub fn track_job(py: Python<'_>, job: &str) -> PyResult<(String, String)> {
    let written = py.detach(|| read(job).map(|job| job.track()))?;
    let written = written.map_err(errors::of_eval)?;
    Ok((written.boxes, written.manifest))
}

/// Target, run and message of each run: what to make, and what can't be made.
type Named = Vec<(String, String, String)>;

/// What a benchmark with these options would run: the store, the jobs, how many are there already, and what
/// can't be run.
#[pyfunction]
#[pyo3(signature = (
    dataset, out, *, protocol, preset, config, command, timeout, name, seeds, sequences, attributes,
    threads, side_by_side
))]
#[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
pub fn bench_jobs(
    py: Python<'_>,
    dataset: PathBuf,
    out: PathBuf,
    protocol: &str,
    preset: String,
    config: Option<PathBuf>,
    command: Option<String>,
    timeout: i64,
    name: Option<String>,
    seeds: i64,
    sequences: Vec<String>,
    attributes: Vec<String>,
    threads: usize,
    side_by_side: usize,
) -> PyResult<(Store, Named, usize, Named)> {
    let options = Options {
        dataset,
        out,
        entrant: entrant(preset, config, command, timeout, name)?,
        scheme: protocol.parse().map_err(PyValueError::new_err)?,
        seeds: in_range("seeds", seeds, MOST_SEEDS)?,
        sequences,
        attributes,
        shard: (1, 1),
    };
    let found = py.detach(|| job::of_bench(&options, threads, side_by_side));
    let BenchJobs { jobs, store, before, failures } = found.map_err(errors::of_eval)?;
    let named = |job: &Job| Ok((job.target.clone(), job.label(), message(job)?));
    let jobs = jobs.iter().map(named).collect::<PyResult<_>>()?;
    let failures = failures.into_iter().map(|f| (f.target, f.run, f.error.to_string())).collect();
    Ok((Store { store, first_seed: 0 }, jobs, before, failures))
}

/// Our tracker with these settings, or another program.
fn entrant(
    preset: String,
    config: Option<PathBuf>,
    command: Option<String>,
    timeout: i64,
    name: Option<String>,
) -> PyResult<Entrant> {
    let Some(command) = command else { return Ok(Entrant::Patchlock { preset, config, name }) };
    if config.is_some() {
        let message = "config holds settings of our tracker: it can't be used with command";
        return Err(PyValueError::new_err(message));
    }
    let Some(name) = name else {
        return Err(PyValueError::new_err("command needs a name for its results: name is None"));
    };
    let patience = Duration::from_secs(in_range("timeout", timeout, MOST_SECONDS)?);
    Ok(Entrant::Program { command, name, patience })
}

/// A whole number from 1 to `most`.
fn in_range(name: &str, value: i64, most: u64) -> PyResult<u64> {
    let number = u64::try_from(value).ok().filter(|number| (1..=most).contains(number));
    number.ok_or_else(|| PyValueError::new_err(format!("{name} is {value}; allowed: 1 to {most}")))
}

/// x, y, w, h.
type Sides = (f64, f64, f64, f64);

/// The boxes of a truth file that counts from 1, counted from 0; `None` for a frame without one.
#[pyfunction]
pub fn read_truth(path: PathBuf) -> PyResult<Vec<Option<Sides>>> {
    let rows = text::read(&path).map_err(errors::of_eval)?.rows;
    let region = |(k, row): (usize, &Vec<f64>)| {
        let bbox = text::region(row, ORIGIN).map_err(|reason| {
            PyValueError::new_err(format!("{}, line {}: {reason}", path.display(), k + 1))
        })?;
        Ok(bbox.map(|BoundingBox { x, y, w, h }| (x, y, w, h)))
    };
    rows.iter().enumerate().map(region).collect()
}
