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
use super::answer::{Arriving, At, Refusal};
use super::frames::jpeg;
use super::once::{self, Exchange, Once, Worth};
use super::{Error, Patience, SENDING, STRANGERS, connections, token};

/// Largest message of a page: many boxes.
const MESSAGE_BYTES: usize = 64 << 10;
/// How often somebody who waits for boxes is asked whether to stop.
const LOOK: Duration = Duration::from_millis(100);
/// Pages of this machine, which may show the window within them: notebooks do.
const NOTEBOOKS: &str = "http://localhost:* http://127.0.0.1:*";

const FILES: [(&str, &str, &str); 3] = [
    ("", "text/html; charset=utf-8", include_str!("../window/window.html")),
    ("window.mjs", "text/javascript; charset=utf-8", include_str!("../window/window.mjs")),
    ("window.css", "text/css; charset=utf-8", include_str!("../window/window.css")),
];

/// A page with its server, which answers as long as this is not dropped.
pub struct Window {
    shared: Arc<Shared>,
    /// `None` only while it is dropped.
    runtime: Option<Runtime>,
}

/// A frame, and what the page writes and draws on it.
struct Shown {
    picture: Picture,
    about: Value,
}

struct Shared {
    access: Access,
    once: Once,
    frames: watch::Sender<Option<Arc<Shown>>>,
    /// Pages that are open.
    pages: AtomicUsize,
    question: Mutex<Question>,
    answered: Condvar,
    in_notebook: bool,
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
enum Said {
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
    /// Listens on this port of this machine; with 0, the system chooses one. A window for a notebook
    /// may be shown within another page of this machine.
    ///
    /// # Errors
    /// [`Error::Listen`] if the port is taken, [`Error::Start`] if the system gives no threads.
    pub fn open(port: u16, in_notebook: bool) -> Result<Self, Error> {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let listen = |reason| Error::Listen { address, reason };
        let listener = TcpListener::bind(address).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        listener.set_nonblocking(true).map_err(listen)?;
        let access = Access::new(address, token::draw().map_err(Error::Start)?);
        let shared = Arc::new(Shared {
            access: access.map_err(Error::Start)?,
            once: Once::default(),
            frames: watch::Sender::new(None),
            pages: AtomicUsize::new(0),
            question: Mutex::default(),
            answered: Condvar::new(),
            in_notebook,
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
        runtime.spawn(connections::accept(listener, routes, STRANGERS, Patience::default()));
        Ok(Self { shared, runtime: Some(runtime) })
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
        let code = self.shared.once.draw().map_err(Error::Start)?;
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
            let shown = Shown { picture: picture.clone(), about: about() };
            self.shared.frames.send_replace(Some(Arc::new(shown)));
        }
    }

    /// Shows a frame and waits until a person has drawn boxes on it, or `stopped` returns true.
    pub fn ask(&self, frame: usize, picture: &Picture, stopped: &dyn Fn() -> bool) -> Answer {
        let (width, height) = (picture.width, picture.height);
        *self.shared.question() = Question { open: Some([frame, width, height]), answer: None };
        let about = json!({ "ask": true, "frame": frame, "targets": [] });
        let shown = Shown { picture: picture.clone(), about };
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

impl Shared {
    fn question(&self) -> MutexGuard<'_, Question> {
        self.question.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the answer of a page; what the page is told.
    fn answer(&self, said: Said) -> Value {
        let mut question = self.question();
        let Some([frame, width, height]) = question.open else {
            return json!({ "error": "the boxes were drawn already" });
        };
        let answer = match said {
            Said::Drawn => return Value::Null,
            Said::Cancel => Answer::Cancelled,
            Said::Boxes(boxes) => {
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

fn routes(shared: Arc<Shared>) -> Router {
    let guard = |State(shared): State<Arc<Shared>>, request, next| async move {
        let frames = if shared.in_notebook { NOTEBOOKS } else { "'none'" };
        access::guarded(&shared.access, frames, request, next).await
    };
    Router::new()
        .route(once::PATH, post(exchange))
        .route("/api/frames", get(frames))
        .route("/api/{*rest}", any(unknown))
        .route("/", get(async || embedded("")))
        .route("/{file}", get(async |At(path): At<String>| embedded(&path)))
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
async fn exchange(State(shared): State<Arc<Shared>>, body: Body) -> Result<Json<Value>, Refusal> {
    let patience = Patience::default();
    let Exchange { code } = Arriving::new(body, once::REQUEST_BYTES, patience.body)?.json().await?;
    match shared.once.take(&code, patience.code) {
        Worth::Token => Ok(Json(json!({ "token": shared.access.token() }))),
        Worth::Void | Worth::Unknown => {
            let message = "this address was used already, or opened too late";
            Err(Refusal::new(StatusCode::UNAUTHORIZED, message)
                .hint("open the address that the program has printed"))
        }
    }
}

/// `GET /api/frames`
async fn frames(
    State(shared): State<Arc<Shared>>,
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
async fn page(mut socket: WebSocket, shared: &Arc<Shared>) {
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
                    Ok(Said::Drawn) => {
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
fn encoded(shown: &Shown) -> Result<Vec<u8>, Refusal> {
    let about = shown.about.to_string();
    let mut bytes = (about.len() as u32).to_le_bytes().to_vec();
    bytes.extend(about.as_bytes());
    bytes.extend(jpeg(&shown.picture, 0)?);
    Ok(bytes)
}
