//! Live sources: real servers on this machine, and what a live source cannot do. Where a server is
//! not installed, a test says so and passes.

use std::io::{BufRead as _, BufReader, Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::{BOX, Bench, column, y4m};
use predicates::str::contains;

/// A process that is killed at the end of the test.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether ffmpeg is there; else the reason is printed.
fn has_ffmpeg() -> bool {
    let there = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).status().is_ok();
    if !there {
        println!("SKIPPED: ffmpeg is not installed");
    }
    there
}

/// An ffmpeg that plays the film at its rate, over and over.
fn playing(bench: &Bench, output: &[&str]) -> Server {
    bench.mp4("film.mp4", 40);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.current_dir(bench.folder.path());
    ffmpeg.args(["-v", "error", "-re", "-stream_loop", "-1", "-i", "film.mp4"]);
    ffmpeg.args(["-c:v", "mpeg4", "-q:v", "2", "-g", "10"]).args(output);
    Server(ffmpeg.stdin(Stdio::null()).spawn().unwrap())
}

/// A port of this machine that was free just now.
fn free_port(udp: bool) -> u16 {
    match udp {
        true => UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port(),
        false => TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port(),
    }
}

/// Waits until something is so.
fn until(what: &str, so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !so() {
        assert!(begun.elapsed() < Duration::from_secs(60), "it takes too long until {what}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// Whether a process listens on this port; a connection to see that would be the only one that it takes. Where
/// the system does not tell, this waits.
fn listens(port: &str) -> bool {
    let Ok(table) = std::fs::read_to_string("/proc/net/tcp") else {
        thread::sleep(Duration::from_secs(1));
        return true;
    };
    let local = format!(":{:04X}", port.parse::<u16>().unwrap());
    // Columns: number, local address, remote address, state; 0A is a socket that listens.
    let mut rows = table.lines().map(|row| row.split_whitespace().collect::<Vec<_>>());
    rows.any(|row| row.len() > 3 && row[1].ends_with(&local) && row[3] == "0A")
}

/// Tracks twenty frames of a live source.
fn tracks(bench: &Bench, address: &str, options: &[&str]) -> Vec<String> {
    bench
        .track(address)
        .args(["--end", "20", "--save", "live.csv", "--summary", "live.json", "--overwrite"])
        .args(options)
        .timeout(Duration::from_secs(60))
        .assert()
        .success();
    let lines = bench.lines("live.csv");
    let frames = column(&lines, "frame");
    assert!(frames.is_sorted_by(|a, b| a < b) && *frames.last().unwrap() < 20.0, "{frames:?}");
    let json = std::fs::read_to_string(bench.path("live.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let dropped = json["frames_dropped"].as_u64().unwrap() as f64;
    let last = frames.last().unwrap() + 1.0;
    assert_eq!(frames.len() as f64 + dropped, last, "{json}");
    assert!(json["wall_fps"].as_f64().unwrap() > 0.0);
    lines
}

#[test]
fn streams_of_the_network_are_tracked() {
    if !has_ffmpeg() {
        return;
    }
    for (address, output) in [
        ("udp://127.0.0.1:PORT", ["-f", "mpegts", "udp://127.0.0.1:PORT?pkt_size=1316"]),
        ("tcp://127.0.0.1:PORT", ["-f", "mpegts", "tcp://127.0.0.1:PORT?listen=1"]),
    ] {
        let bench = Bench::new();
        let port = free_port(address.starts_with("udp")).to_string();
        let output = output.map(|word| word.replace("PORT", &port));
        let _server = playing(&bench, &output.each_ref().map(String::as_str));
        if address.starts_with("tcp") {
            until("the server listens", || listens(&port));
        }
        tracks(&bench, &address.replace("PORT", &port), &[]);
    }
}

/// A server in Python, with the RTSP server of GStreamer.
const RTSP: &str = r#"
import sys
import gi
gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer
Gst.init(None)
factory = GstRtspServer.RTSPMediaFactory.new()
factory.set_launch("( videotestsrc is-live=true pattern=ball ! "
    "video/x-raw,format=I420,width=320,height=240,framerate=25/1 ! jpegenc ! rtpjpegpay name=pay0 )")
factory.set_shared(True)
server = GstRtspServer.RTSPServer.new()
server.set_address("127.0.0.1")
server.set_service(sys.argv[1])
server.get_mount_points().add_factory("/ball", factory)
if not server.attach(None):
    sys.exit("the port is taken")
print("ready", server.get_bound_port(), flush=True)
GLib.MainLoop().run()
"#;

/// The server and its port; `None` if it is not installed.
fn rtsp(port: u16) -> Option<(Server, u16)> {
    for python in ["/usr/bin/python3", "python3"] {
        let mut server = Command::new(python);
        server.args(["-c", RTSP, &port.to_string()]).stdout(Stdio::piped()).stderr(Stdio::null());
        let Ok(mut child) = server.spawn() else { continue };
        let output = child.stdout.take();
        let server = Server(child);
        let mut line = String::new();
        BufReader::new(output?).read_line(&mut line).ok()?;
        if let Some(port) = line.strip_prefix("ready ") {
            return Some((server, port.trim().parse().ok()?));
        }
    }
    assert_ne!(
        std::env::var("PATCHLOCK_RTSP").as_deref(),
        Ok("required"),
        "there is no RTSP server"
    );
    println!(
        "SKIPPED: the RTSP server of GStreamer is not installed (on Debian: gir1.2-gst-rtsp-server-1.0, \
         gstreamer1.0-plugins-good, python3-gi)"
    );
    None
}

/// The ball of the server moves; it is lost when the server ends, and found when it is back.
#[test]
fn a_camera_with_rtsp_is_tracked_and_opened_again() {
    if !has_ffmpeg() {
        return;
    }
    let Some((server, port)) = rtsp(0) else { return };
    let bench = Bench::new();
    let address = format!("rtsp://127.0.0.1:{port}/ball");
    let frame = crate::support::patchlock()
        .current_dir(bench.folder.path())
        .args(["frame", &address, "--at", "3", "--out", "f.png"])
        .assert()
        .success();
    frame.stderr(contains("320 x 240 pixels"));
    let mut track = Command::new(assert_cmd::cargo::cargo_bin("patchlock"));
    track.current_dir(bench.folder.path()).args(["track", &address, "--box", "140,100,40,40"]);
    track.args(["--save", "b.csv", "--video", "b.mp4", "--summary", "b.json"]);
    let mut track = Server(track.stderr(Stdio::piped()).spawn().unwrap());
    // Of the table, before it has its name.
    let rows = || -> usize {
        let texts =
            bench.leftovers().into_iter().filter_map(|path| std::fs::read_to_string(path).ok());
        texts.filter(|text| text.starts_with("frame,")).map(|text| text.lines().count()).sum()
    };
    until("frames are tracked", || rows() > 40);
    drop(server);
    let mut said = BufReader::new(track.0.stderr.take().unwrap()).lines();
    let mut next = |words: &str| {
        let line = said.by_ref().map_while(Result::ok).find(|line| line.contains(words));
        assert!(line.is_some(), "nothing was said of: {words}");
    };
    next("note: the stream was lost");
    let again = rtsp(port).expect("it was installed just now");
    next("note: the stream is back");
    let before = rows();
    until("more frames are tracked", || rows() > before);
    interrupt(&track.0);
    assert_eq!(track.0.wait().unwrap().code(), Some(130));
    drop(again);
    let lines = bench.lines("b.csv");
    assert!(lines.len() > 40, "{} lines", lines.len());
    let video = patchlock_media::open(bench.path("b.mp4"), false).unwrap();
    assert_eq!(video.length(), Some(lines.len() - 1));
    // The gap is in the video too: frames last until the next one came.
    let json = std::fs::read_to_string(bench.path("b.json")).unwrap();
    assert!(json.contains("\"frames_dropped\": "), "{json}");
    assert!(bench.leftovers().is_empty());
}

fn interrupt(child: &Child) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
}

#[test]
fn a_pipe_of_any_format_is_taken_live() {
    if !has_ffmpeg() {
        return;
    }
    let bench = Bench::new();
    bench.mp4("film.mp4", 40);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.current_dir(bench.folder.path()).args(["-v", "error", "-re", "-i", "film.mp4"]);
    ffmpeg.args(["-c:v", "mpeg4", "-f", "matroska", "-"]).stdout(Stdio::piped());
    let mut ffmpeg = ffmpeg.spawn().unwrap();
    let mut track = Command::new(assert_cmd::cargo::cargo_bin("patchlock"));
    track.current_dir(bench.folder.path()).args(["track", "-", "--live", "--box", BOX]);
    track.args(["--config", "quick.toml", "--save", "p.csv"]);
    let status = track.stdin(ffmpeg.stdout.take().unwrap()).status().unwrap();
    ffmpeg.wait().unwrap();
    assert!(status.success());
    let frames = column(&bench.lines("p.csv"), "frame");
    assert!(frames.len() > 1 && *frames.last().unwrap() <= 39.0, "{frames:?}");
    // Without --live, every frame of Y4M is tracked.
    let all = bench.track("-").write_stdin(y4m(6)).args(["--save", "y.csv"]).assert();
    all.success();
    assert_eq!(bench.lines("y.csv").len(), 7);
}

/// Answers every request with these bytes.
fn serve(bytes: Vec<u8>) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut request = BufReader::new(stream.try_clone().unwrap());
            let mut line = String::new();
            while request.read_line(&mut line).is_ok_and(|read| read > 2) {
                line.clear();
            }
            let head = format!("HTTP/1.0 200 OK\r\nContent-Length: {}\r\n\r\n", bytes.len());
            let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&bytes));
        }
    });
    port
}

#[test]
fn a_file_on_a_web_server_has_the_boxes_of_the_file() {
    if !has_ffmpeg() {
        return;
    }
    let bench = Bench::new();
    let film = bench.mp4("film.mp4", 12);
    let port = serve(std::fs::read(film).unwrap());
    let address = format!("http://127.0.0.1:{port}/film.mp4");
    bench.track(&address).args(["--save", "web.txt"]).assert().success();
    bench.track("film.mp4").args(["--save", "file.txt"]).assert().success();
    assert_eq!(bench.lines("web.txt").len(), 12);
    assert_eq!(bench.lines("web.txt"), bench.lines("file.txt"));
}

/// A list of addresses on a server is not followed, as one in a file is not.
#[test]
fn an_address_leads_to_no_other_address() {
    if !has_ffmpeg() {
        return;
    }
    let bench = Bench::new();
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let target = other.local_addr().unwrap().port();
    let list = format!(
        "#EXTM3U\n#EXT-X-TARGETDURATION:5\n#EXTINF:5,\nhttp://127.0.0.1:{target}/a.ts\n#EXT-X-ENDLIST\n"
    );
    let port = serve(list.into());
    let address = format!("http://127.0.0.1:{port}/list.m3u8");
    let error = bench.track(&address).assert().code(1);
    error
        .stderr(contains(format!("{address} is a list of addresses (hls), which are not opened")))
        .stderr(contains(format!(
            "ffmpeg -i '{address}' -f yuv4mpegpipe -pix_fmt yuv420p - | patchlock track -"
        )));
    other.set_nonblocking(true).unwrap();
    assert!(other.accept().is_err(), "the address in the list was asked");
}

/// Answers a request with the file of this folder that it names.
fn serve_files(folder: std::path::PathBuf) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut line = String::new();
            BufReader::new(stream.try_clone().unwrap()).read_line(&mut line).unwrap();
            let name = line.split(['/', ' ']).nth(2).unwrap_or_default();
            let bytes = std::fs::read(folder.join(name)).unwrap_or_default();
            let head = format!("HTTP/1.0 200 OK\r\nContent-Length: {}\r\n\r\n", bytes.len());
            let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&bytes));
        }
    });
    port
}

/// The hint for a list of HLS is a command that tracks its video.
#[cfg(unix)]
#[test]
fn the_pipe_that_is_advised_for_a_list_tracks_it() {
    if !has_ffmpeg() {
        return;
    }
    let bench = Bench::new();
    bench.mp4("film.mp4", 40);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.current_dir(bench.folder.path()).args(["-v", "error", "-i", "film.mp4", "-c", "copy"]);
    ffmpeg.args(["-f", "hls", "-hls_time", "0.5", "-hls_list_size", "0", "list.m3u8"]);
    assert!(ffmpeg.status().unwrap().success());
    let port = serve_files(bench.folder.path().to_path_buf());
    let refused = bench.track(&format!("http://127.0.0.1:{port}/list.m3u8")).assert().code(1);
    let said = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
    let (_, command) = said.split_once("ffmpeg -i ").unwrap();
    let (command, _) = command.split_once(" | patchlock track - ...").unwrap();
    let mut shell = Command::new("sh");
    let program = assert_cmd::cargo::cargo_bin("patchlock");
    let track =
        format!("{} track - --box {BOX} --config quick.toml --save l.csv", program.display());
    shell
        .current_dir(bench.folder.path())
        .args(["-c", &format!("ffmpeg -v error -i {command} | {track}")]);
    assert!(shell.status().unwrap().success());
    assert_eq!(bench.lines("l.csv").len(), 41);
}

#[test]
fn what_only_files_can_do_is_refused_for_live_sources() {
    let bench = Bench::new();
    for (options, message) in [
        (vec!["--reverse"], "--reverse is for files; udp://127.0.0.1:9 is live"),
        (vec!["--stride", "2"], "--stride is for files"),
        (vec!["--project", "p.json"], "--project is for files"),
    ] {
        let error = bench.track("udp://127.0.0.1:9").args(options).assert().code(2);
        error.stderr(contains(message));
    }
    std::fs::write(bench.path("b.csv"), "frame,id,x,y,w,h\n0,1,20,18,32,28\n5,1,,,,\n").unwrap();
    let error = bench.bare("udp://127.0.0.1:9").args(["--boxes", "b.csv"]).assert().code(2);
    error
        .stderr(contains("target 1 has a line for frame 5; of a live source only the first frame"));
    let error = bench.track("file:///etc/hostname").assert().code(1);
    error.stderr(contains("file:///etc/hostname is not an address that can be opened"));
    bench.images("film", 2);
    let error = bench.track("film").arg("--live").assert().code(2);
    error.stderr(contains("--live is for standard input; film is a file"));
}

#[test]
fn without_ffmpeg_a_live_source_names_it() {
    let bench = Bench::new();
    for source in ["rtsp://user:secret@127.0.0.1/a", "0", "/dev/video7"] {
        let error = bench.track(source).env("PATH", "").assert().code(1);
        let shown = source.replace("secret", "***");
        error
            .stderr(contains(format!("{shown} is a live source; reading it needs ffmpeg")))
            .stderr(contains("hint: install ffmpeg"));
    }
}

/// A camera that is not there; the real ones cannot be tried where there are none.
#[cfg(target_os = "linux")]
#[test]
fn a_missing_camera_is_named() {
    if !has_ffmpeg() || std::path::Path::new("/dev/video97").exists() {
        return;
    }
    let error = Bench::new().track("/dev/video97").assert().code(1);
    error
        .stderr(contains("cannot open /dev/video97"))
        .stderr(contains("No such file or directory"))
        .stderr(contains("check that the camera is connected"));
}

/// Nothing but the source that was typed leads to an address.
#[test]
fn a_file_and_a_project_lead_to_no_address() {
    let asked = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp://{}", asked.local_addr().unwrap());
    let opened = patchlock_media::open(&address, false).err().unwrap();
    assert!(matches!(opened, patchlock_media::Error::Missing { .. }), "{opened}");
    asked.set_nonblocking(true).unwrap();
    assert!(asked.accept().is_err(), "the address was asked");
}

/// The page of `--preview` and `--select` says what it needs, and nobody without the token sees it.
#[test]
fn the_page_needs_its_token() {
    let bench = Bench::new();
    bench.images("film", 3);
    let mut track = Command::new(assert_cmd::cargo::cargo_bin("patchlock"));
    track.current_dir(bench.folder.path()).args(["track", "film", "--select", "--no-open"]);
    let mut track = Server(track.stderr(Stdio::piped()).spawn().unwrap());
    let mut said = BufReader::new(track.0.stderr.take().unwrap()).lines();
    let line = said.next().unwrap().unwrap();
    let (host, token) = line.split_once("http://").unwrap().1.split_once("/#").unwrap();
    let ask = |path: &str, headers: &str| {
        let mut stream = std::net::TcpStream::connect(host).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{headers}\r\n")
            .unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    };
    assert!(ask("/", "").starts_with("HTTP/1.1 200") && !ask("/", "").contains(token));
    assert!(ask("/api/frames", "").starts_with("HTTP/1.1 401"));
    assert!(ask("/", "").contains("frame-ancestors 'none'"));
    let with_token = format!("Authorization: Bearer {token}\r\n");
    assert!(ask("/api/frames", &with_token).starts_with("HTTP/1.1 400"), "no WebSocket");
    let other = format!("{with_token}Origin: http://example.org\r\n");
    assert!(ask("/api/frames", &other).starts_with("HTTP/1.1 403"));
    #[cfg(unix)]
    {
        interrupt(&track.0);
        assert_eq!(track.0.wait().unwrap().code(), Some(130));
    }
}
