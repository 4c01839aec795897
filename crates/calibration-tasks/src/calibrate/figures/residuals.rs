//! Residuals against what they should not depend on.

use report::{Axes, CATEGORIES, Canvas, Drawn, Figure, robust_span};
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};

/// Four figures stand in a row.
const SIZE: [f64; 2] = [280.0, 220.0];

/// Parts of the span in which means are taken, and values of which one is worth drawing.
const PARTS: usize = 24;
const FEWEST: f64 = 5.0;
/// Colour of densities below lines.
const DENSITY: [u8; 3] = [90, 100, 115];

/// What residuals are drawn against: name, label and value.
type Abscissa = (&'static str, &'static str, fn(&ObservationQuality) -> f64);

const ABSCISSAE: [Abscissa; 4] = [
    ("range", "range, m", |quality| quality.range_m),
    ("column", "column, px", |quality| quality.pixel[0]),
    ("row", "row, px", |quality| quality.pixel[1]),
    ("amplitude", "amplitude", |quality| quality.amplitude),
];

/// Range residuals and image residuals against range, column, row and amplitude: two rows of small figures.
pub(crate) fn figures(outcome: &CalibrationOutcome) -> Vec<(Figure, String)> {
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
) -> Option<(Figure, String)> {
    let sets: Vec<_> =
        sets.iter().map(|(name, colour, c)| (name, *colour, points(used, *c, abscissa, factor))).collect();
    let all = || sets.iter().flat_map(|(_, _, values)| values);
    all().next()?;
    let spans = [robust_span(all().map(|point| point.0)), robust_span(all().map(|point| point.1))];
    let mut canvas = Canvas::new(&Axes { title, x, y }, SIZE, spans[0], spans[1]);
    let mut drawn = Drawn::Dots;
    if Canvas::is_dense(SIZE, all().count()) {
        // Densities of several sets would hide each other: one of all, with a line of means for each.
        canvas.density(&all().copied().collect::<Vec<_>>(), DENSITY);
        drawn = Drawn::Density;
    }
    for (name, colour, values) in &sets {
        match drawn {
            Drawn::Dots => canvas.points(values, *colour, 0.45),
            Drawn::Density => canvas.line(&means(values, spans[0]), *colour, ""),
        }
        if sets.len() > 1 {
            canvas.name(*colour, name);
        }
    }
    let beyond =
        |(x, y): &&(f64, f64)| !(spans[0][0]..=spans[0][1]).contains(x) || !(spans[1][0]..=spans[1][1]).contains(y);
    let beyond = all().filter(beyond).count();
    let mut caption = if beyond > 0 { format!("{beyond} beyond the axes.") } else { String::new() };
    if drawn == Drawn::Density {
        caption += drawn.words();
        caption += " Lines: means.";
    }
    Some((canvas.finish(), caption))
}

/// Means of the values in parts of the span.
fn means(values: &[(f64, f64)], [low, high]: [f64; 2]) -> Vec<(f64, f64)> {
    let mut sums = [(0.0, 0.0, 0.0); PARTS];
    for (x, y) in values.iter().filter(|(x, _)| (low..high).contains(x)) {
        let part = &mut sums[(((x - low) / (high - low) * PARTS as f64) as usize).min(PARTS - 1)];
        *part = (part.0 + x, part.1 + y, part.2 + 1.0);
    }
    sums.iter().filter(|(.., count)| *count >= FEWEST).map(|(x, y, count)| (x / count, y / count)).collect()
}

fn points(
    used: &[&ObservationQuality],
    component: Component,
    abscissa: fn(&ObservationQuality) -> f64,
    factor: f64,
) -> Vec<(f64, f64)> {
    used.iter()
        .filter(|quality| quality.component == component)
        .map(|quality| (abscissa(quality), factor * quality.residual))
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect()
}
