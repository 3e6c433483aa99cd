//! Running trackers: every target, every seed, to trajectories on disk.
//!
//! [`schemes`] says where a tracker begins (OPE, TRE, SRE), [`subject`] is a tracker under test with its clock, [`store`] keeps complete runs and
//! nothing else, and [`runner`] puts them together, so that it can be killed at any moment and started again.

pub mod machine;
pub mod runner;
pub mod schemes;
pub mod store;
pub mod subject;
pub mod trax;
