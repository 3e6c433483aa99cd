//! The program `patchlock`, run as a user runs it. One binary, as a build of it takes longer than
//! most tests.

mod bad_input;
mod bench;
mod demo;
mod export;
#[cfg(unix)]
mod faults;
mod frame;
mod help;
#[cfg(target_os = "linux")]
mod helper;
mod job;
mod live;
mod many;
mod network;
mod project;
mod real;
mod release;
mod report;
mod score;
mod strangers;
mod studio;
mod support;
mod track;
mod trax;
mod trax_server;
mod video;
mod wording;
