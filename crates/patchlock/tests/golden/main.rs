//! Compares parts of the tracker with other programs. `tools/oracles` wrote the files in this
//! folder.

mod guided_filter;
mod lasso;
mod network;
#[path = "../solvers/mod.rs"]
mod solvers;
mod somp;
mod subspace;
mod warp;

use serde::de::DeserializeOwned;
use std::path::Path;

/// Reads a file of this folder.
fn golden<T: DeserializeOwned>(name: &str) -> T {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name))
}

fn read<T: DeserializeOwned>(path: &Path) -> T {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The largest difference of two vectors of equal length.
fn difference<'a>(
    a: impl IntoIterator<Item = &'a f64>,
    b: impl IntoIterator<Item = &'a f64>,
) -> f64 {
    let (a, b): (Vec<_>, Vec<_>) = (a.into_iter().collect(), b.into_iter().collect());
    assert_eq!(a.len(), b.len());
    a.into_iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
