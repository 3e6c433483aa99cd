//! The frame of an SVG image, what its texts need, and a rasteriser to PNG.
//!
//! Shapes have classes instead of colours. SVG files embed [`STYLE`], which defines light colours;
//! in the page, its own style applies, so that the same plot suits a dark screen and paper.

use minijinja::HtmlEscape;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use super::{outlines, palette};
use crate::Error;

/// Family name of the font that PNGs are drawn with.
const FAMILY: &str = "Hack";
/// The font file. It is monospaced, so digits align, and it is wider than other fonts, whose text
/// therefore fits as well.
pub const FONT: &[u8] = epaint_default_fonts::HACK_REGULAR;
/// Scale of PNGs, for sharp text on high-density screens.
pub const PNG_SCALE: f32 = 2.0;
/// Width of a character relative to the font size.
const CHARACTER: f64 = 0.602;

/// The smallest size of a long name, relative to that of others.
const SMALLEST_NAME: f64 = 0.6;

/// The style of an SVG file, on white.
const STYLE: &str = ".paper{fill:#ffffff}.ink{fill:#1c2530}.soft{fill:#566273}.faint{fill:#eef1f4}\
.grid{stroke:#dfe4ea}.axis{stroke:#8a95a3}.other{stroke:#c9d0d8}.failed{fill:#f3d3c4}\
.band{fill-opacity:.22}.chosen{fill:#fdf0e6}.truth{stroke:#1c2530}.none{fill:#f4f6f8}";

/// The elements of an image as an SVG element for a page, without the uppermost `head` units. The
/// style of the page applies.
pub fn inline(body: &str, [width, height]: [f64; 2], head: f64, label: &str) -> String {
    let (height, label) = (height - head, escape(label));
    format!(
        "<svg viewBox=\"0 {head} {width} {height}\" role=\"img\" aria-label=\"{label}\" \
         style=\"max-width:{width}px\">{body}\n</svg>"
    )
}

/// The elements of an image as an SVG file.
pub fn file(body: &str, [width, height]: [f64; 2]) -> String {
    let colours = palette::style(palette::Theme::Light);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         width=\"{width}\" height=\"{height}\" font-family=\"{FAMILY}, Menlo, Consolas, monospace\">\n\
         <style>{STYLE}{colours}</style>\n\
         <rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>{body}\n</svg>\n"
    )
}

/// The font size and the text of a name that has this room: smaller if it is long, and shortened
/// where that is not enough.
pub fn fitted(name: &str, size: f64, room: f64) -> (f64, String) {
    let size = (size * room / width(name, size).max(1.0)).clamp(size * SMALLEST_NAME, size);
    (size, shorten(name, (room / (size * CHARACTER) + 1e-9) as usize))
}

/// Width of a text in the widest font that may be used.
pub fn width(text: &str, size: f64) -> f64 {
    text.chars().count() as f64 * size * CHARACTER
}

/// Shortens a text to at most this number of characters by an ellipsis in the middle, since similar
/// names differ mostly at their ends.
pub fn shorten(text: &str, letters: usize) -> String {
    let all: Vec<char> = text.chars().collect();
    if all.len() <= letters {
        return text.to_string();
    }
    let kept = letters.saturating_sub(1);
    let (head, tail) = (kept - kept / 2, kept / 2);
    all[..head].iter().chain(&['…']).chain(&all[all.len() - tail..]).collect()
}

/// The text with spaces in place of control characters, which XML forbids.
pub fn plain(text: String) -> String {
    text.replace(|c| matches!(c, '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}'), " ")
}

/// Escapes text for SVG text and attributes.
pub fn escape(text: &str) -> String {
    plain(HtmlEscape(text).to_string())
}

/// Renders an SVG file with the embedded font and returns the bytes of a PNG file.
///
/// # Errors
/// [`Error::Picture`] if the SVG is invalid or has no size.
pub fn png(svg: &str) -> Result<Vec<u8>, Error> {
    let broken = |reason: String| Error::Picture { reason };
    let outlined = outlines::outline_texts(svg).map_err(broken)?;
    let tree = Tree::from_str(&outlined, &Options::default()).map_err(|e| broken(e.to_string()))?;
    let pixels = |length: f32| (length * PNG_SCALE).ceil() as u32;
    let mut pixmap = Pixmap::new(pixels(tree.size().width()), pixels(tree.size().height()))
        .ok_or_else(|| broken("the image has no size".to_string()))?;
    resvg::render(&tree, Transform::from_scale(PNG_SCALE, PNG_SCALE), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|e| broken(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_svg_is_an_error() {
        assert!(matches!(png("<svg"), Err(Error::Picture { .. })));
    }

    #[test]
    fn long_texts_are_shortened() {
        assert_eq!(shorten("tracker", 7), "tracker");
        assert_eq!(shorten("MIL (/data/peers)", 10), "MIL (…ers)");
        assert_eq!(
            (shorten("abc", 2), shorten("abc", 1), shorten("abc", 0)),
            ("a…".into(), "…".into(), "…".into())
        );
    }
}
