//! A row of the growth table: the times of one thing at several sizes.

use crate::fit::{Fit, Order};

/// The times of one thing at several sizes.
pub struct Row {
    /// What is timed.
    pub what: &'static str,
    /// What the size is called.
    pub size: &'static str,
    /// The sizes, in ascending order.
    pub sizes: Vec<f64>,
    /// The sizes as text.
    pub labels: Vec<String>,
    /// Seconds at each.
    pub times: Vec<f64>,
    /// What is expected, fitted to the times.
    pub fit: Fit,
}

impl Row {
    /// The times at these sizes, with the nearest function of the expected order.
    pub fn new(
        (what, size): (&'static str, &'static str),
        sizes: Vec<f64>,
        order: Order,
        times: Vec<f64>,
    ) -> Self {
        Self {
            what,
            size,
            fit: Fit::of(order, &sizes, &times),
            labels: sizes.iter().map(f64::to_string).collect(),
            sizes,
            times,
        }
    }

    /// Prints it as a row of the table.
    pub fn print(&self) {
        let times: Vec<String> = self
            .times
            .iter()
            .map(|t| format!("{:.0}", t * 1e6))
            .collect();
        println!(
            "| {} | {}: {} | {} | {} | {:.0} % |",
            self.what,
            self.size,
            self.labels.join(" · "),
            times.join(" · "),
            self.fit.text(self.size),
            self.fit.furthest(&self.sizes, &self.times) * 100.0
        );
    }
}
