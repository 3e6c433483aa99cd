//! The hosts under which a server is asked.

use std::fmt;
use std::net::Ipv6Addr;
use std::str::FromStr;

/// A host that a server answers for beside those of this machine: the one at which a proxy serves
/// the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AllowedHost {
    /// A name or an address; that of IPv6 without brackets.
    name: String,
    /// `None` stands for all ports.
    port: Option<u16>,
}

/// The hosts that a server answers for beside those of this machine.
#[derive(Debug, Clone)]
pub struct AllowedHosts {
    /// The hosts; often none.
    pub allowed: Vec<AllowedHost>,
    /// What a user does to allow another host: a sentence without its end, for hints.
    pub advice: &'static str,
}

/// A text is not a host.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not a host; allowed are NAME and NAME:PORT, without https:// and without a path")]
pub struct HostError(String);

impl FromStr for AllowedHost {
    type Err = HostError;

    fn from_str(text: &str) -> Result<Self, HostError> {
        let Host { name, port } = Host::parse(text).ok_or_else(|| HostError(text.to_owned()))?;
        Ok(Self { name: name.to_ascii_lowercase(), port })
    }
}

impl AllowedHost {
    /// Whether a request may be for this host. Where the host has no port, it is that of HTTP or
    /// HTTPS.
    pub(super) fn includes(&self, host: Host<'_>) -> bool {
        let is_port = |wanted| host.port.map_or(wanted == 80 || wanted == 443, |it| it == wanted);
        self.name.eq_ignore_ascii_case(host.name) && self.port.is_none_or(is_port)
    }
}

/// As a content policy names it, with a scheme before it.
impl fmt::Display for AllowedHost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name.contains(':') {
            true => write!(f, "[{}]", self.name)?,
            false => f.write_str(&self.name)?,
        }
        match self.port {
            Some(port) => write!(f, ":{port}"),
            None => f.write_str(":*"),
        }
    }
}

/// What a client calls a server.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Host<'a> {
    /// A name or an address; that of IPv6 without brackets.
    pub name: &'a str,
    /// `None` stands for the port of the scheme.
    pub port: Option<u16>,
}

impl<'a> Host<'a> {
    /// The host of a text such as `localhost:8000` or `[::1]`.
    pub fn parse(text: &'a str) -> Option<Self> {
        let (name, rest) = match text.strip_prefix('[') {
            Some(rest) => {
                let (name, rest) = rest.split_once(']')?;
                name.parse::<Ipv6Addr>().ok()?;
                (name, rest)
            }
            None => {
                let end = text.find(':').unwrap_or(text.len());
                let (name, rest) = text.split_at(end);
                let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"-._".contains(&byte);
                (!name.is_empty() && name.bytes().all(is_part)).then_some((name, rest))?
            }
        };
        let port = match rest.strip_prefix(':') {
            Some(digits) if digits.bytes().all(|byte| byte.is_ascii_digit()) => {
                Some(digits.parse().ok()?)
            }
            None if rest.is_empty() => None,
            _ => return None,
        };
        Some(Self { name, port })
    }

    /// Whether a page of this origin was read from this host.
    pub fn is_of(self, origin: Origin<'_>) -> bool {
        let port = |host: Host<'_>| host.port.unwrap_or(origin.port);
        self.name.eq_ignore_ascii_case(origin.host.name) && port(self) == port(origin.host)
    }
}

/// Where a page was read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Origin<'a> {
    pub host: Host<'a>,
    /// The port of the scheme.
    port: u16,
}

impl<'a> Origin<'a> {
    /// The origin of a text such as `https://localhost:8000`.
    pub fn parse(text: &'a str) -> Option<Self> {
        let (host, port) = match text.strip_prefix("https://") {
            Some(host) => (host, 443),
            None => (text.strip_prefix("http://")?, 80),
        };
        Some(Self { host: Host::parse(host)?, port })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_names_or_addresses_with_or_without_a_port() {
        let parsed = |text| Host::parse(text).map(|host| (host.name, host.port));
        assert_eq!(parsed("localhost:8000"), Some(("localhost", Some(8000))));
        assert_eq!(parsed("a-b.example.org"), Some(("a-b.example.org", None)));
        assert_eq!(parsed("[::1]:80"), Some(("::1", Some(80))));
        assert_eq!(parsed("[::1]"), Some(("::1", None)));
        for wrong in [
            "",
            ":80",
            "::1",
            "[::1",
            "[evil.example]",
            "[::1]80",
            "a:b",
            "a:",
            "a:+80",
            "a:65536",
            "a/b",
            "https://a",
            "a b",
            "a@b",
            "*",
            "*.example.org",
        ] {
            assert_eq!(parsed(wrong), None, "{wrong}");
            assert!(wrong.parse::<AllowedHost>().unwrap_err().to_string().contains(wrong));
        }
    }

    #[test]
    fn an_allowed_host_is_meant_with_its_port_or_with_all() {
        let allows = |allowed: &str, host| {
            allowed.parse::<AllowedHost>().unwrap().includes(Host::parse(host).unwrap())
        };
        for host in ["example.org", "EXAMPLE.org:8443", "example.org:443"] {
            assert!(allows("Example.org", host), "{host}");
        }
        assert!(allows("example.org:8443", "example.org:8443"));
        assert!(allows("example.org:443", "example.org"));
        assert!(allows("[2001:db8::1]:9", "[2001:db8::1]:9"));
        for (allowed, host) in [
            ("example.org", "evil.example.org"),
            ("example.org", "example.org.evil.example"),
            ("example.org:8443", "example.org:8444"),
            ("example.org:8443", "example.org"),
        ] {
            assert!(!allows(allowed, host), "{allowed} {host}");
        }
    }

    #[test]
    fn the_port_of_an_origin_is_that_of_its_scheme_unless_it_is_named() {
        let is_of = |host, origin| {
            Origin::parse(origin).is_some_and(|it| Host::parse(host).unwrap().is_of(it))
        };
        assert!(is_of("a.example", "http://a.example") && is_of("a.example", "https://a.example"));
        assert!(is_of("a.example:443", "https://a.example"));
        assert!(is_of("A.example:80", "http://a.example:80"));
        for (host, origin) in [
            ("a.example", "http://b.example"),
            ("a.example:443", "http://a.example"),
            ("a.example:1", "http://a.example:2"),
            ("a.example", "https://a.example:8443"),
            ("a.example", "null"),
            ("a.example", "ftp://a.example"),
            ("a.example", "http://a.example/"),
            ("a.example", "a.example"),
        ] {
            assert!(!is_of(host, origin), "{host} {origin}");
        }
    }
}
