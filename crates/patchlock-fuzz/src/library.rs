//! The library itself: configurations within their ranges, frames of every kind, boxes anywhere,
//! and any order of calls.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use arbitrary::{Arbitrary, Unstructured};
use patchlock::{
    BoundingBox, Error, Estimate, Frame, Kind, Method, MultiTracker, NetworkUse, PARAMETERS,
    Parameter, Preset, Range, Snapshot, Tracker, TrackerConfig, Value,
};

use crate::check::{accepted, estimate, said, through_text};
use crate::made_up_network;
use crate::snapshots::one_restored;

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

/// Frames that trackers have found their target in, over all inputs: for records.
pub static UPDATES: AtomicU64 = AtomicU64::new(0);

/// A box stays within this many times the larger side of the frame, or within the longer side of
/// the box that tracking began on, up to rounding.
const MULTIPLE: f64 = 10.0;
const ROUNDING: f64 = 1.001;
/// Steps after which an input is not followed any further.
const STEPS: usize = 40;
/// One call follows a target for fewer frames than this.
const FRAMES: u8 = 32;
/// Patches of a template at each of both scales, at most: with all that fit, a frame takes seconds.
const PATCHES: usize = 64;

/// Whether few patches of the templates are coded.
fn has_few_patches(config: &TrackerConfig) -> bool {
    let Some(model) = config.method.patches() else { return true };
    [(model.large_patch, model.large_step), (model.small_patch, model.small_step)]
        .iter()
        .all(|(patch, step)| ((model.template_side - patch) / step + 1).pow(2) <= PATCHES)
}

/// Frames of an input, at most: those of `robust` take far less time.
fn most_frames(method: &Method) -> u32 {
    match method.name() {
        "robust" => 160,
        "paper" => 10,
        _ => 20,
    }
}

/// Whether all numbers that cost time are small.
pub fn is_quick(config: &TrackerConfig) -> bool {
    CAPS.iter().all(|(name, cap)| match config.get(name) {
        Ok(Value::Whole(number)) => number as f64 <= *cap,
        Ok(Value::Number(number)) => number <= *cap,
        Ok(value) => panic!("{name} is {value}"),
        Err(error) => matches!(error, Error::UnusedSetting { .. }),
    })
}

/// The settings of a preset with those rows that are meant for it, and with the made-up network if it
/// needs one. A row is the method or the group that it is meant for, a setting, and its value.
pub fn quick(preset: Preset, rows: &[(&str, &str, f64)]) -> TrackerConfig {
    let mut config = TrackerConfig::from(preset);
    for (meant_for, name, number) in rows {
        let row = Parameter::named(name).expect("is a setting");
        let is_meant = [preset.info().name, row.group].contains(meant_for);
        if is_meant && row.is_used_by(&config.method) {
            let value = match row.kind {
                Kind::Whole => Value::from(*number as i64),
                _ => Value::from(*number),
            };
            config.set(name, value).expect("is within its range");
        }
    }
    if preset.info().network == NetworkUse::Required {
        config.network = Some(made_up_network());
    }
    config
}

/// The settings of a preset, with a small patch where the method has one: it is fast enough for
/// many frames.
pub fn small(preset: Preset) -> TrackerConfig {
    quick(preset, &[("robust", "patch", 32.0)])
}

/// A grey picture of a bright square on a gradient with some texture.
pub fn pattern(width: usize, height: usize, variant: u8) -> Vec<u8> {
    let (left, top) =
        (usize::from(variant) % width.max(1), usize::from(variant / 3) % height.max(1));
    let pixel = |k: usize| {
        let (x, y) = (k % width, k / width);
        let inside =
            (left..left + width / 3 + 1).contains(&x) && (top..top + height / 3 + 1).contains(&y);
        let texture = ((x * 7 + y * 13) % 32) as u8;
        if inside { 190 + texture } else { ((x + y) % 120) as u8 + texture }
    };
    (0..width * height).map(pixel).collect()
}

/// A number of the configuration, by its row, and where in its range.
#[derive(Arbitrary, Debug, Clone, Copy)]
struct SettingChange {
    row: u8,
    spread: Distribution,
    share: u16,
}

#[derive(Arbitrary, Debug, Clone, Copy)]
enum Distribution {
    Even,
    /// Each order of magnitude is as likely as the next.
    Magnitudes,
    Least,
    Most,
}

#[derive(Arbitrary, Debug, Clone, Copy)]
enum Samples {
    Grey8,
    Rgb8,
    Bgr8,
    Grey16,
    Rgb16,
    Grey32,
    Rgb32,
}

#[derive(Arbitrary, Debug, Clone, Copy)]
enum FrameContent {
    Pattern(u8),
    Flat(u8),
    Noise(u64),
    /// All samples have this value, as floats also a value that is refused.
    Value(f32),
}

/// A frame: its size if it is not that of the others, the gap between rows, and what it shows.
#[derive(Arbitrary, Debug, Clone, Copy)]
struct FrameSpec {
    other_size: Option<[u8; 2]>,
    gap: u8,
    samples: Samples,
    content: FrameContent,
}

/// A box: as shares of the frame, or any numbers.
#[derive(Arbitrary, Debug, Clone, Copy)]
enum BoxSpec {
    Within([u8; 4]),
    Around([i8; 2], [u8; 2]),
    Any([f64; 4]),
}

#[derive(Arbitrary, Debug, Clone, Copy)]
enum Call {
    Update(FrameSpec),
    Start(FrameSpec, BoxSpec),
    Restart(FrameSpec, BoxSpec),
    /// Follows a target for so many frames, on which it moves; tracking begins on the box if none
    /// is tracked.
    Follow(FrameSpec, BoxSpec, u8),
    /// Continues from a snapshot through text.
    Save,
    /// Returns to the last snapshot.
    Back,
}

#[derive(Arbitrary, Debug)]
struct Plan {
    preset: u8,
    size: [u8; 2],
    changes: Vec<SettingChange>,
    first: (FrameSpec, BoxSpec),
    calls: Vec<Call>,
}

/// Bytes as a configuration and a sequence of calls.
pub fn library(data: &[u8]) {
    if let Ok(plan) = Plan::arbitrary_take_rest(Unstructured::new(data)) {
        run(&plan);
    }
}

fn run(plan: &Plan) {
    let config = plan.config();
    let size = plan.size.map(|side| usize::from(side % 65));
    let (spec, place) = plan.first;
    let mut tracked = TrackerPair {
        left: most_frames(&config.method),
        many: MultiTracker::new(config.clone()).expect("is valid"),
        config,
        size,
        begun: None,
    };
    tracked.begin(spec, place, false);
    let mut saved = tracked.saved();
    for call in plan.calls.iter().take(STEPS) {
        match *call {
            Call::Update(spec) => tracked.update(spec),
            Call::Start(spec, place) => tracked.begin(spec, place, false),
            Call::Restart(spec, place) => tracked.begin(spec, place, true),
            Call::Follow(spec, place, frames) => tracked.follow(spec, place, frames),
            Call::Save => {
                saved = tracked.saved();
                tracked.restore(&saved);
            }
            Call::Back => {
                tracked.restore(&saved);
                // The twin has no such snapshot, so it begins when the other does.
                tracked.many = MultiTracker::new(tracked.config.clone()).expect("is valid");
            }
        }
    }
}

impl Plan {
    /// The configuration, without those changes that do not fit the others.
    fn config(&self) -> TrackerConfig {
        let preset = Preset::ALL[usize::from(self.preset) % Preset::ALL.len()];
        let rows = [
            ("robust", "patch", 64.0),
            ("paper", "particles", 30.0),
            ("paper", "small_step", 8.0),
            ("patches", "update_interval", 2.0),
            ("patches", "small_update_interval", 3.0),
        ];
        let mut config = quick(preset, &rows);
        // Every other round over the presets has a network.
        let is_other_round = usize::from(self.preset) / Preset::ALL.len() % 2 == 1;
        if is_other_round && preset.info().network == NetworkUse::Optional {
            config.network = Some(made_up_network());
        }
        for change in self.changes.iter().take(12) {
            let row = &PARAMETERS[usize::from(change.row) % PARAMETERS.len()];
            let mut changed = config.clone();
            let set = changed.set(row.name, change.value(row));
            if row.is_used_by(&config.method) {
                set.expect("is within its range");
            } else {
                said(set.expect_err("belongs to another method"));
            }
            if accepted(changed.validate()).is_some() && has_few_patches(&changed) {
                config = changed;
            }
        }
        config
    }
}

impl SettingChange {
    /// The value of a row of the table.
    fn value(self, row: &Parameter) -> Value {
        let share = f64::from(self.share) / f64::from(u16::MAX);
        let (min, max) = match row.range {
            Range::Flag => return Value::from(share < 0.5),
            Range::Words(words) => {
                return Value::from(words[usize::from(self.share) % words.len()]);
            }
            Range::Number { min, max } => (min, max),
        };
        let cap = CAPS.iter().find(|(name, _)| *name == row.name).map_or(max, |(_, cap)| *cap);
        let number = match self.spread {
            Distribution::Even => min + share * (cap - min),
            Distribution::Magnitudes => {
                let least = min.max(1e-9_f64.min(cap));
                least * (cap / least).powf(share)
            }
            Distribution::Least => min,
            Distribution::Most => cap,
        };
        match row.kind {
            Kind::Whole => Value::from(number.round() as u64),
            _ => Value::from(number.clamp(min, cap)),
        }
    }
}

/// The tracker of a target, and what is known of it.
struct SingleTracker {
    tracker: Tracker,
    /// The box on which tracking began last.
    on: BoundingBox,
}

/// What a call returns to: the snapshot and the box on which tracking began, if it did, and the
/// size of frames.
type SavedState = (Option<(Snapshot, BoundingBox)>, [usize; 2]);

/// A tracker, and one of many targets that is given the same; their estimates must be the same.
struct TrackerPair {
    config: TrackerConfig,
    begun: Option<SingleTracker>,
    many: MultiTracker,
    size: [usize; 2],
    /// Frames that may still come.
    left: u32,
}

impl TrackerPair {
    fn saved(&self) -> SavedState {
        let begun = self.begun.as_ref().map(|begun| (begun.tracker.snapshot(), begun.on));
        (begun, self.size)
    }

    fn restore(&mut self, (saved, size): &SavedState) {
        let begun = |(snapshot, on): &_| SingleTracker { tracker: continued(snapshot), on: *on };
        (self.begun, self.size) = (saved.as_ref().map(begun), *size);
    }

    /// Begins with a new tracker, or again with the one that there is.
    fn begin(&mut self, spec: FrameSpec, place: BoxSpec, again: bool) {
        let [width, height] = self.size.map(|side| side as f64);
        let bbox = place.bbox(width, height);
        let before = self.saved();
        let Self { config, begun, many, .. } = self;
        let found = spec.with_frame(self.size, |frame| {
            let one = match begun {
                Some(SingleTracker { tracker, .. }) if again => {
                    tracker.restart(frame, bbox).cloned()
                }
                _ => Tracker::start(config.clone(), frame, bbox).map(|tracker| {
                    let estimate = tracker.estimate().clone();
                    *begun = Some(SingleTracker { tracker, on: bbox });
                    estimate
                }),
            };
            let id = many.ids().next();
            let other = match id {
                Some(id) => many.restart(id, frame, bbox).cloned(),
                None => many.add(frame, bbox).map(|tracked| tracked.estimate.clone()),
            };
            // One of many cannot change the size of the frames; it begins anew.
            let other = match other {
                Err(Error::FrameSize { .. }) => {
                    *many = MultiTracker::new(config.clone()).expect("is valid");
                    many.add(frame, bbox).map(|tracked| tracked.estimate.clone())
                }
                other => other,
            };
            assert_eq!(debug_text(&one), debug_text(&other));
            one
        });
        match found {
            Some(Ok(found)) => {
                estimate(&found);
                self.size = spec.size(self.size);
                let begun = self.begun.as_mut().expect("has begun");
                assert_eq!(*begun.tracker.estimate(), found);
                begun.on = bbox;
            }
            Some(Err(error)) => {
                said(error);
                assert_eq!(self.saved(), before, "a refused call changed the tracker");
            }
            None => {}
        }
    }

    fn follow(&mut self, spec: FrameSpec, place: BoxSpec, frames: u8) {
        let spec = FrameSpec { other_size: None, ..spec };
        if self.begun.is_none() {
            self.begin(spec, place, false);
        }
        let frames = frames % FRAMES;
        for k in 1..frames {
            self.advance(spec.later(k));
        }
        self.update(spec.later(frames));
    }

    /// Updates the tracker, and one that was restored from its snapshot before.
    fn update(&mut self, spec: FrameSpec) {
        let Some((snapshot, on)) = self.saved().0 else { return };
        let mut twin = continued(&snapshot);
        let Some(found) = self.advance(spec) else { return };
        let of_twin =
            spec.with_frame(self.size, |frame| twin.update(frame).cloned()).expect("as before");
        assert_eq!(debug_text(&found), debug_text(&of_twin), "a restored tracker differs");
        assert_eq!(Some((twin.snapshot(), on)), self.saved().0);
    }

    /// Updates the tracker, and the one of many targets.
    fn advance(&mut self, spec: FrameSpec) -> Option<Result<Estimate, Error>> {
        let Self { begun, many, .. } = self;
        let SingleTracker { tracker, on } = begun.as_mut()?;
        self.left = self.left.checked_sub(1)?;
        let found = spec.with_frame(self.size, |frame| tracker.update(frame).cloned())?;
        if many.ids().len() == 1 {
            let of_many = spec.with_frame(self.size, |frame| {
                many.update(frame).map(|tracked| tracked[0].estimate.clone())
            });
            let of_many = of_many.expect("as before");
            assert_eq!(debug_text(&found), debug_text(&of_many), "one of many differs");
        }
        match &found {
            Ok(found) => {
                UPDATES.fetch_add(1, Relaxed);
                near(found, *on, self.size);
            }
            Err(error) => drop(said(error)),
        }
        Some(found)
    }
}

/// The box is near the frame, or no larger than the one on which tracking began.
fn near(found: &Estimate, on: BoundingBox, size: [usize; 2]) {
    estimate(found);
    let BoundingBox { w, h, .. } = found.bbox;
    let [x, y] = found.bbox.centre();
    let frame = size[0].max(size[1]) as f64;
    let most = ROUNDING * (MULTIPLE * frame).max(on.w).max(on.h);
    let all = [w, h, x.abs(), y.abs()];
    assert!(all.iter().all(|v| *v <= most), "{:?} of {size:?}, {on:?}", found.bbox);
}

/// A result as text: errors may hold NaN, which is equal to nothing. The shortest text that is read
/// as the same number is exact.
fn debug_text(result: &Result<Estimate, Error>) -> String {
    format!("{result:?}")
}

/// A tracker that continues from a snapshot as text.
fn continued(snapshot: &Snapshot) -> Tracker {
    one_restored(through_text(snapshot).1).expect("what a tracker reaches can be restored")
}

impl BoxSpec {
    fn bbox(self, width: f64, height: f64) -> BoundingBox {
        let share = |v: u8| f64::from(v) / 255.0;
        match self {
            Self::Within([x, y, w, h]) => BoundingBox {
                x: share(x) * width,
                y: share(y) * height,
                w: 1.0 + share(w) * width,
                h: 1.0 + share(h) * height,
            },
            Self::Around([x, y], [w, h]) => BoundingBox {
                x: f64::from(x),
                y: f64::from(y),
                w: f64::from(w).powi(2),
                h: f64::from(h).powi(2),
            },
            Self::Any([x, y, w, h]) => BoundingBox { x, y, w, h },
        }
    }
}

impl FrameSpec {
    fn size(self, usual: [usize; 2]) -> [usize; 2] {
        // Few frames have another size, since they are refused while a target is tracked.
        let other = self.other_size.filter(|[width, _]| width % 8 == 0);
        other.map_or(usual, |size| size.map(|side| usize::from(side % 65)))
    }

    /// The frame so many frames later.
    fn later(self, frames: u8) -> Self {
        let content = match self.content {
            FrameContent::Pattern(variant) => FrameContent::Pattern(variant.wrapping_add(frames)),
            FrameContent::Noise(seed) => FrameContent::Noise(seed.wrapping_add(u64::from(frames))),
            still => still,
        };
        Self { content, ..self }
    }

    /// Calls `see` with the frame; `None` if no such frame can be made, which must be an error with
    /// a text.
    fn with_frame<T>(self, usual: [usize; 2], see: impl FnOnce(&Frame<'_>) -> T) -> Option<T> {
        let [width, height] = self.size(usual);
        let channels = match self.samples {
            Samples::Grey8 | Samples::Grey16 | Samples::Grey32 => 1,
            _ => 3,
        };
        let stride = width * channels + usize::from(self.gap % 8);
        let bytes = self.bytes(width, height, channels, stride);
        let shorts: Vec<u16> = bytes.iter().map(|v| u16::from(*v) * 257).collect();
        let float = |v: &u8| match self.content {
            FrameContent::Value(value) => value,
            _ => f32::from(*v) / 255.0,
        };
        let floats: Vec<f32> = bytes.iter().map(float).collect();
        let frame = match self.samples {
            Samples::Grey8 => Frame::grey8(&bytes, width, height),
            Samples::Rgb8 => Frame::rgb8(&bytes, width, height),
            Samples::Bgr8 => Frame::rgb8(&bytes, width, height).map(Frame::bgr),
            Samples::Grey16 => Frame::grey16(&shorts, width, height),
            Samples::Rgb16 => Frame::rgb16(&shorts, width, height),
            Samples::Grey32 => Frame::grey32f(&floats, width, height),
            Samples::Rgb32 => Frame::rgb32f(&floats, width, height),
        };
        let frame = accepted(frame.and_then(|frame| frame.with_stride(stride)))?;
        Some(see(&frame))
    }

    fn bytes(self, width: usize, height: usize, channels: usize, stride: usize) -> Vec<u8> {
        let grey = match self.content {
            FrameContent::Pattern(variant) => pattern(width, height, variant),
            _ => Vec::new(),
        };
        let sample = |k: usize| {
            let (x, y, channel) = (k % stride / channels, k / stride, k % stride % channels);
            match self.content {
                FrameContent::Pattern(_) if x < width => {
                    grey[y * width + x].wrapping_add(40 * channel as u8)
                }
                FrameContent::Pattern(_) => 99,
                FrameContent::Flat(value) => value,
                FrameContent::Noise(seed) => {
                    (seed ^ k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).to_be_bytes()[1]
                }
                FrameContent::Value(value) => value as u8,
            }
        };
        (0..stride * height).map(sample).collect()
    }
}
