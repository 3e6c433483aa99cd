//! Requirements for every tracking method. Each test runs over [`methods::all`], so a new preset is
//! tested as soon as it is there.

mod allocations;
mod bad_frames;
mod boxes;
mod fields;
mod following;
mod histories;
mod methods;
mod multi;
mod network;
mod refusals;
mod same_boxes;
mod sequence;
mod snapshot;
mod status;
