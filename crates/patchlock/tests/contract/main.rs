//! What every tracker must keep, whatever its method: each test runs over [`methods::all`], so that a further
//! method is held to all of this as soon as it is listed there.

mod allocations;
mod bad_frames;
mod boxes;
mod fields;
mod following;
mod methods;
mod multi;
mod same_boxes;
mod sequence;
mod snapshot;
