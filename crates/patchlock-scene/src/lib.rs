//! Rendered scenes with exact truth, for trying and testing a visual tracker.
//!
//! A [`Scene`] is a short film of a picture card that moves through a
//! woodland: it turns, changes size, passes behind a tree and sees the light
//! change, as its [`SceneConfig`] says. Every frame comes with its [`Truth`]:
//! where the card is, how it is turned and how much of it is hidden.
//!
//! Everything is a pure function of the configuration and the frame index. No
//! file, clock or random device is involved. Two builds on different machines
//! may differ by a grey level in a few pixels, because `sin` and its kin are
//! rounded differently by different mathematics libraries.
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
//! Pixel centres are at integers, with `[0, 0]` in the middle of the top left
//! pixel, x to the right and y down. A box `[x, y, w, h]` whose first pixel is
//! `x` has its centre at `x + (w - 1) / 2`.

mod backdrop;
mod badge;
mod canvas;
mod config;
mod noise;
mod path;
mod post;
mod presets;
mod scene;
mod target;

pub use config::{KeyLight, KeyPose, Post, SceneConfig, TargetLook};
pub use scene::{Scene, SceneFrame};
pub use target::Truth;
