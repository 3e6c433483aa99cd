//! Rendered scenes with exact truth, for testing a visual tracker.
//!
//! A [`Scene`] is a short video of a picture card that moves through a
//! woodland. It rotates, changes size, passes behind a tree and is lit with
//! varying brightness, as configured by its [`SceneConfig`]. Every frame comes
//! with its [`Truth`]: position, rotation, and the shares of the card that are
//! hidden, outside the frame and visible. [`SceneConfig::long`] makes scenes of
//! any length in which the card disappears and returns.
//!
//! Everything is a pure function of the configuration and the frame index,
//! without files, clocks or random devices. Builds on different machines may
//! differ by one grey level in a few pixels, because mathematics libraries
//! round `sin` and similar functions differently.
//!
//! ```
//! use patchlock_scene::Scene;
//!
//! let scene = Scene::simple();
//! let frame = scene.frame(0);
//! assert_eq!(frame.rgb.len(), frame.width * frame.height * 3);
//! let [x, y, w, h] = scene.truth(0).bbox;
//! assert!(x > 0.0 && y > 0.0 && w > 10.0 && h > 10.0);
//! ```
//!
//! # Coordinates
//!
//! Pixel centres are at integers: `[0, 0]` is the centre of the top left pixel,
//! x points to the right and y down. A box `[x, y, w, h]` whose first pixel is
//! `x` has its centre at `x + (w - 1) / 2`.

mod backdrop;
mod badge;
mod canvas;
mod config;
mod long;
mod noise;
mod path;
mod post;
mod presets;
mod scene;
mod target;

pub use config::{KeyLight, KeyPose, Post, SceneConfig, TargetTexture};
pub use long::Absences;
pub use scene::{Scene, SceneFrame};
pub use target::Truth;
