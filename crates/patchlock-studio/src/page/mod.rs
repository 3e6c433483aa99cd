//! The files of the page. They are part of the program.

/// A file of the page.
pub struct PageFile {
    /// Its path in the address, without the leading slash.
    pub path: &'static str,
    /// Its content type.
    pub kind: &'static str,
    /// Its content.
    pub bytes: &'static [u8],
}

const HTML: &str = "text/html; charset=utf-8";

/// Declares a file of this folder.
macro_rules! file {
    ($path:literal, $kind:expr) => {
        PageFile { path: $path, kind: $kind, bytes: include_bytes!($path) }
    };
}

/// All files; the first is served for the address without a path.
pub const FILES: &[PageFile] = &[file!("index.html", HTML)];
