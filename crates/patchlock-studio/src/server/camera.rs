//! The camera of the browser: it sends pictures, and is told where the target is. A picture that
//! comes while another one is tracked replaces the one that waits.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::response::Response;
use futures_util::{SinkExt as _, StreamExt as _};
use patchlock::{BoundingBox, Estimate};
use patchlock_media::{FrameRate, Mp4Writer, Picture, image_file};
use patchlock_track::session::Session;
use serde::Deserialize;
use serde_json::{Value, json};
use tempfile::NamedTempFile;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};

use super::access::PROTOCOL;
use super::answer::{At, Refusal};
use super::files::{cannot_keep, download, keep};
use super::{App, SENDING};

/// Largest picture, in bytes of JPEG.
const PICTURE_BYTES: usize = 16 << 20;
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
    /// Follow what is in this box of the next picture.
    Start {
        #[serde(rename = "box")]
        bbox: BoundingBox,
    },
    /// Follow nothing.
    Stop(bool),
    /// Begin or end a recording.
    Record(bool),
}

/// What waits for the thread that tracks.
#[derive(Default)]
struct Waiting {
    orders: Vec<Order>,
    /// The newest picture, with its number.
    picture: Option<(usize, Bytes)>,
    closed: bool,
}

#[derive(Default)]
struct Desk {
    waiting: Mutex<Waiting>,
    came: Condvar,
}

impl Desk {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for something to do.
    fn next(&self) -> Waiting {
        let idle = |waiting: &mut Waiting| {
            waiting.orders.is_empty() && waiting.picture.is_none() && !waiting.closed
        };
        let waited = self.came.wait_while(self.lock(), idle);
        let mut waiting = waited.unwrap_or_else(PoisonError::into_inner);
        let closed = waiting.closed;
        Waiting { closed, ..std::mem::take(&mut *waiting) }
    }
}

/// `GET /api/camera`
pub async fn camera(
    State(app): State<Arc<App>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Refusal> {
    let upgrade = upgrade.map_err(|error| Refusal::bad(error.body_text()))?;
    let upgrade = upgrade.protocols([PROTOCOL]).max_message_size(PICTURE_BYTES);
    Ok(upgrade.max_frame_size(PICTURE_BYTES).on_upgrade(move |socket| converse(socket, app)))
}

async fn converse(socket: WebSocket, app: Arc<App>) {
    let desk = Arc::new(Desk::default());
    let (answers, mut to_send) = unbounded_channel();
    let follower = Follower::new(app, answers.clone());
    let theirs = Arc::clone(&desk);
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
            let mut waiting = desk.lock();
            let mut dropped = None;
            match message {
                Message::Binary(jpeg) => {
                    dropped = waiting.picture.replace((number, jpeg));
                    number += 1;
                }
                Message::Text(text) => match serde_json::from_str(&text) {
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
            desk.came.notify_all();
            if let Some((number, _)) = dropped {
                let _ = answers.send(json!({ "frame": number, "dropped": true, "ms": 0 }));
            }
        }
    };
    tokio::select! { () = sending => {}, () = receiving => {} }
    desk.lock().closed = true;
    desk.came.notify_all();
}

/// Follows a target in the pictures of one camera, and records them.
struct Follower {
    app: Arc<App>,
    answers: UnboundedSender<Value>,
    session: Option<Session>,
    begin: Option<BoundingBox>,
    recorder: Option<Recorder>,
    /// Whether to record from the next picture on.
    record: bool,
}

impl Follower {
    fn new(app: Arc<App>, answers: UnboundedSender<Value>) -> Self {
        Self { app, answers, session: None, begin: None, recorder: None, record: false }
    }

    fn run(mut self, desk: &Desk) {
        loop {
            let Waiting { orders, picture, closed } = desk.next();
            for order in orders {
                self.obey(order);
            }
            if let Some((number, jpeg)) = picture {
                let answer = self.follow(number, &jpeg).unwrap_or_else(|refusal| {
                    // What cannot be followed is not tried again with each picture.
                    (self.session, self.begin) = (None, None);
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
            Order::Start { bbox } => (self.session, self.begin) = (None, Some(bbox)),
            Order::Stop(true) => (self.session, self.begin) = (None, None),
            Order::Stop(false) => {}
            Order::Record(record) => {
                self.record = record;
                if !record {
                    self.end_recording();
                }
            }
        }
    }

    fn follow(&mut self, number: usize, jpeg: &[u8]) -> Result<Value, Refusal> {
        let picture = image_file::decode_within(jpeg, self.app.settings.limits);
        let picture = picture.map_err(|error| Refusal::bad(format!("not a picture: {error}")))?;
        let begun = Instant::now();
        let estimate = self.estimate(&picture)?;
        let ms = 1e3 * begun.elapsed().as_secs_f64();
        self.record(&picture, estimate.as_ref())?;
        let Some(estimate) = estimate else {
            return Ok(json!({ "frame": number, "box": null, "ms": ms }));
        };
        Ok(json!({
            "frame": number,
            "box": estimate.bbox,
            "corners": estimate.corners,
            "score": estimate.score,
            "status": estimate.status,
            "visible": estimate.visibility.as_ref().map(patchlock::Visibility::share),
            "ms": ms,
        }))
    }

    fn estimate(&mut self, picture: &Picture) -> Result<Option<Estimate>, Refusal> {
        let failed = |error: patchlock::Error| Refusal::bad(error.to_string());
        let frame = picture.frame().map_err(failed)?;
        if let Some(bbox) = self.begin.take() {
            let engine = &self.app.settings;
            let (config, pool) = (engine.config.clone(), Arc::clone(&engine.pool));
            let (session, _) = Session::start(config, pool, &frame, bbox).map_err(failed)?;
            let estimate = session.estimate().clone();
            self.session = Some(session);
            return Ok(Some(estimate));
        }
        let Some(session) = &mut self.session else { return Ok(None) };
        let (estimate, _) = session.update(&frame).map_err(failed)?;
        Ok(Some(estimate.clone()))
    }

    fn record(&mut self, picture: &Picture, found: Option<&Estimate>) -> Result<(), Refusal> {
        if !self.record {
            return Ok(());
        }
        let folder = &self.app.uploads;
        let recorder = match &mut self.recorder {
            Some(recorder) => recorder,
            None => self.recorder.insert(Recorder::begin(folder.clone(), picture)?),
        };
        let pushed = recorder.push(picture, found);
        if pushed.is_err() {
            self.record = false;
            self.end_recording();
        }
        pushed
    }

    fn end_recording(&mut self) {
        let Some(recorder) = self.recorder.take() else { return };
        let answer = match recorder.end() {
            Ok(recording) => {
                let frames = recording.1;
                let mut all = self.app.recordings.lock();
                all.push(recording.0);
                json!({ "recording": all.len(), "frames": frames })
            }
            Err(refusal) => json!({ "error": refusal.message() }),
        };
        self.say(answer);
    }
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
        let table = "frame,x,y,w,h,score,status,time\n".to_owned();
        Ok(Self { folder, video, size, table, frames: 0, begun: Instant::now() })
    }

    fn push(&mut self, picture: &Picture, found: Option<&Estimate>) -> Result<(), Refusal> {
        if (picture.width, picture.height) != self.size {
            return Err(Refusal::bad("the size of the pictures has changed during the recording"));
        }
        let time = self.begun.elapsed().as_secs_f64();
        self.video.push_at(&picture.to_rgb(), Some(time))?;
        let frame = self.frames;
        // Writing to a text does not fail.
        let _ = match found {
            Some(Estimate { bbox: BoundingBox { x, y, w, h }, score, status, .. }) => writeln!(
                self.table,
                "{frame},{x:.3},{y:.3},{w:.3},{h:.3},{score:.4},{status},{time:.4}"
            ),
            None => writeln!(self.table, "{frame},,,,,,,{time:.4}"),
        };
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

impl Recordings {
    fn lock(&self) -> MutexGuard<'_, Vec<Recording>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn get(&self, number: usize) -> Result<Recording, Refusal> {
        let all = self.lock();
        let found = number.checked_sub(1).and_then(|at| all.get(at)).cloned();
        found.ok_or_else(|| Refusal::unknown(format!("there is no recording {number}")))
    }
}

/// `GET /api/camera/recordings/N/{video,table}`
pub async fn recording(
    State(app): State<Arc<App>>,
    At((number, what)): At<(usize, String)>,
) -> Result<Response, Refusal> {
    let Recording { video, table } = app.recordings.get(number)?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match what.as_str() {
        "video" => download(video.clone(), "video/mp4", &name(&video)).await,
        "table" => download(table.clone(), "text/csv; charset=utf-8", &name(&table)).await,
        _ => Err(Refusal::unknown("a recording has a video and a table")),
    }
}
