//! A page that shows the frames of a running command, and lets a person draw boxes on one of them.
//! Its door is that of the studio: this machine only, the token, the host, the pace.
//!
//! A frame is encoded only if somebody looks, and the next one for a page only when it has drawn the
//! last one. So a slow page sees fewer frames, and none of them late.

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{Message, WebSocket};
use axum::response::Response;
use axum::routing::{any, get, post};
use axum::{Router, middleware};
use patchlock::BoundingBox;
use patchlock_media::{NextFrame, Picture};
use patchlock_track::start_box;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::runtime::Runtime;
use tokio::sync::watch;

use super::access::{self, Access};
use super::answer::{PathParam, Refusal, aside};
use super::code::{self, TokenExchange};
use super::error::Error;
use super::frames::jpeg;
use super::handler::boxed;
use super::host::AllowedHosts;
use super::options::STRANGERS;
use super::timeouts::{SENDING, Timeouts};
use super::{connections, embedded, live, lock, token, unknown};
use crate::page::{HTML, PageFile, SCRIPT, STYLE};

/// Largest message of a page: many boxes.
const MESSAGE_BYTES: usize = 64 << 10;
/// How often somebody who waits for boxes is asked whether to stop.
const LOOK: Duration = Duration::from_millis(100);
/// Pages that may show the window within them: notebooks of this machine, and those that are served
/// by the same proxy.
const NOTEBOOKS: &str = "'self' http://localhost:* http://127.0.0.1:*";

/// The first is served for the address without a path.
const FILES: &[PageFile] = &[
    PageFile { path: "", kind: HTML, bytes: include_bytes!("../window/window.html") },
    PageFile { path: "window.mjs", kind: SCRIPT, bytes: include_bytes!("../window/window.mjs") },
    PageFile { path: "window.css", kind: STYLE, bytes: include_bytes!("../window/window.css") },
];

/// What the caller of a window decides.
#[derive(Debug, Clone)]
pub struct WindowOptions {
    /// The port to listen on; with 0, the system chooses one.
    pub port: u16,
    /// The hosts under which the page is read elsewhere, through a proxy for example.
    pub hosts: AllowedHosts,
    /// Whether a notebook may show the page within its own: one of this machine or of these hosts.
    pub in_notebook: bool,
}

/// A page with its server, which answers as long as this is not dropped.
pub struct Window {
    shared: Arc<WindowState>,
    /// `None` only while it is dropped.
    runtime: Option<Runtime>,
}

/// A frame, and what the page writes and draws on it.
struct WindowFrame {
    number: usize,
    picture: Arc<Picture>,
    about: Value,
}

struct WindowState {
    access: Arc<Access>,
    code: Arc<TokenExchange>,
    frames: watch::Sender<Option<Arc<WindowFrame>>>,
    /// Pages that are open.
    pages: AtomicUsize,
    question: Mutex<Question>,
    answered: Condvar,
    /// Targets whose boxes were drawn again, in the order of their ids.
    redrawn: Mutex<Vec<RedrawnTarget>>,
}

/// Whether boxes are wanted, and those that a person has drawn.
#[derive(Default)]
struct Question {
    /// Number, width and height of the frame.
    open: Option<[usize; 3]>,
    /// The boxes that were drawn; none if the person wants none.
    answer: Option<Vec<BoundingBox>>,
    /// Whether a newer frame is wanted, in place of this one.
    newer: bool,
}

/// What a page says.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum PageMessage {
    /// The last frame was drawn.
    Drawn,
    /// Boxes were drawn.
    Boxes(DrawnBoxes),
    /// A newer frame is wanted.
    Newer,
    /// No box is drawn.
    Cancel,
    /// A target was drawn again while it is tracked.
    Redraw(RestartRequest),
}

/// Boxes on the frame of this number: left, top, width, height.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DrawnBoxes {
    frame: usize,
    boxes: Vec<[f64; 4]>,
}

/// The box of a target on a frame that the page shows.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RestartRequest {
    frame: usize,
    id: Option<u64>,
    #[serde(rename = "box")]
    bbox: [f64; 4],
}

/// What a page asks for.
enum PageRequest {
    /// It is answered with these boxes, or with none.
    Answer(Vec<BoundingBox>),
    Newer,
    Nothing,
}

/// A target that a person has drawn again on a frame that was shown.
#[derive(Debug, Clone)]
pub struct RedrawnTarget {
    /// The target's id, as it was shown; `None` for the only target.
    pub id: Option<u64>,
    /// Number of the frame.
    pub frame: usize,
    /// The frame.
    pub picture: Arc<Picture>,
    /// The box.
    pub bbox: BoundingBox,
}

impl Window {
    /// Listens on a port of this machine.
    ///
    /// # Errors
    /// [`Error::Listen`] if the port is taken, [`Error::Start`] if the system gives no threads.
    pub fn open(options: WindowOptions) -> Result<Self, Error> {
        let WindowOptions { port, hosts, in_notebook } = options;
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let listen = |reason| Error::Listen { address, reason };
        let listener = TcpListener::bind(address).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        listener.set_nonblocking(true).map_err(listen)?;
        let frame_ancestors = match in_notebook {
            true => hosts.allowed.iter().fold(NOTEBOOKS.to_owned(), |all, host| {
                format!("{all} http://{host} https://{host}")
            }),
            false => "'none'".to_owned(),
        };
        let token = token::draw().map_err(Error::Start)?;
        let access = Access::new(address, hosts, token, frame_ancestors);
        let access = Arc::new(access.map_err(Error::Start)?);
        let (timeouts, hint) =
            (Timeouts::default(), "open the address that the program has printed");
        let shared = Arc::new(WindowState {
            code: TokenExchange::new(Arc::clone(&access), timeouts, None, hint),
            access,
            frames: watch::Sender::new(None),
            pages: AtomicUsize::new(0),
            question: Mutex::default(),
            answered: Condvar::new(),
            redrawn: Mutex::default(),
        });
        let start = |error: std::io::Error| Error::Start(error.to_string());
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(start)?;
        let routes = routes(&shared);
        let entered = runtime.enter();
        let listener = tokio::net::TcpListener::from_std(listener).map_err(start)?;
        drop(entered);
        runtime.spawn(connections::accept(listener, routes, STRANGERS, timeouts));
        Ok(Self { shared, runtime: Some(runtime) })
    }

    /// The port that it listens on.
    pub fn port(&self) -> u16 {
        self.shared.access.address.port()
    }

    /// The address of the page, with the token.
    pub fn address(&self) -> String {
        self.shared.access.url(false, &self.shared.access.token)
    }

    /// An address for the arguments of a browser, which works once.
    ///
    /// # Errors
    /// [`Error::Start`] if the system gives no random numbers.
    pub fn address_once(&self) -> Result<String, Error> {
        let code = self.shared.code.draw().map_err(Error::Start)?;
        Ok(self.shared.access.url(false, &code))
    }

    /// Whether a page is open.
    pub fn is_watched(&self) -> bool {
        self.shared.pages.load(Ordering::Relaxed) > 0
    }

    /// Shows a frame, if a page is open. `about` has the `targets` to draw and what is written below
    /// the frame; with `redraw`, their boxes can be drawn again.
    pub fn show(&self, number: usize, picture: &Arc<Picture>, about: impl FnOnce() -> Value) {
        if self.is_watched() {
            let shown = WindowFrame { number, picture: Arc::clone(picture), about: about() };
            self.shared.frames.send_replace(Some(Arc::new(shown)));
        }
    }

    /// The boxes that were drawn again since the last call, the last one of each target.
    pub fn redrawn(&self) -> impl Iterator<Item = RedrawnTarget> {
        std::mem::take(&mut *lock(&self.shared.redrawn)).into_iter()
    }

    /// Shows a frame and waits until a person has drawn boxes on it, which are returned: none if the
    /// person wants none, or `stopped` returns true. Of a live source, whenever the person wants a
    /// newer frame, `newer` is called until it has one, which is shown in place of the other.
    ///
    /// # Errors
    /// The first one of `newer`.
    pub fn ask<E>(
        &self,
        shown: &mut (usize, Arc<Picture>),
        mut newer: Option<&mut dyn FnMut() -> Result<NextFrame, E>>,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<BoundingBox>, E> {
        self.shared.pose(shown, newer.is_some());
        loop {
            match self.shared.page_request(stopped) {
                PageRequest::Answer(boxes) => return Ok(boxes),
                PageRequest::Nothing => continue,
                PageRequest::Newer => {}
            }
            match newer.as_mut().map_or(Ok(NextFrame::End), |newer| newer())? {
                NextFrame::Frame(number, picture) => {
                    let next = (number, Arc::new(picture));
                    // Boxes may have been drawn on the other frame meanwhile.
                    if self.shared.pose(&next, true) {
                        *shown = next;
                    }
                }
                NextFrame::NotYet => {}
                NextFrame::End => {
                    newer = None;
                    self.shared.pose(shown, false);
                }
            }
        }
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            // Pages get the answer that is on its way.
            runtime.shutdown_timeout(Duration::from_millis(200));
        }
    }
}

impl WindowState {
    /// Asks for boxes on a frame, unless those of the frame before were drawn; whether it did.
    fn pose(&self, (number, picture): &(usize, Arc<Picture>), has_newer: bool) -> bool {
        let mut question = lock(&self.question);
        if question.answer.is_some() {
            return false;
        }
        let open = Some([*number, picture.width, picture.height]);
        *question = Question { open, ..Question::default() };
        let about = json!({ "ask": true, "frame": number, "newer": has_newer, "targets": [] });
        let shown = WindowFrame { number: *number, picture: Arc::clone(picture), about };
        self.frames.send_replace(Some(Arc::new(shown)));
        true
    }

    /// Waits shortly for what a page says.
    fn page_request(&self, stopped: &dyn Fn() -> bool) -> PageRequest {
        let mut question = lock(&self.question);
        if question.answer.is_none() && !question.newer {
            let wait = self.answered.wait_timeout(question, LOOK);
            question = wait.unwrap_or_else(PoisonError::into_inner).0;
        }
        if let Some(answer) = question.answer.take() {
            return PageRequest::Answer(answer);
        }
        if stopped() {
            question.open = None;
            return PageRequest::Answer(Vec::new());
        }
        if question.newer { PageRequest::Newer } else { PageRequest::Nothing }
    }

    /// Takes what a page says that was sent these frames; what it is told.
    fn told(&self, said: PageMessage, sent: &[Option<Arc<WindowFrame>>]) -> Option<Value> {
        let taken = json!({ "taken": true });
        let told = match said {
            PageMessage::Drawn => return None,
            PageMessage::Newer => {
                let mut question = lock(&self.question);
                question.newer = question.open.is_some();
                self.answered.notify_all();
                return None;
            }
            PageMessage::Boxes(drawn) => self.answer(Some(drawn)).map(|()| taken),
            PageMessage::Cancel => self.answer(None).map(|()| taken),
            PageMessage::Redraw(drawn) => {
                self.redraw(sent, drawn).map(|()| json!({ "redrawn": true }))
            }
        };
        Some(told.unwrap_or_else(|error| json!({ "error": error })))
    }

    /// Takes boxes, or that there are none.
    fn answer(&self, drawn: Option<DrawnBoxes>) -> Result<(), String> {
        let mut question = lock(&self.question);
        let Some([frame, width, height]) = question.open else {
            return Err("the boxes were drawn already".to_owned());
        };
        let boxes = match drawn {
            None => Vec::new(),
            Some(DrawnBoxes { frame: drawn, boxes }) => {
                ensure!(drawn == frame, "the boxes are on frame {drawn}, not on frame {frame}");
                ensure!(!boxes.is_empty(), "no box was drawn");
                let boxes: Vec<BoundingBox> = boxes.into_iter().map(bounding_box).collect();
                for bbox in &boxes {
                    start_box::check(bbox, frame, width, height).map_err(|it| it.to_string())?;
                }
                boxes
            }
        };
        (question.open, question.answer) = (None, Some(boxes));
        self.answered.notify_all();
        Ok(())
    }

    /// Takes the new box of a target on one of the frames that a page shows.
    fn redraw(
        &self,
        sent: &[Option<Arc<WindowFrame>>],
        drawn: RestartRequest,
    ) -> Result<(), String> {
        let RestartRequest { frame, id, bbox } = drawn;
        let shown = sent.iter().flatten().find(|shown| shown.number == frame);
        let shown = shown.ok_or_else(|| format!("frame {frame} is not shown any more"))?;
        let targets = shown.about["targets"].as_array().into_iter().flatten();
        let is_known = { targets }.any(|target| target["id"].as_u64() == id);
        ensure!(is_known && shown.about["redraw"] == true, "this target cannot be drawn again");
        let (bbox, picture) = (bounding_box(bbox), Arc::clone(&shown.picture));
        start_box::check(&bbox, frame, picture.width, picture.height)
            .map_err(|error| error.to_string())?;
        let mut redrawn = lock(&self.redrawn);
        redrawn.retain(|target| target.id != id);
        let place = redrawn.partition_point(|target| target.id < id);
        redrawn.insert(place, RedrawnTarget { id, frame, picture, bbox });
        Ok(())
    }
}

fn bounding_box([x, y, w, h]: [f64; 4]) -> BoundingBox {
    BoundingBox { x, y, w, h }
}

fn routes(shared: &Arc<WindowState>) -> Router {
    let file = async |PathParam(path): PathParam<String>| embedded(FILES, &path);
    Router::new()
        .route(code::PATH, post(boxed(&shared.code, code::exchange)))
        .route("/api/frames", get(boxed(shared, frames)))
        .route("/api/{*rest}", any(boxed(shared, unknown)))
        .route("/", get(boxed(shared, async || embedded(FILES, ""))))
        .route("/{file}", get(boxed(shared, file)))
        .fallback(boxed(shared, unknown))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared.access), access::check))
}

/// `GET /api/frames`
async fn frames(
    State(shared): State<Arc<WindowState>>,
    upgrade: live::Upgrade,
) -> Result<Response, Refusal> {
    live::talk(upgrade, MESSAGE_BYTES, async move |socket| {
        shared.pages.fetch_add(1, Ordering::Relaxed);
        page(socket, &shared).await;
        shared.pages.fetch_sub(1, Ordering::Relaxed);
    })
}

/// Sends the newest frame whenever the page has drawn the last one, until it is closed.
async fn page(mut socket: WebSocket, shared: &Arc<WindowState>) {
    let mut frames = shared.frames.subscribe();
    frames.mark_changed();
    let mut is_ready = true;
    // The page shows one of these; while a target is drawn again, the next one waits there.
    let mut sent = [None, None];
    loop {
        let message = tokio::select! {
            changed = frames.changed(), if is_ready => {
                let shown = frames.borrow_and_update().clone();
                match (changed, shown) {
                    (Err(_), _) => return,
                    (Ok(()), None) => continue,
                    (Ok(()), Some(shown)) => {
                        sent = [sent[1].take(), Some(Arc::clone(&shown))];
                        let Ok(bytes) = aside(move || encoded(&shown)).await else { return };
                        is_ready = false;
                        Message::Binary(bytes.into())
                    }
                }
            },
            received = socket.recv() => match received {
                Some(Ok(Message::Text(text))) => {
                    let Ok(said) = serde_json::from_slice(text.as_bytes()) else { return };
                    is_ready |= matches!(said, PageMessage::Drawn);
                    let Some(answer) = shared.told(said, &sent) else { continue };
                    Message::Text(answer.to_string().into())
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => continue,
            },
        };
        let sending = tokio::time::timeout(SENDING, socket.send(message)).await;
        if !matches!(sending, Ok(Ok(()))) {
            return;
        }
    }
}

/// A frame as it is sent: the length of what is said about it in four bytes, little end first; that
/// as JSON; a JPEG.
fn encoded(shown: &WindowFrame) -> Result<Vec<u8>, Refusal> {
    let about = shown.about.to_string();
    let mut bytes = (about.len() as u32).to_le_bytes().to_vec();
    bytes.extend(about.as_bytes());
    bytes.extend(jpeg(&shown.picture, 0)?);
    Ok(bytes)
}

#[cfg(test)]
mod tests;
