//! Charts: histograms and curves.

use super::Figure;
use super::canvas::{Axes, Canvas, span};

/// A named set of values or points in one colour.
#[derive(Debug, Clone)]
pub struct Series<'a, T> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its colour, RGB.
    pub colour: [u8; 3],
    /// What is drawn.
    pub values: Vec<T>,
}

/// Width and height of a chart, pixels.
pub const SIZE: [f64; 2] = [460.0, 300.0];
const BINS: usize = 60;

/// Histograms over a common span, as outlines so that one does not hide the other; in percent of each set.
///
/// Values outside `span` are counted in the first or last bin, so nothing vanishes.
pub fn histogram(axes: &Axes<'_>, span: [f64; 2], sets: &[Series<'_, f64>]) -> Figure {
    let outlines: Vec<_> = sets
        .iter()
        .map(|set| Series { name: set.name, colour: set.colour, values: outline(&set.values, span) })
        .collect();
    curves(axes, &outlines)
}

/// Curves through points.
pub fn curves(axes: &Axes<'_>, sets: &[Series<'_, (f64, f64)>]) -> Figure {
    let mut canvas = canvas_around(axes, sets);
    for set in sets {
        canvas.line(&set.values, set.colour, "");
        canvas.name(set.colour, set.name);
    }
    canvas.finish()
}

/// Spans widened so that a metre is as long in both directions of a chart.
pub fn to_scale(x: [f64; 2], y: [f64; 2]) -> ([f64; 2], [f64; 2]) {
    let plotted = Canvas::plotted(SIZE);
    let extent = |[low, high]: [f64; 2]| high - low;
    let metres_per_pixel = (extent(x) / plotted[0]).max(extent(y) / plotted[1]);
    let widened = |span: [f64; 2], pixels: f64| {
        let (middle, half) = (f64::midpoint(span[0], span[1]), 0.5 * metres_per_pixel * pixels);
        [middle - half, middle + half]
    };
    (widened(x, plotted[0]), widened(y, plotted[1]))
}

fn canvas_around(axes: &Axes<'_>, sets: &[Series<'_, (f64, f64)>]) -> Canvas {
    let all = || sets.iter().flat_map(|set| set.values.iter());
    Canvas::new(axes, SIZE, span(all().map(|point| point.0)), span(all().map(|point| point.1)))
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
