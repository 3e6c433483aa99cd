//! The code in the address that the program hands to a browser. The list of processes shows that
//! address to other users of the machine, so the code is no token: it is exchanged for one, once,
//! and soon after it was drawn.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::StatusCode;
use serde::Deserialize;
use serde_json::{Value, json};

use super::access::{random_hex, same};
use super::answer::{BodyReader, Refusal, parsed};
use super::app::App;

/// Where a page exchanges a code for the token. It is answered without the token.
pub const PATH: &str = "/api/token";
/// The beginning of a code, which no token has.
const PREFIX: &str = "once-";
/// Random bytes of a code.
const CODE_BYTES: usize = 32;
/// Longest request, in bytes of JSON.
pub const REQUEST_BYTES: u64 = 1024;

/// The code that was drawn last.
#[derive(Default)]
pub struct OneTimeCode {
    drawn: Mutex<Option<IssuedCode>>,
}

struct IssuedCode {
    code: String,
    at: Instant,
    used: bool,
}

/// Whether a code gives the token.
#[derive(PartialEq, Eq)]
pub enum CodeStatus {
    Valid,
    /// It was used already, or is too old.
    Expired,
    Unknown,
}

impl OneTimeCode {
    /// Draws a code. The one before gives the token no more.
    pub fn draw(&self) -> Result<String, String> {
        let code = format!("{PREFIX}{}", random_hex::<CODE_BYTES>()?);
        let drawn = IssuedCode { code: code.clone(), at: Instant::now(), used: false };
        *self.drawn.lock().unwrap_or_else(PoisonError::into_inner) = Some(drawn);
        Ok(code)
    }

    /// Whether this code gives the token: it was drawn at most `timeout` ago, and is used for the
    /// first time.
    pub fn take(&self, given: &str, timeout: Duration) -> CodeStatus {
        let mut drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        match drawn.as_mut().filter(|drawn| same(given, &drawn.code)) {
            None => CodeStatus::Unknown,
            Some(drawn) if drawn.used || drawn.at.elapsed() > timeout => CodeStatus::Expired,
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
pub struct TokenRequest {
    pub code: String,
}

/// `POST /api/token`
pub async fn exchange(State(app): State<Arc<App>>, body: Body) -> Result<Json<Value>, Refusal> {
    let body = BodyReader::new(body, REQUEST_BYTES, app.timeouts.body)?.whole().await?;
    let TokenRequest { code } = parsed(&body)?;
    let status = app.code.take(&code, app.timeouts.code);
    if status == CodeStatus::Valid {
        return Ok(Json(json!({ "token": app.access.token() })));
    }
    // If somebody else has the token now, starting again must help.
    if let Some(file) = app.token_file.clone().filter(|_| status == CodeStatus::Expired) {
        let _ = tokio::fs::remove_file(file).await;
    }
    let message = "this address was used already, or opened too late";
    Err(Refusal::new(StatusCode::UNAUTHORIZED, message).hint(
        "The address that a browser is given works once: open the one that patchlock studio has \
         printed. If nobody but you should have used it, end the program and start it again.",
    ))
}
