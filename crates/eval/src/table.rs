//! Rows of text in columns, aligned for people or as markdown.

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

    /// A markdown table; lines end with a line break.
    pub(super) fn markdown(&self) -> String {
        let mut text = String::new();
        for (index, row) in self.rows.iter().enumerate() {
            let cells: Vec<String> = row.iter().map(|cell| cell.replace('|', "\\|")).collect();
            let _ = writeln!(text, "| {} |", cells.join(" | "));
            if index == 0 {
                let _ = writeln!(text, "|---|{}", "---:|".repeat(row.len() - 1));
            }
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

    fn table() -> Table {
        let mut table = Table::new(&["what", "px"]);
        table.push(vec!["a|b".to_owned(), figure(Some(12.34), 1)]);
        table.push(vec!["without α".to_owned(), figure(None, 1)]);
        table
    }

    #[test]
    fn columns_are_aligned_by_characters() {
        assert_eq!(
            table().text(),
            "what         px\na|b        12.3\nwithout α     -\n"
        );
    }

    #[test]
    fn markdown_keeps_bars_in_their_cell() {
        assert_eq!(
            table().markdown(),
            "| what | px |\n|---|---:|\n| a\\|b | 12.3 |\n| without α | - |\n"
        );
    }
}
