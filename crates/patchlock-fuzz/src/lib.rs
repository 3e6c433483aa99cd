//! What fuzzing feeds to Patchlock: one function for each surface that takes input from strangers.
//! It gives the bytes to the surface and panics where something does not hold: that nothing panics,
//! that errors have a text, that numbers are finite, and that what was accepted can be written and
//! read again.
//!
//! [`SURFACES`] lists them. The targets of cargo-fuzz in `fuzz/` and the tests of this crate run
//! them; the tests need no special compiler. [`seeds`] makes inputs to begin with, by the writers
//! of the program.

use std::sync::LazyLock;

pub mod check;
mod folder;
mod labels;
mod library;
mod media;
mod model;
pub mod mutate;
pub mod onnx;
mod project;
mod scratch;
pub mod seeds;
mod server;
mod settings;
mod snapshots;
mod tables;
mod trax;

pub use folder::folder;
pub use labels::labels;
pub use library::{UPDATES, library, quick};
pub use media::{h264, images, mp4, y4m};
pub use model::model;
pub use project::project;
pub use server::{Studio, server};
pub use settings::settings;
pub use snapshots::{snapshot_network, snapshot_packed, snapshot_paper, snapshot_robust};
pub use tables::{boxes, imports, results, tracks, truth};
pub use trax::trax;

/// A surface: it takes any bytes.
pub type Surface = fn(&[u8]);

macro_rules! by_name {
    ($($surface:ident)*) => {
        &[$((stringify!($surface), $surface)),*]
    };
}

/// All surfaces by name.
pub const SURFACES: &[(&str, Surface)] = by_name! {
    mp4 h264 y4m images truth results boxes tracks imports settings snapshot_robust snapshot_paper
    snapshot_network snapshot_packed model trax project labels server library folder
};

/// The ONNX files of small networks with made-up weights: the backbone and the head of a NanoTrack,
/// and a VitTrack.
pub const MADE_UP: [&[u8]; 3] = [
    include_bytes!("../../patchlock/tests/golden/network/nanotrack_backbone.onnx"),
    include_bytes!("../../patchlock/tests/golden/network/nanotrack_head.onnx"),
    include_bytes!("../../patchlock/tests/golden/network/vittrack.onnx"),
];

/// The NanoTrack of [`MADE_UP`].
pub fn made_up_network() -> patchlock::Network {
    static LOADED: LazyLock<patchlock::Network> =
        LazyLock::new(|| patchlock::Network::from_bytes(&MADE_UP[..2]).expect("is a network"));
    LOADED.clone()
}

/// Separates the parts of an input that stands for several files.
pub const SEPARATOR: u8 = 0x1e;

/// The first byte, which chooses among variants, and the rest.
fn choice(data: &[u8]) -> (u8, &[u8]) {
    data.split_first().map_or((0, data), |(first, rest)| (*first, rest))
}

/// The parts of an input.
fn parts(data: &[u8]) -> impl Iterator<Item = &[u8]> {
    data.split(|byte| *byte == SEPARATOR)
}
