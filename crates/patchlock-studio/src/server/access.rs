//! Who may ask. A page of another site must not reach this server, neither by its address nor by a
//! name that was made to point here (DNS rebinding), and nothing under `/api` is answered without
//! the token, except for [`code`], which hands it out.
//!
//! Tunnels and published ports change the port, so none is asked for: rebinding needs a name, and
//! `localhost` and addresses are none that somebody else can make point here.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::answer::Refusal;
use super::code;
use super::connections::Permit;
use super::host::{AllowedHost, AllowedHosts, Host, Origin};

/// The subprotocol of WebSockets; the token follows as the second one, since a page cannot set
/// headers there.
pub const PROTOCOL: &str = "patchlock";
/// The header with the token. Proxies look at `Authorization`, which may be that of their own users.
const TOKEN: &str = "patchlock-token";

/// What a request is checked against.
pub struct Access {
    /// Where the server listens.
    pub address: SocketAddr,
    hosts: AllowedHosts,
    pub token: String,
    /// A word that differs between two runs of the program, and is no secret.
    pub session: String,
    /// The sources of pages that may show this one within them.
    frames: String,
}

impl Access {
    /// A server that listens on this address, and is asked under other hosts, too. `frames` are the
    /// sources of pages that may show its own within them.
    pub fn new(
        address: SocketAddr,
        hosts: AllowedHosts,
        token: String,
        frames: String,
    ) -> Result<Self, String> {
        Ok(Self { address, hosts, token, session: random_hex::<4>()?, frames })
    }

    /// The address for the browser, with the token or a code for it. What follows `#` is never sent
    /// to a server.
    pub fn url(&self, camera: bool, secret: &str) -> String {
        let page = if camera { "?camera" } else { "" };
        format!("{}{page}#{secret}", self.page())
    }

    /// The address for a browser on this machine.
    fn page(&self) -> String {
        let mut shown = self.address;
        if shown.ip().is_unspecified() {
            shown.set_ip(match shown {
                SocketAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
                SocketAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
            });
        }
        format!("http://{shown}/")
    }

    /// Checks the host that the client believes to talk to, and returns it.
    fn host<'a>(&self, headers: &'a HeaderMap, uri: &'a Uri) -> Result<Host<'a>, Refusal> {
        let wrong = |host: &str| {
            let hint = format!("open {} instead, or {}", self.page(), self.hosts.advice);
            Refusal::forbidden(format!("this server does not answer for the host {host:?}"))
                .hint(hint)
        };
        let mut hosts = headers.get_all(header::HOST).iter();
        let text = match (hosts.next().map(HeaderValue::to_str), hosts.next(), uri.authority()) {
            (Some(Ok(host)), None, None) => host,
            (Some(Ok(host)), None, Some(authority)) if authority.as_str() == host => host,
            _ => return Err(wrong("")),
        };
        Host::parse(text).filter(|host| self.answers_for(*host)).ok_or_else(|| wrong(text))
    }

    /// Whether a host is this server: `localhost`, an address of it, or one that is allowed; never
    /// a name that somebody else can make point here.
    fn answers_for(&self, host: Host<'_>) -> bool {
        if host.name == "localhost" || self.allows(host) {
            return true;
        }
        let Ok(ip) = host.name.parse::<IpAddr>() else { return false };
        let listened = self.address.ip();
        let is_any = listened.is_unspecified() && !ip.is_unspecified();
        ip.is_loopback() || ip == listened || is_any
    }

    fn allows(&self, host: Host<'_>) -> bool {
        self.hosts.allowed.iter().any(|allowed| allowed.includes(host))
    }

    /// Checks the page that asks, if the browser names it: it was read from this host, or from one
    /// that is allowed, since a proxy may change the host.
    fn check_origin(&self, headers: &HeaderMap, host: Host<'_>) -> Result<(), Refusal> {
        let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
        let text = origin.to_str().unwrap_or_default();
        let is_ours = |origin: Origin<'_>| host.is_of(origin) || self.allows(origin.host);
        match Origin::parse(text).is_some_and(is_ours) {
            true => Ok(()),
            false => Err(Refusal::forbidden("requests of other pages are not answered")
                .hint(format!("if {text} is where you read this page, {}", self.hosts.advice))),
        }
    }

    fn check(&self, request: &Request) -> Result<(), Refusal> {
        let headers = request.headers();
        let host = self.host(headers, request.uri())?;
        self.check_origin(headers, host)?;
        if !is_api(request.uri()) {
            return Ok(());
        }
        if headers.get("sec-fetch-site").is_some_and(|site| site == "cross-site") {
            return Err(Refusal::forbidden("requests of other pages are not answered"));
        }
        if request.uri().path() == code::PATH {
            return Ok(());
        }
        match token(headers) {
            // In process there are no connections.
            Some(token) if same(token, &self.token) => {
                request.extensions().get::<Permit>().map_or(Ok(()), Permit::has_token)
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
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok());
    let bearer = || text("authorization")?.strip_prefix("Bearer ");
    let of_socket = || {
        let (first, second) = text("sec-websocket-protocol")?.split_once(',')?;
        (first.trim() == PROTOCOL).then_some(second.trim())
    };
    text(TOKEN).or_else(bearer).or_else(of_socket)
}

/// Checks a request and adds the headers that keep the page in its place.
pub async fn check(State(access): State<Arc<Access>>, request: Request, next: Next) -> Response {
    let checked = access.check(&request);
    let api = is_api(request.uri());
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok());
    let policy = policy(host.filter(|_| checked.is_ok()), &access.hosts.allowed, &access.frames);
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
fn policy(host: Option<&str>, allowed: &[AllowedHost], frames: &str) -> String {
    let allowed = allowed.iter().map(ToString::to_string).filter(|_| host.is_some());
    let hosts = host.map(str::to_owned).into_iter().chain(allowed);
    let sockets: String = hosts.map(|host| format!(" ws://{host} wss://{host}")).collect();
    format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
         connect-src 'self'{sockets}; media-src blob:; worker-src 'self'; manifest-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors {frames}"
    )
}
