//! Tracking between key frames on rendered scenes, in which the truth is known.

use std::collections::BTreeMap;

use patchlock::{BoundingBox, Frame, Preset, Status, Tracker};
use patchlock_scene::{KeyPose, Post, Scene, SceneConfig};
use patchlock_studio::project::{Key, Target, TrackedBox};
use patchlock_studio::tracking::{join::join, review};

/// A target that passes behind a post, at this speed in pixels per frame. The post is wider than
/// the target, so that it is hidden completely for some frames.
fn passing(width: f64, speed: f64, seed: u64) -> SceneConfig {
    let last = (220.0 / speed).ceil();
    let pose = |frame, centre| KeyPose { frame, centre, scale: 1.0, degrees: 0.0 };
    SceneConfig {
        width: 300,
        frames: last as usize + 1,
        target_size: [36.0, 30.0],
        path: vec![pose(0.0, [40.0, 84.0]), pose(last, [260.0, 98.0])],
        post: Some(Post { centre_x: 150.0, width }),
        seed,
        ..SceneConfig::simple()
    }
}

/// A scene, and what was tracked in it so far, by the frame that it began in and its direction.
struct Clip {
    scene: Scene,
    frames: Vec<Vec<u8>>,
    passes: BTreeMap<(usize, bool), Vec<TrackedBox>>,
}

impl Clip {
    fn new(config: SceneConfig) -> Self {
        let scene = Scene::new(config);
        let frames = (0..scene.len()).map(|frame| scene.frame(frame).rgb).collect();
        Self { scene, frames, passes: BTreeMap::new() }
    }

    fn last(&self) -> usize {
        self.scene.len() - 1
    }

    fn visible(&self, frame: usize) -> f64 {
        self.scene.truth(frame).visible
    }

    fn truth(&self, frame: usize) -> BoundingBox {
        let [x, y, w, h] = self.scene.truth(frame).bbox;
        BoundingBox { x, y, w, h }
    }

    fn picture(&self, frame: usize) -> Frame<'_> {
        let SceneConfig { width, height, .. } = *self.scene.config();
        Frame::rgb8(&self.frames[frame], width, height).unwrap()
    }

    /// What is found after the true box in one frame, up to and with another one.
    fn pass(&mut self, from: usize, to: usize) -> Vec<TrackedBox> {
        let (forward, count) = (to > from, from.abs_diff(to));
        if !self.passes.contains_key(&(from, forward)) {
            let end = if forward { self.last() } else { 0 };
            let bbox = self.truth(from);
            let mut tracker = Tracker::start(Preset::Robust, &self.picture(from), bbox).unwrap();
            let frame = |step| if forward { from + step } else { from - step };
            let found = (1..=from.abs_diff(end))
                .map(|step| TrackedBox::from(tracker.update(&self.picture(frame(step))).unwrap()));
            let found = found.collect();
            self.passes.insert((from, forward), found);
        }
        self.passes[&(from, forward)][..count].to_vec()
    }

    /// A target with its true box in the first frame, tracked to the end.
    fn begin(&mut self) -> Target {
        let mut target = Target {
            id: 1,
            label: "car".into(),
            attributes: BTreeMap::new(),
            changes: BTreeMap::new(),
            keys: BTreeMap::new(),
            tracked: BTreeMap::new(),
            hidden: Vec::new(),
        };
        self.confirm(&mut target, 0);
        target
    }

    /// Makes the true box of a frame a key frame, and tracks what follows from it, as the studio does.
    fn confirm(&mut self, target: &mut Target, frame: usize) {
        let bbox = self.truth(frame);
        target.tracked.remove(&frame);
        target.keys.insert(frame, Key::new(bbox));
        let before = review::doubtful(target);
        if let Some(first) = target.keys.range(..frame).next_back().map(|(&first, _)| first) {
            self.between(target, [first, frame], &before);
        }
        match target.keys.range(frame + 1..).next().map(|(&last, _)| last) {
            Some(last) => self.between(target, [frame, last], &before),
            None if frame < self.last() => {
                let found = self.pass(frame, self.last());
                target.tracked.extend((frame + 1..).zip(found));
            }
            None => {}
        }
    }

    fn between(
        &mut self,
        target: &mut Target,
        [first, last]: [usize; 2],
        before: &BTreeMap<usize, TrackedBox>,
    ) {
        let forward = self.pass(first, last);
        let mut backward = self.pass(last, first);
        backward.reverse();
        let ends = [first, last].map(|frame| self.truth(frame));
        let before = |at: usize| before.get(&(first + 1 + at)).copied();
        let joined = join(ends[0], &forward, &backward, ends[1], before);
        target.tracked.extend((first + 1..).zip(joined));
    }
}

/// All orders of all subsets.
fn orders(frames: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for (at, &frame) in frames.iter().enumerate() {
        let others = [&frames[..at], &frames[at + 1..]].concat();
        all.extend(orders(&others).into_iter().map(|order| [vec![frame], order].concat()));
    }
    all
}

/// Frames in which at least half of the target is visible, near the post and far from it.
fn to_confirm(clip: &Clip, hidden: &[usize]) -> Vec<usize> {
    let (first, last) = (hidden[0], hidden[hidden.len() - 1]);
    let half = |frame: &usize| clip.visible(*frame) >= 0.5;
    let whole = |frame: &usize| clip.visible(*frame) == 1.0;
    let before = [(0..first).rev().find(half), (0..first).rev().find(whole)];
    let after = [(last..clip.last()).find(half), (last..clip.last()).find(whole)];
    before.into_iter().chain(after).flatten().chain([clip.last()]).collect()
}

/// Whatever a person confirms, in whatever order: a frame in which nothing of the target is visible
/// never becomes sure by tracking from both sides.
#[test]
fn hidden_frames_are_never_sure_after_any_order_of_confirmations() {
    for (width, speed, seed) in [(44.0, 3.0, 8), (60.0, 3.0, 7), (80.0, 5.0, 8)] {
        let mut clip = Clip::new(passing(width, speed, seed));
        let hidden: Vec<usize> =
            (0..=clip.last()).filter(|&frame| clip.visible(frame) == 0.0).collect();
        let frames = to_confirm(&clip, &hidden);
        assert_eq!(frames.len(), 5);
        let first = clip.begin();
        for order in orders(&frames) {
            let mut target = first.clone();
            for (step, &frame) in order.iter().enumerate() {
                clip.confirm(&mut target, frame);
                let last = target.keys.keys().next_back().unwrap();
                for hidden in hidden.iter().filter(|hidden| *hidden < last) {
                    let TrackedBox { score, status, .. } = target.tracked[hidden];
                    let confirmed = &order[..=step];
                    assert!(
                        score <= 0.5,
                        "frame {hidden} of post {width}, speed {speed}, seed {seed}: {status:?} \
                         {score} after {confirmed:?}"
                    );
                }
            }
        }
        // What is visible is not given up for that.
        let mut target = first.clone();
        clip.confirm(&mut target, clip.last());
        let seen =
            |frame: &usize| clip.visible(*frame) == 1.0 && target.tracked.contains_key(frame);
        let seen: Vec<usize> = (0..clip.last()).filter(seen).collect();
        let good = |frame: &&usize| {
            let TrackedBox { score, status, bbox, .. } = target.tracked[frame];
            score > 0.5 && status != Status::Lost && bbox.overlap(&clip.truth(**frame)) > 0.5
        };
        let good = seen.iter().filter(good).count();
        assert!(10 * good >= 9 * seen.len(), "{good} of {} visible frames are sure", seen.len());
    }
}
