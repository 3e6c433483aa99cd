//! Who may ask. A page of another site must not reach this server, neither by its address nor by a
//! name that was made to point here (DNS rebinding), and nothing under `/api` is answered without
//! the token, except for [`once`], which hands it out.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::answer::Refusal;
use super::connections::Place;
use super::{App, once};

/// The subprotocol of WebSockets; the token follows as the second one, since a page cannot set
/// headers there.
pub const PROTOCOL: &str = "patchlock";

/// What a request is checked against.
pub struct Access {
    address: SocketAddr,
    token: String,
    session: String,
}

impl Access {
    /// A server that listens on this address.
    pub fn new(address: SocketAddr, token: String) -> Result<Self, String> {
        Ok(Self { address, token, session: random_hex::<4>()? })
    }

    /// The address for the browser, with the token or a code for it. What follows `#` is never sent
    /// to a server.
    pub fn address(&self, camera: bool, secret: &str) -> String {
        let mut shown = self.address;
        if shown.ip().is_unspecified() {
            let local: IpAddr = if shown.is_ipv4() {
                [127, 0, 0, 1].into()
            } else {
                [0, 0, 0, 0, 0, 0, 0, 1].into()
            };
            shown.set_ip(local);
        }
        let page = if camera { "?camera" } else { "" };
        format!("http://{shown}/{page}#{secret}")
    }

    /// The token.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// A word that differs between two runs of the program, and is no secret.
    pub fn session(&self) -> &str {
        &self.session
    }

    /// Checks the host that the client believes to talk to, and returns it.
    fn host<'a>(&self, headers: &'a HeaderMap, uri: &'a Uri) -> Result<&'a str, Refusal> {
        let wrong = |host: &str| {
            Refusal::forbidden(format!("this server does not answer for the host {host:?}"))
                .hint(format!("open http://{}/ instead", self.address))
        };
        let mut hosts = headers.get_all(header::HOST).iter();
        let host = match (hosts.next().map(HeaderValue::to_str), hosts.next(), uri.authority()) {
            (Some(Ok(host)), None, None) => host,
            (Some(Ok(host)), None, Some(authority)) if authority.as_str() == host => host,
            _ => return Err(wrong("")),
        };
        if self.answers_for(host) { Ok(host) } else { Err(wrong(host)) }
    }

    /// Whether a host with its port is this server: `localhost` or an address, never a name that
    /// somebody else can make point here.
    fn answers_for(&self, host: &str) -> bool {
        let port = self.address.port();
        let name = match host.strip_suffix(&format!(":{port}")) {
            Some(name) => name,
            None if port == 80 => host,
            None => return false,
        };
        let name = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name);
        if name == "localhost" {
            return true;
        }
        let Ok(ip) = name.parse::<IpAddr>() else { return false };
        let listened = self.address.ip();
        ip == listened || (listened.is_unspecified() && !ip.is_unspecified())
    }

    fn check(&self, request: &Request) -> Result<(), Refusal> {
        let headers = request.headers();
        let host = self.host(headers, request.uri())?;
        let origin = headers.get(header::ORIGIN);
        if origin.is_some_and(|origin| origin.as_bytes() != format!("http://{host}").as_bytes()) {
            return Err(Refusal::forbidden("requests of other pages are not answered"));
        }
        if !is_api(request.uri()) {
            return Ok(());
        }
        if headers.get("sec-fetch-site").is_some_and(|site| site == "cross-site") {
            return Err(Refusal::forbidden("requests of other pages are not answered"));
        }
        if request.uri().path() == once::PATH {
            return Ok(());
        }
        match token(headers) {
            // In process there are no connections.
            Some(token) if same(token, &self.token) => {
                request.extensions().get::<Place>().map_or(Ok(()), Place::has_token)
            }
            Some(_) => Err(unauthorised("the token is not that of this server")),
            None => Err(unauthorised("the token is missing")),
        }
    }
}

/// Random bytes in hexadecimal digits.
pub fn random_hex<const BYTES: usize>() -> Result<String, String> {
    let mut random = [0; BYTES];
    getrandom::fill(&mut random).map_err(|error| format!("no random numbers: {error}"))?;
    Ok(random.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Compares a secret in a time that does not depend on where the two differ.
pub fn same(given: &str, secret: &str) -> bool {
    let same = given.bytes().zip(secret.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0;
    given.len() == secret.len() && same
}

fn unauthorised(message: &str) -> Refusal {
    Refusal::new(StatusCode::UNAUTHORIZED, message)
        .hint("open the address that the program has printed; it holds the token")
}

fn is_api(uri: &Uri) -> bool {
    uri.path() == "/api" || uri.path().starts_with("/api/")
}

/// The token of a request: a header, or of a WebSocket the second subprotocol.
fn token(headers: &HeaderMap) -> Option<&str> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    if let Some(authorisation) = text(header::AUTHORIZATION) {
        return authorisation.strip_prefix("Bearer ");
    }
    let protocols = text(header::SEC_WEBSOCKET_PROTOCOL)?;
    let (first, second) = protocols.split_once(',')?;
    (first.trim() == PROTOCOL).then_some(second.trim())
}

/// Checks a request and adds the headers that keep the page in its place.
pub async fn check(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    guarded(&app.access, "'none'", request, next).await
}

/// The same for any server. `frames` are the sources of pages that may show this one within them.
pub async fn guarded(access: &Access, frames: &str, request: Request, next: Next) -> Response {
    let checked = access.check(&request);
    let api = is_api(request.uri());
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok());
    let policy = policy(host.filter(|_| checked.is_ok()), frames);
    let mut response = match checked {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    let headers = response.headers_mut();
    if api && !headers.contains_key(header::CACHE_CONTROL) {
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    }
    headers.extend(
        FIXED.map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_static(value))),
    );
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    }
    response
}

const FIXED: [(&str, &str); 5] = [
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("permissions-policy", "camera=(self), microphone=(), geolocation=()"),
];

/// What the page may load. Some browsers do not count WebSockets as `'self'`, so they are named.
fn policy(host: Option<&str>, frames: &str) -> String {
    let sockets = host.map(|host| format!(" ws://{host}")).unwrap_or_default();
    format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
         connect-src 'self'{sockets}; media-src blob:; worker-src 'self'; manifest-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors {frames}"
    )
}
