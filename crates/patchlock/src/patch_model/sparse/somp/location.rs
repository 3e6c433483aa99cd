//! A location of the buffer and the dictionary as the solver needs them, before any candidate.

use super::node::Node;
use super::rows::Rows;
use super::vectors::widen;
use crate::numeric::aligned::AlignedVec;
use crate::numeric::instructions::{Instructions, dispatch};
use crate::patch_model::sparse::codes::CodeParams;
use crate::patch_model::sparse::dictionary::Dictionary;
use pulp::Simd;

/// A location: its shared columns, and everything that follows from them and the dictionary alone.
/// It must be filled again when either of them changes.
#[derive(Debug, Clone, Default)]
pub struct Location {
    pub(super) root: Node,
    pub(super) rows: Rows,
    /// The newest shared column, or zeros if there is none.
    pub(super) reference: Vec<f32>,
    /// The location's index.
    pub(super) number: usize,
}

impl Location {
    /// The location of this index with these shared columns (rows of `dim` samples).
    #[cfg(feature = "internals")]
    pub fn new(dictionary: &Dictionary, shared: (usize, &[f32]), params: &CodeParams) -> Self {
        let (mut location, mut made) = (Self::default(), DictionaryPanels::default());
        made.fill(dictionary);
        location.fill((dictionary, &made.wide), shared, params);
        location
    }

    /// Fills in the location of this index with these shared columns (rows of `dim` samples). The
    /// dictionary's panels are given in `f64`.
    pub fn fill(
        &mut self,
        dictionary: (&Dictionary, &[f64]),
        shared: (usize, &[f32]),
        params: &CodeParams,
    ) {
        dispatch!(Instructions::default(), |simd| self.fill_with(simd, dictionary, shared, params));
    }

    /// The same with these instructions.
    #[inline(always)]
    pub(super) fn fill_with<S: Simd>(
        &mut self,
        simd: S,
        (dictionary, panels): (&Dictionary, &[f64]),
        (number, shared): (usize, &[f32]),
        params: &CodeParams,
    ) {
        let Self { root, rows, reference, .. } = self;
        self.number = number;
        reference.clear();
        reference.extend_from_slice(&shared[shared.len().saturating_sub(dictionary.dim())..]);
        reference.resize(dictionary.dim(), 0.0);
        root.fill_root(simd, shared);
        rows.fill_root(simd, (dictionary, panels), root, params);
    }
}

/// The panels of a dictionary that does not keep its products.
#[derive(Debug, Default)]
pub(super) struct DictionaryPanels {
    pub panels: AlignedVec,
    /// The same in `f64`.
    pub wide: Vec<f64>,
}

impl DictionaryPanels {
    pub fn fill(&mut self, dictionary: &Dictionary) {
        dictionary.fill_panels(&mut self.panels);
        widen(&mut self.wide, &self.panels);
    }
}
