//! How all figures look.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// A figure as SVG, or why it could not be drawn.
pub(super) type Drawn = Result<String, Box<dyn std::error::Error>>;

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Colours that people with the common colour blindnesses can tell apart (Okabe and Ito).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(70, 70, 70),
];

pub(super) const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(225, 225, 225);
pub(super) const FONT: &str = "sans-serif";
pub(super) const MARGIN: u32 = 14;
pub(super) const TITLE: u32 = 42;
const LEGEND_LINE: u32 = 22;
const LEGEND_GAP: u32 = 10;

/// What a figure is about.
pub(super) struct Labels<'a> {
    pub title: String,
    pub x: &'a str,
    pub y: &'a str,
    /// A line for each curve, in order.
    pub legend: Vec<String>,
}

/// What is drawn between the axes.
pub(super) struct Plane {
    /// Size of the chart with its axes, in pixels; title and legend come on top.
    pub size: (u32, u32),
    pub x: f64,
    pub y: f64,
    /// Digits behind the point of the numbers along the axes.
    pub digits: (usize, usize),
    /// Approximate number of marks along each axis (x, y).
    pub marks: (usize, usize),
}

pub(super) fn color(curve: usize) -> RGBColor {
    COLORS[curve % COLORS.len()]
}

/// Whether a curve is dashed: in every second pass through the colours.
pub(super) fn dashed(curve: usize) -> bool {
    curve / COLORS.len() % 2 == 1
}

/// Draws a figure with axes from 0: the title above, the legend below, and what `curves` draws between.
pub(super) fn figure(
    labels: &Labels,
    plane: &Plane,
    curves: impl FnOnce(&mut Chart<'_, '_>) -> Result<(), Box<dyn std::error::Error>>,
) -> Drawn {
    let mut svg = String::new();
    let legend = LEGEND_LINE * labels.legend.len() as u32;
    let (width, height) = plane.size;
    {
        let size = (width, TITLE + height + LEGEND_GAP + legend + MARGIN);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, rest) = root.split_vertically(TITLE);
        head.draw(&Text::new(
            labels.title.clone(),
            (MARGIN as i32, MARGIN as i32),
            (FONT, 20).into_font().color(&INK),
        ))?;
        let (middle, foot) = rest.split_vertically(height);
        let mut chart = ChartBuilder::on(&middle)
            .margin_right(MARGIN * 2)
            .margin_left(MARGIN)
            .x_label_area_size(48)
            .y_label_area_size(58)
            .build_cartesian_2d(0.0..plane.x, 0.0..plane.y)?;
        axes(
            &mut chart,
            (labels.x, labels.y),
            plane.marks,
            (&|x| format!("{x:.*}", plane.digits.0), &|y| {
                format!("{y:.*}", plane.digits.1)
            }),
        )?;
        curves(&mut chart)?;
        legend_below(&foot, &labels.legend)?;
        root.present()?;
    }
    Ok(svg)
}

/// How a number beside an axis is written.
pub(super) type Number<'a> = &'a dyn Fn(&f64) -> String;

/// Draws the axes of a chart with these descriptions, about so many marks, and numbers written like this (x, y).
pub(super) fn axes<X, Y>(
    chart: &mut ChartContext<'_, SVGBackend<'_>, Cartesian2d<X, Y>>,
    descriptions: (&str, &str),
    marks: (usize, usize),
    numbers: (Number<'_>, Number<'_>),
) -> Result<(), Box<dyn std::error::Error>>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let small = (FONT, 16).into_font().color(&INK);
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .x_desc(descriptions.0)
        .y_desc(descriptions.1)
        .axis_desc_style(small.clone())
        .label_style(small)
        .x_labels(marks.0)
        .y_labels(marks.1)
        .x_label_formatter(&numbers.0)
        .y_label_formatter(&numbers.1)
        .draw()?;
    Ok(())
}

fn legend_below(area: &Area<'_>, lines: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let left = MARGIN as i32 + 58;
    for (curve, text) in lines.iter().enumerate() {
        let top = LEGEND_GAP as i32 + LEGEND_LINE as i32 * curve as i32;
        let middle = top + LEGEND_LINE as i32 / 2;
        let stroke = color(curve).stroke_width(3);
        // A dashed curve has two short strokes for a long one.
        let strokes: &[(i32, i32)] = if dashed(curve) {
            &[(0, 10), (16, 26)]
        } else {
            &[(0, 26)]
        };
        for (from, to) in strokes {
            let ends = vec![(left + from, middle), (left + to, middle)];
            area.draw(&PathElement::new(ends, stroke))?;
        }
        area.draw(&Text::new(
            text.clone(),
            (left + 36, middle - 7),
            (FONT, 17).into_font().color(&INK),
        ))?;
    }
    Ok(())
}

/// Draws a line of the curve's colour and kind.
pub(super) fn line(
    chart: &mut Chart<'_, '_>,
    curve: usize,
    points: Vec<(f64, f64)>,
) -> Result<(), Box<dyn std::error::Error>> {
    let stroke = color(curve).stroke_width(2);
    if dashed(curve) {
        chart.draw_series(DashedLineSeries::new(points, 8, 5, stroke))?;
    } else {
        chart.draw_series(LineSeries::new(points, stroke))?;
    }
    Ok(())
}
