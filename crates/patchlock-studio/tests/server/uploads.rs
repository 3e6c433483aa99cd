//! Videos that come from the browser.

use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::support::{Answer, TestServer};

/// The names of the files in the folder of uploads, and of those beside it.
fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let name = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.expect("is there").file_name().to_string_lossy().into_owned()
    };
    let mut names: Vec<String> = entries.map(name).collect();
    names.sort();
    names
}

#[test]
fn an_upload_becomes_a_clip_in_a_folder_of_its_own() {
    let server = TestServer::new();
    let film = std::fs::read(server.folder.path().join("clip.mp4")).expect("reads");
    for (name, kept) in [
        ("my%20film.mp4", "my film.mp4"),
        ("..%2F..%2Fetc%2Fpasswd.mp4", "passwd.mp4"),
        ("C%3A%5Cfilms%5Cfilm%3Cb%3E.mp4", "film_b_.mp4"),
        (".hidden.mp4", "hidden.mp4"),
        ("my%20film.mp4", "my film-2.mp4"),
    ] {
        let answer = server.send("POST", &format!("/api/clips?name={name}"), &film);
        let id = answer.json()["id"].as_u64().expect("an id");
        let list = server.get("/api/clips").json();
        assert_eq!(list["clips"][id as usize - 1]["name"], kept);
        assert_eq!(server.get(&format!("/api/clips/{id}/frames/39")).status, 200);
        let kept = server.folder.path().join("uploads").join(kept);
        assert_eq!(std::fs::read(kept).expect("is there"), film);
    }
    assert!(!server.folder.path().join("passwd.mp4").exists());
}

#[test]
fn an_upload_that_is_no_video_leaves_nothing() {
    let server = TestServer::new();
    let answer = server.send("POST", "/api/clips?name=a.mp4", b"\0\0\0\x18ftypisom and no more");
    assert!(!answer.error(422).is_empty());
    for name in ["", "..", "%2F", "%20"] {
        server.send("POST", &format!("/api/clips?name={name}"), b"x").error(400);
    }
    server.send("POST", "/api/clips", b"x").error(400);
    assert!(names(&server.folder.path().join("uploads")).is_empty());
    assert_eq!(server.get("/api/clips").json()["clips"].as_array().expect("a list").len(), 1);
}

#[test]
fn too_large_an_upload_is_stopped_at_the_limit_and_leaves_nothing() {
    let server = TestServer::new();
    let most = server.get("/api/clips").json()["upload_bytes"].as_u64().expect("a number") as usize;
    let head = |length: &str| {
        format!(
            "POST /api/clips?name=a.mp4 HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\
             {length}\r\n\r\n",
            server.address, server.token
        )
    };
    // One that says so is refused before a byte of it is sent.
    let mut stream = server.connect();
    stream.write_all(head(&format!("Content-Length: {}", most + 1)).as_bytes()).expect("sends");
    Answer::read(&mut stream).error(413);
    // One that does not say so is stopped.
    let mut stream = server.connect();
    stream.write_all(head("Transfer-Encoding: chunked").as_bytes()).expect("sends");
    let piece = vec![0; 1 << 16];
    let chunk = [b"10000\r\n".as_slice(), &piece, b"\r\n"].concat();
    let sent = (0..10_000).take_while(|_| stream.write_all(&chunk).is_ok()).count() << 16;
    assert!(sent < most + (16 << 20), "{sent} bytes were taken");
    let uploads = server.folder.path().join("uploads");
    let begun = Instant::now();
    while !names(&uploads).is_empty() {
        assert!(begun.elapsed() < Duration::from_secs(5), "left: {:?}", names(&uploads));
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn an_upload_that_is_broken_off_or_stalls_leaves_nothing() {
    let server = TestServer::new();
    let uploads = server.folder.path().join("uploads");
    for stalls in [false, true] {
        let mut stream = server.connect();
        let head = format!(
            "POST /api/clips?name=a.mp4 HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\n\
             Content-Length: 1000000\r\n\r\nabc",
            server.address, server.token
        );
        stream.write_all(head.as_bytes()).expect("sends");
        let begun = Instant::now();
        while names(&uploads).is_empty() {
            assert!(begun.elapsed() < Duration::from_secs(5), "the upload does not begin");
            std::thread::sleep(Duration::from_millis(5));
        }
        if stalls {
            Answer::read(&mut stream).error(408);
        } else {
            drop(stream);
        }
        while !names(&uploads).is_empty() {
            assert!(begun.elapsed() < Duration::from_secs(10), "left: {:?}", names(&uploads));
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}
