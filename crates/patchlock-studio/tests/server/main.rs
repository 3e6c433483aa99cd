//! A server on this machine, asked as a browser asks it, and as an attacker would.

mod access;
mod attacks;
mod camera;
mod exchange;
mod history;
mod labels;
mod measured;
mod projects;
mod support;
mod uploads;
