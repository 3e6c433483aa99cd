//! Answers that are not what was asked for, and requests that cannot be read.

use std::time::Duration;

use axum::Json;
use axum::body::{Body, BodyDataStream, Bytes, HttpBody as _};
use axum::extract::{FromRequestParts, Path, Query};
use axum::http::StatusCode;
use axum::http::header::{CONNECTION, HeaderValue};
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt as _;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use tokio::sync::oneshot;

use super::advice;
use super::timeouts::TransferDeadline;
use crate::project;

/// Why a request is refused, as JSON: `{"error": "...", "hint": "..."}`.
#[derive(Debug, Clone, Serialize)]
pub struct Refusal {
    #[serde(skip)]
    status: StatusCode,
    #[serde(rename = "error")]
    message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    hint: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    revision: Option<u64>,
}

/// JSON, or a refusal.
pub type JsonAnswer = Result<Json<Value>, Refusal>;

impl Refusal {
    pub fn new(status: StatusCode, message: impl Into<String>) -> Self {
        Self { status, message: message.into(), hint: None, revision: None }
    }

    /// Adds what the user can do about it.
    #[must_use]
    pub fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    /// What is wrong.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The request itself is wrong.
    pub fn bad(message: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, message)
    }

    /// What was asked for does not exist.
    pub fn unknown(message: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, message)
    }

    /// Whoever asks may not.
    pub fn forbidden(message: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, message)
    }

    /// The request is right, but the server failed.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, message)
    }

    /// Another window was faster; the project is now at this revision.
    pub fn conflict(revision: u64) -> Self {
        let message = "the project has changed since it was read";
        let refusal = Self::new(StatusCode::CONFLICT, message);
        Self { revision: Some(revision), ..refusal }
    }

    /// A body is longer than it may be.
    pub fn too_large(most: u64) -> Self {
        let message = format!("it is too large; at most {most} bytes are accepted");
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, message)
    }
}

impl From<patchlock_media::Error> for Refusal {
    fn from(error: patchlock_media::Error) -> Self {
        let hint = advice::media(&error);
        Self { hint, ..Self::new(StatusCode::UNPROCESSABLE_ENTITY, error.to_string()) }
    }
}

impl From<project::Error> for Refusal {
    fn from(error: project::Error) -> Self {
        Self::from(&error)
    }
}

impl From<&project::Error> for Refusal {
    fn from(error: &project::Error) -> Self {
        let status = match error {
            project::Error::Track(patchlock_track::Error::Write { .. }) => {
                StatusCode::INTERNAL_SERVER_ERROR
            }
            error if error.is_misuse() => StatusCode::BAD_REQUEST,
            _ => StatusCode::UNPROCESSABLE_ENTITY,
        };
        Self { hint: advice::project(error), ..Self::new(status, error.to_string()) }
    }
}

impl From<patchlock_track::Error> for Refusal {
    fn from(error: patchlock_track::Error) -> Self {
        let status = match error.is_misuse() {
            true => StatusCode::BAD_REQUEST,
            false => StatusCode::INTERNAL_SERVER_ERROR,
        };
        Self { hint: advice::track(&error), ..Self::new(status, error.to_string()) }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let mut response = (self.status, Json(&self)).into_response();
        // The rest of a body that is not read would be taken for the next request.
        let closes = [
            StatusCode::PAYLOAD_TOO_LARGE,
            StatusCode::REQUEST_TIMEOUT,
            StatusCode::SERVICE_UNAVAILABLE,
        ];
        if closes.contains(&self.status) {
            response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
        }
        response
    }
}

/// The parts of a path, or a refusal as JSON.
pub struct PathParam<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for PathParam<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let path = Path::from_request_parts(parts, state).await;
        let Path(path) = path.map_err(|error| Refusal::unknown(error.body_text()))?;
        Ok(Self(path))
    }
}

/// What follows the question mark of an address, or a refusal as JSON.
pub struct QueryParams<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for QueryParams<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let query = Query::from_request_parts(parts, state).await;
        let Query(query) = query.map_err(|error| Refusal::bad(error.body_text()))?;
        Ok(Self(query))
    }
}

/// A body that arrives piece by piece, of limited length, from a client that must neither pause for
/// long nor be very slow.
pub struct BodyReader {
    pieces: BodyDataStream,
    left: u64,
    most: u64,
    deadline: TransferDeadline,
}

impl BodyReader {
    /// A body of at most `most` bytes. One that says to be longer is refused before it is read.
    pub fn new(body: Body, most: u64, timeout: Duration) -> Result<Self, Refusal> {
        if body.size_hint().lower() > most {
            return Err(Refusal::too_large(most));
        }
        let deadline = TransferDeadline::begin(timeout);
        Ok(Self { pieces: body.into_data_stream(), left: most, most, deadline })
    }

    /// The next piece; `None` at the end.
    pub async fn next(&mut self) -> Result<Option<Bytes>, Refusal> {
        let next = tokio::time::timeout_at(self.deadline.deadline(), self.pieces.next()).await;
        let Ok(piece) = next else {
            let message = "the rest of the request did not arrive in time";
            return Err(Refusal::new(StatusCode::REQUEST_TIMEOUT, message));
        };
        let piece = piece.transpose();
        let piece = piece.map_err(|_| Refusal::bad("the request was broken off"))?;
        let length = piece.as_ref().map_or(0, Bytes::len);
        self.deadline.passed(length);
        self.left = self.left.checked_sub(length as u64).ok_or(Refusal::too_large(self.most))?;
        Ok(piece)
    }

    /// All of it.
    pub async fn whole(mut self) -> Result<Vec<u8>, Refusal> {
        let mut whole = Vec::new();
        while let Some(piece) = self.next().await? {
            whole.extend_from_slice(&piece);
        }
        Ok(whole)
    }
}

/// What a body says in JSON.
pub fn parsed<T: DeserializeOwned>(body: &[u8]) -> Result<T, Refusal> {
    let wrong = |error| Refusal::bad(format!("the request is not as expected: {error}"));
    serde_json::from_slice(body).map_err(wrong)
}

/// Runs work that takes long, or waits for a disk, where it keeps no other request waiting.
pub fn aside<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Refusal> + Send + 'static,
) -> impl Future<Output = Result<T, Refusal>> {
    boxed_aside(Box::new(work))
}

/// In boxes: tasks of many types would each take their time to compile.
async fn boxed_aside<T: Send + 'static>(
    work: Box<dyn FnOnce() -> Result<T, Refusal> + Send>,
) -> Result<T, Refusal> {
    let (answer, wait) = oneshot::channel();
    let work: Box<dyn FnOnce() + Send> = Box::new(move || drop(answer.send(work())));
    tokio::task::spawn_blocking(work);
    wait.await
        .unwrap_or_else(|_| Err(Refusal::failed("the program failed while it worked on this")))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use futures_util::stream;
    use tokio::time::{Instant, sleep};

    use super::*;

    /// A body of this many pieces of this length, one every 15 seconds.
    fn dripping(count: usize, length: usize) -> Body {
        Body::from_stream(stream::unfold(0, move |sent| async move {
            sleep(Duration::from_secs(15)).await;
            (sent < count).then(|| (Ok::<_, Infallible>(vec![b' '; length]), sent + 1))
        }))
    }

    #[tokio::test(start_paused = true)]
    async fn a_body_of_a_byte_every_15_seconds_is_not_waited_for() {
        let begun = Instant::now();
        let timeout = Duration::from_secs(20);
        let body = BodyReader::new(dripping(1000, 1), 5000, timeout).expect("is short");
        let refusal = body.whole().await.expect_err("is too slow");
        assert_eq!(refusal.status, StatusCode::REQUEST_TIMEOUT);
        assert!(begun.elapsed() <= timeout, "{:?}", begun.elapsed());
        let body = BodyReader::new(dripping(100, 1 << 20), 1 << 30, timeout).expect("is short");
        assert_eq!(body.whole().await.expect("arrives").len(), 100 << 20);
    }
}
