//! What a window is told as it happens, through a WebSocket.

use std::sync::Arc;

use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::response::Response;
use futures_util::future::BoxFuture;
use serde_json::json;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;

use super::access::PROTOCOL;
use super::answer::Refusal;
use super::clips::{ClipRequest, OpenClip};
use super::timeouts::SENDING;

/// A window has nothing to say.
const MESSAGE_BYTES: usize = 1 << 10;

/// A request for a WebSocket.
pub type Upgrade = Result<WebSocketUpgrade, WebSocketUpgradeRejection>;

/// Answers a request for a WebSocket, and then talks through it. A message has at most `most` bytes.
pub fn talk<F: Future<Output = ()> + Send + 'static>(
    upgrade: Upgrade,
    most: usize,
    talk: impl FnOnce(WebSocket) -> F + Send + 'static,
) -> Result<Response, Refusal> {
    let upgrade = upgrade.map_err(|error| Refusal::bad(error.body_text()))?;
    let upgrade = upgrade.protocols([PROTOCOL]).max_message_size(most).max_frame_size(most);
    let talk: Box<dyn FnOnce(WebSocket) -> BoxFuture<'static, ()> + Send> =
        Box::new(move |socket| Box::pin(talk(socket)));
    Ok(upgrade.on_upgrade(talk))
}

/// `GET /api/clips/ID/events`
pub async fn events(
    ClipRequest { clip, .. }: ClipRequest,
    upgrade: Upgrade,
) -> Result<Response, Refusal> {
    // The window reads the project as soon as it has the answer; what changes after that must reach
    // it.
    let events = clip.events.subscribe();
    talk(upgrade, MESSAGE_BYTES, move |socket| window(socket, events, clip))
}

async fn window(socket: WebSocket, events: Receiver<Utf8Bytes>, clip: Arc<OpenClip>) {
    clip.window(true);
    forward(socket, events, &clip).await;
    clip.window(false);
}

/// Passes on all events until the window is closed.
async fn forward(mut socket: WebSocket, mut events: Receiver<Utf8Bytes>, clip: &OpenClip) {
    loop {
        let message = tokio::select! {
            event = events.recv() => match event {
                Ok(event) => Message::Text(event),
                // Too slow for all events: what counts is how things are now.
                Err(RecvError::Lagged(_)) => {
                    let revision = clip.revision().await;
                    Message::Text(json!({ "type": "project", "revision": revision }).to_string().into())
                }
                Err(RecvError::Closed) => return,
            },
            received = socket.recv() => match received {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => continue,
            },
        };
        let sent = tokio::time::timeout(SENDING, socket.send(message)).await;
        if !matches!(sent, Ok(Ok(()))) {
            return;
        }
    }
}
