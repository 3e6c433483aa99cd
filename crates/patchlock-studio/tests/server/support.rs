//! A running server, a client that sends what it is told, and a rendered video.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use patchlock::{BoundingBox, Preset, TrackerConfig};
use patchlock_media::{FrameRate, Limits, Mp4Writer};
use patchlock_scene::Scene;
use patchlock_studio::server::{self, AllowedHosts, Options, ProjectLocation, Server, Timeouts};
use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::WebSocket;
use tungstenite::client::IntoClientRequest as _;

/// The number of frames of [`video`].
pub const FRAMES: usize = 40;
/// Most connections without the token.
pub const STRANGERS: usize = 16;

/// Writes the first frames of a scene as a video, and returns the true boxes.
pub fn video(file: &Path) -> Vec<BoundingBox> {
    let scene = Scene::simple();
    let first = scene.frame(0);
    let out = std::fs::File::create(file).expect("creates");
    let rate = FrameRate::DEFAULT;
    let mut writer =
        Mp4Writer::new(out, first.width, first.height, rate, Some(FRAMES)).expect("begins");
    let mut truth = Vec::new();
    for k in 0..FRAMES {
        let frame = scene.frame(k);
        writer.push(&frame.rgb).expect("encodes");
        let [x, y, w, h] = scene.truth(k).bbox;
        truth.push(BoundingBox { x, y, w, h });
    }
    writer.finish().expect("completes");
    truth
}

/// A server in a thread, which ends with this value.
pub struct TestServer {
    pub address: SocketAddr,
    pub token: String,
    /// A code that is exchanged for the token.
    pub code: String,
    /// The folder with the video `clip.mp4`.
    pub folder: TempDir,
    /// The true boxes.
    pub truth: Vec<BoundingBox>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Outcome>>,
}

/// What a server says at its end.
pub type Outcome = Result<Vec<PathBuf>, server::Error>;

impl Drop for TestServer {
    fn drop(&mut self) {
        // A test that expects another end has asked for it.
        let outcome = self.outcome();
        if !std::thread::panicking() {
            outcome.expect("runs");
        }
    }
}

/// Options for these videos, with short timeouts.
pub fn options(videos: Vec<PathBuf>, uploads: &Path) -> Options {
    let timeouts = Timeouts {
        headers: Duration::from_millis(700),
        body: Duration::from_millis(700),
        answer: Duration::from_millis(700),
        code: Duration::from_secs(60),
    };
    Options {
        videos,
        projects: ProjectLocation::Beside,
        hosts: AllowedHosts { allowed: Vec::new(), advice: "allow it" },
        address: ([127, 0, 0, 1], 0).into(),
        config: TrackerConfig::from(Preset::Robust),
        threads: Some(1),
        limits: Limits::default(),
        timeouts,
        strangers: STRANGERS,
        uploads: uploads.join("uploads"),
        upload_bytes: 4 << 20,
        camera: false,
        tokens: None,
    }
}

impl TestServer {
    /// A server with one clip.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let truth = video(&folder.path().join("clip.mp4"));
        Self::serving(folder, truth, &["clip.mp4"])
    }

    /// A server with these files of a folder.
    pub fn serving(folder: TempDir, truth: Vec<BoundingBox>, names: &[&str]) -> Self {
        let videos = names.iter().map(|name| folder.path().join(name)).collect();
        Self::with(options(videos, folder.path()), folder, truth)
    }

    /// A server with these options.
    pub fn with(options: Options, folder: TempDir, truth: Vec<BoundingBox>) -> Self {
        let (address, [token, code], stop, thread) = start(&options);
        Self { address, token, code, folder, truth, stop, thread: Some(thread) }
    }

    /// Ends the server as Ctrl-C does.
    pub fn end(&mut self) {
        self.outcome().expect("runs");
    }

    /// Ends the server, and returns what it says.
    pub fn outcome(&mut self) -> Outcome {
        self.stop.store(true, Ordering::SeqCst);
        match self.thread.take() {
            Some(thread) => thread.join().expect("ends in order"),
            None => Ok(Vec::new()),
        }
    }

    /// Ends the server and starts another one on the same files.
    pub fn restart(&mut self) {
        let options = options(vec![self.folder.path().join("clip.mp4")], self.folder.path());
        self.restart_with(&options);
    }

    /// Ends the server and starts another one with these options.
    pub fn restart_with(&mut self, options: &Options) {
        self.end();
        let (address, [token, code], stop, thread) = start(options);
        (self.address, self.token, self.code) = (address, token, code);
        (self.stop, self.thread) = (stop, Some(thread));
    }

    /// Sends a request with the token and a body.
    pub fn send(&self, method: &str, path: &str, body: &[u8]) -> Answer {
        let bearer = format!("Authorization: Bearer {}", self.token);
        self.send_with(method, path, &[&bearer], body)
    }

    /// Sends a request with these headers instead of the token.
    pub fn send_with(&self, method: &str, path: &str, headers: &[&str], body: &[u8]) -> Answer {
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
        if !headers.iter().any(|header| header.starts_with("Host:")) {
            head += &format!("Host: {}\r\n", self.address);
        }
        for header in headers {
            head += &format!("{header}\r\n");
        }
        head += &format!("Content-Length: {}\r\n\r\n", body.len());
        let mut stream = self.connect();
        stream.write_all(head.as_bytes()).expect("sends");
        // A server that refuses a long body closes the connection before all of it is sent.
        let _ = stream.write_all(body);
        Answer::read(&mut stream)
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).expect("connects");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("sets");
        stream
    }

    pub fn get(&self, path: &str) -> Answer {
        self.send("GET", path, &[])
    }

    pub fn post(&self, path: &str, body: &Value) -> Answer {
        self.send("POST", path, body.to_string().as_bytes())
    }

    /// The state of the first clip.
    pub fn clip(&self) -> Value {
        self.get("/api/clips/1").json()
    }

    /// Applies an edit to the first clip as it is now; it must be accepted.
    pub fn edit(&self, edit: Value) {
        let revision = self.clip()["revision"].clone();
        let answer =
            self.post("/api/clips/1/edits", &json!({ "revision": revision, "edits": [edit] }));
        assert_eq!(answer.status, 200, "{}", answer.text());
    }

    /// Adds a target with its true box in a frame.
    pub fn add_target(&self, frame: usize) {
        let bbox = self.truth[frame];
        self.edit(json!({ "edit": "add_target", "label": "target", "frame": frame, "box": bbox }));
    }

    /// Waits until the first clip has no job.
    pub fn wait(&self) -> Value {
        let begun = Instant::now();
        loop {
            let clip = self.clip();
            if clip["job"].is_null() {
                return clip;
            }
            assert!(begun.elapsed() < Duration::from_secs(120), "the job does not end");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Opens a WebSocket.
    pub fn socket(&self, path: &str) -> WebSocket<TcpStream> {
        self.try_socket(path, &format!("patchlock, {}", self.token)).expect("opens")
    }

    /// Opens a WebSocket with these subprotocols.
    pub fn try_socket(&self, path: &str, protocols: &str) -> Result<WebSocket<TcpStream>, String> {
        self.try_socket_with(path, protocols, &[])
    }

    /// Opens a WebSocket with these subprotocols and headers.
    pub fn try_socket_with(
        &self,
        path: &str,
        protocols: &str,
        headers: &[(&'static str, &str)],
    ) -> Result<WebSocket<TcpStream>, String> {
        let mut request =
            format!("ws://{}{path}", self.address).into_client_request().expect("is valid");
        let protocols = protocols.parse().expect("is valid");
        request.headers_mut().insert("Sec-WebSocket-Protocol", protocols);
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().expect("is valid"));
        }
        let opened = tungstenite::client(request, self.connect());
        opened.map(|(socket, _)| socket).map_err(|error| error.to_string())
    }
}

/// A server in a thread: its address, the token and a code for it, and what ends it.
fn start(options: &Options) -> (SocketAddr, [String; 2], Arc<AtomicBool>, JoinHandle<Outcome>) {
    let server = Server::open(options).expect("starts");
    let (address, token) = parts(&server.address());
    let (same_address, code) = parts(&server.address_once().expect("draws a code"));
    assert_eq!(same_address, address);
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let thread = std::thread::spawn(move || server.run(|| stopped.load(Ordering::SeqCst)));
    (address, [token, code], stop, thread)
}

/// What an address of the page says: where the server is, and the secret.
fn parts(shown: &str) -> (SocketAddr, String) {
    let rest = shown.strip_prefix("http://").expect("an address");
    let (address, secret) = rest.split_once("/#").expect("an address with a secret");
    (address.parse().expect("an address"), secret.to_owned())
}

/// An answer.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    head: String,
    pub body: Vec<u8>,
}

impl Answer {
    /// Reads until the server closes the connection. Status 0 stands for no answer.
    pub fn read(stream: &mut TcpStream) -> Self {
        let mut all = Vec::new();
        // A connection that is reset has an answer all the same, if one came before.
        let mut piece = [0; 65536];
        while let Ok(count @ 1..) = stream.read(&mut piece) {
            all.extend_from_slice(&piece[..count]);
        }
        let end = all.windows(4).position(|four| four == b"\r\n\r\n");
        let Some(end) = end else { return Self { status: 0, head: String::new(), body: all } };
        let body = all.split_off(end + 4);
        let head = String::from_utf8(all).expect("is text");
        let status = head.split(' ').nth(1).and_then(|word| word.parse().ok()).unwrap_or(0);
        let body = if head.contains("chunked") { unchunked(&body) } else { body };
        Self { status, head, body }
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        self.head.lines().find_map(|line| {
            let (found, value) = line.split_once(':')?;
            found.eq_ignore_ascii_case(name).then_some(value.trim())
        })
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn json(&self) -> Value {
        assert_eq!(self.header("content-type"), Some("application/json"), "{}", self.text());
        serde_json::from_slice(&self.body).expect("is JSON")
    }

    /// The message of an error with this status.
    pub fn error(&self, status: u16) -> String {
        assert_eq!(self.status, status, "{}", self.text());
        self.json()["error"].as_str().expect("has a message").to_owned()
    }
}

fn unchunked(mut body: &[u8]) -> Vec<u8> {
    let mut whole = Vec::new();
    while let Some(end) = body.windows(2).position(|two| two == b"\r\n") {
        let length = std::str::from_utf8(&body[..end]).expect("is text");
        let length = usize::from_str_radix(length, 16).expect("is a length");
        if length == 0 {
            break;
        }
        whole.extend_from_slice(&body[end + 2..][..length]);
        body = &body[end + 4 + length..];
    }
    whole
}
