//! The plots of the report. Each can be embedded in the page or written as a file, and has a table
//! with its numbers.

mod chart;
pub mod curves;
pub mod intervals;
pub mod reliability;
pub mod speed;
pub mod timeline;

use serde::{Serialize, Serializer};

use super::svg::{self, Anchor, Svg};
use crate::Error;
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
    picture: Svg,
    size: [f64; 2],
    /// Height of the part at the top that is cut off in the page, which has its own heading.
    head: f64,
}

impl Plot {
    /// The plot as an SVG element for the page.
    pub fn inline(&self) -> String {
        self.picture.inline(self.size, self.head, &self.title)
    }

    /// The plot as an SVG file.
    pub fn svg(&self) -> String {
        self.picture.file(self.size)
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

    /// Draws a line from `left` to `right` at a value of this vertical axis, and the value left of it.
    fn grid_line(self, svg: &mut Svg, value: f64, [left, right]: [f64; 2], font_size: f64) {
        let y = self.at(value);
        svg.line("grid", [left, y], [right, y]);
        let label = format!("{value:.1}");
        svg.text([left - 8.0, y + 4.0], font_size, "soft", Anchor::End, &label);
    }
}

/// The smallest of 1, 2, 5, 10, 20, 50, ... that is at least `least`, for the marks of an axis.
pub fn round_step(least: f64) -> usize {
    let steps = (0..7).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_usize.pow(power)));
    { steps }.find(|&step| step as f64 >= least).unwrap_or(10_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

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
