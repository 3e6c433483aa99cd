//! Rows of `f32` that begin at a cache line: a vector that straddles two lines costs two loads.

use aligned_vec::{AVec, ConstAlign};
use std::ops::{Deref, DerefMut};

/// Bytes of a cache line.
const LINE: usize = 64;

/// A growable array of `f32` that begins at a cache line.
#[derive(Debug, Clone)]
pub struct AlignedVec(AVec<f32, ConstAlign<LINE>>);

impl AlignedVec {
    /// Reserves space for this length.
    pub fn reserve(&mut self, length: usize) {
        self.0.reserve(length.saturating_sub(self.0.len()));
    }

    /// Sets the length; new entries are zero.
    pub fn resize(&mut self, length: usize) {
        self.0.resize(length, 0.0);
    }

    /// Sets the length and all entries to zero.
    pub fn reset(&mut self, length: usize) {
        self.0.clear();
        self.0.resize(length, 0.0);
    }
}

impl Default for AlignedVec {
    fn default() -> Self {
        Self(AVec::new(LINE))
    }
}

impl Deref for AlignedVec {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.0
    }
}

impl DerefMut for AlignedVec {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.0
    }
}
