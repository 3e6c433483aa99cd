//! A page that shows the frames of a running command, and lets a person draw boxes on one of them.
//! Its door is that of the studio: this machine only, the token, the host, the pace.
//!
//! A frame is encoded only if somebody looks, and the next one for a page only when it has drawn the
//! last one. So a slow page sees fewer frames, and none of them late.

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::body::Body;
use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use axum::{Json, Router, middleware};
use patchlock::BoundingBox;
use patchlock_media::Picture;
use patchlock_track::start_box;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::runtime::Runtime;
use tokio::sync::watch;

use super::access::{self, Access};
use super::answer::{BodyReader, PathParam, Refusal};
use super::code::{self, CodeStatus, OneTimeCode, TokenRequest};
use super::error::Error;
use super::frames::jpeg;
use super::host::AllowedHosts;
use super::options::STRANGERS;
use super::timeouts::{SENDING, Timeouts};
use super::{connections, token};

/// Largest message of a page: many boxes.
const MESSAGE_BYTES: usize = 64 << 10;
/// How often somebody who waits for boxes is asked whether to stop.
const LOOK: Duration = Duration::from_millis(100);
/// Pages that may show the window within them: notebooks of this machine, and those that are served
/// by the same proxy.
const NOTEBOOKS: &str = "'self' http://localhost:* http://127.0.0.1:*";

const FILES: [(&str, &str, &str); 3] = [
    ("", "text/html; charset=utf-8", include_str!("../window/window.html")),
    ("window.mjs", "text/javascript; charset=utf-8", include_str!("../window/window.mjs")),
    ("window.css", "text/css; charset=utf-8", include_str!("../window/window.css")),
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
    picture: Picture,
    about: Value,
}

struct WindowState {
    access: Access,
    code: OneTimeCode,
    frames: watch::Sender<Option<Arc<WindowFrame>>>,
    /// Pages that are open.
    pages: AtomicUsize,
    question: Mutex<Question>,
    answered: Condvar,
    /// The sources of pages that may show this one within them.
    frame_ancestors: String,
}

/// Whether boxes are wanted, and those that a person has drawn.
#[derive(Default)]
struct Question {
    /// Number, width and height of the frame.
    open: Option<[usize; 3]>,
    answer: Option<Answer>,
}

/// What a page says.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum PageMessage {
    /// The last frame was drawn.
    Drawn,
    /// Boxes: left, top, width, height.
    Boxes(Vec<[f64; 4]>),
    /// No box is drawn.
    Cancel,
}

/// The answer of a person.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// At least one box.
    Boxes(Vec<BoundingBox>),
    /// The person wants none.
    Cancelled,
    /// Nobody wants the answer any more.
    Stopped,
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
        let access = Access::new(address, hosts, token::draw().map_err(Error::Start)?);
        let shared = Arc::new(WindowState {
            access: access.map_err(Error::Start)?,
            code: OneTimeCode::default(),
            frames: watch::Sender::new(None),
            pages: AtomicUsize::new(0),
            question: Mutex::default(),
            answered: Condvar::new(),
            frame_ancestors,
        });
        let start = |error: std::io::Error| Error::Start(error.to_string());
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(start)?;
        let routes = routes(Arc::clone(&shared));
        let entered = runtime.enter();
        let listener = tokio::net::TcpListener::from_std(listener).map_err(start)?;
        drop(entered);
        runtime.spawn(connections::accept(listener, routes, STRANGERS, Timeouts::default()));
        Ok(Self { shared, runtime: Some(runtime) })
    }

    /// The port that it listens on.
    pub fn port(&self) -> u16 {
        self.shared.access.port()
    }

    /// The address of the page, with the token.
    pub fn address(&self) -> String {
        self.shared.access.address(false, self.shared.access.token())
    }

    /// An address for the arguments of a browser, which works once.
    ///
    /// # Errors
    /// [`Error::Start`] if the system gives no random numbers.
    pub fn address_once(&self) -> Result<String, Error> {
        let code = self.shared.code.draw().map_err(Error::Start)?;
        Ok(self.shared.access.address(false, &code))
    }

    /// Whether a page is open.
    pub fn is_watched(&self) -> bool {
        self.shared.pages.load(Ordering::Relaxed) > 0
    }

    /// Shows a frame, if a page is open. `about` has the `targets` to draw and what is written below
    /// the frame.
    pub fn show(&self, picture: &Picture, about: impl FnOnce() -> Value) {
        if self.is_watched() {
            let shown = WindowFrame { picture: picture.clone(), about: about() };
            self.shared.frames.send_replace(Some(Arc::new(shown)));
        }
    }

    /// Shows a frame and waits until a person has drawn boxes on it, or `stopped` returns true.
    pub fn ask(&self, frame: usize, picture: &Picture, stopped: &dyn Fn() -> bool) -> Answer {
        let (width, height) = (picture.width, picture.height);
        *self.shared.question() = Question { open: Some([frame, width, height]), answer: None };
        let about = json!({ "ask": true, "frame": frame, "targets": [] });
        let shown = WindowFrame { picture: picture.clone(), about };
        self.shared.frames.send_replace(Some(Arc::new(shown)));
        let mut question = self.shared.question();
        loop {
            if let Some(answer) = question.answer.take() {
                return answer;
            }
            if stopped() {
                question.open = None;
                return Answer::Stopped;
            }
            let wait = self.shared.answered.wait_timeout(question, LOOK);
            question = wait.unwrap_or_else(PoisonError::into_inner).0;
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
    fn question(&self) -> MutexGuard<'_, Question> {
        self.question.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the answer of a page; what the page is told.
    fn answer(&self, said: PageMessage) -> Value {
        let mut question = self.question();
        let Some([frame, width, height]) = question.open else {
            return json!({ "error": "the boxes were drawn already" });
        };
        let answer = match said {
            PageMessage::Drawn => return Value::Null,
            PageMessage::Cancel => Answer::Cancelled,
            PageMessage::Boxes(boxes) => {
                let boxes: Vec<BoundingBox> =
                    boxes.into_iter().map(|[x, y, w, h]| BoundingBox { x, y, w, h }).collect();
                if boxes.is_empty() {
                    return json!({ "error": "no box was drawn" });
                }
                let wrong = boxes
                    .iter()
                    .find_map(|bbox| start_box::check(bbox, frame, width, height).err());
                if let Some(error) = wrong {
                    return json!({ "error": error.to_string() });
                }
                Answer::Boxes(boxes)
            }
        };
        (question.open, question.answer) = (None, Some(answer));
        self.answered.notify_all();
        json!({ "taken": true })
    }
}

fn routes(shared: Arc<WindowState>) -> Router {
    let guard = |State(shared): State<Arc<WindowState>>, request, next| async move {
        access::guarded(&shared.access, &shared.frame_ancestors, request, next).await
    };
    Router::new()
        .route(code::PATH, post(exchange))
        .route("/api/frames", get(frames))
        .route("/api/{*rest}", any(unknown))
        .route("/", get(async || embedded("")))
        .route("/{file}", get(async |PathParam(path): PathParam<String>| embedded(&path)))
        .fallback(unknown)
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared)
}

async fn unknown() -> Refusal {
    Refusal::unknown("there is nothing at this address")
}

fn embedded(path: &str) -> Response {
    match FILES.iter().find(|(name, ..)| *name == path) {
        Some((_, kind, text)) => ([(CONTENT_TYPE, *kind)], *text).into_response(),
        None => Refusal::unknown("the page has no such file").into_response(),
    }
}

/// `POST /api/token`
async fn exchange(
    State(shared): State<Arc<WindowState>>,
    body: Body,
) -> Result<Json<Value>, Refusal> {
    let timeouts = Timeouts::default();
    let TokenRequest { code } =
        BodyReader::new(body, code::REQUEST_BYTES, timeouts.body)?.json().await?;
    match shared.code.take(&code, timeouts.code) {
        CodeStatus::Valid => Ok(Json(json!({ "token": shared.access.token() }))),
        CodeStatus::Expired | CodeStatus::Unknown => {
            let message = "this address was used already, or opened too late";
            Err(Refusal::new(StatusCode::UNAUTHORIZED, message)
                .hint("open the address that the program has printed"))
        }
    }
}

/// `GET /api/frames`
async fn frames(
    State(shared): State<Arc<WindowState>>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Refusal> {
    let upgrade = upgrade.map_err(|error| Refusal::bad(error.body_text()))?;
    let upgrade = upgrade.protocols([access::PROTOCOL]).max_message_size(MESSAGE_BYTES);
    Ok(upgrade.on_upgrade(async move |socket| {
        shared.pages.fetch_add(1, Ordering::Relaxed);
        page(socket, &shared).await;
        shared.pages.fetch_sub(1, Ordering::Relaxed);
    }))
}

/// Sends the newest frame whenever the page has drawn the last one, until it is closed.
async fn page(mut socket: WebSocket, shared: &Arc<WindowState>) {
    let mut frames = shared.frames.subscribe();
    frames.mark_changed();
    let mut is_ready = true;
    loop {
        let message = tokio::select! {
            changed = frames.changed(), if is_ready => {
                let shown = frames.borrow_and_update().clone();
                match (changed, shown) {
                    (Err(_), _) => return,
                    (Ok(()), None) => continue,
                    (Ok(()), Some(shown)) => {
                        let encoded = tokio::task::spawn_blocking(move || encoded(&shown)).await;
                        let Ok(Ok(bytes)) = encoded else { return };
                        is_ready = false;
                        Message::Binary(bytes.into())
                    }
                }
            },
            received = socket.recv() => match received {
                Some(Ok(Message::Text(text))) => match serde_json::from_str(&text) {
                    Ok(PageMessage::Drawn) => {
                        is_ready = true;
                        continue;
                    }
                    Ok(said) => Message::Text(shared.answer(said).to_string().into()),
                    Err(_) => return,
                },
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => continue,
            },
        };
        let sent = tokio::time::timeout(SENDING, socket.send(message)).await;
        if !matches!(sent, Ok(Ok(()))) {
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
