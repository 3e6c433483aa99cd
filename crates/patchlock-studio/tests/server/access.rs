//! Who may ask.

use std::time::Duration;

use patchlock_studio::server::Options;
use serde_json::json;

use crate::support::{TestServer, options, video};

const ADDRESSES: [(&str, &str); 6] = [
    ("GET", "/api/clips"),
    ("GET", "/api/clips/1"),
    ("GET", "/api/clips/1/frames/0"),
    ("POST", "/api/clips/1/edits"),
    ("POST", "/api/clips/1/undo"),
    ("GET", "/api/nothing"),
];

#[test]
fn nothing_of_the_interface_is_answered_without_the_token() {
    let server = TestServer::new();
    for (method, path) in ADDRESSES {
        let answer = server.send_with(method, path, &[], b"{}");
        assert_eq!(answer.error(401), "the token is missing", "{path}");
        assert!(answer.json()["hint"].as_str().is_some());
    }
    let zeros = format!("Authorization: Bearer {}", "0".repeat(64));
    let short = format!("Authorization: Bearer {}", &server.token[..63]);
    let longer = format!("Authorization: Bearer {}0", server.token);
    let basic = format!("Authorization: Basic {}", server.token);
    for header in [&zeros, &short, &longer, &basic, "Authorization: Bearer "] {
        for (method, path) in ADDRESSES {
            assert_eq!(server.send_with(method, path, &[header], b"{}").status, 401, "{header}");
        }
    }
    // Nor in the address, where it would end up in logs.
    let path = format!("/api/clips?token={}", server.token);
    assert_eq!(server.send_with("GET", &path, &[], &[]).status, 401);
    assert_eq!(server.get("/api/clips").status, 200);
    assert_eq!(server.clip()["revision"], 0, "nothing was changed");
}

#[test]
fn the_token_is_long_and_another_one_each_time() {
    let mut server = TestServer::new();
    let before = server.token.clone();
    assert!(before.len() == 64 && before.bytes().all(|byte| byte.is_ascii_hexdigit()));
    server.restart();
    assert_ne!(server.token, before);
}

#[test]
fn a_server_that_is_started_again_has_the_same_token() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("clip.mp4");
    let truth = video(&file);
    let mut options = options(vec![file], folder.path());
    options.tokens = Some(folder.path().join("state"));
    let mut server = TestServer::with(options.clone(), folder, truth);
    let before = server.token.clone();
    options.address = server.address;
    server.restart_with(&options);
    assert_eq!(server.token, before);
    assert_eq!(server.get("/api/clips").status, 200);
    // Somebody may have used the code of the browser: then starting again must help.
    exchange(&server, "once-00", &[]).error(401);
    assert_eq!(exchange(&server, &server.code, &[]).status, 200);
    server.restart_with(&options);
    assert_eq!(server.token, before);
    assert_eq!(exchange(&server, &server.code, &[]).status, 200);
    exchange(&server, &server.code, &[]).error(401);
    server.restart_with(&options);
    assert_ne!(server.token, before);
    let before = server.token.clone();
    // Other videos, or an address that others can reach, are not for the pages from before.
    options.videos.clear();
    server.restart_with(&options);
    assert_ne!(server.token, before);
    let mut open = Options { address: ([0, 0, 0, 0], 0).into(), ..options };
    server.restart_with(&open);
    let first = server.token.clone();
    open.address.set_port(server.address.port());
    server.restart_with(&open);
    assert_ne!(server.token, first);
    let mut proxied = open.clone();
    proxied.address.set_ip([127, 0, 0, 1].into());
    proxied.hosts.allowed = vec!["studio.example.org".parse().expect("a host")];
    server.restart_with(&proxied);
    let first = server.token.clone();
    server.restart_with(&proxied);
    assert_ne!(server.token, first);
}

/// Asks for the token without having it.
fn exchange(server: &TestServer, code: &str, headers: &[&str]) -> crate::support::Answer {
    let body = json!({ "code": code }).to_string();
    server.send_with("POST", "/api/token", headers, body.as_bytes())
}

#[test]
fn the_code_for_a_browser_gives_the_token_once() {
    let server = TestServer::new();
    assert!(server.code.starts_with("once-") && !server.code.contains(&server.token));
    assert_eq!(exchange(&server, "once-00", &[]).status, 401);
    assert_eq!(exchange(&server, &server.token, &[]).status, 401);
    // A page of another site cannot use it up.
    for header in
        ["Origin: http://evil.example", "Sec-Fetch-Site: cross-site", "Host: evil.example"]
    {
        assert!(matches!(exchange(&server, &server.code, &[header]).status, 400 | 403), "{header}");
    }
    let answer = exchange(&server, &server.code, &[]);
    assert_eq!((answer.status, answer.header("cache-control")), (200, Some("no-store")));
    assert_eq!(answer.json()["token"], server.token.as_str());
    let late = exchange(&server, &server.code, &[]);
    assert!(late.error(401).contains("used already"));
    // It is no token itself.
    let bearer = format!("Authorization: Bearer {}", server.code);
    assert_eq!(server.send_with("GET", "/api/clips", &[&bearer], &[]).status, 401);
}

#[test]
fn the_code_for_a_browser_ends_soon() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("clip.mp4");
    let truth = video(&file);
    let mut options = options(vec![file], folder.path());
    options.timeouts.code = Duration::ZERO;
    let server = TestServer::with(options, folder, truth);
    assert!(exchange(&server, &server.code, &[]).error(401).contains("too late"));
    assert_eq!(server.get("/api/clips").status, 200);
}

#[test]
fn only_this_machine_is_answered_for() {
    let server = TestServer::new();
    let bearer = format!("Authorization: Bearer {}", server.token);
    let port = server.address.port();
    for host in [
        "evil.example".to_owned(),
        format!("evil.example:{port}"),
        format!("127.0.0.1.evil.example:{port}"),
        format!("localhost.evil.example:{port}"),
        format!("localhost.:{port}"),
        format!("10.0.0.1:{port}"),
        "[::ffff:10.0.0.1]".to_owned(),
        format!("localhost:{port}:1"),
        "localhost:65536".to_owned(),
        String::new(),
    ] {
        for path in ["/", "/api/clips"] {
            let header = format!("Host: {host}");
            let answer = server.send_with("GET", path, &[&header, &bearer], &[]);
            assert!(matches!(answer.status, 400 | 403), "{host} {path}: {}", answer.status);
        }
    }
    // A tunnel or a published port has another number; that of HTTP is left out.
    let (other, tunnel) = (port ^ 1, format!("localhost:{}", port ^ 1));
    for host in [
        format!("127.0.0.1:{port}"),
        format!("localhost:{port}"),
        format!("127.0.0.1:{other}"),
        format!("[::1]:{other}"),
        tunnel.clone(),
        "localhost".to_owned(),
    ] {
        let header = format!("Host: {host}");
        assert_eq!(server.send_with("GET", "/api/clips", &[&header, &bearer], &[]).status, 200);
        assert_eq!(server.send_with("GET", "/", &[&header], &[]).status, 200);
    }
    // The page that a browser names is then that of the tunnel, and no other of this machine.
    let host = format!("Host: {tunnel}");
    for (origin, status) in [
        (format!("http://{tunnel}"), 200),
        (format!("https://{tunnel}"), 200),
        (format!("http://localhost:{port}"), 403),
        (format!("http://127.0.0.1:{other}"), 403),
        ("http://localhost".to_owned(), 403),
    ] {
        let header = format!("Origin: {origin}");
        let answer = server.send_with("GET", "/api/clips", &[&host, &header, &bearer], &[]);
        assert_eq!(answer.status, status, "{origin}");
    }
    let twice = format!("Host: evil.example\r\nHost: 127.0.0.1:{port}");
    assert!(matches!(server.send_with("GET", "/", &[&twice], &[]).status, 400 | 403));
}

/// A server that a proxy serves at some hosts.
fn proxied(hosts: &[&str]) -> TestServer {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("clip.mp4");
    let truth = video(&file);
    let mut options = options(vec![file], folder.path());
    options.hosts.allowed = hosts.iter().map(|host| host.parse().expect("a host")).collect();
    TestServer::with(options, folder, truth)
}

#[test]
fn a_host_is_allowed_with_the_token_and_others_are_not() {
    let server = proxied(&["studio.example.org", "10.0.0.7:8443"]);
    let bearer = format!("Patchlock-Token: {}", server.token);
    let status = |host: &str, headers: &[&str]| {
        let host = format!("Host: {host}");
        let headers: Vec<&str> = headers.iter().copied().chain([&*host]).collect();
        let answer = server.send_with("GET", "/api/clips", &headers, &[]);
        if answer.status >= 400 {
            assert!(answer.json()["hint"].as_str().is_some(), "{}", answer.text());
        }
        answer.status
    };
    for host in ["studio.example.org", "Studio.Example.org:8080", "10.0.0.7:8443", "localhost:1"] {
        assert_eq!(status(host, &[&bearer]), 200, "{host}");
        assert_eq!(status(host, &[]), 401, "{host}");
        assert_eq!(status(host, &["Patchlock-Token: 00"]), 401, "{host}");
    }
    for host in ["evil.example", "evil.studio.example.org", "10.0.0.7:8444", "10.0.0.8:8443"] {
        assert_eq!(status(host, &[&bearer]), 403, "{host}");
        assert_eq!(status(host, &[]), 403, "{host}");
    }
    // A proxy may leave its own name out of the request, but not what the browser says of the page.
    let local = server.address.to_string();
    for (host, origin, expected) in [
        ("studio.example.org", "https://studio.example.org", 200),
        ("studio.example.org", "https://studio.example.org:8443", 200),
        (&*local, "https://studio.example.org", 200),
        ("10.0.0.7:8443", "https://10.0.0.7:8443", 200),
        ("studio.example.org", "https://evil.example", 403),
        ("studio.example.org", "https://studio.example.org.evil.example", 403),
        (&*local, "https://10.0.0.7", 403),
        (&*local, "https://evil.example", 403),
    ] {
        let origin = format!("Origin: {origin}");
        assert_eq!(status(host, &[&origin, &bearer]), expected, "{host} {origin}");
    }
    let cross = ["Host: studio.example.org", "Sec-Fetch-Site: cross-site", &bearer];
    assert_eq!(server.send_with("GET", "/api/clips", &cross, &[]).status, 403);
}

#[test]
fn sockets_are_opened_at_an_allowed_host_too() {
    let server = proxied(&["studio.example.org"]);
    let protocols = format!("patchlock, {}", server.token);
    let opens = |headers: &[(&'static str, &str)], protocols: &str| {
        server.try_socket_with("/api/clips/1/events", protocols, headers).is_ok()
    };
    let host = ("Host", "studio.example.org");
    assert!(opens(&[host, ("Origin", "https://studio.example.org")], &protocols));
    assert!(opens(&[("Origin", "https://studio.example.org")], &protocols));
    // The proxy may have users of its own.
    assert!(opens(&[host, ("Authorization", "Basic dTpw")], &protocols));
    assert!(!opens(&[host], "patchlock, 00"));
    assert!(!opens(&[host, ("Origin", "https://evil.example")], &protocols));
    assert!(!opens(&[("Host", "evil.example")], &protocols));
}

#[test]
fn what_a_proxy_asks_of_its_users_does_not_hide_the_token() {
    let server = TestServer::new();
    let own = format!("Patchlock-Token: {}", server.token);
    let bearer = format!("Authorization: Bearer {}", server.token);
    for (headers, status) in [
        (vec!["Authorization: Basic dTpw", &own], 200),
        (vec!["Authorization: Bearer another", &own], 200),
        (vec![&*bearer], 200),
        (vec![&*bearer, "Patchlock-Token: 00"], 401),
        (vec!["Authorization: Basic dTpw"], 401),
    ] {
        assert_eq!(
            server.send_with("GET", "/api/clips", &headers, &[]).status,
            status,
            "{headers:?}"
        );
    }
}

#[test]
fn other_pages_are_not_answered_even_with_the_token() {
    let server = TestServer::new();
    let bearer = format!("Authorization: Bearer {}", server.token);
    for origin in ["http://evil.example", "https://127.0.0.1", "null", "http://127.0.0.1:1"] {
        let header = format!("Origin: {origin}");
        for path in ["/", "/api/clips"] {
            let answer = server.send_with("GET", path, &[&header, &bearer], &[]);
            assert_eq!(answer.status, 403, "{origin} {path}");
            assert_eq!(answer.header("access-control-allow-origin"), None);
        }
    }
    let cross = ["Sec-Fetch-Site: cross-site", &bearer];
    assert_eq!(server.send_with("GET", "/api/clips", &cross, &[]).status, 403);
    let own = format!("Origin: http://{}", server.address);
    assert_eq!(server.send_with("GET", "/api/clips", &[&own, &bearer], &[]).status, 200);
    // A browser asks before it sends a foreign request with a token: there is no permission.
    let preflight =
        server.send_with("OPTIONS", "/api/clips", &["Origin: http://evil.example"], &[]);
    assert_eq!(preflight.status, 403);
}

#[test]
fn sockets_need_the_token_too() {
    let server = TestServer::new();
    let path = "/api/clips/1/events";
    for protocols in ["patchlock", "patchlock, 00", "other"] {
        assert!(server.try_socket(path, protocols).is_err(), "{protocols}");
    }
    let swapped = format!("{}, patchlock", server.token);
    assert!(server.try_socket(path, &swapped).is_err());
    assert!(server.try_socket(path, &format!("patchlock, {}", server.token)).is_ok());
}

#[test]
fn every_answer_tells_the_browser_to_keep_the_page_in_its_place() {
    let server = TestServer::new();
    for path in ["/", "/api/clips", "/api/clips/1/frames/0", "/nothing", "/api/clips/7"] {
        let answer = server.get(path);
        let policy = answer.header("content-security-policy").expect("is there");
        for part in ["default-src 'none'", "script-src 'self'", "frame-ancestors 'none'"] {
            assert!(policy.contains(part), "{path}: {policy}");
        }
        assert!(!policy.contains("unsafe") && !policy.contains('*'), "{policy}");
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"), "{path}");
        assert_eq!(answer.header("referrer-policy"), Some("no-referrer"), "{path}");
    }
    let proxied = proxied(&["studio.example.org"]).get("/");
    let policy = proxied.header("content-security-policy").expect("is there");
    assert!(
        policy.contains("wss://studio.example.org:*") && !policy.contains("unsafe"),
        "{policy}"
    );
    assert_eq!(server.get("/api/clips").header("cache-control"), Some("no-store"));
    assert_eq!(server.get("/").header("content-type"), Some("text/html; charset=utf-8"));
}
