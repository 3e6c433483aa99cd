//! The camera of the browser: it sends pictures, and is told where the targets are. A picture that
//! comes while another one is tracked replaces the one that waits.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::{Message, WebSocket};
use axum::response::Response;
use futures_util::{SinkExt as _, StreamExt as _};
use patchlock::{BoundingBox, Estimate, Tracker};
use patchlock_media::{FrameRate, Mp4Writer, Picture, image_file};
use patchlock_track::files;
use serde::Deserialize;
use serde_json::{Value, json};
use tempfile::NamedTempFile;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};

use super::answer::{PathParam, Refusal};
use super::app::App;
use super::files::{cannot_keep, download, keep};
use super::options::ProjectLocation;
use super::timeouts::SENDING;
use super::{live, lock};
use crate::engine::Settings;
use crate::import;

/// Largest picture, in bytes of JPEG.
const PICTURE_BYTES: usize = 16 << 20;
/// Most targets at once: each takes its time from every picture.
const TARGETS: usize = 16;
/// Quantiser of recordings: they are to be annotated, so they lose little.
const QUALITY: u8 = 22;

/// The recordings of this run of the program, by their numbers, which count from 1.
#[derive(Default)]
pub struct Recordings(Mutex<Vec<Recording>>);

#[derive(Clone)]
struct Recording {
    video: PathBuf,
    table: PathBuf,
}

/// What the page asks for.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Order {
    /// Follow what is in this box of the next picture, and with `add` go on with the others.
    Start {
        #[serde(rename = "box")]
        bbox: BoundingBox,
        #[serde(default)]
        add: bool,
    },
    /// Follow nothing.
    Stop(bool),
    /// Follow this target no more.
    Forget(u64),
    /// Begin or end a recording.
    Record(bool),
}

/// What waits for the thread that tracks.
#[derive(Default)]
struct MailboxState {
    orders: Vec<Order>,
    /// The newest picture, with its number.
    picture: Option<(usize, Bytes)>,
    closed: bool,
}

#[derive(Default)]
struct Mailbox {
    waiting: Mutex<MailboxState>,
    arrived: Condvar,
}

impl Mailbox {
    /// Waits for something to do.
    fn next(&self) -> MailboxState {
        let idle = |waiting: &mut MailboxState| {
            waiting.orders.is_empty() && waiting.picture.is_none() && !waiting.closed
        };
        let waited = self.arrived.wait_while(lock(&self.waiting), idle);
        let mut waiting = waited.unwrap_or_else(PoisonError::into_inner);
        let closed = waiting.closed;
        MailboxState { closed, ..std::mem::take(&mut *waiting) }
    }
}

/// `GET /api/camera`
pub async fn camera(
    State(app): State<Arc<App>>,
    upgrade: live::Upgrade,
) -> Result<Response, Refusal> {
    live::talk(upgrade, PICTURE_BYTES, move |socket| converse(socket, app))
}

async fn converse(socket: WebSocket, app: Arc<App>) {
    let mailbox = Arc::new(Mailbox::default());
    let (answers, mut to_send) = unbounded_channel();
    let follower = Follower::new(app, answers.clone());
    let theirs = Arc::clone(&mailbox);
    thread::spawn(move || follower.run(&theirs));
    let (mut sink, mut stream) = socket.split();
    let sending = async {
        while let Some(answer) = to_send.recv().await {
            let text: Value = answer;
            let sent = sink.send(Message::Text(text.to_string().into()));
            if !matches!(tokio::time::timeout(SENDING, sent).await, Ok(Ok(()))) {
                return;
            }
        }
    };
    let receiving = async {
        let mut number = 0;
        while let Some(Ok(message)) = stream.next().await {
            let mut waiting = lock(&mailbox.waiting);
            let mut dropped = None;
            match message {
                Message::Binary(jpeg) => {
                    dropped = waiting.picture.replace((number, jpeg));
                    number += 1;
                }
                Message::Text(text) => match serde_json::from_slice(text.as_bytes()) {
                    Ok(order) => {
                        // The box of a start is for the picture that follows.
                        if matches!(order, Order::Start { .. }) {
                            dropped = waiting.picture.take();
                        }
                        waiting.orders.push(order);
                    }
                    Err(error) => {
                        let message = format!("the message is not as expected: {error}");
                        let _ = answers.send(json!({ "error": message }));
                    }
                },
                Message::Close(_) => return,
                Message::Ping(_) | Message::Pong(_) => {}
            }
            mailbox.arrived.notify_all();
            if let Some((number, _)) = dropped {
                let _ = answers.send(json!({ "frame": number, "dropped": true, "ms": 0 }));
            }
        }
    };
    tokio::select! { () = sending => {}, () = receiving => {} }
    lock(&mailbox.waiting).closed = true;
    mailbox.arrived.notify_all();
}

/// Follows targets in the pictures of one camera, and records them.
struct Follower {
    app: Arc<App>,
    answers: UnboundedSender<Value>,
    /// The targets with their ids.
    targets: Vec<(u64, Tracker)>,
    /// The boxes of targets that begin with the next picture.
    begin: Vec<BoundingBox>,
    /// The id of the last target.
    last: u64,
    /// The targets that began with the last picture: their boxes are drawn.
    drawn: Vec<u64>,
    recorder: Option<Recorder>,
    /// Whether to record from the next picture on.
    record: bool,
}

impl Follower {
    fn new(app: Arc<App>, answers: UnboundedSender<Value>) -> Self {
        let (targets, begin) = (Vec::new(), Vec::new());
        let drawn = Vec::new();
        Self { app, answers, targets, begin, last: 0, drawn, recorder: None, record: false }
    }

    fn run(mut self, mailbox: &Mailbox) {
        loop {
            let MailboxState { orders, picture, closed } = mailbox.next();
            for order in orders {
                self.obey(order);
            }
            if let Some((number, jpeg)) = picture {
                let answer = self.follow(number, &jpeg).unwrap_or_else(|refusal| {
                    // What cannot be followed is not tried again with each picture.
                    self.forget_all();
                    json!({ "frame": number, "error": refusal.message() })
                });
                self.say(answer);
            }
            if closed {
                return self.end_recording();
            }
        }
    }

    /// The page may be gone.
    fn say(&self, answer: Value) {
        let _ = self.answers.send(answer);
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::Start { bbox, add } => {
                if !add {
                    self.forget_all();
                }
                match self.targets.len() + self.begin.len() < TARGETS {
                    true => self.begin.push(bbox),
                    false => {
                        let error =
                            format!("{TARGETS} targets are followed; stop one of them first");
                        self.say(json!({ "error": error }));
                    }
                }
            }
            Order::Stop(true) => self.forget_all(),
            Order::Stop(false) => {}
            Order::Forget(id) => self.targets.retain(|(target, _)| *target != id),
            Order::Record(record) => {
                self.record = record;
                if !record {
                    self.end_recording();
                }
            }
        }
    }

    fn forget_all(&mut self) {
        self.targets.clear();
        self.begin.clear();
    }

    fn follow(&mut self, number: usize, jpeg: &[u8]) -> Result<Value, Refusal> {
        let picture = image_file::decode(jpeg, self.app.options.limits);
        let picture = picture.map_err(|error| Refusal::bad(format!("not a picture: {error}")))?;
        let begun = Instant::now();
        let found = self.estimates(&picture)?;
        let ms = 1e3 * begun.elapsed().as_secs_f64();
        self.record(&picture, &found)?;
        let targets: Vec<Value> = found.iter().map(|(id, it)| shown(*id, it)).collect();
        // What is said of the first target is also said of the picture.
        let mut answer = targets.first().cloned().unwrap_or_else(|| json!({ "box": null }));
        answer["frame"] = json!(number);
        answer["ms"] = json!(ms);
        answer["targets"] = json!(targets);
        Ok(answer)
    }

    fn estimates(&mut self, picture: &Picture) -> Result<Vec<(u64, Estimate)>, Refusal> {
        let failed = |error: patchlock::Error| Refusal::bad(error.to_string());
        let frame = picture.frame().map_err(failed)?;
        let Settings { config, pool, .. } = self.app.clips.settings();
        for (_, tracker) in &mut self.targets {
            pool.install(|| tracker.update(&frame)).map_err(failed)?;
        }
        self.drawn.clear();
        for bbox in std::mem::take(&mut self.begin) {
            let begun = pool.install(|| Tracker::start(config.clone(), &frame, bbox));
            let tracker = begun.map_err(failed)?;
            self.last += 1;
            self.targets.push((self.last, tracker));
            self.drawn.push(self.last);
        }
        Ok(self.targets.iter().map(|(id, tracker)| (*id, tracker.estimate().clone())).collect())
    }

    fn record(&mut self, picture: &Picture, found: &[(u64, Estimate)]) -> Result<(), Refusal> {
        if !self.record {
            return Ok(());
        }
        let folder = &self.app.options.uploads;
        let recorder = match &mut self.recorder {
            Some(recorder) => recorder,
            None => self.recorder.insert(Recorder::begin(folder.clone(), picture)?),
        };
        let pushed = recorder.push(picture, found, &self.drawn);
        if pushed.is_err() {
            self.record = false;
            self.end_recording();
        }
        pushed
    }

    fn end_recording(&mut self) {
        let Some(recorder) = self.recorder.take() else { return };
        let answer = match recorder.end() {
            Ok((recording, frames)) => {
                let clip = add_clip(&self.app, &recording);
                let shown = |path: &Path| {
                    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
                    path.display().to_string()
                };
                let (video, table) = (shown(&recording.video), shown(&recording.table));
                let mut all = lock(&self.app.recordings.0);
                all.push(recording);
                let mut answer = json!({
                    "recording": all.len(), "frames": frames, "video": video, "table": table,
                });
                match clip {
                    Ok(clip) => answer["clip"] = json!(clip),
                    Err(refusal) => answer["note"] = json!(refusal.message()),
                }
                answer
            }
            Err(refusal) => json!({ "error": refusal.message() }),
        };
        self.say(answer);
    }
}

/// Makes a recording one of the clips, with what was followed as its targets. Returns its id.
fn add_clip(app: &App, recording: &Recording) -> Result<usize, Refusal> {
    let clip = app.clips.add(&recording.video, &ProjectLocation::Beside);
    let opened = clip.open().map_err(|error| Refusal::from(&*error))?;
    let table = files::read(&recording.table)
        .map_err(|error| Refusal::failed(format!("cannot read the table: {error}")))?;
    if has_boxes(&table) {
        let project = opened.hold().store.project().clone();
        let imported = import::read(import::Format::Csv, &table, &project, &[])?;
        app.clips.import(&opened, imported)?;
    }
    Ok(clip.id)
}

/// Whether a table has a row with a box; the first line are names.
fn has_boxes(table: &[u8]) -> bool {
    table
        .split(|byte| *byte == b'\n')
        .skip(1)
        .any(|row| row.split(|byte| *byte == b',').nth(1).is_some_and(|x| !x.is_empty()))
}

/// What the page is told of a target.
fn shown(id: u64, estimate: &Estimate) -> Value {
    json!({
        "id": id,
        "box": estimate.bbox,
        "corners": estimate.corners,
        "score": estimate.score,
        "status": estimate.status,
        "visible": estimate.visibility.as_ref().map(patchlock::Visibility::share),
    })
}

/// A recording that grows.
struct Recorder {
    folder: PathBuf,
    video: Mp4Writer<NamedTempFile>,
    size: (usize, usize),
    table: String,
    frames: usize,
    begun: Instant,
}

impl Recorder {
    fn begin(folder: PathBuf, first: &Picture) -> Result<Self, Refusal> {
        let cannot = |error: std::io::Error| cannot_keep(&folder, &error);
        std::fs::create_dir_all(&folder).map_err(cannot)?;
        let file = tempfile::Builder::new().prefix(".camera-").tempfile_in(&folder);
        let file = file.map_err(cannot)?;
        let size = (first.width, first.height);
        let rate = FrameRate::DEFAULT;
        let video = Mp4Writer::with_quantiser(file, size.0, size.1, rate, None, QUALITY)?;
        let table = "frame,x,y,w,h,score,status,time,id,key\n".to_owned();
        Ok(Self { folder, video, size, table, frames: 0, begun: Instant::now() })
    }

    /// Adds a picture with the targets in it; the boxes of some of them were drawn.
    fn push(
        &mut self,
        picture: &Picture,
        found: &[(u64, Estimate)],
        drawn: &[u64],
    ) -> Result<(), Refusal> {
        if (picture.width, picture.height) != self.size {
            return Err(Refusal::bad("the size of the pictures has changed during the recording"));
        }
        let time = self.begun.elapsed().as_secs_f64();
        self.video.push_at(&picture.to_rgb(), Some(time))?;
        let frame = self.frames;
        // Writing to a text does not fail.
        for (id, Estimate { bbox: BoundingBox { x, y, w, h }, score, status, .. }) in found {
            let _ = writeln!(
                self.table,
                "{frame},{x:.3},{y:.3},{w:.3},{h:.3},{score:.4},{status},{time:.4},{id},{}",
                drawn.contains(id)
            );
        }
        if found.is_empty() {
            let _ = writeln!(self.table, "{frame},,,,,,,{time:.4},,");
        }
        self.frames += 1;
        Ok(())
    }

    /// Completes the files; returns them with the number of frames.
    fn end(self) -> Result<(Recording, usize), Refusal> {
        let Self { folder, video, table, frames, .. } = self;
        let cannot = |error: std::io::Error| cannot_keep(&folder, &error);
        let file = video.finish()?;
        let video = keep(file.into_temp_path(), &folder, "camera.mp4").map_err(cannot)?;
        let mut file = NamedTempFile::new_in(&folder).map_err(cannot)?;
        file.write_all(table.as_bytes()).map_err(cannot)?;
        let name = video.with_extension("csv");
        let name = name.file_name().unwrap_or_default().to_string_lossy();
        let table = keep(file.into_temp_path(), &folder, &name).map_err(cannot)?;
        Ok((Recording { video, table }, frames))
    }
}

/// `GET /api/camera/recordings/N/{video,table}`
pub async fn recording(
    State(app): State<Arc<App>>,
    PathParam((number, what)): PathParam<(usize, String)>,
) -> Result<Response, Refusal> {
    let found = number.checked_sub(1).and_then(|at| lock(&app.recordings.0).get(at).cloned());
    let no_recording = || Refusal::unknown(format!("there is no recording {number}"));
    let Recording { video, table } = found.ok_or_else(no_recording)?;
    let (path, kind) = match what.as_str() {
        "video" => (video, "video/mp4"),
        "table" => (table, "text/csv; charset=utf-8"),
        _ => return Err(Refusal::unknown("a recording has a video and a table")),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    download(Box::new(path), kind, &name).await
}
