//! The page in the browser: a server for this machine, with the clips that the command line named and those
//! that are uploaded.
//!
//! [`access`] decides who may ask: the token, the host and the origin of every request are checked before
//! anything else. [`clips`] answers about projects, [`frames`] serves single frames.

mod access;
mod answer;
mod clips;
mod connections;
mod frames;

use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::http::header::CONTENT_TYPE;
use axum::middleware;
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use patchlock_media::Limits;

use crate::page;
use access::Access;
use answer::{At, Refusal};
use clips::Clips;

/// What a server needs to know.
#[derive(Debug, Clone)]
pub struct Options {
    /// Videos and folders of images to annotate.
    pub videos: Vec<PathBuf>,
    /// The address to listen on. With port 0 the system chooses a free one.
    pub address: SocketAddr,
    /// What a video may claim.
    pub limits: Limits,
    /// How long to wait for a client.
    pub patience: Patience,
}

/// How long the server waits for a client before it closes the connection.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// For a request, until its headers are complete.
    pub headers: Duration,
    /// For a body, until its next bytes.
    pub body: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { headers: Duration::from_secs(30), body: Duration::from_secs(20) }
    }
}

/// Why a server cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
}

/// What all requests share.
pub(crate) struct App {
    access: Access,
    clips: Clips,
}

/// A server that listens, but does not answer yet.
pub struct Server {
    listener: TcpListener,
    app: Arc<App>,
    patience: Patience,
}

impl Server {
    /// Listens on the address of the options and opens the videos.
    ///
    /// # Errors
    /// [`Error`] if the address cannot be used. A video that cannot be read is no error: the page says so.
    pub fn open(options: &Options) -> Result<Self, Error> {
        let listen = |reason| Error::Listen { address: options.address, reason };
        let listener = TcpListener::bind(options.address).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let access = Access::new(address).map_err(Error::Start)?;
        let clips = Clips::new(options.limits);
        options.videos.iter().for_each(|video| clips.add(video));
        let app = Arc::new(App { access, clips });
        Ok(Self { listener, app, patience: options.patience })
    }

    /// The address to open in the browser. It holds the token that allows changes.
    pub fn address(&self) -> String {
        self.app.access.address()
    }

    /// Answers requests until `stopped` returns true, which is asked ten times a second.
    ///
    /// # Errors
    /// [`Error::Start`] if the system gives no threads.
    pub fn run(self, stopped: impl Fn() -> bool) -> Result<(), Error> {
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
            tokio::spawn(connections::accept(listener, routes, self.patience));
            while !stopped() {
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
            Ok(())
        });
        runtime.shutdown_timeout(Duration::from_secs(1));
        served.map_err(start)
    }
}

/// All addresses.
fn routes(app: Arc<App>) -> Router {
    Router::new()
        .route("/api/clips", get(clips::list))
        .route("/api/clips/{clip}", get(clips::one))
        .route("/api/clips/{clip}/frames/{frame}", get(frames::frame))
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
