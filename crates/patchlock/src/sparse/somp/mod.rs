//! Joint sparse codes by greedy matching pursuit (Eq. 3-9).
//!
//! ```text
//! min ||R - D A||_F^2  with at most `atoms` non-zero rows of A
//! ```
//!
//! `R` holds the signals as columns: the patches of the same location in the buffer (the *shared* columns: all candidates
//! have the same) and the candidate's patch, of whose coefficients alone the code is made. Each step takes the eligible
//! atom with the largest score
//!
//! ```text
//! ||R_res^T d||^2 / ||d_res||^2
//! ```
//!
//! where `R_res` and `d_res` are what projecting out the chosen atoms leaves of signals and atom; the first atom wins a tie. An atom is
//! eligible while `||d_res||^2 >= min_residual` and it is not chosen yet. It ends at `atoms` atoms, when the remaining energy is
//! that of rounding, or when no eligible atom has a positive score.
//!
//! [`definition`] is this written out; [`batched`] solves all candidates of a location together and chooses the same atoms.

pub mod batched;
pub mod definition;
mod exact;
mod node;
mod product;
mod rows;
mod screen;
mod vectors;
