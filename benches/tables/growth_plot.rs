//! The figure of the growth table: a panel for each row, logarithmic on both axes, with what is expected as a dashed
//! line.

use plotters::prelude::*;

use crate::growth_row::Row;
use crate::style::{self, Drawn, FONT, INK, MARGIN, TITLE};

const PANEL: (u32, u32) = (330, 260);
const COLUMNS: usize = 3;
const HEADING: u32 = 28;
/// Points of the dashed line.
const STEPS: u32 = 40;

/// Draws all rows.
pub fn draw(rows: &[Row]) -> Drawn {
    let lines = rows.len().div_ceil(COLUMNS);
    let size = (
        PANEL.0 * COLUMNS as u32 + MARGIN,
        TITLE + PANEL.1 * lines as u32 + MARGIN,
    );
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, panels) = root.split_vertically(TITLE);
        head.draw(&Text::new(
            "Microseconds against each size; dashed: the nearest of the expected order",
            (MARGIN as i32, MARGIN as i32),
            (FONT, 20).into_font().color(&INK),
        ))?;
        for (row, area) in rows.iter().zip(panels.split_evenly((lines, COLUMNS))) {
            panel(row, &area)?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn panel(row: &Row, area: &style::Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
    let (heading, area) = area.split_vertically(HEADING);
    heading.draw(&Text::new(
        row.what.replace('`', ""),
        (MARGIN as i32 + 40, 8),
        (FONT, 16).into_font().color(&INK),
    ))?;
    let micros: Vec<f64> = row.times.iter().map(|t| t * 1e6).collect();
    let (left, right) = (row.sizes[0], row.sizes[row.sizes.len() - 1]);
    let least = micros.iter().copied().fold(f64::INFINITY, f64::min);
    let most = micros.iter().copied().fold(0.0, f64::max);
    // At least a decade, so that nearly constant times look constant.
    let middle = (least * most).sqrt();
    let (bottom, top) = (
        (least / 1.3).min(middle / 10_f64.sqrt()),
        (most * 1.3).max(middle * 10_f64.sqrt()),
    );
    let mut chart = ChartBuilder::on(&area)
        .margin_right(MARGIN)
        .margin_left(4)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d(
            (left / 1.1..right * 1.1)
                .log_scale()
                .with_key_points(row.sizes.clone()),
            (bottom..top)
                .log_scale()
                .with_key_points(marks(bottom, top)),
        )?;
    let few = |x: &f64| format!("{}", (x * 100.0).round() / 100.0);
    let marks = (row.sizes.len(), 10);
    style::axes(&mut chart, (row.size, "µs"), marks, (&few, &few))?;
    let expected = (0..=STEPS).map(|step| {
        let size = left * (right / left).powf(f64::from(step) / f64::from(STEPS));
        (size, row.fit.at(size) * 1e6)
    });
    chart.draw_series(DashedLineSeries::new(
        expected,
        6,
        4,
        style::color(1).stroke_width(2),
    ))?;
    let points = || row.sizes.iter().copied().zip(micros.iter().copied());
    chart.draw_series(LineSeries::new(points(), style::color(0).stroke_width(2)))?;
    chart.draw_series(points().map(|at| Circle::new(at, 4, style::color(0).filled())))?;
    Ok(())
}

/// The numbers 1, 2 and 5 times a power of ten between these.
fn marks(bottom: f64, top: f64) -> Vec<f64> {
    let first = bottom.log10().floor() as i32;
    let last = top.log10().ceil() as i32;
    (first..=last)
        .flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10_f64.powi(power)))
        .filter(|mark| (bottom..=top).contains(mark))
        .collect()
}
