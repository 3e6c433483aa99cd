//! TraX, the protocol between a tracker and its client, for both sides: lines of text on standard
//! input and output (Čehovin: "TraX: The visual Tracking eXchange protocol and library",
//! Neurocomputing 260, 2017).
//!
//! [`message`] is a line; [`region`] and [`image`] are its arguments. The client is
//! [`crate::bench::trax`]; the tracker's side is in `patchlock-cli`.

pub mod image;
pub mod message;
pub mod region;
