//! SVG by hand: a few shapes, escaped text, and what turns it into PNG.
//!
//! Nothing has a colour of its own but a class, and [`STYLE`] gives the classes their colours. Files carry that style (light); in a page the
//! page's own style decides, so that the same picture fits to a dark screen and to paper.

use std::fmt::{Arguments, Write};
use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, fontdb};

use super::palette;
use crate::Error;

/// Family name of the font that PNGs are drawn with, for SVG.
pub const FAMILY: &str = "Hack";
/// The font's data. Its width is fixed, so figures stand below each other, and where its texts fit, those of other fonts do too.
pub const FONT: &[u8] = epaint_default_fonts::HACK_REGULAR;
/// PNGs have twice the pixels, for sharp text on any screen.
pub const PNG_SCALE: f32 = 2.0;
/// Width of a letter, as a share of the size of the text.
const LETTER: f64 = 0.602;

/// The colours of a picture that stands alone, on white.
const STYLE: &str = ".paper{fill:#ffffff}.ink{fill:#1c2530}.soft{fill:#566273}.faint{fill:#eef1f4}.grid{stroke:#dfe4ea}.axis{stroke:#8a95a3}\
.other{stroke:#c9d0d8}.failed{fill:#f3d3c4}.band{fill-opacity:.22}.chosen{fill:#fdf0e6}.truth{stroke:#1c2530}.none{fill:#f4f6f8}";

/// Part of a picture, or a whole one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Svg {
    body: String,
}

/// Where a text is, relative to its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
    End,
}

impl Svg {
    /// Adds markup. Writing to a string can't fail.
    pub fn put(&mut self, markup: Arguments<'_>) {
        let _ = self.body.write_fmt(markup);
        self.body.push('\n');
    }

    /// A text in the colour of a class, `ink` or `soft`.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, class: &str, anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let text = escape(text);
        self.put(format_args!(
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\"{anchor} xml:space=\"preserve\">{text}</text>"
        ));
    }

    /// A straight line.
    pub fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.put(format_args!(
            "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>"
        ));
    }

    /// A filled rectangle.
    pub fn rect(&mut self, class: &str, [x, y]: [f64; 2], [w, h]: [f64; 2]) {
        self.put(format_args!(
            "<rect class=\"{class}\" x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\"/>"
        ));
    }

    /// A line through points, with a tooltip.
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

    /// The picture for a page, without its uppermost part: the page's style colours it.
    pub fn inline(&self, [width, height]: [f64; 2], head: f64, label: &str) -> String {
        let height = height - head;
        format!(
            "<svg viewBox=\"0 {head} {width} {height}\" role=\"img\" aria-label=\"{}\" style=\"max-width:{width}px\">\n{}</svg>",
            escape(label),
            self.body
        )
    }

    /// The picture as a file of its own.
    pub fn file(&self, [width, height]: [f64; 2]) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"{FAMILY}, Menlo, Consolas, monospace\">\n<style>{STYLE}{}</style>\n\
             <rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>\n{}</svg>\n",
            palette::style(palette::Ground::Light),
            self.body
        )
    }
}

/// Room that a text takes, with the widest of the fonts.
pub fn width(text: &str, size: f64) -> f64 {
    text.chars().count() as f64 * size * LETTER
}

/// At most so many letters, with an ellipsis for the middle where there are more: names that differ do so at an end.
pub fn shorten(text: &str, letters: usize) -> String {
    let all: Vec<char> = text.chars().collect();
    if all.len() <= letters {
        return text.to_string();
    }
    let kept = letters.saturating_sub(1);
    let (head, tail) = (kept - kept / 2, kept / 2);
    all[..head].iter().chain(&['…']).chain(&all[all.len() - tail..]).collect()
}

/// For text and attributes of SVG. Characters that XML does not allow are replaced.
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

/// Turns SVG into PNG, with the program's own font.
pub struct Rasteriser {
    options: usvg::Options<'static>,
}

impl Rasteriser {
    /// Loads the font, once for many pictures.
    pub fn new() -> Self {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(FONT.to_vec());
        fonts.set_monospace_family(FAMILY);
        Self { options: usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() } }
    }

    /// The picture as the bytes of a PNG.
    ///
    /// # Errors
    /// [`Error::Picture`] where the text is no SVG, or it has no size.
    pub fn png(&self, svg: &str) -> Result<Vec<u8>, Error> {
        let broken = |reason: String| Error::Picture { reason };
        let tree = usvg::Tree::from_str(svg, &self.options).map_err(|e| broken(e.to_string()))?;
        let pixels = |length: f32| (length * PNG_SCALE).ceil() as u32;
        let mut pixmap = Pixmap::new(pixels(tree.size().width()), pixels(tree.size().height()))
            .ok_or_else(|| broken("a picture without a size".to_string()))?;
        resvg::render(&tree, Transform::from_scale(PNG_SCALE, PNG_SCALE), &mut pixmap.as_mut());
        pixmap.encode_png().map_err(|e| broken(e.to_string()))
    }
}

impl Default for Rasteriser {
    fn default() -> Self {
        Self::new()
    }
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
        let png = Rasteriser::new().png(&file).unwrap();
        let drawn = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(drawn.dimensions(), (240, 60));
        let dark = drawn.pixels().filter(|p| p.0[0] < 100).count();
        assert!(dark > 100, "only {dark} dark pixels: the font is missing");
    }

    #[test]
    fn what_is_no_svg_is_an_error() {
        assert!(matches!(Rasteriser::new().png("<svg"), Err(Error::Picture { .. })));
    }

    #[test]
    fn long_texts_are_cut() {
        assert_eq!(shorten("tracker", 7), "tracker");
        assert_eq!(shorten("MIL (/data/peers)", 10), "MIL (…ers)");
        assert_eq!(
            (shorten("abc", 2), shorten("abc", 1), shorten("abc", 0)),
            ("a…".into(), "…".into(), "…".into())
        );
    }
}
