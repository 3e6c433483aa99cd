//! Connections: how many at once, and how long each may take.
//!
//! A connection is a stranger until a request on it has shown the token. Strangers never keep
//! anybody out: where there are too many, the oldest of them is ended. Those that know the token
//! have places of their own.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::http::StatusCode;
use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::AbortHandle;

use super::Patience;
use super::answer::Refusal;
use super::pace::Paced;

/// Most connections at once that have shown the token.
const KNOWN: usize = 512;
/// Largest size of the headers of a request.
const HEADER_BYTES: usize = 32 << 10;

/// All connections.
struct Crowd {
    /// What ends those that have not shown the token, by their numbers: the oldest comes first.
    strangers: Mutex<BTreeMap<u64, AbortHandle>>,
    known: Arc<Semaphore>,
}

impl Crowd {
    fn strangers(&self) -> MutexGuard<'_, BTreeMap<u64, AbortHandle>> {
        self.strangers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The place of a connection, free again when the connection ends.
#[derive(Clone)]
pub struct Place(Arc<Taken>);

struct Taken {
    number: u64,
    crowd: Arc<Crowd>,
    known: Mutex<Option<OwnedSemaphorePermit>>,
}

impl Place {
    /// A request on this connection has shown the token.
    pub fn has_token(&self) -> Result<(), Refusal> {
        let Taken { number, crowd, known } = &*self.0;
        let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
        if known.is_none() {
            let place = Arc::clone(&crowd.known).try_acquire_owned();
            *known = Some(place.map_err(|_| too_many())?);
            crowd.strangers().remove(number);
        }
        Ok(())
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.crowd.strangers().remove(&self.number);
    }
}

fn too_many() -> Refusal {
    let message = format!("{KNOWN} connections are open, which is the most");
    Refusal::new(StatusCode::SERVICE_UNAVAILABLE, message).hint("close other windows of this page")
}

/// Accepts connections for ever, at most `strangers` without the token at once.
pub async fn accept(listener: TcpListener, routes: Router, strangers: usize, patience: Patience) {
    let known = Arc::new(Semaphore::new(KNOWN));
    let crowd = Arc::new(Crowd { strangers: Mutex::default(), known });
    for number in 0.. {
        let stream = accepted(&listener).await;
        let taken = Taken { number, crowd: Arc::clone(&crowd), known: Mutex::default() };
        let served = serve(stream, routes.clone(), Place(Arc::new(taken)), patience);
        // The task leaves this list when it ends, so it must be in it before that.
        let mut all = crowd.strangers();
        while all.len() >= strangers.max(1) {
            let Some((_, oldest)) = all.pop_first() else { break };
            oldest.abort();
        }
        all.insert(number, tokio::spawn(served).abort_handle());
    }
}

/// The next connection.
async fn accepted(listener: &TcpListener) -> TcpStream {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => return stream,
            // No file descriptors are left, for example.
            Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
        }
    }
}

async fn serve(stream: TcpStream, routes: Router, place: Place, patience: Patience) {
    // Small answers must not wait for more to send.
    let _ = stream.set_nodelay(true);
    let service = TowerToHyperService::new(routes.layer(Extension(place)));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(patience.headers)
        .max_buf_size(HEADER_BYTES)
        .serve_connection(TokioIo::new(Paced::new(stream, patience.answer)), service)
        .with_upgrades();
    // A client that goes away is no error of ours.
    let _ = connection.await;
}
