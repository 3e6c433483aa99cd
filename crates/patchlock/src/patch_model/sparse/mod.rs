//! Sparse codes: the dictionary of patches, joint codes by matching pursuit, and the lasso with
//! trivial templates.

pub mod codes;
pub mod dictionary;
mod gram;
pub mod lasso;
pub mod somp;
