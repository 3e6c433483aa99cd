//! The files of the page. They are part of the program. `tools/studio/check.sh` checks their types
//! and tries them in a browser.

/// A file of the page.
pub struct PageFile {
    /// Its path in the address, without the leading slash.
    pub path: &'static str,
    /// Its content type.
    pub kind: &'static str,
    /// Its content.
    pub bytes: &'static [u8],
}

pub const HTML: &str = "text/html; charset=utf-8";
pub const SCRIPT: &str = "text/javascript; charset=utf-8";
pub const STYLE: &str = "text/css; charset=utf-8";
const SVG: &str = "image/svg+xml";

/// Declares a file of this folder.
macro_rules! file {
    ($path:literal, $kind:expr) => {
        PageFile { path: $path, kind: $kind, bytes: include_bytes!($path) }
    };
}

/// All files; `index.html` is served for the address without a path.
pub const FILES: &[PageFile] = &[
    file!("index.html", HTML),
    file!("style.css", STYLE),
    file!("icon.svg", SVG),
    file!("attributes.mjs", SCRIPT),
    file!("camera.mjs", SCRIPT),
    file!("clip.mjs", SCRIPT),
    file!("clipboard.mjs", SCRIPT),
    file!("clips.mjs", SCRIPT),
    file!("commands.mjs", SCRIPT),
    file!("dom.mjs", SCRIPT),
    file!("drafts.mjs", SCRIPT),
    file!("drawing.mjs", SCRIPT),
    file!("editor.mjs", SCRIPT),
    file!("edits.mjs", SCRIPT),
    file!("files.mjs", SCRIPT),
    file!("frames.mjs", SCRIPT),
    file!("help.mjs", SCRIPT),
    file!("left.mjs", SCRIPT),
    file!("main.mjs", SCRIPT),
    file!("notices.mjs", SCRIPT),
    file!("outline.mjs", SCRIPT),
    file!("panel.mjs", SCRIPT),
    file!("picture.mjs", SCRIPT),
    file!("places.mjs", SCRIPT),
    file!("playing.mjs", SCRIPT),
    file!("proposals.mjs", SCRIPT),
    file!("requests.mjs", SCRIPT),
    file!("review.mjs", SCRIPT),
    file!("stage.mjs", SCRIPT),
    file!("stretches.mjs", SCRIPT),
    file!("timeline.mjs", SCRIPT),
    file!("tracks.mjs", SCRIPT),
    file!("zoom.mjs", SCRIPT),
];
