//! An output that works on a thread of its own, so that the tracker does not wait for it.

use std::panic::resume_unwind;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread::{self, JoinHandle};

use anyhow::{Error, Result};

use super::{Sink, TrackedFrame};

/// The output is at most this many frames behind. An error of it ends the run exactly so many
/// frames later, however fast the thread is.
const FRAMES: usize = 3;

/// A sink on its own thread, which gets the frames in order.
pub struct BackgroundSink {
    /// `None` when no more come.
    frames: Option<SyncSender<Write>>,
    done: Receiver<Result<()>>,
    /// How many frames have been sent whose outcome is not known yet.
    under_way: usize,
    /// Returns the sink, unless it failed.
    thread: Option<JoinHandle<Option<Box<dyn Sink + Send>>>>,
}

/// Writes a frame to the sink.
type Write = Box<dyn FnOnce(&mut dyn Sink) -> Result<()> + Send>;

impl BackgroundSink {
    /// Starts a thread for an output.
    pub fn new(mut sink: Box<dyn Sink + Send>) -> Self {
        let (frames, waiting) = mpsc::sync_channel::<Write>(FRAMES);
        let (report, done) = mpsc::channel();
        // Works until no more frames come, or the first error.
        let work = move || {
            for write in waiting {
                let outcome = write(&mut *sink);
                let failed = outcome.is_err();
                if report.send(outcome).is_err() || failed {
                    return None;
                }
            }
            Some(sink)
        };
        Self { frames: Some(frames), done, under_way: 0, thread: Some(thread::spawn(work)) }
    }

    /// The outcome of the oldest frame whose outcome is not known.
    fn outcome(&mut self) -> Result<()> {
        self.under_way -= 1;
        self.done.recv().unwrap_or_else(|_| self.sink().map(drop))
    }

    /// The sink, when its thread has ended.
    fn sink(&mut self) -> Result<Box<dyn Sink + Send>> {
        self.frames = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Some(sink))) => Ok(sink),
            Some(Err(panic)) => resume_unwind(panic),
            _ => Err(Error::msg("an output was abandoned after an earlier error")),
        }
    }
}

impl Sink for BackgroundSink {
    fn write(&mut self, tracked: &TrackedFrame<'_>) -> Result<()> {
        let TrackedFrame { frame, ms, targets, picture } = *tracked;
        let (targets, picture) = (targets.to_vec(), Arc::clone(picture));
        let write: Write = Box::new(move |sink| {
            sink.write(&TrackedFrame { frame, ms, targets: &targets, picture: &picture })
        });
        self.under_way += 1;
        // A thread that has ended takes nothing more.
        let sent = self.frames.as_ref().is_some_and(|to| to.send(write).is_ok());
        if sent && self.under_way <= FRAMES { Ok(()) } else { self.outcome() }
    }

    fn finish(mut self: Box<Self>) -> Result<Option<PathBuf>> {
        while self.under_way > 0 {
            self.outcome()?;
        }
        self.sink()?.finish()
    }
}

impl Drop for BackgroundSink {
    /// Waits until what the output has begun is removed.
    fn drop(&mut self) {
        self.frames = None;
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
