//! Replaces the texts of an SVG image by the outlines of their glyphs. The renderer then needs no
//! fonts and no text layout, which would be a large part of the program.

use std::fmt::Write;

use ab_glyph::{Font, FontRef, OutlineCurve, Point};
use resvg::usvg::roxmltree::{Document, Node};

use super::svg::FONT;

/// The image with a path in place of each `text` element. Of a text, `x`, `y`, `font-size`,
/// `text-anchor`, `transform`, `class` and `fill` count.
///
/// # Errors
/// What is wrong, if the image is not XML.
pub fn outline_texts(svg: &str) -> Result<String, String> {
    let document = Document::parse(svg).map_err(|error| error.to_string())?;
    let font = FontRef::try_from_slice(FONT).map_err(|error| error.to_string())?;
    let mut outlined = String::with_capacity(4 * svg.len());
    let mut end = 0;
    for text in document.descendants().filter(|node| node.has_tag_name("text")) {
        let range = text.range();
        outlined.push_str(&svg[end..range.start]);
        outlined.push_str(&path(text, &font));
        end = range.end;
    }
    outlined.push_str(&svg[end..]);
    Ok(outlined)
}

fn path(text: Node<'_, '_>, font: &FontRef<'_>) -> String {
    let number = |name| text.attribute(name).and_then(|value| value.parse::<f32>().ok());
    let scale = number("font-size").unwrap_or(12.0) / font.units_per_em().unwrap_or(1000.0);
    let own = text.children().filter(Node::is_text);
    let letters: Vec<char> = own.filter_map(|node| node.text()).flat_map(str::chars).collect();
    let advance = |letter: &char| scale * font.h_advance_unscaled(font.glyph_id(*letter));
    let width: f32 = letters.iter().map(advance).sum();
    let share = match text.attribute("text-anchor") {
        Some("middle") => 0.5,
        Some("end") => 1.0,
        _ => 0.0,
    };
    let mut x = number("x").unwrap_or(0.0) - share * width;
    let y = number("y").unwrap_or(0.0);
    let mut lines = String::new();
    for letter in &letters {
        let at = |point: Point| (x + scale * point.x, y - scale * point.y);
        draw(font, *letter, at, &mut lines);
        x += advance(letter);
    }
    let mut path = String::from("<path");
    for name in ["class", "fill", "transform"] {
        if let Some(value) = text.attribute(name) {
            let _ = write!(path, " {name}=\"{}\"", super::svg::escape(value));
        }
    }
    let _ = write!(path, " d=\"{lines}\"/>");
    path
}

/// Appends the path data of a glyph.
fn draw(font: &FontRef<'_>, letter: char, at: impl Fn(Point) -> (f32, f32), lines: &mut String) {
    let curves = font.outline(font.glyph_id(letter)).map(|outline| outline.curves);
    let mut last = None;
    for curve in curves.unwrap_or_default() {
        let (command, points) = match curve {
            OutlineCurve::Line(a, b) => ('L', vec![a, b]),
            OutlineCurve::Quad(a, b, c) => ('Q', vec![a, b, c]),
            OutlineCurve::Cubic(a, b, c, d) => ('C', vec![a, b, c, d]),
        };
        if last != Some(points[0]) {
            let (x, y) = at(points[0]);
            let _ = write!(lines, "M{x:.2} {y:.2}");
        }
        lines.push(command);
        for (x, y) in points[1..].iter().map(|point| at(*point)) {
            let _ = write!(lines, "{x:.2} {y:.2} ");
        }
        last = points.last().copied();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The left and right end of the path in an image with one text.
    fn ends(attributes: &str, text: &str) -> [f32; 2] {
        let image = format!("<svg><text {attributes}>{text}</text></svg>");
        let outlined = outline_texts(&image).expect("it is XML");
        let data = outlined.split("d=\"").nth(1).and_then(|rest| rest.split('"').next());
        let numbers = data.expect("a path").split(|c: char| c.is_ascii_alphabetic() || c == ' ');
        let numbers: Vec<f32> = numbers.filter_map(|number| number.parse().ok()).collect();
        let xs = numbers.chunks_exact(2).map(|pair| pair[0]);
        [xs.clone().fold(f32::MAX, f32::min), xs.fold(f32::MIN, f32::max)]
    }

    #[test]
    fn a_text_is_a_path_at_its_place() {
        let [left, right] = ends("x=\"10\" y=\"20\" font-size=\"10\"", "HHHH");
        assert!(left > 10.0 && left < 12.0, "{left}");
        // Each glyph of the font is .602 of the size wide.
        assert!(right > 32.0 && right < 34.1, "{right}");
        let [middle, _] = ends("x=\"10\" font-size=\"10\" text-anchor=\"middle\"", "HHHH");
        let [end, _] = ends("x=\"10\" font-size=\"10\" text-anchor=\"end\"", "HHHH");
        assert!((left - middle - 12.04).abs() < 0.1 && (left - end - 24.08).abs() < 0.1);
    }

    #[test]
    fn style_and_neighbours_stay_and_tooltips_are_not_drawn() {
        let image =
            "<svg><g/><text class=\"ink\" x=\"1\">a&lt;<title>long</title></text><rect/></svg>";
        let outlined = outline_texts(image).expect("it is XML");
        assert!(outlined.starts_with("<svg><g/><path class=\"ink\" d=\"M"), "{outlined}");
        assert!(outlined.ends_with("/><rect/></svg>") && !outlined.contains("long"), "{outlined}");
        let [_, right] = ends("x=\"0\" font-size=\"10\"", "a&lt;<title>long</title>");
        assert!(right < 12.1, "only two glyphs are drawn: {right}");
        assert!(outline_texts("<svg").is_err());
    }
}
