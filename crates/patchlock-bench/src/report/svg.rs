//! A minimal SVG writer (a few shapes and escaped text), and a rasteriser to PNG.
//!
//! Shapes have classes instead of colours. SVG files embed [`STYLE`], which defines light colours;
//! in the page, its own style applies, so that the same plot suits a dark screen and paper.

use std::fmt::{Arguments, Write};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use super::{outlines, palette};
use crate::Error;

/// Family name of the font that PNGs are drawn with.
pub const FAMILY: &str = "Hack";
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

/// The body of an SVG image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Svg {
    body: String,
}

/// The alignment of a text relative to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text starts there.
    Start,
    /// The text is centred there.
    Middle,
    /// The text ends there.
    End,
}

impl Svg {
    pub fn put(&mut self, markup: Arguments<'_>) {
        let _ = self.body.write_fmt(markup);
        self.body.push('\n');
    }

    /// Appends a text in the colour of a class, such as `ink` or `soft`.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, class: &str, anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let text = escape(text);
        self.put(format_args!(
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\"{anchor} \
             xml:space=\"preserve\">{text}</text>"
        ));
    }

    /// Appends a name in the colour `ink`, from `x` to at most `x + room`: smaller if it is long,
    /// and shortened where that is not enough. A shortened name has the whole one as its tooltip.
    pub fn name(&mut self, [x, y]: [f64; 2], size: f64, room: f64, name: &str) {
        let size = (size * room / width(name, size).max(1.0)).clamp(size * SMALLEST_NAME, size);
        let shown = shorten(name, (room / (size * CHARACTER) + 1e-9) as usize);
        let tooltip = match shown == name {
            true => String::new(),
            false => format!("<title>{}</title>", escape(name)),
        };
        self.put(format_args!(
            "<text class=\"ink\" x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size:.1}\" \
             xml:space=\"preserve\">{tooltip}{}</text>",
            escape(&shown)
        ));
    }

    pub fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.put(format_args!(
            "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>"
        ));
    }

    pub fn rect(&mut self, class: &str, [x, y]: [f64; 2], [w, h]: [f64; 2]) {
        self.put(format_args!(
            "<rect class=\"{class}\" x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\"/>"
        ));
    }

    /// Appends a line through points, with a tooltip.
    pub fn polyline(&mut self, attributes: &str, points: &[[f64; 2]], tooltip: &str) {
        let mut path = String::with_capacity(points.len() * 12);
        for [x, y] in points {
            let _ = write!(path, "{x:.1},{y:.1} ");
        }
        self.put(format_args!(
            "<polyline {attributes} fill=\"none\" points=\"{}\"><title>{}</title></polyline>",
            path.trim_end(),
            escape(tooltip)
        ));
    }

    /// The image as an SVG element for a page, without the uppermost `head` units. The style of the
    /// page applies.
    pub fn inline(&self, [width, height]: [f64; 2], head: f64, label: &str) -> String {
        let height = height - head;
        format!(
            "<svg viewBox=\"0 {head} {width} {height}\" role=\"img\" aria-label=\"{}\" \
             style=\"max-width:{width}px\">\n{}</svg>",
            escape(label),
            self.body
        )
    }

    /// The image as an SVG file.
    pub fn file(&self, [width, height]: [f64; 2]) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" font-family=\"{FAMILY}, Menlo, Consolas, monospace\">\n\
             <style>{STYLE}{}</style>\n\
             <rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>\n{}</svg>\n",
            palette::style(palette::Theme::Light),
            self.body
        )
    }
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

/// Escapes text for SVG text and attributes. Control characters, which XML forbids, become spaces.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
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
    fn text_is_escaped_and_drawn() {
        let mut svg = Svg::default();
        svg.text([5.0, 20.0], 16.0, "ink", Anchor::Start, "a<b & \"c\"\u{1}");
        let file = svg.file([120.0, 30.0]);
        assert!(file.contains("a&lt;b &amp; &quot;c&quot; </text>"));
        let picture = png(&file).unwrap();
        let drawn = image::load_from_memory(&picture).unwrap().to_rgb8();
        assert_eq!(drawn.dimensions(), (240, 60));
        let dark = drawn.pixels().filter(|p| p.0[0] < 100).count();
        assert!(dark > 100, "only {dark} dark pixels: the font is missing");
    }

    #[test]
    fn invalid_svg_is_an_error() {
        assert!(matches!(png("<svg"), Err(Error::Picture { .. })));
    }

    #[test]
    fn long_names_are_small_before_they_are_shortened() {
        let drawn = |name: &str| {
            let mut svg = Svg::default();
            svg.name([0.0, 0.0], 10.0, 120.4, name);
            svg.body
        };
        assert!(drawn(&"n".repeat(20)).contains("font-size=\"10.0\""));
        let long = "n".repeat(33);
        assert!(drawn(&long).contains("font-size=\"6.1\"") && drawn(&long).contains(&long));
        let longer = drawn(&"n".repeat(300));
        assert!(longer.contains(&format!("<title>{}</title>", "n".repeat(300))), "{longer}");
        assert!(longer.contains(&format!(">{}…{}</text>", "n".repeat(16), "n".repeat(16))));
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
