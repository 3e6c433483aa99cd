//! What `Tracker` and `MultiTracker` have in common: threads, the channel order of frames, the count of frames,
//! snapshots.

use std::sync::{Mutex, MutexGuard, PoisonError};

use patchlock::{Error, Frame, Method, Network, NetworkError, TrackerConfig};
use patchlock_track::session::timed_on;
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::config::{Config, Settings};
use crate::errors;
use crate::fork::detached;
use crate::network::{self, check_use};
use crate::pixels::{Channels, Pixels};
use crate::threads::Threads;

/// A tracker of the library.
pub trait Engine: Send + Sized {
    /// Its complete state.
    type Snapshot: Clone + Serialize + DeserializeOwned;
    /// What it is called where something else was given.
    const NAME: &str;

    fn config(&self) -> &TrackerConfig;
    fn snapshot(&self) -> Self::Snapshot;
    /// Continues with this network, which the snapshot does not hold.
    fn restore(snapshot: Self::Snapshot, network: Option<Network>) -> Result<Self, Error>;
    fn method(snapshot: &Self::Snapshot) -> &Method;
}

/// The trackers of the library have the same methods, but no trait of them.
macro_rules! engine {
    ($tracker:ident, $snapshot:ident) => {
        impl Engine for patchlock::$tracker {
            type Snapshot = patchlock::$snapshot;
            const NAME: &str = stringify!($tracker);

            fn config(&self) -> &TrackerConfig {
                self.config()
            }

            fn snapshot(&self) -> Self::Snapshot {
                self.snapshot()
            }

            fn restore(snapshot: Self::Snapshot, network: Option<Network>) -> Result<Self, Error> {
                Self::restore(match network {
                    Some(network) => snapshot.with_network(network),
                    None => snapshot,
                })
            }

            fn method(snapshot: &Self::Snapshot) -> &Method {
                &snapshot.config().method
            }
        }
    };
}

engine!(Tracker, Snapshot);
engine!(MultiTracker, MultiSnapshot);

/// The network of a tracker, as a Python object.
type Model = Option<Py<network::Network>>;

/// A tracker with its threads and what changes from frame to frame.
pub struct Driver<T> {
    state: Mutex<State<T>>,
    /// The network of the settings.
    model: Model,
    threads: Threads,
    channels: Channels,
}

/// What changes from frame to frame.
pub struct State<T> {
    pub tracker: T,
    /// Number of the latest frame.
    pub frame: u64,
    /// Milliseconds that the latest call took.
    pub ms: f64,
}

/// What a call has found, with the number of the frame and the milliseconds that it took.
pub struct CallResult<R> {
    pub result: R,
    pub frame: u64,
    pub ms: f64,
}

/// What pickle needs: the state as MessagePack, and the arguments of `restored`.
pub type PickleState<'py> = (Bound<'py, PyBytes>, Option<usize>, &'static str, u64, Model);

impl<T: Engine> Driver<T> {
    /// A driver of the tracker that `make` makes of settings without a frame.
    pub fn new(
        settings: Settings,
        threads: Option<usize>,
        channels: &str,
        make: impl FnOnce(TrackerConfig) -> Result<T, Error>,
    ) -> PyResult<Self> {
        let (threads, channels) = (Threads::new(threads)?, Channels::parse(channels)?);
        let Settings { config, model } = settings;
        let tracker = make(config).map_err(to_python)?;
        let state = Mutex::new(State { tracker, frame: 0, ms: 0.0 });
        Ok(Self { state, model, threads, channels })
    }

    /// A driver of the tracker that `start` makes of settings and a frame.
    pub fn start(
        py: Python<'_>,
        settings: Settings,
        frame: &Bound<'_, PyAny>,
        threads: Option<usize>,
        channels: &str,
        start: impl FnOnce(TrackerConfig, &Frame<'_>) -> Result<T, Error> + Send,
    ) -> PyResult<Self> {
        let (threads, channels) = (Threads::new(threads)?, Channels::parse(channels)?);
        let pixels = Pixels::of(frame, channels)?;
        let (frame, pool) = (pixels.frame()?, threads.pool()?);
        let Settings { config, model } = settings;
        let started = detached(py, || timed_on(&pool, || start(config, &frame)));
        let (tracker, seconds) = started.map_err(to_python)?;
        let state = Mutex::new(State { tracker, frame: 0, ms: seconds * 1e3 });
        Ok(Self { state, model, threads, channels })
    }

    /// The tracker; waits until no other thread uses it.
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at the tracker, or changes it, while other Python threads continue.
    pub fn with<R: Send>(&self, py: Python<'_>, look: impl FnOnce(&mut State<T>) -> R + Send) -> R {
        detached(py, || look(&mut self.lock()))
    }

    /// Processes a frame while other Python threads continue. The lock lets one thread in at a time.
    pub fn step<R: Send>(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        step: impl FnOnce(&mut State<T>, &Frame<'_>) -> Result<R, Error> + Send,
    ) -> PyResult<CallResult<R>> {
        let pixels = Pixels::of(frame, self.channels)?;
        let (frame, pool) = (pixels.frame()?, self.threads.pool()?);
        let found = self.with(py, |state| {
            let (result, seconds) = timed_on(&pool, || step(state, &frame))?;
            state.ms = seconds * 1e3;
            Ok(CallResult { result, frame: state.frame, ms: state.ms })
        });
        found.map_err(to_python)
    }

    /// A copy of the settings.
    pub fn config(&self, py: Python<'_>) -> Config {
        let config = self.with(py, |state| state.tracker.config().clone());
        Config::of(Settings { config, model: self.model(py) })
    }

    /// Number of threads; `None` means one per core.
    pub fn threads(&self) -> Option<usize> {
        self.threads.count
    }

    /// The channel order of colour arrays.
    pub fn channels(&self) -> &'static str {
        self.channels.name()
    }

    /// The state as JSON text.
    pub fn text<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let text = self.with(py, |state| serde_json::to_vec(&state.tracker.snapshot()));
        Ok(PyBytes::new(py, &text.map_err(errors::of_value)?))
    }

    /// The state as MessagePack, and what else a driver needs to continue.
    pub fn saved<'py>(&self, py: Python<'py>) -> PyResult<PickleState<'py>> {
        let saved = |state: &mut State<T>| {
            (rmp_serde::to_vec_named(&state.tracker.snapshot()), state.frame)
        };
        let (bytes, frame) = self.with(py, saved);
        let bytes = PyBytes::new(py, &bytes.map_err(errors::of_value)?);
        Ok((bytes, self.threads(), self.channels(), frame, self.model(py)))
    }

    fn model(&self, py: Python<'_>) -> Model {
        self.model.as_ref().map(|model| model.clone_ref(py))
    }

    /// A driver that continues where it was saved, from text or bytes. Without a network, it has our
    /// own if the state was saved with it.
    pub fn restored(
        py: Python<'_>,
        snapshot: &[u8],
        model: Model,
        threads: Option<usize>,
        channels: &str,
        frame: u64,
    ) -> PyResult<Self> {
        let read = match snapshot.trim_ascii_start().first() {
            Some(b'{') | None => {
                serde_json::from_slice(snapshot).map_err(|error| error.to_string())
            }
            _ => rmp_serde::from_slice(snapshot).map_err(|error| error.to_string()),
        };
        let snapshot: T::Snapshot = read.map_err(|error| {
            PyValueError::new_err(format!("this is not a snapshot of a {}: {error}", T::NAME))
        })?;
        let network = model.as_ref().map(|model| model.get().to_rust());
        check_use(T::method(&snapshot), network.as_ref())?;
        let (threads, channels) = (Threads::new(threads)?, Channels::parse(channels)?);
        let (tracker, model) = match T::restore(snapshot.clone(), network) {
            Ok(tracker) => (tracker, model),
            Err(error) if needs_network(&error) => {
                let ours = network::patchnet(py)?;
                let tracker = T::restore(snapshot, Some(ours.get().to_rust()));
                (tracker.map_err(|_| to_python(error))?, Some(ours))
            }
            Err(error) => return Err(to_python(error)),
        };
        let state = Mutex::new(State { tracker, frame, ms: 0.0 });
        Ok(Self { state, model, threads, channels })
    }

    /// A copy that continues with threads of its own.
    pub fn copied(&self, py: Python<'_>) -> PyResult<Self> {
        let copy = self.with(py, |state| {
            let network = state.tracker.config().network.clone();
            let tracker = T::restore(state.tracker.snapshot(), network)?;
            Ok(State { tracker, frame: state.frame, ms: state.ms })
        });
        let (state, model) = (Mutex::new(copy.map_err(to_python)?), self.model(py));
        let threads = Threads::new(self.threads.count)?;
        Ok(Self { state, model, threads, channels: self.channels })
    }
}

/// Whether a state cannot be restored because it was given no network.
fn needs_network(error: &Error) -> bool {
    use NetworkError::{None, Other};
    matches!(error, Error::Network(None | Other { given: Option::None, .. }))
}

/// An unknown id is a `KeyError`; other errors are those of the library.
pub fn to_python(error: Error) -> PyErr {
    match error {
        Error::UnknownTarget { .. } => PyKeyError::new_err(error.to_string()),
        error => errors::of_tracker(error),
    }
}
