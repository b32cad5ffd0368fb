//! Rows of text in aligned columns.

use std::fmt::Write;

/// A table: the first column is text, the others are figures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new(header: &[&str]) -> Self {
        Self {
            rows: vec![header.iter().map(ToString::to_string).collect()],
        }
    }

    /// Adds a row with as many cells as the header.
    pub(super) fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    /// Two spaces between the columns, figures to the right; lines end with a line break.
    pub(super) fn text(&self) -> String {
        let length = |text: &String| text.chars().count();
        let widths: Vec<usize> = (0..self.rows[0].len())
            .map(|column| self.rows.iter().map(|row| length(&row[column])).max())
            .map(Option::unwrap_or_default)
            .collect();
        let mut text = String::new();
        for row in &self.rows {
            let _ = write!(text, "{:width$}", row[0], width = widths[0]);
            for (cell, width) in row.iter().zip(&widths).skip(1) {
                let _ = write!(text, "  {cell:>width$}");
            }
            text.push('\n');
        }
        text
    }
}

/// A figure with so many digits, or a dash where there is none.
pub(super) fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_by_characters() {
        let mut table = Table::new(&["what", "px"]);
        table.push(vec!["with".to_owned(), figure(Some(12.34), 1)]);
        table.push(vec!["without α".to_owned(), figure(None, 1)]);
        assert_eq!(
            table.text(),
            "what         px\nwith       12.3\nwithout α     -\n"
        );
    }
}
