//! Joint sparse codes by greedy matching pursuit (Eq. 3-9).
//!
//! ```text
//! min ||R - D A||_F^2  with at most `atoms` non-zero rows of A
//! ```
//!
//! The columns of `R` are the signals: the patches of one location in the buffer (the *shared*
//! columns, the same for all candidates) and the candidate's patch, whose coefficients alone become
//! the code. Each step chooses the eligible atom with the largest score
//!
//! ```text
//! ||R_res^T d||^2 / ||d_res||^2
//! ```
//!
//! where `R_res` and `d_res` are the residuals of the signals and of the atom after projecting out
//! the chosen atoms. In a tie the first atom is chosen. An atom is eligible while `||d_res||^2 >=
//! min_residual` and it has not been chosen. The pursuit ends at `atoms` atoms, when only rounding
//! errors remain of the signals' energy, or when no eligible atom has a positive score.
//!
//! [`batched`] solves all candidates of a location together. `tests/solvers/definition.rs`
//! implements the above literally, and the tests check that both choose the same atoms.

pub mod batched;
mod errors;
mod exact;
mod location;
mod node;
mod product;
mod rows;
mod screen;
pub(super) mod vectors;
