//! Running trackers: every target, every seed, to trajectories on disk.
//!
//! [`schemes`] says where a tracker begins (OPE, TRE, SRE), [`subject`] is a tracker under test, [`store`]
//! keeps complete runs and nothing else, [`plan`] says which runs are to be made, and [`runner`] makes them,
//! so that it can be killed at any moment and started again. [`job`] is one run as a message, to be made by
//! another process or machine.

pub mod clock;
pub mod job;
pub mod machine;
pub mod plan;
pub mod runner;
pub mod schemes;
pub mod store;
pub mod subject;
pub mod trax;
