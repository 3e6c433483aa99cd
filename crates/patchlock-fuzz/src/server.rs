//! Requests to the server of the studio, in this process and without a socket.

use std::fs;
use std::path::Path;
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::Duration;

use axum::body::{Body, Bytes, to_bytes};
use axum::http::{Request, StatusCode};
use patchlock::Preset;
use patchlock_media::Limits;
use patchlock_studio::project::{SharedLabels, Store};
use patchlock_studio::server::{
    AllowedHosts, InProcessServer, Options, ProjectLocation, Server, Timeouts,
};
use serde_json::Value;
use tokio::runtime::Runtime;

use crate::library::small;
use crate::parts;
use crate::scratch::Scratch;
use crate::seeds::bmp;

/// Requests of an input that are sent.
const REQUESTS: usize = 12;
/// Longest answer.
const ANSWER: usize = 64 << 20;
/// Frames of the clip.
const FRAMES: usize = 6;

/// A server on a clip of its own.
pub struct Studio {
    // Fields are dropped in this order: first the server, then its files.
    server: InProcessServer,
    host: String,
    token: String,
    scratch: Scratch,
}

static RUNTIME: LazyLock<Runtime> = LazyLock::new(|| {
    let mut builder = tokio::runtime::Builder::new_multi_thread();
    builder.worker_threads(1).enable_all().build().expect("threads")
});

impl Studio {
    /// A server on a few small images, which tracks with a small patch.
    pub fn begin() -> Self {
        let scratch = Scratch::new();
        for k in 0..FRAMES {
            scratch.file(&format!("frames/{k:04}.bmp"), &bmp(64, 48, k));
        }
        let second = Duration::from_secs(1);
        let options = Options {
            videos: vec![scratch.folder().join("frames")],
            projects: ProjectLocation::Beside,
            hosts: AllowedHosts { allowed: Vec::new(), advice: "allow it" },
            address: ([127, 0, 0, 1], 0).into(),
            config: small(Preset::Robust),
            threads: Some(1),
            limits: Limits::default(),
            timeouts: Timeouts { headers: second, body: second, answer: second, code: second },
            strangers: 1,
            uploads: scratch.folder().join("uploads"),
            upload_bytes: 1 << 20,
            camera: false,
            tokens: None,
        };
        let server = Server::open(&options).expect("starts");
        let address = server.address();
        let (host, token) = address
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once("/#"))
            .expect("an address with a token");
        let (host, token) = (host.to_owned(), token.to_owned());
        Self { server: server.in_process(), host, token, scratch }
    }

    /// Sends a request as text: its first line is the method and the path, then come headers, an
    /// empty line and the body. The host and the token are added, unless the text begins with `!`.
    /// `None` if it is no request of HTTP.
    pub fn send(&self, text: &[u8]) -> Option<(StatusCode, Bytes)> {
        let (text, own) = match text.strip_prefix(b"!") {
            Some(text) => (text, false),
            None => (text, true),
        };
        let end = text.windows(2).position(|two| two == b"\n\n").unwrap_or(text.len());
        let head = std::str::from_utf8(&text[..end]).ok()?;
        let body = text.get(end + 2..).unwrap_or_default().to_vec();
        let mut lines = head.lines();
        let (method, path) = lines.next()?.split_once(' ')?;
        let mut request = Request::builder().method(method).uri(path);
        if own {
            request = request.header("host", &self.host);
            request = request.header("authorization", format!("Bearer {}", self.token));
        }
        for (name, value) in lines.filter_map(|line| line.split_once(": ")) {
            request = request.header(name, value.replace("HOST", &self.host));
        }
        let request = request.body(Body::from(body)).ok()?;
        RUNTIME.block_on(async {
            let answer = self.server.answer(request).await;
            let status = answer.status();
            let body = to_bytes(answer.into_body(), ANSWER).await;
            Some((status, body.expect("an answer can be read")))
        })
    }

    /// The project on disk can be read, if there is one.
    fn check_files(&self) {
        let file = self.scratch.folder().join("frames.patchlock.json");
        if file.exists() {
            Store::open_shared(&file, None, Limits::default())
                .expect("the project on disk is whole");
        }
        SharedLabels::new(self.scratch.folder()).read().expect("the labels on disk are whole");
        let outside = |path: &Path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let known = ["frames", "uploads", "frames.patchlock.json", "patchlock-labels.json"];
            !known.contains(&name.trim_end_matches(".lock").trim_end_matches(".history"))
        };
        let strange = fs::read_dir(self.scratch.folder()).expect("is there");
        let strange: Vec<_> = strange.flatten().map(|e| e.path()).filter(|p| outside(p)).collect();
        assert!(strange.is_empty(), "{strange:?}");
    }
}

/// Requests, divided by separators. A server that has taken changes is replaced before the next
/// input.
pub fn server(data: &[u8]) {
    static STUDIO: Mutex<Option<Studio>> = Mutex::new(None);
    // After a panic the old one is not trusted.
    let mut held = STUDIO.lock().unwrap_or_else(PoisonError::into_inner).take();
    let studio = held.get_or_insert_with(Studio::begin);
    let mut changed = false;
    for request in parts(data).take(REQUESTS) {
        let Some((status, body)) = studio.send(request) else { continue };
        changed |= status.is_success() && !request.starts_with(b"GET");
        answered(request, status, &body);
    }
    let (status, clip) = studio.send(b"GET /api/clips/1").expect("is a request");
    assert_eq!(status, StatusCode::OK, "{}", String::from_utf8_lossy(&clip));
    let clip: Value = serde_json::from_slice(&clip).expect("is JSON");
    assert!(clip["project"]["targets"].is_array(), "{clip}");
    if changed {
        studio.check_files();
    } else {
        *STUDIO.lock().unwrap_or_else(PoisonError::into_inner) = held;
    }
}

/// An answer is no failure of the server, and an error has a text, if it has a body.
fn answered(request: &[u8], status: StatusCode, body: &[u8]) {
    let shown = || format!("{}\n{status}", String::from_utf8_lossy(request));
    assert!(!status.is_server_error(), "{}\n{}", shown(), String::from_utf8_lossy(body));
    // What answers HEAD has no body.
    if status.is_client_error() && !request.starts_with(b"HEAD") {
        let error: Value = serde_json::from_slice(body).unwrap_or_default();
        let text = error["error"].as_str().unwrap_or_default();
        assert!(!text.trim().is_empty(), "an error without a text: {}", shown());
    }
}
