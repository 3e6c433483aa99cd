//! Requests that no page sends.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use patchlock_studio::server::Timeouts;
use serde_json::json;

use crate::support::{Answer, STRANGERS, TestServer, options, video};

#[test]
fn no_path_leads_out_of_the_page() {
    let server = TestServer::new();
    for path in [
        "/../Cargo.toml",
        "/../../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%2f..%2fetc%2fpasswd",
        "/..%5c..%5cwindows%5cwin.ini",
        "/%252e%252e/etc/passwd",
        "//etc/passwd",
        "/etc/passwd",
        "/./index.html/../../etc/passwd",
        "/index.html%00",
        "/api/clips/..%2f..%2fetc%2fpasswd",
        "/api/clips/1/frames/..%2f..%2fetc",
        "/api/clips/%2fetc%2fpasswd/frames/0",
        "/api/../etc/passwd",
    ] {
        let answer = server.get(path);
        assert!(matches!(answer.status, 400 | 404), "{path}: {}", answer.status);
        assert!(answer.status == 400 || answer.json()["error"].is_string(), "{path}");
        assert!(!answer.text().contains("root:"), "{path}");
    }
}

#[test]
fn what_does_not_exist_and_wrong_methods_are_errors_as_json() {
    let server = TestServer::new();
    for path in [
        "/api",
        "/api/",
        "/api/clips/0",
        "/api/clips/2",
        "/api/clips/99999999999999999999999",
        "/api/clips/-1",
        "/api/clips/x",
        "/api/clips/1/frames/40",
        "/api/clips/1/frames/x",
        "/api/clips/1/look?target=1&frame=0",
        "/api/clips/1/doubts?target=5",
        "/api/clips/1/nothing",
        "/nothing.js",
    ] {
        server.get(path).error(404);
    }
    server.get("/api/clips/1/frames/0?width=x").error(400);
    server.get("/api/clips/1/frames/0?width=-1").error(400);
    server.get("/api/clips/1/look?target=1").error(400);
    for (method, path) in [
        ("DELETE", "/api/clips"),
        ("PUT", "/api/clips/1"),
        ("POST", "/api/clips/1/frames/0"),
        ("GET", "/api/clips/1/edits"),
        ("GET", "/api/clips/1/undo"),
        ("POST", "/"),
    ] {
        server.send(method, path, &[]).error(405);
    }
    assert!(matches!(server.send("BREW", "/api/clips", &[]).status, 400 | 405));
}

#[test]
fn names_and_labels_with_markup_are_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let name = "<img src=x onerror=alert(1)>&quot;'.mp4";
    let truth = video(&folder.path().join(name));
    let server = TestServer::serving(folder, truth, &[name]);
    let list = server.get("/api/clips");
    assert_eq!(list.json()["clips"][0]["name"], name);
    let label = "<script>alert(1)</script>";
    server.edit(json!({ "edit": "add_label", "name": label, "colour": "#ff0000" }));
    let clip = server.get("/api/clips/1");
    assert_eq!(clip.header("content-type"), Some("application/json"));
    let labels = &clip.json()["project"]["labels"];
    assert!(labels.as_array().expect("a list").iter().any(|found| found["name"] == label));
    // An error that repeats what was sent is JSON, too.
    let edits = json!({ "revision": 0, "edits": [{
        "edit": "set_target", "target": 1, "label": "<b>x</b>",
    }] });
    server.post("/api/clips/1/edits", &edits).error(400);
    let answer = server.get("/<script>alert(1)</script>");
    assert!(matches!(answer.status, 400 | 404));
}

#[test]
fn nonsense_instead_of_json_is_refused() {
    let server = TestServer::new();
    let deep = "[".repeat(100_000);
    for body in [
        "",
        "{",
        "null",
        "[]",
        "{}",
        "\u{0}",
        &deep,
        r#"{"revision": -1, "edits": []}"#,
        r#"{"revision": 1e400, "edits": []}"#,
        r#"{"revision": 0, "edits": [{"edit": "format_disk"}]}"#,
        r#"{"revision": 0, "edits": [], "more": 1}"#,
        r#"{"revision": 0, "edits": [{"edit": "add_target", "label": "target", "frame": 0,
            "box": {"x": 1e999, "y": 0, "w": 5, "h": 5}}]}"#,
        r#"{"revision": 0, "edits": [{"edit": "add_target", "label": "target", "frame": 0,
            "box": {"x": "0", "y": 0, "w": 5, "h": 5}}]}"#,
    ] {
        server.send("POST", "/api/clips/1/edits", body.as_bytes()).error(400);
        server.send("POST", "/api/clips/1/track", body.as_bytes()).error(400);
    }
    server.send("POST", "/api/clips/1/edits", &[0xff, 0xfe, 0x00]).error(400);
    assert_eq!(server.clip()["revision"], 0);
}

#[test]
fn huge_json_is_refused_before_it_is_read() {
    let server = TestServer::new();
    let mut stream = server.connect();
    let head = format!(
        "POST /api/clips/1/edits HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\
         Content-Length: 100000000000\r\n\r\n",
        server.address, server.token
    );
    stream.write_all(head.as_bytes()).expect("sends");
    let answer = Answer::read(&mut stream);
    answer.error(413);
    // Without a length, it is stopped at the limit.
    let mut stream = server.connect();
    let head = format!(
        "POST /api/clips/1/track HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\
         Transfer-Encoding: chunked\r\n\r\n",
        server.address, server.token
    );
    stream.write_all(head.as_bytes()).expect("sends");
    let piece = [b' '; 1 << 16];
    let mut sent = 0;
    while sent < 256 << 20 {
        let chunk = [format!("{:x}\r\n", piece.len()).as_bytes(), &piece, b"\r\n"].concat();
        if stream.write_all(&chunk).is_err() {
            break;
        }
        sent += piece.len();
    }
    assert!(sent < 100 << 20, "{sent} bytes were taken");
}

#[test]
fn headers_and_bodies_that_do_not_arrive_are_not_waited_for() {
    let server = TestServer::new();
    let begun = Instant::now();
    let mut silent = server.connect();
    let mut half = server.connect();
    half.write_all(b"GET / HTTP/1.1\r\nHost: 127").expect("sends");
    let mut body = server.connect();
    let head = format!(
        "POST /api/clips/1/edits HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\
         Content-Length: 100\r\n\r\n{{",
        server.address, server.token
    );
    body.write_all(head.as_bytes()).expect("sends");
    assert!(matches!(Answer::read(&mut silent).status, 0 | 408));
    assert!(matches!(Answer::read(&mut half).status, 0 | 408));
    Answer::read(&mut body).error(408);
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
}

#[test]
fn one_that_sends_a_byte_at_a_time_is_stopped() {
    let server = TestServer::new();
    let head = format!("GET / HTTP/1.1\r\nHost: {}\r\nX: ", server.address);
    let body = format!(
        "POST /api/token HTTP/1.1\r\nHost: {}\r\nContent-Length: 1000\r\n\r\n",
        server.address
    );
    for begin in [head, body] {
        let mut slow = server.connect();
        slow.write_all(begin.as_bytes()).expect("sends");
        // Each byte comes in time; all of them would take half a minute.
        let taken = (0..600).take_while(|_| {
            std::thread::sleep(Duration::from_millis(50));
            slow.write_all(b"a").is_ok()
        });
        assert!(taken.count() < 600, "{begin}");
    }
}

/// A server that waits for everything as good as for ever.
fn with_long_timeouts() -> TestServer {
    let folder = tempfile::tempdir().expect("a folder");
    let truth = video(&folder.path().join("clip.mp4"));
    let mut options = options(vec![folder.path().join("clip.mp4")], folder.path());
    let long = Duration::from_secs(3600);
    options.timeouts = Timeouts { headers: long, body: long, answer: long, code: long };
    TestServer::with(options, folder, truth)
}

/// Asks for the page again and again, without reading any answer, until no more is taken.
fn flood(server: &TestServer, header: &str) -> TcpStream {
    let request = format!("GET /style.css HTTP/1.1\r\nHost: {}\r\n{header}\r\n", server.address);
    let requests = request.repeat(100);
    let mut stream = server.connect();
    stream.set_write_timeout(Some(Duration::from_millis(200))).expect("sets");
    while stream.write(requests.as_bytes()).is_ok() {}
    stream
}

#[test]
fn those_without_the_token_keep_nobody_out() {
    let server = with_long_timeouts();
    let strangers = STRANGERS + 10;
    let mut known = server.connect();
    let request = format!(
        "GET /api/clips HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\r\n",
        server.address, server.token
    );
    let ask = |known: &mut TcpStream| {
        known.write_all(request.as_bytes()).expect("sends");
        let mut piece = [0; 4096];
        let count = known.read(&mut piece).expect("answers");
        assert!(piece[..count].starts_with(b"HTTP/1.1 200"), "{count} bytes");
    };
    ask(&mut known);
    // Those that say nothing, those that say a part, and those that ask and never read.
    let silent: Vec<_> = (0..strangers).map(|_| server.connect()).collect();
    let half: Vec<_> = (0..strangers)
        .map(|_| {
            let mut stream = server.connect();
            stream.write_all(b"GET / HTTP/1.1\r\nHost: ").expect("sends");
            stream
        })
        .collect();
    let flooding: Vec<_> = std::thread::scope(|scope| {
        let floods: Vec<_> = (0..strangers).map(|_| scope.spawn(|| flood(&server, ""))).collect();
        floods.into_iter().map(|flood| flood.join().expect("ends")).collect()
    });
    assert_eq!(server.get("/api/clips").status, 200);
    assert_eq!(server.get("/style.css").status, 200);
    ask(&mut known);
    drop((silent, half, flooding));
}

#[test]
fn one_that_never_reads_is_stopped_with_the_token_too() {
    let server = TestServer::new();
    let bearer = format!("Authorization: Bearer {}\r\n", server.token);
    for header in ["", &bearer] {
        let mut stream = flood(&server, header);
        stream.set_write_timeout(Some(Duration::from_secs(60))).expect("sets");
        let error = loop {
            if let Err(error) = stream.write_all(&[b'x'; 1 << 16]) {
                break error;
            }
        };
        assert!(!matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut), "{error}");
    }
}

#[test]
fn headers_without_end_are_refused() {
    let server = TestServer::new();
    let mut stream = server.connect();
    stream.write_all(b"GET / HTTP/1.1\r\n").expect("sends");
    let line = [b"X: ".as_slice(), &[b'a'; 8000], b"\r\n"].concat();
    while stream.write_all(&line).is_ok() {}
    assert!(matches!(Answer::read(&mut stream).status, 0 | 431));
}

#[test]
fn a_hundred_sockets_at_once_keep_nobody_from_working() {
    let server = TestServer::new();
    let open: Vec<_> = (0..100).map(|_| server.connect()).collect();
    let begun = Instant::now();
    assert_eq!(server.get("/api/clips/1/frames/3").status, 200);
    assert!(begun.elapsed() < Duration::from_secs(2), "{:?}", begun.elapsed());
    drop(open);
    let windows: Vec<_> = (0..100).map(|_| server.socket("/api/clips/1/events")).collect();
    wait_for_windows(&server, 100);
    server.add_target(0);
    drop(windows);
    wait_for_windows(&server, 0);
}

/// The server counts a window a moment after its handshake or its end.
fn wait_for_windows(server: &TestServer, count: usize) {
    let begun = Instant::now();
    while server.clip()["windows"] != count {
        let counted = server.clip()["windows"].clone();
        assert!(begun.elapsed() < Duration::from_secs(10), "{counted} windows instead of {count}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
