//! Plots as SVG, which needs no fonts to be made.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::table::tick;
use crate::failure::Failure;

/// Whose figures a series shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Ours: solid lines, full dots.
    Ours,
    /// The paper's: dashed lines, rings.
    Paper,
}

/// Points joined by a line.
pub struct Series {
    name: String,
    points: Vec<(f64, f64)>,
    colour: RGBColor,
    style: Style,
}

/// Colours that colour-blind people can tell apart (Okabe & Ito 2008).
const COLOURS: [RGBColor; 5] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
];

impl Series {
    /// A series in one of the [`COLOURS`].
    pub fn new(
        name: impl Into<String>,
        points: Vec<(f64, f64)>,
        colour: usize,
        style: Style,
    ) -> Self {
        Self { name: name.into(), points, colour: COLOURS[colour % COLOURS.len()], style }
    }
}

/// One diagram of a figure. Its x axis is logarithmic.
pub struct Panel<'a> {
    title: String,
    x: &'a str,
    y: &'a str,
    log_y: bool,
    series: Vec<Series>,
}

impl<'a> Panel<'a> {
    /// A diagram with a linear y axis.
    pub fn new(title: String, x: &'a str, y: &'a str, series: Vec<Series>) -> Self {
        Self { title, x, y, log_y: false, series }
    }

    /// The same with a logarithmic y axis.
    pub fn log_y(self) -> Self {
        Self { log_y: true, ..self }
    }
}

/// Smallest and largest finite value on an axis of some panels.
fn extent(panels: &[Panel<'_>], value: impl Fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let points = panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.points).map(value);
    let (low, high) = points
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if low <= high { (low, high) } else { (1.0, 2.0) }
}

/// Pixels of a panel.
const PANEL: (u32, u32) = (440, 440);

/// The panels side by side over the same x axis, as SVG.
pub fn figure(panels: &[Panel<'_>]) -> Result<String, Failure> {
    let mut svg = String::new();
    {
        let size = (PANEL.0 * panels.len() as u32, PANEL.1);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).map_err(Failure::failed)?;
        let (left, right) = extent(panels, |p| p.0);
        for (area, panel) in root.split_evenly((1, panels.len())).iter().zip(panels) {
            let x = ((left / 1.3)..(right * 1.3)).log_scale();
            let (low, high) = extent(std::slice::from_ref(panel), |p| p.1);
            // Room for the names above the lines.
            if panel.log_y {
                draw(
                    area,
                    panel,
                    x,
                    ((low / 1.5)..(1.5 * high * (high / low).sqrt())).log_scale(),
                )?;
            } else {
                let (low, high) = (low.min(0.0), high.max(0.0));
                let room = (high - low).max(1.0) * 0.08;
                draw(area, panel, x, (low - room)..(high + 5.0 * room))?;
            }
        }
        root.present().map_err(Failure::failed)?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Draws one diagram.
fn draw(
    area: &Area<'_>,
    panel: &Panel<'_>,
    x: impl AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>>,
    y: impl AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>>,
) -> Result<(), Failure> {
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(62)
        .build_cartesian_2d(x, y)
        .map_err(Failure::failed)?;
    chart
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .x_desc(panel.x)
        .y_desc(panel.y)
        .x_labels(6)
        .x_label_formatter(&|x| tick(*x))
        .y_label_formatter(&|y| tick(*y))
        .label_style(("sans-serif", 12))
        .axis_desc_style(("sans-serif", 14))
        .draw()
        .map_err(Failure::failed)?;
    for series in &panel.series {
        let colour = series.colour;
        let points = series.points.iter().copied();
        let line = colour.stroke_width(2);
        let drawn = match series.style {
            Style::Ours => chart.draw_series(LineSeries::new(points.clone(), line)),
            Style::Paper => chart.draw_series(DashedLineSeries::new(points.clone(), 5, 4, line)),
        };
        let dot = match series.style {
            Style::Ours => colour.filled(),
            Style::Paper => colour.stroke_width(2),
        };
        let dash = if series.style == Style::Ours { 24 } else { 8 };
        drawn.map_err(Failure::failed)?.label(&series.name).legend(move |(x, y)| {
            EmptyElement::at((x, y))
                + PathElement::new(vec![(0, 0), (dash, 0)], colour.stroke_width(2))
                + PathElement::new(vec![(24 - dash, 0), (24, 0)], colour.stroke_width(2))
        });
        chart.draw_series(points.map(|p| Circle::new(p, 4, dot))).map_err(Failure::failed)?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .legend_area_size(34)
        .background_style(WHITE.mix(0.8))
        .border_style(RGBColor(215, 215, 215))
        .label_font(("sans-serif", 12))
        .draw()
        .map_err(Failure::failed)
}
