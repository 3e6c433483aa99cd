//! TraX, the protocol between a tracker and who asks it, as both sides need it: lines of text on standard input and output (Čehovin: "TraX: The
//! visual Tracking eXchange protocol and library", Neurocomputing 260, 2017).
//!
//! [`message`] is a line, [`region`] and [`image`] are its arguments. The side that asks is [`crate::bench::trax`]; the side that answers is the program's.

pub mod image;
pub mod message;
pub mod region;
