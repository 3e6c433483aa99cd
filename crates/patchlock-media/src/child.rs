//! A process whose output is read with a limit on its silence, and which does not outlive its
//! owner.

use std::io::{self, Cursor, ErrorKind, Read};
use std::process::{Child, Command, ExitStatus};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Bytes that are read at once: what a pipe holds.
const PIECE: usize = 1 << 16;
/// Pieces that are read ahead.
const QUEUED: usize = 4;
/// Time between two looks at a process that is expected to end.
const PAUSE: Duration = Duration::from_millis(5);

/// All running processes. The thread that reads from one may still wait for it when the program
/// ends, and then drops nothing.
static RUNNING: Mutex<Vec<Arc<Mutex<Child>>>> = Mutex::new(Vec::new());

/// A running process; it is killed when this is dropped. On Linux, what the leader of its
/// [own process group](own_process_group) has started itself ends with it.
pub struct ChildGuard(Arc<Mutex<Child>>);

impl ChildGuard {
    pub fn new(child: Child) -> Self {
        let child = Arc::new(Mutex::new(child));
        locked(&RUNNING).push(Arc::clone(&child));
        Self(child)
    }

    /// Waits for the end of a process that has closed its output.
    pub fn end(&self, timeout: Duration) -> io::Result<ExitStatus> {
        for _ in 0..=timeout.as_millis() / PAUSE.as_millis() {
            if let Some(status) = locked(&self.0).try_wait()? {
                return Ok(status);
            }
            thread::sleep(PAUSE);
        }
        self.kill();
        Err(silent(timeout))
    }

    /// Ends the process at once.
    pub fn kill(&self) {
        let _ = self.stop();
    }

    /// Ends the process at once, and says how it has ended, maybe before.
    pub fn stop(&self) -> io::Result<ExitStatus> {
        stop(&mut locked(&self.0))
    }
}

impl Drop for ChildGuard {
    fn drop(&mut self) {
        self.kill();
        locked(&RUNNING).retain(|child| !Arc::ptr_eq(child, &self.0));
    }
}

/// Keeps Ctrl-C in a terminal from ending a program that is started: ours decides when it ends.
pub fn own_process_group(command: &mut Command) -> &mut Command {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    #[cfg(windows)]
    std::os::windows::process::CommandExt::creation_flags(command, 0x200);
    command
}

/// Ends all processes that decode or encode videos. For a program that ends while a thread may still read
/// one; the videos then fail.
pub fn stop_decoders() {
    for child in locked(&RUNNING).iter() {
        let _ = stop(&mut locked(child));
    }
}

fn stop(child: &mut Child) -> io::Result<ExitStatus> {
    kill_group(child);
    // If it has exited already, both calls change nothing.
    let _ = child.kill();
    child.wait()
}

/// Kills the group that a process leads, if any. Its number is that of no other group as long as nobody has
/// waited for the process.
#[cfg(target_os = "linux")]
fn kill_group(leader: &Child) {
    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
    let Some(id) = i32::try_from(leader.id()).ok().and_then(Pid::from_raw) else { return };
    let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    if waitid(WaitId::Pid(id), look).is_ok() {
        let _ = kill_process_group(id, Signal::KILL);
    }
}

#[cfg(not(target_os = "linux"))]
fn kill_group(_: &Child) {}

/// A panic cannot leave these values in an inconsistent state.
pub fn locked<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The output of a process. It is read on a thread of its own, since a read cannot be given up. A
/// time without a byte is an error of the kind `TimedOut`; time during which nobody reads does not
/// count.
pub struct TimeoutReader {
    pieces: Receiver<io::Result<Vec<u8>>>,
    piece: Cursor<Vec<u8>>,
    timeout: Duration,
}

impl TimeoutReader {
    pub fn new(mut stream: impl Read + Send + 'static, timeout: Duration) -> Self {
        let (sender, pieces) = mpsc::sync_channel(QUEUED);
        thread::spawn(move || {
            loop {
                let mut piece = vec![0; PIECE];
                let read = match stream.read(&mut piece) {
                    Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                    read => read,
                };
                let ends = matches!(read, Ok(0) | Err(_));
                let read = read.map(|count| {
                    piece.truncate(count);
                    piece
                });
                if sender.send(read).is_err() || ends {
                    return;
                }
            }
        });
        Self { pieces, piece: Cursor::default(), timeout }
    }
}

impl Read for TimeoutReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.piece.read(buffer)?;
        if count > 0 || buffer.is_empty() {
            return Ok(count);
        }
        match self.pieces.recv_timeout(self.timeout) {
            Ok(piece) => self.piece = Cursor::new(piece?),
            Err(RecvTimeoutError::Timeout) => return Err(silent(self.timeout)),
            Err(RecvTimeoutError::Disconnected) => return Ok(0),
        }
        self.piece.read(buffer)
    }
}

/// The error for a process that does nothing.
pub fn silent(timeout: Duration) -> io::Error {
    let seconds = timeout.as_secs_f64();
    io::Error::new(
        ErrorKind::TimedOut,
        format!("ffmpeg wrote nothing for {seconds} s and was stopped"),
    )
}
