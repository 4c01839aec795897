//! Charts: histograms, curves and bars.

use plotters::prelude::*;

use crate::{Error, Result};

/// A named set of values or points in one colour.
pub(crate) struct Series<'a, T> {
    pub(crate) name: &'a str,
    pub(crate) colour: [u8; 3],
    pub(crate) values: Vec<T>,
}

/// What stands around a chart.
pub(crate) struct Axes<'a> {
    pub(crate) title: &'a str,
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
}

const SIZE: (u32, u32) = (460, 300);
const BINS: usize = 60;

/// Histograms over a common span, as outlines so that one does not hide the other; in percent of each set.
///
/// Values outside `span` are counted in the first or last bin, so nothing vanishes.
pub(crate) fn histogram(axes: &Axes<'_>, span: [f64; 2], sets: &[Series<'_, f64>]) -> Result<String> {
    let outlines: Vec<_> = sets
        .iter()
        .map(|set| Series { name: set.name, colour: set.colour, values: outline(&set.values, span) })
        .collect();
    curves(axes, &outlines)
}

/// Curves through points.
pub(crate) fn curves(axes: &Axes<'_>, sets: &[Series<'_, (f64, f64)>]) -> Result<String> {
    let all = || sets.iter().flat_map(|set| set.values.iter());
    let x = bounds(all().map(|point| point.0));
    let y = bounds(all().map(|point| point.1));
    let mut svg = String::new();
    draw_curves(&mut svg, axes, x, y, sets)
        .map_err(|message| Error::Figure { figure: axes.title.to_owned(), message })?;
    Ok(svg)
}

fn draw_curves(
    svg: &mut String,
    axes: &Axes<'_>,
    x: [f64; 2],
    y: [f64; 2],
    sets: &[Series<'_, (f64, f64)>],
) -> std::result::Result<(), String> {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE).map_err(|e| e.to_string())?;
    let mut chart = ChartBuilder::on(&area)
        .caption(axes.title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(52)
        .build_cartesian_2d(x[0]..x[1], y[0]..y[1])
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .x_desc(axes.x)
        .y_desc(axes.y)
        .light_line_style(TRANSPARENT)
        .label_style(("sans-serif", 11))
        .draw()
        .map_err(|e| e.to_string())?;
    for set in sets {
        let [r, g, b] = set.colour;
        let colour = RGBColor(r, g, b);
        chart
            .draw_series(LineSeries::new(set.values.iter().copied(), colour.stroke_width(2)))
            .map_err(|e| e.to_string())?
            .label(set.name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 16, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 12))
        .draw()
        .map_err(|e| e.to_string())?;
    area.present().map_err(|e| e.to_string())
}

fn outline(values: &[f64], [low, high]: [f64; 2]) -> Vec<(f64, f64)> {
    let mut counts = [0_usize; BINS];
    let finite = values.iter().filter(|value| value.is_finite());
    let mut total = 0_usize;
    for value in finite {
        let bin = ((value - low) / (high - low) * BINS as f64).clamp(0.0, BINS as f64 - 1.0);
        counts[bin as usize] += 1;
        total += 1;
    }
    let edge = |bin: usize| low + (high - low) * bin as f64 / BINS as f64;
    let percent = |count: usize| 100.0 * count as f64 / total.max(1) as f64;
    let steps = counts.iter().enumerate();
    steps.flat_map(|(bin, &count)| [(edge(bin), percent(count)), (edge(bin + 1), percent(count))]).collect()
}

/// Smallest and largest value with a little air, and never an empty span.
fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    match high - low {
        span if span > 0.0 => [low - 0.02 * span, high + 0.05 * span],
        _ if low.is_finite() => [low - 0.5, low + 0.5],
        _ => [0.0, 1.0],
    }
}
