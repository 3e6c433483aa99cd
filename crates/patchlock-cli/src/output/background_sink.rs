//! An output that works on a thread of its own, so that the tracker does not wait for it.

use std::panic::resume_unwind;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender, SyncSender};
use std::thread::{self, JoinHandle};

use anyhow::{Error, Result};
use patchlock_media::Picture;

use super::{Sink, TargetResult, TrackedFrame};

/// The output is at most this many frames behind. An error of it ends the run exactly so many
/// frames later, however fast the thread is.
const FRAMES: usize = 3;

/// A sink on its own thread, which gets the frames in order.
pub struct BackgroundSink {
    /// `None` when no more come.
    messages: Option<SyncSender<Message>>,
    done: Receiver<Result<Option<PathBuf>>>,
    /// How many frames have been sent whose outcome is not known yet.
    under_way: usize,
    thread: Option<JoinHandle<()>>,
}

/// What is sent to the thread of the sink.
enum Message {
    Frame {
        frame: usize,
        ms: f64,
        targets: Vec<TargetResult>,
        picture: Arc<Picture>,
    },
    /// Completes the output. Without it, the output is dropped.
    Finish,
}

impl BackgroundSink {
    /// Starts a thread for an output.
    pub fn new(sink: Box<dyn Sink + Send>) -> Self {
        let (messages, waiting) = mpsc::sync_channel(FRAMES);
        let (report, done) = mpsc::channel();
        let thread = thread::spawn(move || serve(sink, &waiting, &report));
        Self { messages: Some(messages), done, under_way: 0, thread: Some(thread) }
    }

    fn send(&mut self, message: Message) -> Result<()> {
        self.under_way += 1;
        let sent = self.messages.as_ref().map(|to| to.send(message));
        // A thread that has panicked takes nothing more.
        if matches!(sent, Some(Ok(()))) { Ok(()) } else { self.outcome().map(drop) }
    }

    /// The outcome of the oldest message whose outcome is not known.
    fn outcome(&mut self) -> Result<Option<PathBuf>> {
        self.under_way -= 1;
        match self.done.recv() {
            Ok(outcome) => outcome,
            Err(_) => match self.thread.take().map(JoinHandle::join) {
                Some(Err(panic)) => resume_unwind(panic),
                _ => Err(Error::msg("an output was abandoned after an earlier error")),
            },
        }
    }
}

/// Works until the end, or the first error.
fn serve(
    mut sink: Box<dyn Sink + Send>,
    messages: &Receiver<Message>,
    report: &Sender<Result<Option<PathBuf>>>,
) {
    for message in messages {
        let outcome = match message {
            Message::Finish => {
                // Nobody waits for the outcome if the run was given up.
                let _ = report.send(sink.finish());
                return;
            }
            Message::Frame { frame, ms, targets, picture } => {
                sink.write(&TrackedFrame { frame, ms, targets: &targets, picture: &picture })
            }
        };
        let failed = outcome.is_err();
        if report.send(outcome.map(|()| None)).is_err() || failed {
            return;
        }
    }
}

impl Sink for BackgroundSink {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        let TrackedFrame { frame, ms, targets, picture } = *tracked;
        let (targets, picture) = (targets.to_vec(), Arc::clone(picture));
        self.send(Message::Frame { frame, ms, targets, picture })?;
        if self.under_way > FRAMES {
            self.outcome()?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Option<PathBuf>> {
        while self.under_way > 0 {
            self.outcome()?;
        }
        self.send(Message::Finish)?;
        self.outcome()
    }
}

impl Drop for BackgroundSink {
    /// Waits until what the output has begun is removed.
    fn drop(&mut self) {
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            // A panic was printed when it happened; a second one here would end the program.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::time::Duration;

    use super::super::example;
    use super::*;

    type Log = Arc<Mutex<Vec<String>>>;

    /// Writes down what happens; each frame takes this long. The frame `fails` is an error.
    struct SlowSink {
        log: Log,
        pause: Duration,
        fails: usize,
    }

    impl Sink for SlowSink {
        fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
            thread::sleep(self.pause);
            if tracked.frame == self.fails {
                return Err(Error::msg("the disk is full"));
            }
            self.log.lock().unwrap().push(format!("{} {}", tracked.frame, tracked.targets.len()));
            Ok(())
        }

        fn finish(self: Box<Self>) -> Result<Option<PathBuf>> {
            self.log.lock().unwrap().push("finished".to_string());
            Ok(Some(PathBuf::from("out.mp4")))
        }
    }

    impl Drop for SlowSink {
        fn drop(&mut self) {
            self.log.lock().unwrap().push("dropped".to_string());
        }
    }

    fn slow_sink(log: &Log, milliseconds: u64, fails: usize) -> BackgroundSink {
        let (log, pause) = (Arc::clone(log), Duration::from_millis(milliseconds));
        BackgroundSink::new(Box::new(SlowSink { log, pause, fails }))
    }

    #[test]
    fn frames_are_written_in_order_before_the_output_is_complete() {
        let log = Log::default();
        let mut sink = Box::new(slow_sink(&log, 2, usize::MAX));
        let targets = [example::target(patchlock::Status::Tracked)];
        for frame in 0..20 {
            sink.write(&example::tracked(frame, &targets[..frame % 2])).unwrap();
            let written = log.lock().unwrap().len();
            assert!(written + FRAMES > frame, "{written} at {frame}");
        }
        assert_eq!(sink.finish().unwrap(), Some(PathBuf::from("out.mp4")));
        let mut expected: Vec<String> = (0..20).map(|k| format!("{k} {}", k % 2)).collect();
        expected.extend(["finished", "dropped"].map(String::from));
        assert_eq!(*log.lock().unwrap(), expected);
    }

    #[test]
    fn an_error_comes_at_the_same_frame_however_fast_the_output_is() {
        for milliseconds in [0, 5] {
            let mut sink = slow_sink(&Log::default(), milliseconds, 4);
            for frame in 0..4 + FRAMES {
                thread::sleep(Duration::from_millis(5 - milliseconds));
                sink.write(&example::tracked(frame, &[])).unwrap();
            }
            let error = sink.write(&example::tracked(4 + FRAMES, &[])).unwrap_err();
            assert_eq!(error.to_string(), "the disk is full");
        }
    }

    #[test]
    fn an_error_of_the_last_frames_is_one_of_the_whole() {
        let mut sink = Box::new(slow_sink(&Log::default(), 0, 2));
        (0..3).for_each(|frame| sink.write(&example::tracked(frame, &[])).unwrap());
        assert_eq!(sink.finish().unwrap_err().to_string(), "the disk is full");
    }

    #[test]
    fn an_output_that_is_given_up_is_dropped_and_not_completed() {
        let log = Log::default();
        let mut sink = slow_sink(&log, 2, usize::MAX);
        sink.write(&example::tracked(0, &[])).unwrap();
        drop(sink);
        assert_eq!(*log.lock().unwrap(), ["0 0", "dropped"]);
    }
}
