//! Connections: how many at once, and how long each may take.
//!
//! A connection is a stranger until a request on it has shown the token. Strangers never keep
//! anybody out: where there are too many, the oldest of them is ended. Those that know the token
//! have permits of their own.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::http::StatusCode;
use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::AbortHandle;

use super::answer::Refusal;
use super::lock;
use super::timeouts::{TimeoutStream, Timeouts};

/// Most connections at once that have shown the token.
const KNOWN: usize = 512;
/// Largest size of the headers of a request.
const HEADER_BYTES: usize = 32 << 10;

/// All connections.
struct ConnectionPool {
    /// What ends those that have not shown the token, by their numbers: the oldest comes first.
    strangers: Mutex<VecDeque<(u64, AbortHandle)>>,
    known: Arc<Semaphore>,
}

impl ConnectionPool {
    /// This connection is no stranger any more.
    fn forget(&self, number: u64) {
        lock(&self.strangers).retain(|(stranger, _)| *stranger != number);
    }
}

/// The permit of a connection, given back when the connection ends.
#[derive(Clone)]
pub struct Permit(Arc<PermitState>);

struct PermitState {
    number: u64,
    pool: Arc<ConnectionPool>,
    known: Mutex<Option<OwnedSemaphorePermit>>,
}

impl Permit {
    /// A request on this connection has shown the token.
    pub fn has_token(&self) -> Result<(), Refusal> {
        let PermitState { number, pool, known } = &*self.0;
        let mut known = lock(known);
        if known.is_none() {
            let permit = Arc::clone(&pool.known).try_acquire_owned();
            *known = Some(permit.map_err(|_| too_many())?);
            pool.forget(*number);
        }
        Ok(())
    }
}

impl Drop for PermitState {
    fn drop(&mut self) {
        self.pool.forget(self.number);
    }
}

fn too_many() -> Refusal {
    let message = format!("{KNOWN} connections are open, which is the most");
    Refusal::new(StatusCode::SERVICE_UNAVAILABLE, message).hint("close other windows of this page")
}

/// Accepts connections for ever, at most `strangers` without the token at once.
pub async fn accept(listener: TcpListener, routes: Router, strangers: usize, timeouts: Timeouts) {
    let known = Arc::new(Semaphore::new(KNOWN));
    let pool = Arc::new(ConnectionPool { strangers: Mutex::default(), known });
    for number in 0.. {
        let stream = accepted(&listener).await;
        let state = PermitState { number, pool: Arc::clone(&pool), known: Mutex::default() };
        let served = serve(stream, routes.clone(), Permit(Arc::new(state)), timeouts);
        // The task leaves this list when it ends, so it must be in it before that.
        let mut all = lock(&pool.strangers);
        while all.len() >= strangers.max(1) {
            let Some((_, oldest)) = all.pop_front() else { break };
            oldest.abort();
        }
        all.push_back((number, tokio::spawn(served).abort_handle()));
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

async fn serve(stream: TcpStream, routes: Router, permit: Permit, timeouts: Timeouts) {
    // Small answers must not wait for more to send.
    let _ = stream.set_nodelay(true);
    let service = TowerToHyperService::new(routes.layer(Extension(permit)));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(timeouts.headers)
        .max_buf_size(HEADER_BYTES)
        .serve_connection(TokioIo::new(TimeoutStream::new(stream, timeouts.answer)), service)
        .with_upgrades();
    // A client that goes away is no error of ours.
    let _ = connection.await;
}
