//! The pictures of the report. Each is a picture for the page, a file of its own, and a table with its numbers.

pub mod curves;
pub mod intervals;
pub mod speed;
pub mod timeline;

use super::svg::{Rasteriser, Svg};
use crate::Error;

/// One picture with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Name of its files, without an end.
    pub name: String,
    /// What it shows, in words.
    pub title: String,
    /// Its numbers, the first row being the names of the columns.
    pub table: Vec<Vec<String>>,
    picture: Svg,
    size: [f64; 2],
    /// Height of the part at the top that the page leaves away, because it has a heading of its own.
    head: f64,
}

impl Plot {
    /// The picture for the page.
    pub fn inline(&self) -> String {
        self.picture.inline(self.size, self.head, &self.title)
    }

    /// The picture as an SVG file.
    pub fn svg(&self) -> String {
        self.picture.file(self.size)
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// [`Error::Picture`] where it can't be drawn.
    pub fn png(&self, rasteriser: &Rasteriser) -> Result<Vec<u8>, Error> {
        rasteriser.png(&self.svg())
    }

    /// Its numbers as a CSV file.
    pub fn csv(&self) -> String {
        csv(&self.table)
    }
}

/// Rows as CSV. Cells with commas, quotes or line ends are quoted.
pub fn csv(table: &[Vec<String>]) -> String {
    let cell = |cell: &String| match cell.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.clone(),
    };
    let row = |row: &Vec<String>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
    table.iter().map(row).collect()
}

/// Linear from one range to another.
#[derive(Debug, Clone, Copy)]
struct Axis {
    values: [f64; 2],
    places: [f64; 2],
}

impl Axis {
    fn at(self, value: f64) -> f64 {
        let [low, high] = self.values;
        let share = if high > low { (value - low) / (high - low) } else { 0.0 };
        self.places[0] + share * (self.places[1] - self.places[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn awkward_cells_are_quoted() {
        let table = [vec!["a,b".to_string(), "say \"x\"".to_string(), "c".to_string()]];
        assert_eq!(csv(&table), "\"a,b\",\"say \"\"x\"\"\",c\n");
    }

    #[test]
    fn an_axis_without_extent_is_a_place() {
        let axis = Axis { values: [1.0, 1.0], places: [10.0, 20.0] };
        assert_eq!(axis.at(1.0), 10.0);
    }
}
