//! `patchlock studio` prints its address, serves the page, and ends in order.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

use crate::support::{Bench, patchlock};
use predicates::prelude::*;
use predicates::str::contains;

/// A running server, killed at the end of the test at the latest.
struct Studio {
    child: Child,
    address: String,
    token: String,
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Studio {
    fn new(bench: &Bench, args: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_patchlock"));
        command.current_dir(bench.folder.path()).args(["studio", "--no-open"]).args(args);
        Self::start(&mut command)
    }

    fn start(command: &mut Command) -> Self {
        let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
        let mut child = command.spawn().expect("starts");
        let mut line = String::new();
        let out = child.stdout.take().expect("is piped");
        BufReader::new(out).read_line(&mut line).expect("prints");
        let (address, token) = line
            .trim()
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once('#'))
            .expect("an address with a token");
        let address = address.split('/').next().expect("has a host");
        Self { child, address: address.to_owned(), token: token.to_owned() }
    }

    /// What it says before it answers.
    fn said(&mut self) -> String {
        let stderr = BufReader::new(self.child.stderr.as_mut().expect("is piped"));
        let lines = stderr.lines().map(|line| line.expect("reads"));
        lines.take_while(|line| !line.contains("Ctrl-C")).collect::<Vec<_>>().join("\n")
    }

    /// The answer to a request with the token.
    fn ask(&self, method: &str, path: &str, body: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).expect("connects");
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {}\r\nConnection: close\r\n\
             Content-Length: {}\r\n\r\n{body}",
            self.address,
            self.token,
            body.len()
        );
        stream.write_all(request.as_bytes()).expect("sends");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answers");
        answer
    }
}

const EDIT: &str = r#"{"revision": 0, "edits": [{"edit": "add_target", "label": "target", "frame": 0,
    "box": {"x": 20, "y": 18, "w": 32, "h": 28}}]}"#;

#[test]
fn the_page_is_served_and_edits_are_beside_the_video() {
    let bench = Bench::new();
    bench.images("f", 4);
    let studio = Studio::new(&bench, &["f"]);
    assert!(studio.address.starts_with("127.0.0.1:"), "{}", studio.address);
    assert!(studio.ask("GET", "/", "").contains("<!doctype html>"));
    assert!(studio.ask("POST", "/api/clips/1/edits", EDIT).starts_with("HTTP/1.1 200"));
    // Killed at any moment, nothing is lost.
    drop(studio);
    let project = std::fs::read_to_string(bench.path("f.patchlock.json")).expect("is written");
    assert!(project.contains("patchlock-project"), "{project}");
    let studio = Studio::new(&bench, &["f", "--camera", "--threads", "1"]);
    let list = studio.ask("GET", "/api/clips", "");
    assert!(list.contains("\"keys\":1") && list.contains("\"camera\":true"), "{list}");
}

#[test]
fn a_clip_of_too_many_pixels_is_refused_with_a_hint() {
    let bench = Bench::new();
    bench.images("f", 2);
    let mut refused = patchlock();
    refused.current_dir(bench.folder.path());
    refused.args(["studio", "--no-open", "f", "--max-pixels", "6911"]);
    refused.assert().code(1).stderr(
        contains("96 x 72 pixels are more than the 6911").and(contains("--max-pixels 6912")),
    );
    let studio = Studio::new(&bench, &["f", "--max-pixels", "6912"]);
    assert!(studio.ask("GET", "/api/clips", "").contains("\"width\":96"));
}

/// The arguments of a program can be read by all users of the machine.
#[cfg(target_os = "linux")]
#[test]
fn the_program_that_opens_the_browser_is_not_given_the_token() {
    use std::os::unix::fs::PermissionsExt as _;
    let bench = Bench::new();
    bench.images("f", 1);
    std::fs::create_dir(bench.path("bin")).unwrap();
    let (opener, said) = (bench.path("bin/xdg-open"), bench.path("said"));
    let script = "#!/bin/sh\necho \"$@\" > said.part && mv said.part said\n";
    std::fs::write(&opener, script).unwrap();
    std::fs::set_permissions(&opener, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_patchlock"));
    let path = std::env::var("PATH").unwrap();
    command.env("PATH", format!("{}:{path}", bench.path("bin").display()));
    let studio = Studio::start(command.current_dir(bench.folder.path()).args(["studio", "f"]));
    let begun = std::time::Instant::now();
    while !said.exists() {
        assert!(begun.elapsed().as_secs() < 60, "nothing is opened");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let arguments = std::fs::read_to_string(said).unwrap();
    assert!(!arguments.contains(&studio.token), "{arguments}");
    let (address, code) = arguments.trim().split_once("/#").expect("an address with a code");
    assert_eq!(address, format!("http://{}", studio.address));
    let body = format!("{{\"code\": \"{code}\"}}");
    assert!(studio.ask("POST", "/api/token", &body).contains(&studio.token));
    assert!(studio.ask("POST", "/api/token", &body).starts_with("HTTP/1.1 401"));
}

#[test]
fn a_project_is_open_in_one_program_at_a_time() {
    let bench = Bench::new();
    bench.images("f", 2);
    let studio = Studio::new(&bench, &["f", "--project", "mine.patchlock.json"]);
    let number = studio.child.id().to_string();
    let mut second = patchlock();
    second.current_dir(bench.folder.path());
    second.args(["studio", "--no-open", "f", "--project", "mine.patchlock.json"]);
    second
        .assert()
        .code(1)
        .stderr(contains("mine.patchlock.json is open in").and(contains(number)));
}

/// The answer for a thumbnail, around which no others are prepared.
#[cfg(target_os = "linux")]
fn thumbnail(studio: &Studio, number: usize) -> String {
    let path = format!("/api/clips/1/frames/{number}?width=64");
    let mut stream = TcpStream::connect(&studio.address).expect("connects");
    let (host, token) = (&studio.address, &studio.token);
    let request = format!(
        "GET {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).expect("sends");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("answers");
    String::from_utf8_lossy(&answer).into_owned()
}

#[cfg(target_os = "linux")]
#[test]
fn a_clip_is_decoded_in_a_process_with_walls() {
    use crate::helper::{helpers, kill, status};
    let bench = Bench::new();
    bench.mp4("a.mp4", 6);
    let studio = Studio::new(&bench, &["a.mp4"]);
    assert!(thumbnail(&studio, 0).starts_with("HTTP/1.1 200"));
    let started = helpers(studio.child.id());
    assert_eq!(started.len(), 1, "one for the thumbnails");
    assert_eq!(status(started[0], "NoNewPrivs").as_deref(), Some("1"));
    assert!(status(started[0], "Seccomp").is_none_or(|mode| mode == "2"));
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", started[0])).unwrap();
    let memory = limits.lines().find(|line| line.starts_with("Max data size")).unwrap();
    assert!(!memory.contains("unlimited"), "{memory}");
    kill(started[0]);
    let refused = thumbnail(&studio, 1);
    assert!(refused.starts_with("HTTP/1.1 422"), "{refused}");
    assert!(refused.contains("the process that decodes it has ended: signal: 9"), "{refused}");
    assert!(thumbnail(&studio, 1).starts_with("HTTP/1.1 200"));
}

#[cfg(unix)]
#[test]
fn control_c_ends_it_in_order() {
    let bench = Bench::new();
    bench.images("f", 2);
    let mut studio = Studio::new(&bench, &["f"]);
    assert!(bench.path("f.patchlock.json.lock").exists());
    let number = studio.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &number]).status().expect("runs").success());
    assert!(studio.child.wait().expect("ends").success());
    assert!(!bench.path("f.patchlock.json.lock").exists());
}

/// The folder of the project is away during an edit, as a disk can be full.
#[cfg(unix)]
#[test]
fn an_edit_that_could_not_be_written_is_written_or_reported_at_the_end() {
    for (comes_back, code, words) in [
        (true, 0, "p.patchlock.json was written at the end"),
        (false, 1, "the last changes are lost: cannot write"),
    ] {
        let bench = Bench::new();
        bench.images("f", 2);
        let (projects, away) = (bench.path("projects"), bench.path("away"));
        std::fs::create_dir(&projects).unwrap();
        let mut studio = Studio::new(&bench, &["f", "--project", "projects/p.patchlock.json"]);
        std::fs::rename(&projects, &away).unwrap();
        assert!(studio.ask("POST", "/api/clips/1/edits", EDIT).starts_with("HTTP/1.1 500"));
        if comes_back {
            std::fs::rename(&away, &projects).unwrap();
        }
        let number = studio.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &number]).status().expect("runs").success());
        assert_eq!(studio.child.wait().expect("ends").code(), Some(code));
        let mut said = String::new();
        studio.child.stderr.take().expect("is piped").read_to_string(&mut said).expect("reads");
        assert!(said.contains(words), "{said}");
        let written = std::fs::read_to_string(projects.join("p.patchlock.json"));
        assert_eq!(written.is_ok_and(|text| text.contains("\"keys\"")), comes_back);
    }
}

/// Clips in a folder that is not to be written to.
#[test]
fn projects_are_in_a_folder_of_their_own() {
    let bench = Bench::new();
    for folder in ["share/a/f", "share/b/f"] {
        bench.images(folder, 2);
    }
    let args = ["share/a/f", "share/b/f", "--projects", "mine/projects"];
    let studio = Studio::new(&bench, &args);
    for clip in ["1", "2"] {
        let path = format!("/api/clips/{clip}/edits");
        assert!(studio.ask("POST", &path, EDIT).starts_with("HTTP/1.1 200"));
    }
    drop(studio);
    let files = |folder| std::fs::read_dir(bench.path(folder)).unwrap().count();
    // Two projects and the labels.
    assert_eq!((files("share/a"), files("share/b")), (1, 1));
    let written = std::fs::read_dir(bench.path("mine/projects")).unwrap().flatten();
    let mut names: Vec<_> = written.map(|file| file.file_name().into_string().unwrap()).collect();
    names.retain(|name| name.ends_with(".patchlock.json"));
    assert_eq!(names.len(), 2, "{names:?}");
    let studio = Studio::new(&bench, &["share/b/f", "--projects", "mine/projects"]);
    assert!(studio.ask("GET", "/api/clips", "").contains("\"keys\":1"));
}

/// What has the name of the lock cannot be written, as in a folder that is read-only.
#[test]
fn a_project_that_cannot_be_written_names_the_folder_for_projects() {
    let bench = Bench::new();
    bench.images("f", 1);
    bench.images("g", 1);
    std::fs::create_dir(bench.path("f.patchlock.json.lock")).unwrap();
    let refused = patchlock().current_dir(bench.folder.path()).args(["studio", "f"]).assert();
    refused.code(1).stderr(contains("cannot write").and(contains("--projects DIR")));
    let list = Studio::new(&bench, &["f", "g"]).ask("GET", "/api/clips", "");
    assert!(
        list.contains("cannot write") && list.contains("another folder for the projects"),
        "{list}"
    );
    let list = Studio::new(&bench, &["f", "--projects", "p"]).ask("GET", "/api/clips", "");
    assert!(!list.contains("error"), "{list}");
}

#[test]
fn a_host_that_is_allowed_is_answered_for() {
    let bench = Bench::new();
    bench.images("f", 1);
    let mut studio = Studio::new(&bench, &["f", "--allow-host", "studio.example.org"]);
    let ask = |studio: &Studio, host: &str| {
        let mut stream = TcpStream::connect(&studio.address).expect("connects");
        write!(stream, "GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
            .expect("sends");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answers");
        answer
    };
    assert!(ask(&studio, "studio.example.org:8443").starts_with("HTTP/1.1 200"));
    let refused = ask(&studio, "evil.example");
    assert!(refused.starts_with("HTTP/1.1 403") && refused.contains("--allow-host"), "{refused}");
    let said = studio.said();
    assert!(
        said.contains(&format!("the address of the page ends with #{}", studio.token)),
        "{said}"
    );
}

/// Who has logged in by ssh is told how a browser gets here.
#[test]
fn the_command_of_the_tunnel_is_printed_over_ssh() {
    let bench = Bench::new();
    bench.images("f", 1);
    let mut command = Command::new(env!("CARGO_BIN_EXE_patchlock"));
    command.env("SSH_CONNECTION", "10.0.0.2 50000 10.0.0.1 22").env("USER", "me");
    command.current_dir(bench.folder.path()).args(["studio", "--no-open", "f"]);
    let mut studio = Studio::start(&mut command);
    let port = studio.address.rsplit(':').next().expect("a port").to_owned();
    let said = studio.said();
    let tunnel = format!("ssh -N -L {port}:localhost:{port} me@10.0.0.1");
    assert!(said.contains(&tunnel), "{said}");
}

#[test]
fn one_bad_clip_keeps_no_other_from_being_shown() {
    let bench = Bench::new();
    bench.images("f", 2);
    std::fs::write(bench.path("text.mp4"), "no video").unwrap();
    let studio = Studio::new(&bench, &["text.mp4", "f"]);
    let list = studio.ask("GET", "/api/clips", "");
    assert!(
        list.contains("\"error\":\"cannot read text.mp4") && list.contains("\"width\":96"),
        "{list}"
    );
    let bad = studio.ask("GET", "/api/clips/1", "");
    assert!(!bad.starts_with("HTTP/1.1 200") && bad.contains("\"hint\":"), "{bad}");
}

#[test]
fn errors_say_what_to_do() {
    let bench = Bench::new();
    bench.images("f", 1);
    bench.images("g", 1);
    std::fs::write(bench.path("text.mp4"), "no video").unwrap();
    for (args, code, words) in [
        (&["nowhere.mp4"][..], 2, "there is no file or folder nowhere.mp4"),
        (&["f", "g", "--project", "p.json"], 2, "--project is for one video; there are 2"),
        (&["--project", "p.json"], 2, "--project is for one video; there are 0"),
        (&["f", "--project", "p.json", "--projects", "p"], 2, "cannot be used with"),
        (&["f", "--projects", "text.mp4"], 1, "cannot make the folder text.mp4"),
        (&["f", "--allow-host", "https://a.example/"], 2, "\"https://a.example/\" is not a host"),
        (&["f", "--preset", "best"], 2, "best"),
        (&["f", "--preset", "paper", "--set", "rotate=true"], 2, "--set"),
        (&["f", "--port", "65536"], 2, "65536"),
        (&["f", "--listen", "nowhere"], 2, "nowhere"),
        (&["f", "--listen", "192.0.2.1"], 1, "cannot listen on 192.0.2.1"),
        (&["text.mp4"], 1, "cannot read text.mp4"),
        (&["text.mp4"], 1, "hint: convert the video"),
    ] {
        let mut command = patchlock();
        command.current_dir(bench.folder.path()).args(["studio", "--no-open"]).args(args);
        command.timeout(std::time::Duration::from_secs(60));
        command.assert().code(code).stderr(contains(words));
    }
}

#[test]
fn a_taken_port_is_an_error_and_other_addresses_are_warned_of() {
    let bench = Bench::new();
    bench.images("f", 1);
    let mut studio = Studio::new(&bench, &["f", "--listen", "0.0.0.0"]);
    assert!(studio.address.starts_with("127.0.0.1:"), "{}", studio.address);
    let port = studio.address.rsplit(':').next().expect("a port").to_owned();
    let mut second = patchlock();
    second.current_dir(bench.folder.path()).args(["studio", "--no-open", "--listen", "0.0.0.0"]);
    second.args(["--port", &port]);
    second.assert().code(1).stderr(contains("cannot listen on").and(contains("--port")));
    let _ = studio.child.kill();
    let mut errors = String::new();
    studio.child.stderr.take().expect("is piped").read_to_string(&mut errors).expect("reads");
    assert!(errors.contains("warning: with --listen 0.0.0.0 others"), "{errors}");
}
