//! Clips: a video with its project. What the page asks and changes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

use axum::Json;
use axum::body::Body;
use axum::extract::ws::Utf8Bytes;
use axum::extract::{FromRequestParts, State};
use axum::http::request::Parts;
use patchlock_media::FrameRate;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use tokio::sync::{MutexGuard, broadcast};

use super::advice;
use super::answer::{BodyReader, JsonAnswer, PathParam, Refusal, aside, parsed};
use super::app::App;
use super::frames::{Cache, Reader};
use super::jobs::Jobs;
use super::lock;
use super::options::ProjectLocation;
use crate::engine::plan::TrackRequest;
use crate::engine::{Engine, Settings};
use crate::import::ImportResult;
use crate::project::{self, Edit, Error, History, Label, SharedLabels, Store};
use crate::tracking::review::review_stats;

/// Largest list of edits, in bytes of JSON.
const EDIT_BYTES: u64 = 64 << 20;
/// Events kept for a window that is slow to take them; one that is slower still is told to read
/// everything again.
const EVENTS: usize = 256;
/// How long the list of clips waits for those that are still being opened.
const OPENING: Duration = Duration::from_secs(60);

/// All clips, by their ids, which count from 1.
pub struct Clips {
    shared: Arc<ClipContext>,
    all: Mutex<Vec<Arc<Clip>>>,
    /// Held by the one who adds a clip: it reads files, and nobody who asks for a clip waits for
    /// that.
    adding: Mutex<()>,
}

/// What all clips share.
struct ClipContext {
    settings: Settings,
    cache: Arc<Cache>,
    /// The labels of all clips, in a file of the folder of the first one. Whoever has them may take
    /// a project, and nobody the other way round.
    labels: Mutex<SharedLabels>,
}

impl ClipContext {
    /// Changes the labels, and returns them with what the work returns.
    fn update_labels<T>(
        &self,
        work: impl FnOnce(&mut project::Vocabulary) -> Result<T, Error>,
    ) -> Result<(Vec<Label>, T), Error> {
        lock(&self.labels).update(|vocabulary| {
            let done = work(vocabulary)?;
            Ok((vocabulary.labels(), done))
        })
    }
}

/// A video with its project, opened when it is first needed.
pub struct Clip {
    /// Its name on the page.
    pub name: String,
    /// Its id.
    pub id: usize,
    video: PathBuf,
    project: PathBuf,
    shared: Arc<ClipContext>,
    opened: OnceLock<Result<Arc<OpenClip>, Arc<project::Error>>>,
}

/// An open clip.
pub struct OpenClip {
    pub name: String,
    pub frames: usize,
    pub width: usize,
    pub height: usize,
    pub rate: Option<FrameRate>,
    pub reader: Reader,
    pub engine: Engine,
    pub jobs: Jobs,
    /// What is sent to all windows, as JSON.
    pub events: broadcast::Sender<Utf8Bytes>,
    changed: Option<String>,
    windows: AtomicUsize,
    held: tokio::sync::Mutex<ProjectState>,
}

/// The project, and what the windows know of it.
pub struct ProjectState {
    pub store: Store,
    /// The last revision that was announced. Later ones are pieces of a running job, which conflict
    /// with nothing.
    told: u64,
}

impl ProjectState {
    /// Checks that the sender of edits knows the project as it is.
    fn check_revision(&self, revision: u64) -> Result<(), Refusal> {
        let now = self.store.revision();
        match (self.told..=now).contains(&revision) {
            true => Ok(()),
            false => Err(Refusal::conflict(now)),
        }
    }
}

impl Clips {
    /// No clips yet; the labels of all are in this folder.
    pub fn new(settings: Settings, folder: &Path) -> Self {
        let labels = Mutex::new(SharedLabels::new(folder));
        let shared = Arc::new(ClipContext { settings, cache: Arc::default(), labels });
        Self { shared, all: Mutex::default(), adding: Mutex::default() }
    }

    /// What all clips share.
    pub fn settings(&self) -> &Settings {
        &self.shared.settings
    }

    /// Adds a clip, with a project file of its own.
    pub fn add(&self, video: &Path, projects: &ProjectLocation) -> Arc<Clip> {
        let name = video.file_name().unwrap_or(video.as_os_str()).to_string_lossy().into_owned();
        let _adding = lock(&self.adding);
        let all = self.all();
        let is_taken = |file: &Path| all.iter().any(|clip| clip.project == file);
        let project = projects.file(video, is_taken);
        let clip = Arc::new(Clip {
            name,
            id: all.len() + 1,
            video: video.to_path_buf(),
            project,
            shared: Arc::clone(&self.shared),
            opened: OnceLock::new(),
        });
        lock(&self.all).push(Arc::clone(&clip));
        clip
    }

    /// All clips.
    pub fn all(&self) -> Vec<Arc<Clip>> {
        lock(&self.all).clone()
    }

    /// The clip with this id.
    pub fn get(&self, id: usize) -> Result<Arc<Clip>, Refusal> {
        let found = id.checked_sub(1).and_then(|at| lock(&self.all).get(at).cloned());
        found.ok_or_else(|| Refusal::unknown(format!("there is no clip {id}")))
    }

    /// The clip with this id, open.
    pub async fn open(&self, id: usize) -> Result<Arc<OpenClip>, Refusal> {
        let clip = self.get(id)?;
        let refused = |error: Arc<project::Error>| Refusal::from(&*error);
        match clip.opened.get() {
            Some(opened) => opened.clone().map_err(refused),
            None => aside(move || clip.open().map_err(refused)).await,
        }
    }

    /// All clips that are open.
    pub fn opened(&self) -> Vec<Arc<OpenClip>> {
        let opened = |clip: &Arc<Clip>| clip.opened.get()?.as_ref().ok().cloned();
        self.all().iter().filter_map(opened).collect()
    }

    /// The labels of all clips.
    pub fn labels(&self) -> Result<Vec<Label>, Error> {
        Ok(self.shared.update_labels(|_| Ok(()))?.0)
    }

    /// Makes edits of labels, for all clips. It is no step of any history: a label belongs to all
    /// clips, and undoing it in one would take it from the others.
    fn label(&self, edits: &[Edit]) -> Result<(), Refusal> {
        if edits.is_empty() {
            return Ok(());
        }
        let opened = self.opened();
        let in_use = |name: &str| {
            let uses = |clip: &Arc<OpenClip>| {
                clip.hold().store.project().targets.iter().any(|target| target.label == name)
            };
            opened.iter().any(uses)
        };
        let change = |vocabulary: &mut project::Vocabulary| {
            let renamed = edits.iter().map(|edit| vocabulary.apply(edit, in_use));
            renamed.collect::<Result<Vec<_>, Error>>()
        };
        let (labels, renamed) = self.shared.update_labels(change)?;
        let renamed: Vec<_> = renamed.into_iter().flatten().collect();
        for clip in opened {
            clip.relabel(&labels, &renamed)?;
        }
        Ok(())
    }

    /// Adds labels that targets are to have, unless they are there.
    fn need(&self, names: &[String]) -> Result<(), Refusal> {
        let known = self.labels()?;
        let mut edits: Vec<Edit> = Vec::new();
        for name in names {
            let add = Edit::AddLabel { name: name.clone(), colour: None, at: None };
            if !known.iter().any(|label| label.name == *name) && !edits.contains(&add) {
                edits.push(add);
            }
        }
        self.label(&edits)
    }

    /// Applies edits to a clip at the revision that the sender knew; those of labels to all clips.
    fn edit(&self, clip: &OpenClip, revision: u64, edits: Vec<Edit>) -> Result<u64, Refusal> {
        let (of_labels, others): (Vec<_>, Vec<_>) = edits.into_iter().partition(Edit::is_of_labels);
        if !of_labels.is_empty() {
            clip.hold().check_revision(revision)?;
            self.label(&of_labels)?;
            if others.is_empty() {
                return Ok(revision);
            }
        }
        clip.edit(revision, others)
    }

    /// Adds targets to a clip, and labels and attributes that they need to all clips. Returns the revision and the
    /// ids.
    pub fn import(
        &self,
        clip: &OpenClip,
        imported: ImportResult,
    ) -> Result<(u64, Vec<u64>), Refusal> {
        let names = imported.targets.iter().map(|target| target.label.clone()).collect::<Vec<_>>();
        let edits = imported.edits(&self.labels()?);
        let (of_labels, import): (Vec<_>, Vec<_>) = edits.into_iter().partition(Edit::is_of_labels);
        self.label(&of_labels)?;
        self.need(&names)?;
        let mut held = clip.hold();
        let before = held.store.project().next_id;
        held.store.apply(import)?;
        let ids = (before..held.store.project().next_id).collect();
        Ok((clip.announce_and_save(&mut held)?, ids))
    }

    /// Takes back the last step of a clip, or does it again. A label that it needs may have been
    /// removed since. Says the revision, and the step in words if there is one.
    fn step(&self, clip: &OpenClip, redo: bool) -> Result<Value, Refusal> {
        let said = |revision: u64, text| json!({ "revision": revision, "text": text });
        let text = |history: &History| history.text(redo).map(ToOwned::to_owned);
        let (meant, targets, asked) = {
            let held = clip.hold();
            let history = held.store.history();
            (history.id(redo), history.targets(redo), text(history))
        };
        let Some(meant) = meant else { return Ok(said(clip.hold().store.revision(), None)) };
        // A correction and the tracking that follows from it are one step.
        clip.jobs.stop(clip, |_, step| step == meant);
        clip.jobs.stop(clip, |target, _| targets.contains(&target));
        let needed = clip.hold().store.history().labels(redo);
        self.need(&needed)?;
        let mut held = clip.hold();
        if held.store.history().id(redo) != Some(meant) {
            // Tracking that had found nothing is no step any more.
            return Ok(said(clip.announce_and_save(&mut held)?, asked));
        }
        // It may have found more since then.
        let done = text(held.store.history());
        held.store.step(redo)?;
        Ok(said(clip.announce_and_save(&mut held)?, done))
    }

    /// Stops all jobs and waits until their results are written. Then writes what could not be
    /// written when it was changed. Returns the project files of which that is true, and the errors.
    pub fn close(&self) -> (Vec<PathBuf>, Vec<project::Error>) {
        let (mut saved, mut failed) = (Vec::new(), Vec::new());
        for clip in self.all() {
            let Some(Ok(opened)) = clip.opened.get() else { continue };
            Jobs::close(opened);
            let mut held = opened.hold();
            let store = &mut held.store;
            if !store.has_unsaved_changes() {
                continue;
            }
            match store.save() {
                Ok(()) => saved.push(store.path().to_path_buf()),
                Err(error) => failed.push(error),
            }
        }
        (saved, failed)
    }
}

impl Clip {
    /// Opens it, unless it is open.
    pub fn open(&self) -> Result<Arc<OpenClip>, Arc<project::Error>> {
        self.opened.get_or_init(|| Ok(Arc::new(self.open_now()?))).clone()
    }

    fn open_now(&self) -> Result<OpenClip, project::Error> {
        let ClipContext { settings, cache, .. } = &*self.shared;
        let limits = settings.limits;
        let mut store = Store::open(&self.project, Some(&self.video), limits)?;
        store.keep_history()?;
        let absorb = |all: &mut project::Vocabulary| all.absorb(store.project());
        let (labels, renamed) = self.shared.update_labels(absorb)?;
        if store.set_labels(&labels, &renamed) && store.has_unsaved_changes() {
            store.save()?;
        }
        let engine = Engine { video: self.video.clone(), settings: settings.clone() };
        let source = engine.open(false)?;
        let video = &store.project().video;
        let (frames, width, height) = (video.frames, video.width, video.height);
        let changed = store.changed();
        // A changed video may have another length, of which the page warns. The same one has not.
        let is_wrong = |length: &usize| *length != frames && changed.is_none();
        if let Some(length) = source.length().filter(is_wrong) {
            let reason =
                format!("it says that the video has {frames} frames; the video has {length}");
            return Err(project::Error::Invalid { path: store.path().to_path_buf(), reason });
        }
        Ok(OpenClip {
            name: self.name.clone(),
            frames,
            width,
            height,
            rate: source.rate(),
            reader: Reader::new(&self.video, limits, frames, self.id, Arc::clone(cache)),
            engine,
            jobs: Jobs::default(),
            events: broadcast::channel(EVENTS).0,
            changed,
            windows: AtomicUsize::new(0),
            held: tokio::sync::Mutex::new(ProjectState { told: store.revision(), store }),
        })
    }

    fn summary(&self) -> Value {
        let (id, name) = (self.id, &self.name);
        let opened = match self.opened.get() {
            None => return json!({ "id": id, "name": name, "opening": true }),
            Some(Err(error)) => {
                let (text, hint) = (error.to_string(), advice::project(error));
                return json!({ "id": id, "name": name, "error": text, "hint": hint });
            }
            Some(Ok(opened)) => opened,
        };
        let held = opened.hold();
        let project = held.store.project();
        let targets = &project.targets;
        let unknown = targets.iter().map(|target| review_stats(target, opened.frames).unknown);
        let unknown: Vec<usize> = unknown.collect();
        json!({
            "id": id,
            "name": name,
            "frames": opened.frames,
            "width": opened.width,
            "height": opened.height,
            "rate": opened.per_second(),
            "targets": targets.len(),
            "keys": targets.iter().map(|target| target.keys.len()).sum::<usize>(),
            "unknown": unknown.iter().sum::<usize>(),
            "unknown_targets": unknown.iter().filter(|frames| **frames > 0).count(),
            "done": project.done,
            "changed": opened.changed,
        })
    }
}

impl OpenClip {
    /// The project, for one thread at a time. Whoever holds it may write to the disk, so this panics
    /// on the threads that answer requests, which must not wait for that: see [`aside`].
    pub fn hold(&self) -> MutexGuard<'_, ProjectState> {
        self.held.blocking_lock()
    }

    /// The revision of the project, for code that may not call [`OpenClip::hold`].
    pub async fn revision(&self) -> u64 {
        self.held.lock().await.store.revision()
    }

    /// Frames per second, if the video says so.
    fn per_second(&self) -> Option<f64> {
        self.rate.map(|rate| f64::from(rate.frames) / f64::from(rate.seconds))
    }

    /// Tells all windows. Without any, nobody needs to know.
    pub fn tell(&self, event: &Value) {
        let _ = self.events.send(event.to_string().into());
    }

    /// Tells all windows that the project has changed, and returns its revision.
    pub fn announce(&self, held: &mut ProjectState) -> u64 {
        held.told = held.store.revision();
        self.tell(&json!({ "type": "project", "revision": held.told }));
        held.told
    }

    /// Tells all windows what can be undone and redone.
    pub fn tell_history(&self, held: &ProjectState) {
        let history = held.store.history();
        let (undo, redo) = (history.text(false), history.text(true));
        self.tell(&json!({ "type": "history", "undo": undo, "redo": redo }));
    }

    /// A window was opened or closed.
    pub fn window(&self, opened: bool) {
        let count = match opened {
            true => self.windows.fetch_add(1, Ordering::SeqCst) + 1,
            false => self.windows.fetch_sub(1, Ordering::SeqCst) - 1,
        };
        self.tell(&json!({ "type": "windows", "count": count }));
    }

    /// Everything about the clip.
    fn whole(&self) -> Result<Value, Refusal> {
        let job = self.jobs.state();
        let held = self.hold();
        let targets = &held.store.project().targets;
        let colours: BTreeMap<String, &str> =
            targets.iter().map(|it| (it.id.to_string(), it.colour())).collect();
        let project = serde_json::to_value(held.store.project());
        let project = project.map_err(|error| Refusal::failed(error.to_string()))?;
        Ok(json!({
            "name": self.name,
            "rate": self.per_second(),
            "revision": held.store.revision(),
            "project": project,
            "colours": colours,
            "file": held.store.path(),
            "job": job,
            "windows": self.windows.load(Ordering::SeqCst),
            "undo": held.store.history().text(false),
            "redo": held.store.history().text(true),
            "changed": self.changed,
            "notes": held.store.notes().iter().map(ToString::to_string).collect::<Vec<_>>(),
        }))
    }

    /// Gives the project the labels of all clips, and tells the windows.
    fn relabel(&self, labels: &[Label], renamed: &[(String, String)]) -> Result<(), Error> {
        let mut held = self.hold();
        if held.store.set_labels(labels, renamed) {
            self.tell(&json!({ "type": "labels" }));
            if held.store.has_unsaved_changes() {
                held.store.save()?;
            }
        }
        Ok(())
    }

    /// Applies edits to the revision that the sender knew, and writes the project.
    fn edit(&self, revision: u64, edits: Vec<Edit>) -> Result<u64, Refusal> {
        let shaped: Vec<u64> = edits.iter().flat_map(Edit::shapes).collect();
        self.jobs.stop(self, |target, _| shaped.contains(&target));
        let mut held = self.hold();
        held.check_revision(revision)?;
        held.store.apply(edits)?;
        self.announce_and_save(&mut held)
    }

    /// Announces a change first: it is true even if the file cannot be written.
    pub fn announce_and_save(&self, held: &mut ProjectState) -> Result<u64, Refusal> {
        let revision = self.announce(held);
        held.store.save()?;
        Ok(revision)
    }
}

/// The clip that an address names, open.
pub struct ClipRequest {
    pub app: Arc<App>,
    pub clip: Arc<OpenClip>,
}

impl FromRequestParts<Arc<App>> for ClipRequest {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, app: &Arc<App>) -> Result<Self, Refusal> {
        let PathParam(clip) = PathParam::from_request_parts(parts, app).await?;
        Ok(Self { app: Arc::clone(app), clip: app.clips.open(clip).await? })
    }
}

/// `GET /api/clips`
pub async fn list(State(app): State<Arc<App>>) -> JsonAnswer {
    let begun = Instant::now();
    let clips = app.clips.all();
    while clips.iter().any(|clip| clip.opened.get().is_none()) && begun.elapsed() < OPENING {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let summaries = move || {
        let clips: Vec<Value> = clips.iter().map(|clip| clip.summary()).collect();
        Ok(
            json!({ "clips": clips, "camera": app.options.camera, "upload_bytes": app.options.upload_bytes }),
        )
    };
    aside(summaries).await.map(Json)
}

/// `GET /api/clips/ID`
pub async fn one(ClipRequest { clip, .. }: ClipRequest) -> JsonAnswer {
    aside(move || clip.whole()).await.map(Json)
}

/// What a window wants to change.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Edits {
    revision: u64,
    edits: Vec<Edit>,
}

/// `POST /api/clips/ID/edits`
pub async fn edit(ClipRequest { app, clip }: ClipRequest, body: Body) -> JsonAnswer {
    let body = BodyReader::new(body, EDIT_BYTES, app.options.timeouts.body)?.whole().await?;
    let edit = move || {
        let Edits { revision, edits } = parsed(&body)?;
        Ok(json!({ "revision": app.clips.edit(&clip, revision, edits)? }))
    };
    aside(edit).await.map(Json)
}

/// `POST /api/clips/ID/undo`
pub async fn undo(ClipRequest { app, clip }: ClipRequest) -> JsonAnswer {
    aside(move || app.clips.step(&clip, false)).await.map(Json)
}

/// `POST /api/clips/ID/redo`
pub async fn redo(ClipRequest { app, clip }: ClipRequest) -> JsonAnswer {
    aside(move || app.clips.step(&clip, true)).await.map(Json)
}

/// `POST /api/clips/ID/track`
pub async fn track(ClipRequest { app, clip }: ClipRequest, body: Body) -> JsonAnswer {
    let body = BodyReader::new(body, EDIT_BYTES, app.options.timeouts.body)?.whole().await?;
    let start = move || {
        let mut request: Map<String, Value> = parsed(&body)?;
        let since = request.remove("since").unwrap_or_default();
        let wrong = |error: serde_json::Error| Refusal::bad(error.to_string());
        let request: TrackRequest = serde_json::from_value(request.into()).map_err(wrong)?;
        let since: Option<u64> = serde_json::from_value(since).map_err(wrong)?;
        Ok(json!({ "job": Jobs::start(&clip, request, since)? }))
    };
    aside(start).await.map(Json)
}

/// `POST /api/clips/ID/stop`
pub async fn stop(ClipRequest { clip, .. }: ClipRequest) -> JsonAnswer {
    let stop = move || {
        let (running, dropped) = clip.jobs.stop(&clip, |_, _| true);
        Ok(json!({ "stopped": dropped.len() + usize::from(running), "dropped": dropped }))
    };
    aside(stop).await.map(Json)
}

/// The answer about a target that does not exist.
pub fn no_target(id: u64) -> Refusal {
    Refusal::unknown(format!("there is no target {id}"))
}
