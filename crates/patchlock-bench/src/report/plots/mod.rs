//! The plots of the report. Each can be embedded in the page or written as a file, and has a table
//! with its numbers.

mod chart;
pub mod curves;
pub mod intervals;
pub mod reliability;
pub mod speed;
pub mod timeline;

use super::svg::{self, Svg};
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
    fn an_empty_axis_maps_to_its_start() {
        let axis = Axis { values: [1.0, 1.0], pixels: [10.0, 20.0] };
        assert_eq!(axis.at(1.0), 10.0);
    }
}
