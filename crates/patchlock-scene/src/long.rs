//! Scenes of any length in which the target disappears and returns, again and again.

use crate::config::{KeyPose, Post, SceneConfig};
use crate::noise::uniform;

/// Width and height of the target at scale 1.
const TARGET: [f64; 2] = [48.0, 40.0];
/// The scales of the target.
const SCALES: [f64; 2] = [0.9, 1.1];
/// Mean speeds between two poses, in pixels per frame.
const SPEEDS: [f64; 2] = [1.5, 3.0];
/// The largest mean turn per frame between two poses, in degrees.
const TURN_SPEED: f64 = 1.0;
/// Poses on the way from one absence to the next.
const STOPS: [f64; 2] = [1.0, 4.0];
/// Frames that the target is on its way where nobody sees it.
const FRAMES_AWAY: [f64; 2] = [24.0, 64.0];
/// Distance that the target, however it is turned, keeps from what may hide it.
const CLEARANCE: f64 = 4.0;

/// How the target of [`SceneConfig::long`] disappears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absences {
    /// It is always visible.
    Never,
    /// It passes behind a tree trunk wide enough to hide all of it, moves up or down there, and
    /// appears on either side.
    BehindPost,
    /// It leaves the frame and returns over another edge.
    OutsideFrame,
}

impl SceneConfig {
    /// `frames` frames of 400 x 240 pixels. The target moves to and fro by up to 5 pixels per
    /// frame, changes its size by up to a tenth, turns by up to `turn` degrees to either side, and
    /// disappears 5 to 20 times in 3000 frames, for 24 frames or more. While it is absent, it keeps
    /// its size and its rotation.
    ///
    /// The seed determines the way of the target, the backdrop and the noise. A scene begins with
    /// all frames of a shorter one with the same `absences`, `turn` and `seed`.
    pub fn long(frames: usize, absences: Absences, turn: f64, seed: u64) -> Self {
        let base =
            Self { width: 400, height: 240, frames, target_size: TARGET, seed, ..Self::simple() };
        let post = (absences == Absences::BehindPost).then(|| wide_post(&base));
        let path = RandomPath::new(&base, turn, post).path(absences);
        Self { path, post, ..base }
    }
}

/// Half the diagonal of the largest target: no part of it is farther from its centre.
fn reach() -> f64 {
    SCALES[1] * TARGET[0].hypot(TARGET[1]) / 2.0
}

/// A trunk that hides the whole target, at whatever height its wavy edges are passed.
fn wide_post(config: &SceneConfig) -> Post {
    let middle = (config.width as f64 - 1.0) / 2.0;
    let shift = 20.0 * (uniform(config.seed ^ 0xc1, 0, 0) - 0.5);
    Post { centre_x: middle + shift, width: 2.0 * (reach() + CLEARANCE) / (1.0 - Post::WAVER) }
}

/// The target on its way: it draws one pose after the other.
struct RandomPath {
    seed: u64,
    drawn: i64,
    /// The last coordinates at which the centre of a pixel is still in the frame.
    last: [f64; 2],
    frames: usize,
    turn: f64,
    post: Option<Post>,
    /// Whether it is to the right of the post.
    right: bool,
    poses: Vec<KeyPose>,
}

impl RandomPath {
    fn new(config: &SceneConfig, turn: f64, post: Option<Post>) -> Self {
        let last = [config.width, config.height].map(|side| side as f64 - 1.0);
        let (seed, frames) = (config.seed ^ 0xc2, config.frames);
        Self { seed, drawn: 0, last, frames, turn, post, right: false, poses: Vec::new() }
    }

    /// Poses until after the last frame.
    fn path(mut self, absences: Absences) -> Vec<KeyPose> {
        let centre = self.open_place();
        self.poses.push(KeyPose { frame: 0.0, centre, scale: 1.0, degrees: 0.0 });
        // The pose after the last frame decides how fast the target is there, so there is one more.
        while self.poses[self.poses.len().saturating_sub(2)].frame <= self.frames as f64 {
            for _ in 0..self.draw(STOPS) as usize {
                self.stop();
            }
            match absences {
                Absences::Never => {}
                Absences::BehindPost => self.pass_behind_post(),
                Absences::OutsideFrame => self.leave_frame(),
            }
        }
        self.poses
    }

    /// The next random number from this range.
    fn draw(&mut self, [min, max]: [f64; 2]) -> f64 {
        self.drawn += 1;
        min + (max - min) * uniform(self.seed, self.drawn, 0)
    }

    /// A place where the whole target is visible, on its side of the post.
    fn open_place(&mut self) -> [f64; 2] {
        let near = reach() + CLEARANCE;
        let mut across = [near, self.last[0] - near];
        if let Some(post) = self.post {
            let half = post.width / 2.0 * (1.0 + Post::WAVER);
            match self.right {
                true => across[0] = post.centre_x + half + near,
                false => across[1] = post.centre_x - half - near,
            }
        }
        [self.draw(across), self.draw([near, self.last[1] - near])]
    }

    /// Goes to an open place, with another size and rotation.
    fn stop(&mut self) {
        let centre = self.open_place();
        let (scale, degrees) = (self.draw(SCALES), self.draw([-self.turn, self.turn]));
        let from = self.poses[self.poses.len() - 1];
        let turning = (degrees - from.degrees).abs() / TURN_SPEED;
        let frames = self.frames_to(centre).max(turning);
        self.poses.push(KeyPose { frame: from.frame + frames, centre, scale, degrees });
    }

    /// Frames on the way to a place, at a random speed.
    fn frames_to(&mut self, [x, y]: [f64; 2]) -> f64 {
        let [x0, y0] = self.poses[self.poses.len() - 1].centre;
        ((x - x0).hypot(y - y0) / self.draw(SPEEDS)).max(1.0)
    }

    /// Goes to a place with the size and rotation at hand.
    fn go(&mut self, centre: [f64; 2], frames: f64) {
        let from = self.poses[self.poses.len() - 1];
        self.poses.push(KeyPose { frame: from.frame + frames, centre, ..from });
    }

    /// Goes behind the post, up or down there by half the height, and out on one of its sides.
    fn pass_behind_post(&mut self) {
        let Some(Post { centre_x, .. }) = self.post else { return };
        let near = reach() + CLEARANCE;
        let middle = self.last[1] / 2.0;
        let (above, below) = (
            self.draw([near, middle - near / 2.0]),
            self.draw([middle + near / 2.0, self.last[1] - near]),
        );
        let (from, to) = if self.draw([0.0, 1.0]) < 0.5 { (above, below) } else { (below, above) };
        let way = self.frames_to([centre_x, from]);
        self.go([centre_x, from], way);
        let away = self.draw(FRAMES_AWAY);
        self.go([centre_x, to], away);
        self.right = self.draw([0.0, 1.0]) < 0.5;
        let out = self.open_place();
        let way = self.frames_to(out);
        self.go(out, way);
    }

    /// Leaves the frame over one edge and returns over another. Outside it goes round the corners,
    /// never across the frame.
    fn leave_frame(&mut self) {
        let leaves = self.draw([0.0, 4.0]) as usize;
        let returns = (leaves + self.draw([1.0, 4.0]) as usize) % 4;
        let from = self.beyond(leaves);
        let to = self.beyond(returns);
        let way = self.frames_to(from);
        self.go(from, way);
        let corners = self.corners(leaves, returns);
        let leg = self.draw(FRAMES_AWAY) / (corners.len() + 1) as f64;
        for place in corners.into_iter().chain([to]) {
            self.go(place, leg);
        }
        let place = self.open_place();
        let way = self.frames_to(place);
        self.go(place, way);
    }

    /// A place just outside an edge of the frame: left, top, right and bottom are 0 to 3.
    fn beyond(&mut self, edge: usize) -> [f64; 2] {
        let (axis, off) = (edge % 2, reach() + CLEARANCE);
        let along = self.draw([off, self.last[1 - axis] - off]);
        let beyond = if edge < 2 { -off } else { self.last[axis] + off };
        if axis == 0 { [beyond, along] } else { [along, beyond] }
    }

    /// The corners outside the frame on the way from one edge to another.
    fn corners(&self, from: usize, to: usize) -> Vec<[f64; 2]> {
        let off = reach() + CLEARANCE;
        let corner = |a: usize, b: usize| {
            // One of two neighbouring edges is left or right, the other top or bottom.
            let (side, level) = if a.is_multiple_of(2) { (a, b) } else { (b, a) };
            let x = if side == 0 { -off } else { self.last[0] + off };
            let y = if level == 1 { -off } else { self.last[1] + off };
            [x, y]
        };
        let next = (from + 1) % 4;
        if (from + 2) % 4 == to {
            vec![corner(from, next), corner(next, to)]
        } else {
            vec![corner(from, to)]
        }
    }
}
