//! Clips: a video with its project.

use std::path::Path;
use std::sync::{Arc, RwLock};

use axum::Json;
use axum::extract::State;
use patchlock_media::{FrameRate, FrameSource, Limits};
use serde_json::{Value, json};

use super::App;
use super::answer::{At, Refusal};
use super::frames::{Cache, Reader};

/// All clips, by their ids, which count from 1.
pub struct Clips {
    limits: Limits,
    cache: Arc<Cache>,
    all: RwLock<Vec<Arc<Clip>>>,
}

/// A video with its project.
pub struct Clip {
    /// Its name on the page.
    pub name: String,
    /// Its id.
    pub id: usize,
    /// The video, or why it cannot be read.
    pub video: Result<Readable, Refusal>,
}

/// A video that can be read.
pub struct Readable {
    pub frames: usize,
    pub width: usize,
    pub height: usize,
    pub rate: Option<FrameRate>,
    pub reader: Reader,
}

impl Clips {
    pub fn new(limits: Limits) -> Self {
        Self { limits, cache: Arc::default(), all: RwLock::default() }
    }

    /// Adds a clip.
    pub fn add(&self, path: &Path) {
        let name = path.file_name().map_or(path.as_os_str(), |name| name).to_string_lossy();
        let mut all = self.all.write().unwrap_or_else(|poisoned| poisoned.into_inner());
        let id = all.len() + 1;
        let video = Readable::open(path, self.limits, id, &self.cache);
        all.push(Arc::new(Clip { name: name.into_owned(), id, video }));
    }

    /// The clip with this id.
    pub fn get(&self, id: usize) -> Result<Arc<Clip>, Refusal> {
        let all = self.all.read().unwrap_or_else(|poisoned| poisoned.into_inner());
        let found = id.checked_sub(1).and_then(|at| all.get(at));
        found.cloned().ok_or_else(|| Refusal::unknown(format!("there is no clip {id}")))
    }
}

impl Clip {
    /// The video.
    pub fn video(&self) -> Result<&Readable, Refusal> {
        self.video.as_ref().map_err(Clone::clone)
    }

    fn summary(&self) -> Value {
        let mut summary = json!({ "id": self.id, "name": self.name });
        let about = match &self.video {
            Ok(video) => json!({
                "frames": video.frames,
                "width": video.width,
                "height": video.height,
                "rate": video.rate.map(|rate| f64::from(rate.frames) / f64::from(rate.seconds)),
                "targets": 0,
                "keys": 0,
            }),
            Err(refusal) => json!({ "error": refusal.message() }),
        };
        if let (Value::Object(summary), Value::Object(about)) = (&mut summary, about) {
            summary.extend(about);
        }
        summary
    }
}

impl Readable {
    fn open(path: &Path, limits: Limits, id: usize, cache: &Arc<Cache>) -> Result<Self, Refusal> {
        let name = path.to_string_lossy().into_owned();
        let mut source = patchlock_media::open_within(&name, true, limits)?;
        let rate = source.rate();
        let Some(first) = source.frame(0)? else {
            return Err(Refusal::bad(format!("{name} has no frames")));
        };
        let frames = match source.length() {
            Some(length) => length,
            None => count(source.as_mut())?,
        };
        let reader = Reader::new(path, limits, frames, id, Arc::clone(cache));
        Ok(Self { frames, width: first.width, height: first.height, rate, reader })
    }
}

fn count(source: &mut dyn FrameSource) -> Result<usize, Refusal> {
    let mut frames = 1;
    while source.frame(frames)?.is_some() {
        frames += 1;
    }
    Ok(frames)
}

/// `GET /api/clips`
pub async fn list(State(app): State<Arc<App>>) -> Json<Value> {
    let all = app.clips.all.read().unwrap_or_else(|poisoned| poisoned.into_inner());
    let clips: Vec<Value> = all.iter().map(|clip| clip.summary()).collect();
    Json(json!({ "clips": clips }))
}

/// `GET /api/clips/ID`
pub async fn one(State(app): State<Arc<App>>, At(clip): At<usize>) -> Result<Json<Value>, Refusal> {
    let clip = app.clips.get(clip)?;
    let video = clip.video()?;
    Ok(Json(json!({
        "revision": 0,
        "project": {
            "video": {
                "path": clip.name, "bytes": 0, "hash": "",
                "frames": video.frames, "width": video.width, "height": video.height,
            },
            "labels": [],
            "targets": [],
        },
        "job": null,
        "windows": 0,
        "undo": null,
        "redo": null,
        "changed": null,
    })))
}
