//! The plots of the report. Each can be embedded in the page or written as a file, and has a table
//! with its numbers. A template beside this file draws it.

pub mod chart;
pub mod curves;
pub mod intervals;
mod overlap;
pub mod reliability;
pub mod speed;
pub mod timeline;

use std::fmt::Write;

use minijinja::{Environment, Value};
use serde::{Serialize, Serializer};

use super::svg;
use crate::Error;
pub use overlap::overlap;
use patchlock_track::text::as_cell;

/// A plot with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// File name without extension.
    pub name: String,
    /// The heading.
    pub title: String,
    /// The numbers; the first row has the names of the columns.
    pub table: Vec<Vec<String>>,
    /// The elements of the image.
    body: String,
    size: [f64; 2],
    /// Height of the part at the top that is cut off in the page, which has its own heading.
    head: f64,
}

impl Plot {
    /// The plot as an SVG element for the page.
    pub fn inline(&self) -> String {
        svg::inline(&self.body, self.size, self.head, &self.title)
    }

    /// The plot as an SVG file.
    pub fn svg(&self) -> String {
        svg::file(&self.body, self.size)
    }

    /// The plot as a PNG file.
    ///
    /// # Errors
    /// [`Error::Picture`] if the plot cannot be rendered.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        svg::png(&self.svg())
    }

    /// The numbers as a CSV file.
    pub fn csv(&self) -> String {
        csv(&self.table)
    }
}

/// In the page, a plot is its SVG element.
impl Serialize for Plot {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.inline())
    }
}

/// The elements of an image: what a template makes of the values.
///
/// # Errors
/// [`Error::Picture`] if they do not match, which is a bug.
fn drawn(template: &str, values: Value) -> Result<String, Error> {
    let mut environment = Environment::new();
    environment.add_filter("px", |pixels: f64| format!("{pixels:.1}"));
    environment.add_filter("plain", svg::plain);
    environment.add_function("fitted", svg::fitted);
    let template = include_str!("parts.xml").to_string() + template;
    // By this name, texts are escaped.
    let body = environment.render_named_str("plot.xml", &template, values);
    body.map_err(|error| Error::Picture { reason: format!("{error:#}") })
}

/// Formats rows as CSV. Cells with commas, quotes or line breaks are quoted. A text that a
/// spreadsheet would take for a formula has an apostrophe before it.
pub fn csv(table: &[Vec<String>]) -> String {
    let cell = |cell: &String| {
        let text = as_cell(cell);
        match text.contains(['"', ',', '\n', '\r']) {
            true => format!("\"{}\"", text.replace('"', "\"\"")),
            false => text.into_owned(),
        }
    };
    let row = |row: &Vec<String>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
    table.iter().map(row).collect()
}

/// Maps values linearly to pixels.
#[derive(Debug, Clone, Copy)]
struct Axis {
    values: [f64; 2],
    pixels: [f64; 2],
}

impl Axis {
    fn at(self, value: f64) -> f64 {
        let [low, high] = self.values;
        let share = if high > low { (value - low) / (high - low) } else { 0.0 };
        self.pixels[0] + share * (self.pixels[1] - self.pixels[0])
    }

    /// The axis as a function of templates.
    fn function(self) -> Value {
        Value::from_function(move |value: f64| self.at(value))
    }
}

/// Points of an image as the attribute `points`.
fn points(all: impl Iterator<Item = [f64; 2]>) -> String {
    all.fold(String::new(), |mut text, [x, y]| {
        let _ = write!(text, "{x:.1},{y:.1} ");
        text
    })
}

/// The smallest of 1, 2, 5, 10, 20, 50, ... that is at least `least`, for the marks of an axis.
pub fn round_step(least: f64) -> usize {
    let steps = (0..7).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_usize.pow(power)));
    { steps }.find(|&step| step as f64 >= least).unwrap_or(10_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use minijinja::context;

    fn plot(template: &str, values: Value) -> String {
        svg::file(&drawn(template, values).unwrap(), [120.0, 30.0])
    }

    #[test]
    fn text_is_escaped_and_drawn() {
        let text = r#"{{ text(5, 20, 16, "ink", words) }}"#;
        let file = plot(text, context! { words => "a<b & \"c\"\u{1}" });
        assert!(file.contains("a&lt;b &amp; &quot;c&quot; </text>"));
        let picture = svg::png(&file).unwrap();
        let drawn = image::load_from_memory(&picture).unwrap().to_rgb8();
        assert_eq!(drawn.dimensions(), (240, 60));
        let dark = drawn.pixels().filter(|p| p.0[0] < 100).count();
        assert!(dark > 100, "only {dark} dark pixels: the font is missing");
    }

    #[test]
    fn long_names_are_small_before_they_are_shortened() {
        let drawn = |name: &str| plot("{{ name(0, 0, 10, 120.4, n) }}", context! { n => name });
        assert!(drawn(&"n".repeat(20)).contains("font-size=\"10.0\""));
        let long = "n".repeat(33);
        assert!(drawn(&long).contains("font-size=\"6.1\"") && drawn(&long).contains(&long));
        let longer = drawn(&"<".repeat(300));
        let few = "&lt;".repeat(16);
        assert!(longer.contains(&format!("<title>{}</title>", "&lt;".repeat(300))), "{longer}");
        assert!(longer.contains(&format!(">{few}…{few}</text>")));
    }

    #[test]
    fn cells_with_special_characters_are_quoted() {
        let table = [vec!["a,b".to_string(), "say \"x\"".to_string(), "c".to_string()]];
        assert_eq!(csv(&table), "\"a,b\",\"say \"\"x\"\"\",c\n");
        let table = [["=1+1", "-x", "-0.5", "@A1,2"].map(str::to_string).to_vec()];
        assert_eq!(csv(&table), "'=1+1,'-x,-0.5,\"'@A1,2\"\n");
    }

    #[test]
    fn steps_are_round_numbers() {
        let steps =
            [(0.2, 1), (1.0, 1), (1.1, 2), (13.0, 20), (15.0, 20), (40.0, 50), (120.0, 200)];
        for (least, expected) in steps {
            assert_eq!(round_step(least), expected, "{least}");
        }
    }

    #[test]
    fn an_empty_axis_maps_to_its_start() {
        let axis = Axis { values: [1.0, 1.0], pixels: [10.0, 20.0] };
        assert_eq!(axis.at(1.0), 10.0);
    }
}
