//! Residuals against what they should not depend on.

use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};

use crate::report::chart::{Axes, Series, scatter};
use crate::report::colour::CATEGORIES;

/// Residuals drawn in one figure; of more, every so many.
const MOST_POINTS: usize = 5000;

/// What residuals are drawn against: label and value.
type Abscissa = (&'static str, fn(&ObservationQuality) -> f64);

const ABSCISSAE: [Abscissa; 4] = [
    ("range, m", |quality| quality.range_m),
    ("column, px", |quality| quality.pixel[0]),
    ("row, px", |quality| quality.pixel[1]),
    ("amplitude", |quality| quality.amplitude),
];

/// Range residuals and image residuals against range, column, row and amplitude.
pub(super) fn figures(outcome: &CalibrationOutcome) -> Vec<(String, String)> {
    let used: Vec<&ObservationQuality> =
        outcome.residuals.iter().filter(|q| matches!(q.verdict, Verdict::Used | Verdict::Uncontrolled)).collect();
    let mut figures = Vec::new();
    for (name, abscissa) in ABSCISSAE {
        let ranges = points(&used, &[Component::Range], abscissa, 1e3);
        if !ranges.is_empty() {
            let title = format!("Range residuals against {}", bare(name));
            let axes = Axes { title: &title, x: name, y: "mm" };
            figures.push((scatter(&axes, &[series("range", CATEGORIES[2], ranges)]), String::new()));
        }
    }
    for (name, abscissa) in ABSCISSAE {
        let col = points(&used, &[Component::Col], abscissa, 1.0);
        let row = points(&used, &[Component::Row], abscissa, 1.0);
        if !(col.is_empty() && row.is_empty()) {
            let title = format!("Image residuals against {}", bare(name));
            let axes = Axes { title: &title, x: name, y: "px" };
            let sets = [series("col", CATEGORIES[0], col), series("row", CATEGORIES[1], row)];
            figures.push((scatter(&axes, &sets), String::new()));
        }
    }
    figures
}

fn bare(label: &str) -> &str {
    label.split(',').next().unwrap_or(label)
}

fn series(name: &str, colour: [u8; 3], values: Vec<(f64, f64)>) -> Series<'_, (f64, f64)> {
    Series { name, colour, values }
}

fn points(
    used: &[&ObservationQuality],
    components: &[Component],
    abscissa: fn(&ObservationQuality) -> f64,
    factor: f64,
) -> Vec<(f64, f64)> {
    let all: Vec<(f64, f64)> = used
        .iter()
        .filter(|quality| components.contains(&quality.component))
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
