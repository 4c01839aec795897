//! Residuals against what they should not depend on.

use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};

use crate::report::canvas::{Axes, Canvas, robust_span};
use crate::report::colour::CATEGORIES;

/// Residuals drawn in one figure; of more, every so many.
const MOST_POINTS: usize = 5000;

/// Four figures stand in a row.
const SIZE: [f64; 2] = [280.0, 220.0];

/// What residuals are drawn against: name, label and value.
type Abscissa = (&'static str, &'static str, fn(&ObservationQuality) -> f64);

const ABSCISSAE: [Abscissa; 4] = [
    ("range", "range, m", |quality| quality.range_m),
    ("column", "column, px", |quality| quality.pixel[0]),
    ("row", "row, px", |quality| quality.pixel[1]),
    ("amplitude", "amplitude", |quality| quality.amplitude),
];

/// Range residuals and image residuals against range, column, row and amplitude: two rows of small figures.
pub(super) fn figures(outcome: &CalibrationOutcome) -> Vec<(String, String)> {
    let used: Vec<&ObservationQuality> =
        outcome.residuals.iter().filter(|q| matches!(q.verdict, Verdict::Used | Verdict::Uncontrolled)).collect();
    let range = [("range", CATEGORIES[2], Component::Range)];
    let image = [("col", CATEGORIES[0], Component::Col), ("row", CATEGORIES[1], Component::Row)];
    let mut figures = Vec::new();
    for (name, label, abscissa) in ABSCISSAE {
        figures.extend(figure(&format!("Range against {name}"), [label, "mm"], &used, &range, abscissa, 1e3));
    }
    for (name, label, abscissa) in ABSCISSAE {
        figures.extend(figure(&format!("Image against {name}"), [label, "px"], &used, &image, abscissa, 1.0));
    }
    figures
}

/// One figure; `None` where there is nothing to draw.
fn figure(
    title: &str,
    [x, y]: [&str; 2],
    used: &[&ObservationQuality],
    sets: &[(&str, [u8; 3], Component)],
    abscissa: fn(&ObservationQuality) -> f64,
    factor: f64,
) -> Option<(String, String)> {
    let sets: Vec<_> =
        sets.iter().map(|(name, colour, c)| (name, *colour, points(used, *c, abscissa, factor))).collect();
    let all = || sets.iter().flat_map(|(_, _, values)| values);
    all().next()?;
    let spans = [robust_span(all().map(|point| point.0)), robust_span(all().map(|point| point.1))];
    let mut canvas = Canvas::new(&Axes { title, x, y }, SIZE, spans[0], spans[1]);
    for (name, colour, values) in &sets {
        canvas.points(values, *colour, 0.45);
        if sets.len() > 1 {
            canvas.name(*colour, name);
        }
    }
    let beyond =
        |(x, y): &&(f64, f64)| !(spans[0][0]..=spans[0][1]).contains(x) || !(spans[1][0]..=spans[1][1]).contains(y);
    let beyond = all().filter(beyond).count();
    let caption = if beyond > 0 { format!("{beyond} beyond the axes.") } else { String::new() };
    Some((canvas.finish(), caption))
}

fn points(
    used: &[&ObservationQuality],
    component: Component,
    abscissa: fn(&ObservationQuality) -> f64,
    factor: f64,
) -> Vec<(f64, f64)> {
    let all: Vec<(f64, f64)> = used
        .iter()
        .filter(|quality| quality.component == component)
        .map(|quality| (abscissa(quality), factor * quality.residual))
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    thinned(all)
}

/// Every so many of a long list.
pub(super) fn thinned<T: Copy>(all: Vec<T>) -> Vec<T> {
    let step = all.len().div_ceil(MOST_POINTS).max(1);
    if step == 1 { all } else { all.into_iter().step_by(step).collect() }
}
