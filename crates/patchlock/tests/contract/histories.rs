//! Whatever a tracker can reach, its snapshot can hold: random configurations, frames and
//! histories.

use crate::methods::{all, complete};
use crate::sequence::numbers;
use patchlock::{
    BoundingBox, Error, Estimate, Frame, Kind, Method, PARAMETERS, Range, Snapshot, Tracker,
    TrackerConfig, Value,
};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

/// The largest value that is tried of numbers that cost time.
const CAPS: &[(&str, f64)] = &[
    ("particles", 60.0),
    ("template_side", 36.0),
    ("buffer", 6.0),
    ("templates", 12.0),
    ("update_interval", 6.0),
    ("small_update_interval", 6.0),
    ("guided_radius", 8.0),
    ("patch", 100.0),
    ("scale_count", 33.0),
    ("scale_area", 512.0),
    ("first_frames", 12.0),
    ("lost_after", 4.0),
    ("trial", 4.0),
    ("search_windows", 6.0),
];

/// The numbers that decide what is learnt, which are changed more often.
const LEARNING: &[&str] = &[
    "buffer",
    "epsilon",
    "delta",
    "forgetting",
    "subspace_keep",
    "subspace_vectors",
    "lambda",
    "sure",
    "memory_rate",
];

/// How a number is chosen from its range.
#[derive(Debug, Clone, Copy)]
enum Spread {
    Even,
    /// Each order of magnitude is as likely as the next.
    Magnitudes,
    Least,
    Most,
}

/// The numbers that differ from the base, by their row in the table and a share of their range.
type Changes = Vec<(usize, Spread, f64)>;

/// What a frame shows.
#[derive(Debug, Clone, Copy)]
enum Picture {
    Flat(u8),
    Noise(u64),
    /// A bright square on a dark gradient, here.
    Square([u8; 2]),
    /// The same with all values inverted, as after a cut.
    Inverted([u8; 2]),
}

#[derive(Debug, Clone)]
enum Step {
    Update(Picture),
    Cuts(Vec<bool>),
    Begin(Picture, [f64; 4]),
    /// Continues from a snapshot through text.
    Save,
    /// Returns to the last snapshot.
    Back,
}

#[derive(Debug, Clone)]
struct History {
    method: usize,
    changes: Changes,
    size: [usize; 2],
    colour: bool,
    first: (Picture, [f64; 4]),
    steps: Vec<Step>,
}

fn history(method: usize) -> impl Strategy<Value = History> {
    let spread = select(vec![
        Spread::Even,
        Spread::Magnitudes,
        Spread::Magnitudes,
        Spread::Least,
        Spread::Most,
    ]);
    let used = |row: &usize| PARAMETERS[*row].is_used_by(&all()[method].method);
    let rows: Vec<usize> = (0..PARAMETERS.len()).filter(used).collect();
    let learning = |row: &usize| LEARNING.contains(&PARAMETERS[*row].name);
    let of_learning: Vec<usize> = rows.iter().copied().filter(learning).collect();
    // The method `network` learns nothing.
    let often = if of_learning.is_empty() { rows.clone() } else { of_learning };
    let row = prop_oneof![select(rows), select(often)];
    let change = (row, spread, 0.0..=1.0f64);
    let changes = prop::collection::vec(change, 0..12);
    let size = [8..64usize, 8..64usize];
    let steps = prop::collection::vec(step(), 1..12);
    let first = (picture(), shape());
    (changes, size, any::<bool>(), first, steps).prop_map(move |parts| {
        let (changes, size, colour, first, steps) = parts;
        History { method, changes, size, colour, first, steps }
    })
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        6 => picture().prop_map(Step::Update),
        2 => prop::collection::vec(any::<bool>(), 4..12).prop_map(Step::Cuts),
        1 => (picture(), shape()).prop_map(|(picture, shape)| Step::Begin(picture, shape)),
        2 => Just(Step::Save),
        1 => Just(Step::Back),
    ]
}

fn picture() -> impl Strategy<Value = Picture> {
    prop_oneof![
        any::<u8>().prop_map(Picture::Flat),
        any::<u64>().prop_map(Picture::Noise),
        any::<[u8; 2]>().prop_map(Picture::Square),
        any::<[u8; 2]>().prop_map(Picture::Inverted),
    ]
}

/// Left, top, width and height as shares of the frame.
fn shape() -> impl Strategy<Value = [f64; 4]> {
    [-0.3..0.9f64, -0.3..0.9f64, 0.35..1.5f64, 0.35..1.5f64]
}

impl Picture {
    fn samples(self, [width, height]: [usize; 2], colour: bool) -> Vec<u8> {
        let channels = if colour { 3 } else { 1 };
        let square = |[left, top]: [u8; 2], x: usize, y: usize| {
            let left = usize::from(left) % width;
            let top = usize::from(top) % height;
            let inside = (left..left + width / 3 + 1).contains(&x)
                && (top..top + height / 3 + 1).contains(&y);
            if inside { 220 } else { ((x + y) / 4) as u8 }
        };
        let value = |k: usize| {
            let (x, y, channel) = (k / channels % width, k / channels / width, k % channels);
            let grey = match self {
                Self::Flat(value) => value,
                Self::Noise(seed) => {
                    (seed ^ k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).to_be_bytes()[1]
                }
                Self::Square(at) => square(at, x, y),
                Self::Inverted(at) => 255 - square(at, x, y),
            };
            grey.wrapping_add(40 * channel as u8)
        };
        (0..width * height * channels).map(value).collect()
    }
}

/// The value of a row of the table at this share of its range.
fn value(row: usize, spread: Spread, share: f64) -> Value {
    let parameter = &PARAMETERS[row];
    match parameter.range {
        Range::Flag => Value::from(share < 0.5),
        Range::Words(words) => {
            Value::from(words[((share * words.len() as f64) as usize).min(words.len() - 1)])
        }
        Range::Number { min, max } => {
            let cap =
                CAPS.iter().find(|(name, _)| *name == parameter.name).map_or(max, |row| row.1);
            let number = match spread {
                Spread::Even => min + share * (cap - min),
                Spread::Magnitudes => {
                    let least = min.max(1e-9_f64.min(cap));
                    least * (cap / least).powf(share)
                }
                Spread::Least => min,
                Spread::Most => cap,
            };
            match parameter.kind {
                Kind::Whole => Value::from(number.round() as u64),
                _ => Value::from(number.clamp(min, cap)),
            }
        }
    }
}

impl History {
    /// The configuration, unless its numbers do not fit each other.
    fn config(&self) -> Option<TrackerConfig> {
        let mut config = all()[self.method].clone();
        if config.method.patches().is_some() {
            config.set("update_interval", 2).unwrap();
            config.set("small_update_interval", 3).unwrap();
        }
        if let Method::Robust(robust) = &mut config.method {
            robust.patch = 64.0;
        }
        for &(row, spread, share) in &self.changes {
            config.set(PARAMETERS[row].name, value(row, spread, share)).unwrap();
        }
        config.validate().ok().map(|()| config)
    }

    fn bbox(&self, [x, y, w, h]: [f64; 4]) -> BoundingBox {
        let [width, height] = self.size.map(|side| side as f64);
        BoundingBox { x: x * width, y: y * height, w: w * width, h: h * height }
    }

    fn run(&self) -> Result<(), TestCaseError> {
        let Some(config) = self.config() else { return Ok(()) };
        let (picture, shape) = self.first;
        let mut tracker =
            self.show(picture, |frame| Tracker::start(config.clone(), frame, self.bbox(shape)));
        self.check(tracker.estimate())?;
        restored(tracker.snapshot(), &config)?;
        let mut saved = tracker.snapshot();
        for step in &self.steps {
            match step {
                Step::Update(picture) => self.update(&mut tracker, *picture)?,
                Step::Cuts(cuts) => {
                    for &inverted in cuts {
                        let picture = if inverted {
                            Picture::Inverted([9, 5])
                        } else {
                            Picture::Square([9, 5])
                        };
                        self.update(&mut tracker, picture)?;
                    }
                }
                Step::Begin(picture, shape) => self.restart(&mut tracker, (*picture, *shape))?,
                Step::Save => {
                    saved = tracker.snapshot();
                    let text = serde_json::to_string(&saved).unwrap();
                    let read: Snapshot = serde_json::from_str(&text)
                        .map_err(|error| TestCaseError::fail(format!("as text: {error}")))?;
                    prop_assert_eq!(&read, &saved);
                    tracker = restored(read, &config)?;
                }
                Step::Back => tracker = restored(saved.clone(), &config)?,
            }
        }
        Ok(())
    }

    fn restart(
        &self,
        tracker: &mut Tracker,
        (picture, shape): (Picture, [f64; 4]),
    ) -> Result<(), TestCaseError> {
        let estimate =
            self.show(picture, |frame| tracker.restart(frame, self.bbox(shape)).cloned());
        self.check(&estimate)?;
        restored(tracker.snapshot(), tracker.config()).map(drop)
    }

    /// A restored tracker gives the same estimate.
    fn update(&self, tracker: &mut Tracker, picture: Picture) -> Result<(), TestCaseError> {
        let mut twin = restored(tracker.snapshot(), tracker.config())?;
        let estimate = self.show(picture, |frame| tracker.update(frame).cloned());
        self.check(&estimate)?;
        prop_assert_eq!(self.show(picture, |frame| twin.update(frame).cloned()), estimate);
        prop_assert_eq!(twin.snapshot(), tracker.snapshot());
        restored(tracker.snapshot(), tracker.config()).map(drop)
    }

    fn show<T>(&self, picture: Picture, see: impl FnOnce(&Frame<'_>) -> Result<T, Error>) -> T {
        let [width, height] = self.size;
        let samples = picture.samples(self.size, self.colour);
        let frame = match self.colour {
            true => Frame::rgb8(&samples, width, height),
            false => Frame::grey8(&samples, width, height),
        };
        see(&frame.unwrap()).unwrap()
    }

    fn check(&self, estimate: &Estimate) -> Result<(), TestCaseError> {
        let all = numbers(estimate);
        prop_assert!(all.iter().all(|v| v.is_finite()), "{:?}", all);
        prop_assert!((0.0..=1.0).contains(&estimate.score));
        let BoundingBox { w, h, .. } = estimate.bbox;
        prop_assert!(w > 0.0 && h > 0.0);
        let most = 10.0 * self.size[0].max(self.size[1]) as f64;
        let [x, y] = estimate.bbox.centre();
        prop_assert!(w.max(h).max(x.abs()).max(y.abs()) <= 1.001 * most, "{:?}", estimate.bbox);
        Ok(())
    }
}

fn restored(snapshot: Snapshot, config: &TrackerConfig) -> Result<Tracker, TestCaseError> {
    Tracker::restore(complete(snapshot, config))
        .map_err(|error| TestCaseError::fail(error.to_string()))
}

/// The place of a method in [`all`].
fn numbered(method: &str) -> usize {
    all().iter().position(|config| config.method.name() == method).unwrap()
}

/// The cases are the same on every run; the environment variable `PROPTEST_CASES` asks for more.
fn run(method: &str) {
    let method = numbered(method);
    let cases = std::env::var("PROPTEST_CASES").ok().and_then(|count| count.parse().ok());
    let config = ProptestConfig {
        cases: cases.unwrap_or(64),
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let result = runner.run(&history(method), |history| history.run());
    result.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn whatever_paper_reaches_a_snapshot_holds() {
    run("paper");
}

#[test]
fn whatever_network_reaches_a_snapshot_holds() {
    run("network");
}

#[test]
fn whatever_robust_reaches_a_snapshot_holds() {
    run("robust");
}

/// Runs a history with these changes.
fn scripted(method: &str, changes: &[(&str, f64)], first: Picture, steps: Vec<Step>) {
    let method = numbered(method);
    let row = |name: &str| PARAMETERS.iter().position(|row| row.name == name).unwrap();
    let share = |name: &str, wanted: f64| {
        let Range::Number { min, max } = PARAMETERS[row(name)].range else { panic!("{name}") };
        let cap = CAPS.iter().find(|(capped, _)| *capped == name).map_or(max, |row| row.1);
        (wanted - min) / (cap - min)
    };
    let changes =
        changes.iter().map(|(name, wanted)| (row(name), Spread::Even, share(name, *wanted)));
    let history = History {
        method,
        changes: changes.collect(),
        size: [48, 40],
        colour: false,
        first: (first, [0.2, 0.2, 0.5, 0.5]),
        steps,
    };
    history.run().unwrap_or_else(|error| panic!("{history:?}: {error}"));
}

/// Where nothing tells the candidates apart, their spread alone moves the box.
#[test]
fn boxes_on_flat_frames_stay_near_the_frame() {
    let changes = [
        ("sigma_scale", 10.0),
        ("sigma_aspect", 10.0),
        ("sigma_x", 1000.0),
        ("sigma_y", 1000.0),
        ("particles", 10.0),
    ];
    let steps = vec![Step::Update(Picture::Flat(90)); 200];
    scripted("paper", &changes, Picture::Flat(90), steps);
}

/// The memory of a target without texture does not respond at all.
#[test]
fn a_target_without_texture_has_a_score_and_a_snapshot() {
    for first in [0, 255] {
        let pictures = [first, 128, first, 3].map(|value| Step::Update(Picture::Flat(value)));
        let more =
            [Step::Update(Picture::Noise(4)), Step::Update(Picture::Square([9, 5])), Step::Save];
        let steps = pictures.into_iter().chain(more).collect();
        scripted("robust", &[], Picture::Flat(first), steps);
    }
}
