//! Live sources: cameras, streams of the network, pipes. ffmpeg opens them; a thread reads its
//! frames and keeps only the newest, so that the delay never grows. Frames that nobody took are
//! counted.
//!
//! A stream of the network that was lost is opened again, after pauses that grow. A file that a
//! server offers has an end: all of its frames are taken, each in its turn.

mod address;
mod stream;

use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use crate::child::{ChildGuard, locked};
use crate::{Error, FrameRate, Limits, NextFrame, Note, ffmpeg, limits, prefetch};
use stream::{RawFrame, Stream, Task};

pub use address::Address;
pub(crate) use address::schemes;

/// How a live source is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// What the source may claim.
    pub limits: Limits,
    /// The first frame that is given.
    pub start: usize,
    /// The first frame that is not given any more; `None` for no end.
    pub end: Option<usize>,
    /// How long to wait in all, between attempts, for a stream of the network that was lost. With
    /// zero, the source ends there.
    pub reconnect: Duration,
}

impl Options {
    /// Default of [`Options::reconnect`].
    pub const RECONNECT: Duration = Duration::from_secs(60);
}

/// The pauses between attempts to open a lost stream: the first, and the longest.
const PAUSES: [Duration; 2] = [Duration::from_millis(500), Duration::from_secs(8)];

/// The newest frames of a live source.
pub struct LiveSource {
    shared: Arc<FrameSlot>,
    notes: Receiver<Note>,
    options: Options,
    /// The time of frame 0, in millionths of a second.
    begun: Option<i64>,
    /// How many frames had come before the one that was given first, which is frame 0.
    before: Option<usize>,
    /// Frames that were given, or skipped because they come before the first one.
    given: usize,
    /// The number of the last one of these.
    last: Option<usize>,
}

/// What the thread that reads shares with the one that takes frames.
#[derive(Default)]
struct FrameSlot {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// The newest frame that nobody has taken, with its number.
    newest: Option<(usize, RawFrame)>,
    /// Frames that have come.
    received: usize,
    ended: Option<Result<(), Error>>,
    rate: Option<FrameRate>,
    /// Whether it is a file that somebody serves.
    has_length: bool,
    /// Nobody wants frames any more.
    closed: bool,
    process: Option<Arc<ChildGuard>>,
}

impl FrameSlot {
    fn state(&self) -> MutexGuard<'_, State> {
        locked(&self.state)
    }

    /// Waits for a change, at most this long.
    fn wait<'a>(&self, state: MutexGuard<'a, State>, most: Duration) -> MutexGuard<'a, State> {
        self.changed.wait_timeout(state, most).unwrap_or_else(PoisonError::into_inner).0
    }

    /// Remembers the process that is to be ended with the source.
    fn began(&self, process: &Arc<ChildGuard>) {
        let mut state = self.state();
        state.process = Some(Arc::clone(process));
        if state.closed {
            process.kill();
        }
    }

    /// Passes a frame on. With `each`, it waits until the frame is taken; else the frame replaces
    /// one that was not. Returns whether more frames are wanted.
    fn put(&self, raw: RawFrame, each: bool) -> bool {
        let mut state = self.state();
        state.newest = Some((state.received, raw));
        state.received += 1;
        self.changed.notify_all();
        while each && state.newest.is_some() && !state.closed {
            state = self.wait(state, prefetch::MAX_WAIT);
        }
        !state.closed
    }

    fn end(&self, result: Result<(), Error>) {
        let mut state = self.state();
        if !state.closed {
            state.ended = Some(result);
        }
        self.changed.notify_all();
    }

    /// Waits this long; whether frames are still wanted.
    fn pause(&self, pause: Duration) -> bool {
        let state = self.state();
        let wait = self.changed.wait_timeout_while(state, pause, |state| !state.closed);
        !wait.unwrap_or_else(PoisonError::into_inner).0.closed
    }
}

impl LiveSource {
    /// Opens the source on a thread of its own. What goes wrong is an error of [`LiveSource::wait`].
    pub fn open(address: Address, options: Options) -> Self {
        let timeout = limits::LIVE_SILENCE;
        Self::with(address, options, ffmpeg::Program { timeout, ..Default::default() })
    }

    fn with(address: Address, options: Options, program: ffmpeg::Program) -> Self {
        let task = Task { address, program, limits: options.limits };
        let shared = Arc::new(FrameSlot::default());
        let (sender, notes) = mpsc::channel();
        let reader = Reader { task, shared: Arc::clone(&shared), notes: sender, options };
        thread::spawn(move || reader.run());
        Self { shared, notes, options, begun: None, before: None, given: 0, last: None }
    }

    /// Waits up to 100 ms for a frame that is newer than the last one. Frame 0 is the newest at the
    /// first call.
    ///
    /// # Errors
    /// [`Error::NotLive`] if it does not open, [`Error::FfmpegMissing`], [`Error::TooLarge`] and
    /// [`Error::TooManyPixels`]; [`Error::Gone`] if it has stopped.
    pub fn wait(&mut self) -> Result<NextFrame, Error> {
        let (index, raw) = {
            let mut state = self.shared.state();
            if state.newest.is_none() && state.ended.is_none() {
                state = self.shared.wait(state, prefetch::MAX_WAIT);
            }
            match (state.newest.take(), &mut state.ended) {
                (Some(newest), _) => newest,
                (None, None) => return Ok(NextFrame::NotYet),
                (None, Some(ended)) => {
                    return std::mem::replace(ended, Ok(())).map(|()| NextFrame::End);
                }
            }
        };
        // The reader may wait until the frame is taken.
        self.shared.changed.notify_all();
        let index = index - *self.before.get_or_insert(index);
        if self.options.end.is_some_and(|end| index >= end) {
            self.close();
            return Ok(NextFrame::End);
        }
        self.begun = self.begun.or(raw.time);
        self.given += 1;
        self.last = Some(index);
        if index < self.options.start {
            return Ok(NextFrame::NotYet);
        }
        let mut picture = raw.picture(index);
        if let (Some(time), Some(begun)) = (raw.time, self.begun) {
            picture = picture.at(Some((time - begun) as f64 / 1e6));
        }
        Ok(NextFrame::Frame(index, picture))
    }

    /// What has happened since the last call.
    pub fn notes(&self) -> impl Iterator<Item = Note> {
        self.notes.try_iter()
    }

    /// How many frames, up to the last one that was given, were not given because a newer one had
    /// come.
    pub fn dropped(&self) -> usize {
        self.last.map_or(0, |last| last + 1 - self.given)
    }

    /// Counts the last frame that was given as dropped, because the caller took a newer one instead.
    pub fn leave_out(&mut self) {
        self.given = self.given.saturating_sub(1);
    }

    /// Whether it is a file that somebody serves, all of whose frames are given.
    pub fn has_length(&self) -> bool {
        self.shared.state().has_length
    }

    /// Frames per second, as far as the source says.
    pub fn rate(&self) -> Option<FrameRate> {
        self.shared.state().rate
    }

    /// When the first frame came, in seconds since 1970; `None` if that is not known.
    pub fn begun(&self) -> Option<f64> {
        self.begun.filter(|_| !self.has_length()).map(|time| time as f64 / 1e6)
    }

    fn close(&self) {
        let mut state = self.shared.state();
        state.closed = true;
        state.ended = Some(Ok(()));
        if let Some(process) = state.process.take() {
            process.kill();
        }
        self.shared.changed.notify_all();
    }
}

impl Drop for LiveSource {
    fn drop(&mut self) {
        self.close();
    }
}

/// What the thread that reads has.
struct Reader {
    task: Task,
    shared: Arc<FrameSlot>,
    notes: Sender<Note>,
    options: Options,
}

impl Reader {
    fn run(self) {
        let mut stream = match self.open() {
            Ok(stream) => stream,
            Err(error) => return self.shared.end(Err(error)),
        };
        let may_return = self.task.address.is_network() && !stream.has_length;
        let pauses = pauses(self.options.reconnect).len();
        loop {
            let Some(ended) = self.read(&mut stream).transpose() else { return };
            drop(stream);
            // The end of a source that was closed is no loss.
            if !may_return || pauses == 0 || self.shared.state().closed {
                return self.shared.end(ended);
            }
            let reason = match ended {
                Ok(()) => "it ended".to_string(),
                Err(Error::Gone { reason, .. }) => reason,
                Err(error) => error.to_string(),
            };
            // Nobody reads the notes of a source that was closed.
            let _ = self.notes.send(Note::Lost { reason });
            stream = match self.open_again() {
                Ok(Some(again)) => again,
                Ok(None) => return,
                Err(error) => return self.shared.end(Err(error)),
            };
        }
    }

    /// Opens the source for the first time.
    fn open(&self) -> Result<Stream, Error> {
        let began = |process: &Arc<ChildGuard>| self.shared.began(process);
        let mut stream = self.task.open(false, &began)?;
        if stream.has_length {
            // The times at which parts of a file come say nothing.
            drop(stream);
            stream = self.task.open(true, &began)?;
        }
        let mut state = self.shared.state();
        (state.rate, state.has_length) = (stream.rate(), stream.has_length);
        Ok(stream)
    }

    /// Reads to the end of a stream; `None` if no more frames are wanted.
    fn read(&self, stream: &mut Stream) -> Result<Option<()>, Error> {
        while let Some(raw) = stream.next()? {
            if !self.shared.put(raw, stream.has_length) {
                return Ok(None);
            }
        }
        Ok(Some(()))
    }

    /// Opens the stream again; `None` if no more frames are wanted.
    fn open_again(&self) -> Result<Option<Stream>, Error> {
        let mut last = String::new();
        let pauses = pauses(self.options.reconnect);
        for (failed, &pause) in pauses.iter().enumerate() {
            if !self.shared.pause(pause) {
                return Ok(None);
            }
            match self.task.open(false, &|process| self.shared.began(process)) {
                Ok(stream) => {
                    let _ = self.notes.send(Note::Back { failed });
                    return Ok(Some(stream));
                }
                Err(Error::NotLive { reason, .. }) => last = reason,
                Err(error) => return Err(error),
            }
        }
        let reason = format!("{last}; it was tried {} times again", pauses.len());
        Err(Error::Gone { name: self.task.address.shown(), reason })
    }
}

/// Pauses that grow, of this length together.
fn pauses(mut whole: Duration) -> Vec<Duration> {
    let [mut pause, longest] = PAUSES;
    let mut pauses = Vec::new();
    while !whole.is_zero() {
        pauses.push(pause.min(whole));
        whole = whole.saturating_sub(pause);
        pause = (2 * pause).min(longest);
    }
    pauses
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use crate::fake_ffmpeg::FakeFfmpeg;
    use std::fs;

    /// The description of the input, and the time of a frame.
    const LIVE: &str = "echo $$ > id; echo x >> runs\necho '[info]   Duration: N/A' >&2\necho '[info] Stream mapping:' >&2\n\
                        printf 'YUV4MPEG2 W2 H2 F25:1 Cmono\\n'\n\
                        frame() { echo \"[m @ 0] [info] frame:0 pts:$1 x\" >&2; printf 'FRAME\\nabcd'; }";

    /// Opens a source with a script in place of ffmpeg.
    fn open_with(fake: &FakeFfmpeg, address: &str, options: Options) -> LiveSource {
        let address = Address::parse(address).unwrap().unwrap();
        LiveSource::with(address, options, fake.program.clone())
    }

    /// The next frame: its number and time.
    fn next(live: &mut LiveSource) -> Result<Option<(usize, Option<f64>)>, Error> {
        loop {
            match live.wait()? {
                NextFrame::Frame(index, picture) => return Ok(Some((index, picture.time))),
                NextFrame::End => return Ok(None),
                NextFrame::NotYet => {}
            }
        }
    }

    const RECONNECT: Options = Options {
        limits: Limits { pixels: 1000, helper: None },
        start: 0,
        end: None,
        reconnect: Duration::from_millis(900),
    };
    const ONCE: Options = Options { reconnect: Duration::ZERO, ..RECONNECT };

    #[test]
    fn only_the_newest_frame_is_given_and_the_others_are_counted() {
        let script = format!(
            "{LIVE}\nframe 1000000\nsleep 0.2\nfor k in 1 2 3 4 5; do frame ${{k}}000000; done\nsleep 0.4"
        );
        let fake = FakeFfmpeg::new(&script);
        let mut live = open_with(&fake, "udp://h", ONCE);
        assert_eq!(next(&mut live).unwrap(), Some((0, Some(0.0))));
        thread::sleep(Duration::from_millis(400));
        assert_eq!(next(&mut live).unwrap(), Some((5, Some(4.0))));
        assert_eq!((live.dropped(), live.begun()), (4, Some(1.0)));
        live.leave_out();
        assert_eq!(live.dropped(), 5);
        assert_eq!(next(&mut live).unwrap(), None);
        // What came before the first call is no frame.
        let mut late = open_with(&fake, "udp://h", ONCE);
        thread::sleep(Duration::from_millis(500));
        assert_eq!(next(&mut late).unwrap(), Some((0, Some(0.0))));
        assert_eq!((late.dropped(), late.begun()), (0, Some(5.0)));
    }

    #[test]
    fn a_lost_stream_is_opened_again_and_the_numbers_go_on() {
        // The second of three runs fails.
        let begins = "[ -e runs ] && [ $(wc -l < runs) = 1 ] && { echo x >> runs; exit 1; }";
        let fake = FakeFfmpeg::new(&format!(
            "{begins}\n{LIVE}\nframe $(wc -l < runs)000000\n[ $(wc -l < runs) = 3 ] && exec sleep 1000"
        ));
        let options = Options { reconnect: Duration::from_secs(3), ..RECONNECT };
        let mut live = open_with(&fake, "rtsp://h/a", options);
        assert_eq!(next(&mut live).unwrap(), Some((0, Some(0.0))));
        assert_eq!(next(&mut live).unwrap(), Some((1, Some(2.0))));
        let notes: Vec<Note> = live.notes().collect();
        assert_eq!(notes[1], Note::Back { failed: 1 });
        assert!(notes[0].to_string().contains("opened again"), "{}", notes[0]);
        drop(live);
        assert!(fake.has_ended());
    }

    #[test]
    fn a_stream_that_does_not_come_back_is_an_error_that_says_how_often_it_was_tried() {
        let fake = FakeFfmpeg::new(&format!(
            "[ -e runs ] && {{ echo '[error] rtsp://u:secret@h/a: refused' >&2; exit 1; }}\n{LIVE}\nframe 1000000"
        ));
        let mut live = open_with(&fake, "rtsp://u:secret@h/a", RECONNECT);
        assert!(next(&mut live).unwrap().is_some());
        let error = next(&mut live).unwrap_err();
        assert_eq!(
            error.to_string(),
            "rtsp://u:***@h/a has stopped: refused; it was tried 2 times again"
        );
        assert_eq!(next(&mut live).unwrap(), None, "the error comes once");
    }

    #[test]
    fn a_camera_that_stops_is_not_waited_for() {
        let fake = FakeFfmpeg::new(&format!(
            "{LIVE}\nframe 1\necho '[v4l2 @ 0] [error] No such device' >&2\nexit 1"
        ));
        let mut live = open_with(&fake, "0", RECONNECT);
        assert!(next(&mut live).unwrap().is_some());
        assert_eq!(next(&mut live).unwrap_err().to_string(), "0 has stopped: No such device");
        assert_eq!(live.notes().count(), 0);
    }

    #[test]
    fn a_source_that_is_silent_is_ended() {
        let fake = FakeFfmpeg::new("echo $$ > id\nexec sleep 1000");
        let error = next(&mut open_with(&fake, "udp://h", RECONNECT)).unwrap_err().to_string();
        assert_eq!(error, "cannot open udp://h: no frame came for 0.5 s");
        assert!(fake.has_ended());
        let fake = FakeFfmpeg::new(&format!("{LIVE}\nframe 1\nexec sleep 1000"));
        let mut live = open_with(&fake, "udp://h", ONCE);
        assert!(next(&mut live).unwrap().is_some());
        let error = next(&mut live).unwrap_err().to_string();
        assert_eq!(error, "udp://h has stopped: no frame came for 0.5 s");
        assert!(fake.has_ended());
    }

    #[test]
    fn each_frame_of_a_file_that_is_served_is_given_once() {
        let served = LIVE.replace("N/A", "00:00:01.00");
        let fake = FakeFfmpeg::new(&format!(
            "echo \"$*\" >> asked\n{served}\nfor k in 7 8 9; do frame ${{k}}00000; done"
        ));
        let mut live = open_with(&fake, "http://h/v.mp4", RECONNECT);
        let mut given = Vec::new();
        while let Some(frame) = next(&mut live).unwrap() {
            given.push(frame);
            thread::sleep(Duration::from_millis(100));
        }
        assert_eq!(given, [(0, Some(0.0)), (1, Some(0.1)), (2, Some(0.2))]);
        assert_eq!((live.dropped(), live.begun()), (0, None));
        let asked = fs::read_to_string(fake.file("asked")).unwrap();
        let clock = asked.lines().map(|line| line.contains("wallclock")).collect::<Vec<_>>();
        assert_eq!(clock, [true, false]);
    }

    #[test]
    fn a_range_of_frames_is_given() {
        let fake = FakeFfmpeg::new(&format!(
            "{LIVE}\nfor k in 0 1 2 3 4 5 6 7 8 9; do frame $k; sleep 0.1; done\nexec sleep 1000"
        ));
        let mut live = open_with(&fake, "udp://h", Options { start: 2, end: Some(5), ..RECONNECT });
        let mut given = Vec::new();
        while let Some((index, _)) = next(&mut live).unwrap() {
            given.push(index);
        }
        thread::sleep(Duration::from_millis(200));
        assert_eq!(live.notes().count(), 0, "nothing was lost");
        assert!(given.iter().all(|index| (2..5).contains(index)) && !given.is_empty(), "{given:?}");
        assert!(fake.has_ended());
    }

    #[test]
    fn without_ffmpeg_the_error_names_it() {
        let program = ffmpeg::Program { name: "/nowhere/ffmpeg".into(), ..Default::default() };
        let address = Address::parse("rtsp://h/a").unwrap().unwrap();
        let error = next(&mut LiveSource::with(address, ONCE, program)).unwrap_err();
        let expected =
            "rtsp://h/a is a live source; reading it needs ffmpeg, which is not on the PATH";
        assert_eq!(error.to_string(), expected);
        assert_eq!(error.advice().unwrap(), "install ffmpeg");
    }

    #[test]
    fn pauses_grow_up_to_a_limit() {
        assert_eq!(pauses(Duration::ZERO), []);
        let all = pauses(Duration::from_secs(60));
        assert_eq!(all.iter().sum::<Duration>(), Duration::from_secs(60));
        assert!(all.is_sorted_by(|a, b| a <= b) || all[all.len() - 1] < PAUSES[1]);
        assert_eq!((all[0], all[5]), (PAUSES[0], PAUSES[1]));
    }
}
