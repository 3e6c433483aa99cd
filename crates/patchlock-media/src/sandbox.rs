//! Sources whose decoders run in a process of their own, which the system keeps to the file: see
//! [`Helper`](crate::Helper).

#[cfg(target_os = "linux")]
mod client;
#[cfg(target_os = "linux")]
pub mod serve;
#[cfg(target_os = "linux")]
mod wire;
#[cfg(target_os = "linux")]
mod wire_error;

#[cfg(target_os = "linux")]
pub use client::find;

/// Elsewhere, no helper is started.
#[cfg(not(target_os = "linux"))]
pub fn find(
    _: &std::ffi::OsStr,
    _: bool,
    _: crate::Limits,
) -> Option<Result<crate::find::OpenedSource, crate::Error>> {
    None
}
