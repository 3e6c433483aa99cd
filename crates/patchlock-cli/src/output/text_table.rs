//! Plain text tables: text is aligned to the left, numbers to the right.

/// A header and rows; each column is as wide as its widest cell.
pub struct TextTable {
    rows: Vec<Vec<String>>,
}

impl TextTable {
    pub fn new(titles: &[&str]) -> Self {
        Self { rows: vec![titles.iter().map(|title| title.to_string()).collect()] }
    }

    /// Adds a row. Control characters, which a terminal would obey, become spaces.
    pub fn row(&mut self, cells: &[String]) {
        let plain = |cell: &String| cell.replace(char::is_control, " ");
        self.rows.push(cells.iter().map(plain).collect());
    }

    /// The table as text, one line per row.
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |k: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(k));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let numbers: Vec<bool> = (0..columns).map(|k| self.is_numbers(k)).collect();
        let mut text = String::new();
        for row in &self.rows {
            let mut line = String::new();
            for (k, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                line += if k > 0 { "  " } else { "" };
                line += &match numbers[k] {
                    true => format!("{cell:>width$}"),
                    false => format!("{cell:<width$}"),
                };
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }

    /// Whether every cell below the title starts with a digit, or is `-` for a missing value.
    fn is_numbers(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().skip(1).filter_map(|row| row.get(column));
        cells.all(|cell| cell == "-" || cell.starts_with(|c: char| c.is_ascii_digit()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let mut table = TextTable::new(&["tracker", "DP"]);
        table.row(&["a".to_string(), "0.5".to_string()]);
        table.row(&["longer\u{1b}name".to_string(), "0.123 +- 0.001".to_string()]);
        let lines: Vec<String> = table.text().lines().map(str::to_string).collect();
        assert_eq!(lines[0], "tracker                  DP");
        assert_eq!(lines[1], "a                       0.5");
        assert_eq!(lines[2], "longer name  0.123 +- 0.001");
    }
}
