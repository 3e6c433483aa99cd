//! The code in the address that the program hands to a browser. The list of processes shows that
//! address to other users of the machine, so the code is no token: it is exchanged for one, once,
//! and soon after it was drawn.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::StatusCode;
use serde::Deserialize;
use serde_json::json;

use super::access::{Access, random_hex, same};
use super::answer::{BodyReader, JsonAnswer, Refusal, parsed};
use super::lock;
use super::timeouts::Timeouts;

/// Where a page exchanges a code for the token. It is answered without the token.
pub const PATH: &str = "/api/token";
/// The beginning of a code, which no token has.
const PREFIX: &str = "once-";
/// Random bytes of a code.
const CODE_BYTES: usize = 32;
/// Longest request, in bytes of JSON.
const REQUEST_BYTES: u64 = 1024;

/// What gives a page the token for a code.
pub struct TokenExchange {
    access: Arc<Access>,
    timeouts: Timeouts,
    /// The file that has the token, if it is kept.
    token_file: Option<PathBuf>,
    /// What the user of a code can do that gives no token.
    hint: &'static str,
    /// The code that was drawn last.
    drawn: Mutex<Option<IssuedCode>>,
}

struct IssuedCode {
    code: String,
    at: Instant,
    used: bool,
}

/// Whether a code gives the token.
#[derive(PartialEq, Eq)]
enum CodeStatus {
    Valid,
    /// It was used already, or is too old.
    Expired,
    Unknown,
}

impl TokenExchange {
    /// Without a code yet.
    pub fn new(
        access: Arc<Access>,
        timeouts: Timeouts,
        token_file: Option<PathBuf>,
        hint: &'static str,
    ) -> Arc<Self> {
        Arc::new(Self { access, timeouts, token_file, hint, drawn: Mutex::default() })
    }

    /// Draws a code. The one before gives the token no more.
    pub fn draw(&self) -> Result<String, String> {
        let code = format!("{PREFIX}{}", random_hex::<CODE_BYTES>()?);
        let drawn = IssuedCode { code: code.clone(), at: Instant::now(), used: false };
        *lock(&self.drawn) = Some(drawn);
        Ok(code)
    }

    /// Whether this code gives the token: it was drawn a short while ago, and is used for the first
    /// time.
    fn take(&self, given: &str) -> CodeStatus {
        let mut drawn = lock(&self.drawn);
        match drawn.as_mut().filter(|drawn| same(given, &drawn.code)) {
            None => CodeStatus::Unknown,
            Some(drawn) if drawn.used || drawn.at.elapsed() > self.timeouts.code => {
                CodeStatus::Expired
            }
            Some(drawn) => {
                drawn.used = true;
                CodeStatus::Valid
            }
        }
    }
}

/// What a page has instead of the token.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TokenRequest {
    code: String,
}

/// `POST /api/token`
pub async fn exchange(State(codes): State<Arc<TokenExchange>>, body: Body) -> JsonAnswer {
    let body = BodyReader::new(body, REQUEST_BYTES, codes.timeouts.body)?.whole().await?;
    let TokenRequest { code } = parsed(&body)?;
    let status = codes.take(&code);
    if status == CodeStatus::Valid {
        return Ok(Json(json!({ "token": codes.access.token })));
    }
    // If somebody else has the token now, starting again must help.
    if let Some(file) = codes.token_file.as_ref().filter(|_| status == CodeStatus::Expired) {
        let _ = tokio::fs::remove_file(file).await;
    }
    let message = "this address was used already, or opened too late";
    Err(Refusal::new(StatusCode::UNAUTHORIZED, message).hint(codes.hint))
}
