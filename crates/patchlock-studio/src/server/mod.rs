//! The page in the browser: a server for this machine, with the clips that the command line named
//! and those that are uploaded.
//!
//! `access` decides who may ask: the token, the host and the origin of every request are checked
//! before anything else. `clips` answers about projects, `frames` serves single frames.

mod access;
mod advice;
mod answer;
mod app;
mod camera;
mod clips;
mod code;
mod connections;
mod error;
mod files;
mod frames;
mod handler;
mod host;
mod jobs;
mod live;
mod look;
mod options;
mod review;
mod timeouts;
mod token;
mod video;
pub mod window;

use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::header::CONTENT_TYPE;
use axum::http::{Request, StatusCode};
use axum::middleware;
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use patchlock_track::session;

use crate::engine::Settings;
use crate::page::{self, PageFile};
use access::Access;
use answer::{PathParam, Refusal};
use app::App;
use camera::Recordings;
use clips::Clips;
use code::TokenExchange;
use handler::boxed;

pub use error::Error;
pub use host::{AllowedHost, AllowedHosts, HostError};
pub use options::{Options, ProjectLocation, STRANGERS};
pub use timeouts::Timeouts;

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
        options.make_project_folder()?;
        let listener = TcpListener::bind(options.address).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let token_file = options.token_file(address);
        let token = token_file.as_deref().map_or_else(token::draw, token::kept);
        let token = token.map_err(Error::Start)?;
        let access = Access::new(address, options.hosts.clone(), token, "'none'".to_owned());
        let access = Arc::new(access.map_err(Error::Start)?);
        let hint = "The address that a browser is given works once: open the one that patchlock \
                    studio has printed. If nobody but you should have used it, end the program and \
                    start it again.";
        let settings = Settings { config: options.config.clone(), pool, limits: options.limits };
        let app = Arc::new(App {
            code: TokenExchange::new(Arc::clone(&access), options.timeouts, token_file, hint),
            access,
            clips: Clips::new(settings, &options.folder()),
            options: options.clone(),
            recordings: Recordings::default(),
        });
        let only = options.videos.len() == 1;
        for video in &options.videos {
            let clip = app.clips.add(video, &options.projects);
            if only {
                clip.open().map_err(Error::Clip)?;
            }
        }
        open_in_order(&app);
        Ok(Self { listener, app })
    }

    /// The address to open in the browser. It holds the token that allows changes.
    pub fn address(&self) -> String {
        let App { access, options, .. } = &*self.app;
        access.url(options.camera, &access.token)
    }

    /// The port that it listens on.
    pub fn port(&self) -> u16 {
        self.app.access.address.port()
    }

    /// An address for the arguments of a browser, which other users of the machine can read.
    /// Instead of the token it holds a code: the first page that uses it within [`Timeouts::code`]
    /// gets the token.
    ///
    /// # Errors
    /// [`Error::Start`] if the system gives no random numbers.
    pub fn address_once(&self) -> Result<String, Error> {
        let code = self.app.code.draw().map_err(Error::Start)?;
        Ok(self.app.access.url(self.app.options.camera, &code))
    }

    /// The server without its listener.
    #[doc(hidden)]
    pub fn in_process(self) -> InProcessServer {
        InProcessServer { routes: routes(&self.app), app: self.app }
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
        let routes = routes(&self.app);
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            let Options { strangers, timeouts, .. } = self.app.options;
            tokio::spawn(connections::accept(listener, routes, strangers, timeouts));
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
pub struct InProcessServer {
    app: Arc<App>,
    routes: Router,
}

impl InProcessServer {
    /// The answer to a request, which passes all checks that one from a connection does.
    pub async fn answer(&self, request: Request<Body>) -> Response {
        let service = TowerToHyperService::new(self.routes.clone());
        service.call(request).await.unwrap_or_else(|never| match never {})
    }
}

/// Stops all jobs and waits for their threads.
impl Drop for InProcessServer {
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
fn routes(app: &Arc<App>) -> Router {
    Router::new()
        .route(code::PATH, post(boxed(&app.code, code::exchange)))
        .route("/api/clips", get(boxed(app, clips::list)).post(boxed(app, files::upload)))
        .route("/api/formats", get(boxed(app, files::formats)))
        .route("/api/export", get(boxed(app, files::export_all)))
        .route("/api/camera", get(boxed(app, camera::camera)))
        .route("/api/camera/recordings/{number}/{what}", get(boxed(app, camera::recording)))
        .route("/api/clips/{clip}", get(boxed(app, clips::one)))
        .route("/api/clips/{clip}/frames/{frame}", get(boxed(app, frames::frame)))
        .route("/api/clips/{clip}/edits", post(boxed(app, clips::edit)))
        .route("/api/clips/{clip}/undo", post(boxed(app, clips::undo)))
        .route("/api/clips/{clip}/redo", post(boxed(app, clips::redo)))
        .route("/api/clips/{clip}/track", post(boxed(app, clips::track)))
        .route("/api/clips/{clip}/stop", post(boxed(app, clips::stop)))
        .route("/api/clips/{clip}/doubts", get(boxed(app, review::doubtful)))
        .route("/api/clips/{clip}/look", get(boxed(app, look::look)))
        .route("/api/clips/{clip}/events", get(boxed(app, live::events)))
        .route("/api/clips/{clip}/import", post(boxed(app, files::import_boxes)))
        .route("/api/clips/{clip}/export", get(boxed(app, files::export_boxes)))
        .route("/api/clips/{clip}/video", get(boxed(app, video::annotated)))
        .route("/api/clips/{clip}/targets/{target}/clip", get(boxed(app, video::around)))
        .route("/api", any(boxed(app, unknown)))
        .route("/api/{*rest}", any(boxed(app, unknown)))
        .route("/", get(boxed(app, async || embedded(page::FILES, "index.html"))))
        .route("/{*path}", get(boxed(app, file)))
        .method_not_allowed_fallback(boxed(app, wrong_method))
        .fallback(boxed(app, unknown))
        .layer(middleware::from_fn_with_state(Arc::clone(&app.access), access::check))
}

async fn unknown() -> Refusal {
    Refusal::unknown("there is nothing at this address")
}

async fn wrong_method() -> Refusal {
    let message = "this address does not take this method";
    Refusal::new(StatusCode::METHOD_NOT_ALLOWED, message)
}

async fn file(PathParam(path): PathParam<String>) -> Result<Response, Refusal> {
    embedded(page::FILES, &path)
}

/// A file of a page.
fn embedded(files: &[PageFile], path: &str) -> Result<Response, Refusal> {
    let file = files.iter().find(|file| file.path == path);
    let file = file.ok_or_else(|| Refusal::unknown("the page has no such file"))?;
    Ok(([(CONTENT_TYPE, file.kind)], file.bytes).into_response())
}

/// The data behind a lock. After a panic of another thread they are as that thread left them
/// between two statements, which is good enough here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
