//! The page in the browser: a server for this machine, with the clips that the command line named
//! and those that are uploaded.
//!
//! `access` decides who may ask: the token, the host and the origin of every request are checked
//! before anything else. `clips` answers about projects, `frames` serves single frames.

mod access;
mod advice;
mod answer;
mod camera;
mod clips;
mod connections;
mod doubts;
mod files;
mod frames;
mod jobs;
mod live;
mod look;
mod once;
mod pace;
mod token;
mod video;
pub mod window;

use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use axum::http::header::CONTENT_TYPE;
use axum::middleware;
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use patchlock::TrackerConfig;
use patchlock_media::Limits;
use patchlock_track::session;
use rayon::ThreadPool;

use crate::page;
use crate::project::beside;
use access::Access;
use answer::{At, Refusal};
use camera::Recordings;
use clips::Clips;
use once::Once;

/// [`Options::strangers`] of a server for people: many, since a page is read without the token, and
/// few enough that files can still be opened.
pub const STRANGERS: usize = 256;
/// How long a window may take to receive a message.
const SENDING: Duration = Duration::from_secs(20);

/// What a server needs to know.
#[derive(Debug, Clone)]
pub struct Options {
    /// Videos and folders of images to annotate.
    pub videos: Vec<PathBuf>,
    /// The project file of the only video; by default it is beside the video.
    pub project: Option<PathBuf>,
    /// The address to listen on. With port 0 the system chooses a free one.
    pub address: SocketAddr,
    /// The settings of the tracker.
    pub config: TrackerConfig,
    /// The number of threads of the tracker; by default one per logical processor.
    pub threads: Option<usize>,
    /// What a video may claim.
    pub limits: Limits,
    /// How long to wait for a client.
    pub patience: Patience,
    /// Most connections at once that have not shown the token. One more ends the oldest of them.
    pub strangers: usize,
    /// The folder for uploads and recordings, made when it is needed.
    pub uploads: PathBuf,
    /// Largest upload in bytes.
    pub upload_bytes: u64,
    /// Whether the page begins with the camera.
    pub camera: bool,
    /// A folder of the user's own, where the token is kept for a week. A server with the same
    /// address and videos has it again, so pages that are open go on. Without a folder, and if other
    /// machines can reach the address, each server has another token.
    pub tokens: Option<PathBuf>,
}

impl Options {
    /// The folder of the labels of all clips: that of the first project, or else of uploads.
    fn folder(&self) -> PathBuf {
        let file = self.project.clone();
        let file = file.or_else(|| self.videos.first().map(|video| beside(video, |_| false)));
        let folder = file.map(|file| file.parent().map(Path::to_path_buf).unwrap_or_default());
        match folder {
            Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
            Some(folder) => folder,
            None => self.uploads.clone(),
        }
    }

    /// The file for the token of a server that listens on this address.
    fn token_file(&self, address: SocketAddr) -> Option<PathBuf> {
        let folder = self.tokens.as_deref().filter(|_| address.ip().is_loopback())?;
        let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let videos: Vec<PathBuf> = self.videos.iter().map(absolute).collect();
        let (project, uploads) = (self.project.as_ref().map(absolute), absolute(&self.uploads));
        Some(token::file(folder, &format!("{address} {videos:?} {project:?} {uploads:?}")))
    }
}

/// How long the server waits for a client.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// For a request, until its headers are complete.
    pub headers: Duration,
    /// For a body, until its next bytes. All of it may take this and a second per KiB.
    pub body: Duration,
    /// For an answer, until the client takes the next bytes. All of it may take this and a second
    /// per KiB.
    pub answer: Duration,
    /// For the page that [`Server::address_once`] leads to, until it asks for the token.
    pub code: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            headers: Duration::from_secs(30),
            body: Duration::from_secs(20),
            answer: Duration::from_secs(60),
            // Browsers that are installed as snaps may take a minute to start.
            code: Duration::from_secs(120),
        }
    }
}

/// Why a server cannot start.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The address is taken or not of this machine.
    #[error("cannot listen on {address}: {reason}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The reason given by the system.
        reason: std::io::Error,
    },
    /// The system gives no random numbers or threads.
    #[error("cannot start the server: {0}")]
    Start(String),
    /// The only video or its project cannot be opened.
    #[error(transparent)]
    Clip(Arc<crate::project::Error>),
    /// The program ends, and the last changes of these projects could not be written.
    #[error("the last changes are lost: {}", shown(.0))]
    Unsaved(Vec<crate::project::Error>),
}

/// All errors in one line.
fn shown(errors: &[crate::project::Error]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// What all clips share.
#[derive(Clone)]
struct Settings {
    config: TrackerConfig,
    pool: Arc<ThreadPool>,
    limits: Limits,
}

/// What all requests share.
struct App {
    access: Access,
    /// The file that has the token.
    token_file: Option<PathBuf>,
    once: Once,
    clips: Clips,
    settings: Settings,
    patience: Patience,
    strangers: usize,
    uploads: PathBuf,
    upload_bytes: u64,
    camera: bool,
    recordings: Recordings,
}

/// A server that listens, but does not answer yet.
pub struct Server {
    listener: TcpListener,
    app: Arc<App>,
}

impl Server {
    /// Listens on the address of the options and opens the videos.
    ///
    /// # Errors
    /// [`Error`] if the address cannot be used, or if the only video cannot be opened. Of several,
    /// the page says which cannot.
    pub fn open(options: &Options) -> Result<Self, Error> {
        let listen = |reason| Error::Listen { address: options.address, reason };
        let pool = session::pool(options.threads);
        let pool = pool.map_err(|error| Error::Start(error.to_string()))?;
        let listener = TcpListener::bind(options.address).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let token_file = options.token_file(address);
        let token = token_file.as_deref().map_or_else(token::draw, token::kept);
        let token = token.map_err(Error::Start)?;
        let access = Access::new(address, token).map_err(Error::Start)?;
        let settings = Settings { config: options.config.clone(), pool, limits: options.limits };
        let app = Arc::new(App {
            access,
            token_file,
            once: Once::default(),
            clips: Clips::new(settings.clone(), &options.folder()),
            settings,
            patience: options.patience,
            strangers: options.strangers,
            uploads: options.uploads.clone(),
            upload_bytes: options.upload_bytes,
            camera: options.camera,
            recordings: Recordings::default(),
        });
        let only = options.videos.len() == 1;
        for video in &options.videos {
            let clip = app.clips.add(video, options.project.as_deref().filter(|_| only));
            if only {
                clip.open().map_err(Error::Clip)?;
            }
        }
        open_in_order(&app);
        Ok(Self { listener, app })
    }

    /// The address to open in the browser. It holds the token that allows changes.
    pub fn address(&self) -> String {
        let access = &self.app.access;
        access.address(self.app.camera, access.token())
    }

    /// An address for the arguments of a browser, which other users of the machine can read.
    /// Instead of the token it holds a code: the first page that uses it within [`Patience::code`]
    /// gets the token.
    ///
    /// # Errors
    /// [`Error::Start`] if the system gives no random numbers.
    pub fn address_once(&self) -> Result<String, Error> {
        let code = self.app.once.draw().map_err(Error::Start)?;
        Ok(self.app.access.address(self.app.camera, &code))
    }

    /// The server without its listener.
    #[doc(hidden)]
    pub fn in_process(self) -> InProcess {
        InProcess { routes: routes(Arc::clone(&self.app)), app: self.app }
    }

    /// Answers requests until `stopped` returns true, which is asked ten times a second. Returns the
    /// project files with changes that could not be written before, and now were.
    ///
    /// # Errors
    /// [`Error::Start`] if the system gives no threads; [`Error::Unsaved`] if changes could not be
    /// written.
    pub fn run(self, stopped: impl Fn() -> bool) -> Result<Vec<PathBuf>, Error> {
        let start = |error: std::io::Error| Error::Start(error.to_string());
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(start)?;
        self.listener.set_nonblocking(true).map_err(start)?;
        let routes = routes(Arc::clone(&self.app));
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            let App { strangers, patience, .. } = *self.app;
            tokio::spawn(connections::accept(listener, routes, strangers, patience));
            while !stopped() {
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
            Ok(())
        });
        let (saved, failed) = self.app.clips.close();
        // What still runs aside, an import for example, is not waited for.
        runtime.shutdown_timeout(Duration::from_secs(1));
        if !failed.is_empty() {
            return Err(Error::Unsaved(failed));
        }
        served.map(|()| saved).map_err(start)
    }
}

/// A server without connections: fuzzing calls it in its own process. No part of the public
/// interface.
#[doc(hidden)]
pub struct InProcess {
    app: Arc<App>,
    routes: Router,
}

impl InProcess {
    /// The answer to a request, which passes all checks that one from a connection does.
    pub async fn answer(&self, request: Request<Body>) -> Response {
        let service = TowerToHyperService::new(self.routes.clone());
        service.call(request).await.unwrap_or_else(|never| match never {})
    }
}

/// Stops all jobs and waits for their threads.
impl Drop for InProcess {
    fn drop(&mut self) {
        self.app.clips.close();
    }
}

/// Opens the clips one after the other, so that the page can say what is in them.
fn open_in_order(app: &Arc<App>) {
    let app = Arc::downgrade(app);
    std::thread::spawn(move || {
        for id in 1.. {
            let clip = app.upgrade().and_then(|app| app.clips.get(id).ok());
            let Some(clip) = clip else { return };
            // The page shows the error.
            let _ = clip.open();
        }
    });
}

/// All addresses.
fn routes(app: Arc<App>) -> Router {
    Router::new()
        .route(once::PATH, post(once::exchange))
        .route("/api/clips", get(clips::list).post(files::upload))
        .route("/api/export", get(files::export_all))
        .route("/api/camera", get(camera::camera))
        .route("/api/camera/recordings/{number}/{what}", get(camera::recording))
        .route("/api/clips/{clip}", get(clips::one))
        .route("/api/clips/{clip}/frames/{frame}", get(frames::frame))
        .route("/api/clips/{clip}/edits", post(clips::edit))
        .route("/api/clips/{clip}/undo", post(clips::undo))
        .route("/api/clips/{clip}/redo", post(clips::redo))
        .route("/api/clips/{clip}/track", post(clips::track))
        .route("/api/clips/{clip}/stop", post(clips::stop))
        .route("/api/clips/{clip}/doubts", get(doubts::doubtful))
        .route("/api/clips/{clip}/look", get(look::look))
        .route("/api/clips/{clip}/events", get(live::events))
        .route("/api/clips/{clip}/import", post(files::import_boxes))
        .route("/api/clips/{clip}/export", get(files::export_boxes))
        .route("/api/clips/{clip}/video", get(video::annotated))
        .route("/api/clips/{clip}/targets/{target}/clip", get(video::around))
        .route("/api", any(unknown))
        .route("/api/{*rest}", any(unknown))
        .route("/", get(index))
        .route("/{*path}", get(file))
        .method_not_allowed_fallback(wrong_method)
        .fallback(unknown)
        .layer(middleware::from_fn_with_state(Arc::clone(&app), access::check))
        .with_state(app)
}

async fn unknown() -> Refusal {
    Refusal::unknown("there is nothing at this address")
}

async fn wrong_method() -> Refusal {
    Refusal::method()
}

async fn index() -> Response {
    embedded(&page::FILES[0])
}

async fn file(At(path): At<String>) -> Result<Response, Refusal> {
    let found = page::FILES.iter().find(|file| file.path == path);
    found.map(embedded).ok_or_else(|| Refusal::unknown("the page has no such file"))
}

fn embedded(file: &page::PageFile) -> Response {
    ([(CONTENT_TYPE, file.kind)], file.bytes).into_response()
}
