//! How fast a client must send a request and take an answer, and how long it may pause.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Instant, Sleep, sleep_until};

/// How long a window may take to receive a message.
pub const SENDING: Duration = Duration::from_secs(20);
/// The slowest mean speed, in bytes per second, once the timeout has passed.
const SLOWEST: u64 = 1024;

/// How long the server waits for a client.
#[derive(Debug, Clone, Copy)]
pub struct Timeouts {
    /// For a request, until its headers are complete.
    pub headers: Duration,
    /// For a body, until its next bytes. All of it may take this and a second per KiB.
    pub body: Duration,
    /// For an answer, until the client takes the next bytes. All of it may take this and a second
    /// per KiB.
    pub answer: Duration,
    /// For the page that [`super::Server::address_once`] leads to, until it asks for the token.
    pub code: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self {
            headers: Duration::from_secs(30),
            body: Duration::from_secs(20),
            answer: Duration::from_secs(60),
            // Browsers that are installed as snaps may take a minute to start.
            code: Duration::from_secs(120),
        }
    }
}

/// How far a transfer is. It may pause for the timeout, and as a whole take the timeout and the
/// time that its bytes need at [`SLOWEST`].
#[derive(Debug)]
pub struct TransferDeadline {
    timeout: Duration,
    begun: Instant,
    moved: Instant,
    bytes: u64,
}

impl TransferDeadline {
    /// A transfer that begins now.
    pub fn begin(timeout: Duration) -> Self {
        let now = Instant::now();
        Self { timeout, begun: now, moved: now, bytes: 0 }
    }

    /// Some bytes have passed.
    pub fn passed(&mut self, bytes: usize) {
        self.bytes = self.bytes.saturating_add(bytes as u64);
        self.moved = Instant::now();
    }

    /// When the next bytes must have passed.
    pub fn deadline(&self) -> Instant {
        let whole = self.begun + Duration::from_secs(self.bytes / SLOWEST);
        whole.min(self.moved) + self.timeout
    }
}

/// A connection whose other end must take what is written.
#[derive(Debug)]
pub struct TimeoutStream<S> {
    stream: S,
    timeout: Duration,
    /// What is being written, while the other end does not take all of it at once.
    slow: Option<(TransferDeadline, Pin<Box<Sleep>>)>,
}

impl<S> TimeoutStream<S> {
    pub fn new(stream: S, timeout: Duration) -> Self {
        Self { stream, timeout, slow: None }
    }

    /// Passes on the outcome of a write; an error if it has waited for too long.
    fn watched(
        &mut self,
        written: Poll<io::Result<usize>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<usize>> {
        if let Poll::Ready(written) = written {
            if let (Ok(bytes), Some((deadline, _))) = (&written, &mut self.slow) {
                deadline.passed(*bytes);
            }
            return Poll::Ready(written);
        }
        let (deadline, sleep) = self.slow.get_or_insert_with(|| {
            let deadline = TransferDeadline::begin(self.timeout);
            let sleep = Box::pin(sleep_until(deadline.deadline()));
            (deadline, sleep)
        });
        if sleep.deadline() != deadline.deadline() {
            sleep.as_mut().reset(deadline.deadline());
        }
        ready!(sleep.as_mut().poll(context));
        let late = io::Error::new(io::ErrorKind::TimedOut, "the client does not take the answer");
        Poll::Ready(Err(late))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for TimeoutStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for TimeoutStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.watched(written, context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, bytes);
        self.watched(written, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    /// Called when all was written: what comes next is another transfer.
    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.slow = None;
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, duplex};
    use tokio::time::sleep;

    use super::*;

    const TIMEOUT: Duration = Duration::from_secs(60);

    /// How long a writer of this many bytes is borne whose other end takes `piece` bytes every 15
    /// seconds, and whether all was written.
    async fn borne(bytes: usize, piece: usize) -> (Duration, bool) {
        let (ours, mut theirs) = duplex(64);
        let reading = tokio::spawn(async move {
            let mut taken = vec![0; piece];
            while theirs.read_exact(&mut taken).await.is_ok() {
                sleep(Duration::from_secs(15)).await;
            }
        });
        let begun = Instant::now();
        let mut paced = TimeoutStream::new(ours, TIMEOUT);
        let written = paced.write_all(&vec![7; bytes]).await;
        let time = begun.elapsed();
        drop(paced);
        reading.abort();
        (time, written.is_ok())
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_nobody_takes_is_ended() {
        let (ours, theirs) = duplex(64);
        let mut paced = TimeoutStream::new(ours, TIMEOUT);
        let error = paced.write_all(&[7; 100]).await.expect_err("nobody reads");
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        drop(theirs);
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_is_taken_a_byte_at_a_time_is_ended() {
        let (time, all) = borne(1000, 1).await;
        assert!(!all && time <= TIMEOUT, "{time:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_is_taken_slowly_is_given() {
        let (time, all) = borne(1 << 20, 16 << 10).await;
        assert!(all && time > 10 * TIMEOUT, "{time:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_pause_is_allowed_for_the_timeout_however_fast_it_was_before() {
        let mut deadline = TransferDeadline::begin(TIMEOUT);
        deadline.passed(1 << 30);
        assert_eq!(deadline.deadline(), Instant::now() + TIMEOUT);
    }
}
