//! Runs trackers on every target with every seed, and stores the trajectories on disk.
//!
//! [`schemes`] defines where a tracker starts (OPE, TRE, SRE), [`subject`] what it does, [`trackers`]
//! makes one, [`store`] keeps complete runs only, [`plan`] determines which runs to make, and
//! [`runner`] makes them; it can be interrupted at any time and restarted. [`job`] describes a run so
//! that another process or machine can make it.

pub mod job;
pub mod machine;
pub mod plan;
pub mod runner;
pub mod schemes;
pub mod store;
pub mod subject;
pub mod trackers;
pub mod trax;
