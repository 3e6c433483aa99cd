//! Runs as JSON messages, for the engines of `patchlock.batch`: planned and stored here, executed wherever
//! an engine sends them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use patchlock::BoundingBox;
use patchlock_bench::Error;
use patchlock_bench::bench::job::{self, FrameObserver, Frames, Job, ObservedFrame};
use patchlock_bench::bench::plan::{MOST_SECONDS, MOST_SEEDS, Options, Plan, TrackerSpec};
use patchlock_bench::bench::schemes::{Scheme, Start};
use patchlock_bench::bench::store::{self, Clip, Identity, RunFiles, Series};
use patchlock_cli::output::background_sink::BackgroundSink;
use patchlock_cli::output::partial_files;
use patchlock_cli::output::pending::PendingFile;
use patchlock_cli::output::video::{QUALITY, Video, played_by};
use patchlock_cli::output::view::View;
use patchlock_cli::output::{Sink, TargetResult, TrackedFrame};
use patchlock_media::FrameRate;
use patchlock_track::{ModelPaths, text};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::config::{self, Config, Settings, basis};
use crate::errors;
use crate::network::{self, RuntimeName};

/// The coordinate of the first pixel in the text files of clips, as in those of `patchlock track`.
const ORIGIN: f64 = 1.0;

/// The results folder of one tracker, with runs in the format of `patchlock bench`.
#[pyclass(frozen, module = "patchlock")]
pub struct Store {
    store: store::Store,
    /// The seed for clips that specify none.
    #[pyo3(get)]
    first_seed: u64,
    /// The files of the network.
    paths: ModelPaths,
}

#[pymethods]
impl Store {
    /// Opens the folder `name` in `out`; without a name it is that of the preset. The settings `own`
    /// differ from the common ones. If settings differ from those that the name stands for, the
    /// folder is `name-<first digits of the settings' hash>`.
    #[new]
    #[pyo3(signature = (out, name, *, config, own))]
    fn new(
        py: Python<'_>,
        out: PathBuf,
        name: Option<String>,
        config: &Config,
        own: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let Settings { config: common, model } = config.settings(py);
        let paths = model.map(|model| model.get().paths_for_jobs()).transpose()?;
        let preset = basis(&common).0;
        let meant = match name {
            Some(_) => common.clone(),
            None => Settings::of_preset(py, preset)?.config,
        };
        let name = name.unwrap_or_else(|| preset.to_string());
        let mut configuration = common;
        config::apply(&mut configuration, own, &[])?;
        configuration.validate().map_err(errors::of_tracker)?;
        let subject = Identity::patchlock(&configuration, preset.name());
        let tracker = match Identity::patchlock(&meant, preset.name()) == subject {
            true => name,
            false => format!("{name}-{}", &subject.hash()[..8]),
        };
        let series = Series { tracker, scheme: Scheme::Ope, subject, origin: ORIGIN };
        let store = store::Store::open(&out, series).map_err(errors::of_bench)?;
        Ok(Self { store, first_seed: configuration.seed, paths: paths.unwrap_or_default() })
    }

    /// Path of the folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.store.folder().to_path_buf()
    }

    /// Describes the run on a clip as a JSON message.
    ///
    /// `source` is recorded in the manifest; `path` locates the clip from any working directory, and
    /// `video` the video that is drawn of it.
    #[pyo3(signature = (
        target, seed, bbox, *, source, path, start, end, stride, threads, side_by_side, video = None
    ))]
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
        video: Option<PathBuf>,
    ) -> PyResult<String> {
        let bbox = bbox.into();
        let job = Job {
            series: self.store.series().clone(),
            target,
            seed,
            start: Start { variant: 0, first: 0, bbox },
            frames: Frames::Clip { path, clip: Clip { source, start, end, stride } },
            threads,
            side_by_side,
            patience: Duration::ZERO,
            paths: self.paths.clone(),
            video,
        };
        message(&job)
    }

    /// Whether the complete run is already stored, with its video, if there is to be one.
    fn holds(&self, py: Python<'_>, job: &str) -> PyResult<bool> {
        py.detach(|| {
            let job = read(job)?;
            let stored = self.store.holds(&job.run()).map_err(errors::of_bench)?;
            Ok(stored && job.video.is_none_or(|file| file.exists()))
        })
    }

    /// Stores the two files of a run.
    fn keep(&self, py: Python<'_>, job: &str, boxes: String, manifest: String) -> PyResult<()> {
        let written = RunFiles { boxes, manifest };
        py.detach(|| self.store.keep(&read(job)?.run(), &written).map_err(errors::of_bench))
    }
}

/// A run, as it is sent to the engine.
fn message(job: &Job) -> PyResult<String> {
    serde_json::to_string(job).map_err(errors::of_value)
}

fn read(job: &str) -> PyResult<Job> {
    serde_json::from_str(job).map_err(|error| {
        PyValueError::new_err(format!(
            "{error}: all machines must run the same version of Patchlock"
        ))
    })
}

/// Removes the parts of files that this process writes. It must end after this.
#[pyfunction]
pub fn abandon_files() {
    partial_files::clean_up();
}

/// Performs a run; returns its boxes as text and its manifest. Its video is then complete.
#[pyfunction]
pub fn track_job(py: Python<'_>, job: &str) -> PyResult<(String, String)> {
    let written = py.detach(|| {
        let job = read(job)?;
        let stride = stride(&job);
        let mut run_video = job.video.clone().map(|file| RunVideo { stride, file, sink: None });
        let observer = run_video.as_mut().map(|run_video| run_video as &mut dyn FrameObserver);
        let written = job.track(observer).map_err(errors::of_bench)?;
        run_video.map_or(Ok(()), RunVideo::finish).map_err(errors::of_bench)?;
        Ok::<_, PyErr>(written)
    })?;
    Ok((written.boxes, written.manifest))
}

fn stride(job: &Job) -> usize {
    match &job.frames {
        Frames::Clip { clip, .. } => clip.stride,
        Frames::Files(_) => 1,
    }
}

/// The video of a run.
struct RunVideo {
    file: PathBuf,
    stride: usize,
    /// `None` before the first frame.
    sink: Option<Box<BackgroundSink>>,
}

impl RunVideo {
    fn error(&self, reason: &impl ToString) -> Error {
        let (file, reason) = (self.file.display(), reason.to_string());
        // What writes a file names it; what makes a folder does not.
        let names = reason.contains(&file.to_string());
        Error::Subject(if names { reason } else { format!("cannot write {file}: {reason}") })
    }

    fn finish(mut self) -> Result<(), Error> {
        let finished = self.sink.take().map_or(Ok(None), |sink| sink.finish());
        finished.map(drop).map_err(|error| self.error(&error))
    }
}

impl FrameObserver for RunVideo {
    fn begin(&mut self, rate: Option<FrameRate>, expected: Option<usize>) -> Result<(), Error> {
        let folder = self.file.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(|error| self.error(&error))?;
        let pending = PendingFile::create(&self.file, true);
        let pending = pending.map_err(|error| self.error(&error))?;
        let (rate, view) = (played_by(rate, self.stride), View::new(true, None));
        let video = Video::new(pending, rate, view, QUALITY, expected);
        self.sink = Some(Box::new(BackgroundSink::new(Box::new(video))));
        Ok(())
    }

    fn observe(&mut self, observed: ObservedFrame<'_>) -> Result<(), Error> {
        let ObservedFrame { frame, picture, bbox, estimate, seconds } = observed;
        let targets = [TargetResult { id: None, name: None, bbox, estimate: estimate.clone() }];
        let picture = &Arc::new(picture);
        let tracked = TrackedFrame { frame, ms: seconds * 1e3, targets: &targets, picture };
        let written = self.sink.as_mut().map_or(Ok(()), |sink| sink.write(&tracked));
        written.map_err(|error| self.error(&error))
    }
}

/// Target, run, and either the job's message or the error message of each run.
type RunMessages = Vec<(String, String, String)>;

/// Plans a benchmark.
///
/// Returns the store, the jobs to run, the number of runs that are already stored, and the failures: targets
/// that can't be run.
#[pyfunction]
#[pyo3(signature = (
    dataset, out, *, protocol, preset, file, model, runtime, command, timeout, name, seeds,
    sequences, attributes, threads, side_by_side
))]
#[expect(clippy::too_many_arguments, reason = "Python calls it with keywords")]
pub fn bench_jobs(
    py: Python<'_>,
    dataset: PathBuf,
    out: PathBuf,
    protocol: &str,
    preset: String,
    file: Option<PathBuf>,
    model: Option<PathBuf>,
    runtime: Option<RuntimeName>,
    command: Option<String>,
    timeout: i64,
    name: Option<String>,
    seeds: i64,
    sequences: Vec<String>,
    attributes: Vec<String>,
    threads: usize,
    side_by_side: usize,
) -> PyResult<(Store, RunMessages, usize, RunMessages)> {
    let paths = ModelPaths { model, runtime: network::library(py, runtime.as_ref())? };
    let options = Options {
        dataset,
        out,
        tracker: match command {
            Some(_) if file.is_some() || paths != ModelPaths::default() => {
                return Err(PyValueError::new_err(
                    "file, model and runtime are for Patchlock: they can't be combined with command",
                ));
            }
            Some(command) => program(command, timeout, name)?,
            None => TrackerSpec::Patchlock { preset, config: file, paths, name },
        },
        scheme: protocol.parse().map_err(PyValueError::new_err)?,
        seeds: in_range("seeds", seeds, MOST_SEEDS)?,
        sequences,
        attributes,
        shard: (1, 1),
    };
    let found = py.detach(|| job::of_bench(&options, threads, side_by_side));
    let Plan { tasks: jobs, store, before, failures, .. } = found.map_err(errors::of_bench)?;
    let named = |job: Job| {
        let (target, label) = (job.target.clone(), job.label());
        Ok((target, label, message(&job)?))
    };
    let jobs = jobs.into_iter().map(named).collect::<PyResult<_>>()?;
    let failures = failures.into_iter().map(|f| (f.target, f.run, f.error.to_string())).collect();
    // The jobs have the files of the network.
    let store = Store { store, first_seed: 0, paths: ModelPaths::default() };
    Ok((store, jobs, before, failures))
}

/// Another program, which must have a name.
fn program(command: String, timeout: i64, name: Option<String>) -> PyResult<TrackerSpec> {
    let Some(name) = name else {
        return Err(PyValueError::new_err(
            "command needs a name for its results, but name is None",
        ));
    };
    let patience = Duration::from_secs(in_range("timeout", timeout, MOST_SECONDS)?);
    Ok(TrackerSpec::Program { command, name, patience })
}

/// Checks that a whole number is in 1 to `most`.
fn in_range(name: &str, value: i64, most: u64) -> PyResult<u64> {
    let number = u64::try_from(value).ok().filter(|number| (1..=most).contains(number));
    number.ok_or_else(|| PyValueError::new_err(format!("{name} is {value}; allowed: 1 to {most}")))
}

/// x, y, w, h.
type BoxTuple = (f64, f64, f64, f64);

/// Reads the boxes of a truth file; `None` for a frame without a box.
///
/// The file counts pixels from 1; the boxes returned count from 0.
#[pyfunction]
pub fn read_truth(path: PathBuf) -> PyResult<Vec<Option<BoxTuple>>> {
    let rows = text::read(&path).map_err(errors::of_track)?.rows;
    let region = |(k, row): (usize, &Vec<f64>)| {
        let bbox = text::region(row, ORIGIN).map_err(|reason| {
            PyValueError::new_err(format!("{}, line {}: {reason}", path.display(), k + 1))
        })?;
        Ok(bbox.map(|BoundingBox { x, y, w, h }| (x, y, w, h)))
    };
    rows.iter().enumerate().map(region).collect()
}
