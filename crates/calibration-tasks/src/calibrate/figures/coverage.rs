//! Which parts of the image and of the range were observed.

use std::fmt::Write;

use report::{Axes, CATEGORIES, Canvas, ColourMap, Figure, hex, open_svg, span};
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};

const WIDTH: f64 = 560.0;
/// Cells along the longer side of the image.
const CELLS: usize = 8;
const RANGE_BINS: usize = 60;

fn used(outcome: &CalibrationOutcome) -> Vec<&ObservationQuality> {
    outcome.residuals.iter().filter(|q| matches!(q.verdict, Verdict::Used | Verdict::Uncontrolled)).collect()
}

/// Sightings with an image point or a range, counted once.
fn is_sighting(quality: &ObservationQuality, has_columns: bool) -> bool {
    quality.component == if has_columns { Component::Col } else { Component::Range }
}

/// Targets over the image.
pub(crate) fn image_figure(outcome: &CalibrationOutcome) -> Option<(Figure, String)> {
    let used = used(outcome);
    let format = outcome.camera.format;
    let scale = WIDTH / format.width as f64;
    let height = scale * format.height as f64;
    let (columns, rows) = cells(format.width, format.height);
    let (wide, tall) = (WIDTH / columns as f64, height / rows as f64);
    let has_columns = used.iter().any(|quality| quality.component == Component::Col);
    let points: Vec<[f64; 2]> =
        used.iter().filter(|quality| is_sighting(quality, has_columns)).map(|quality| quality.pixel).collect();
    let mut counts = vec![0_usize; columns * rows];
    for [col, row] in points.iter().filter(|pixel| pixel.iter().all(|p| p.is_finite())) {
        let cell = |pixel: f64, size: f64, count: usize| ((scale * (pixel + 0.5) / size) as usize).min(count - 1);
        counts[cell(*row, tall, rows) * columns + cell(*col, wide, columns)] += 1;
    }
    let mut svg = open_svg("Targets over the image", WIDTH, height + 26.0);
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    for (index, count) in counts.iter().enumerate() {
        let (x, y) = (wide * (index % columns) as f64, 22.0 + tall * (index / columns) as f64);
        // The lighter half of the map, so that dots and numbers stay readable.
        let fill = match count {
            0 => "#ffffff".to_owned(),
            count => hex(ColourMap::Sequential.colour(0.45 + 0.5 * (*count as f64 / most))),
        };
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r##"<rect x="{x:.1}" y="{y:.1}" width="{wide:.1}" height="{tall:.1}" fill="{fill}" fill-opacity="0.55" stroke="#d5dae1"/><text x="{:.1}" y="{:.1}" class="tick">{count}</text>"##,
            x + 3.0,
            y + 11.0
        );
    }
    let mut dots = String::new();
    let shown = if Canvas::is_dense([WIDTH, height], points.len()) { &[][..] } else { &points[..] };
    for [col, row] in shown {
        let _ = write!(dots, "M{:.1} {:.1}h0", scale * (col + 0.5), 22.0 + scale * (row + 0.5));
    }
    let _ = write!(
        svg,
        r##"<path d="{dots}" stroke="#1c2430" stroke-opacity="0.55" stroke-width="2" stroke-linecap="round" fill="none"/></svg>"##
    );
    let nothing_seen = counts.iter().all(|count| *count == 0);
    let empty = counts.iter().filter(|count| **count == 0).count();
    let caption = format!(
        "Targets in each of {} cells; {empty} cells are empty. Lens terms are extrapolated where there is no target.",
        counts.len()
    );
    (!nothing_seen).then_some((Figure::new(svg), caption))
}

/// Cells, about square, along both sides of the image.
fn cells(width: usize, height: usize) -> (usize, usize) {
    let longer = width.max(height).max(1);
    let along = |side: usize| ((CELLS as f64 * side as f64 / longer as f64).round() as usize).max(1);
    (along(width), along(height))
}

/// Histogram of the ranges; empty where there are none.
pub(crate) fn range_figure(outcome: &CalibrationOutcome) -> Vec<(Figure, String)> {
    let used = used(outcome);
    let ranges: Vec<f64> =
        used.iter().filter(|q| q.component == Component::Range).map(|q| q.range_m).filter(|r| r.is_finite()).collect();
    if ranges.is_empty() {
        return Vec::new();
    }
    let interval = outcome.range_models.first().map(|(_, model)| model.ambiguity_interval_m);
    let [_, high] = span(ranges.iter().copied());
    let x = [0.0, interval.map_or(high, |interval| interval.max(high))];
    let width = x[1] / RANGE_BINS as f64;
    let mut counts = [0_usize; RANGE_BINS];
    for range_m in &ranges {
        counts[((range_m / width) as usize).min(RANGE_BINS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0) as f64;
    let axes = Axes { title: "Ranges observed", x: "observed range, m", y: "ranges" };
    let mut canvas = Canvas::new(&axes, [1206.0, 220.0], x, [0.0, 1.1 * most]);
    let bar = |(bin, count): (usize, &usize)| (bin as f64 * width, (bin + 1) as f64 * width, *count as f64);
    canvas.bars(&counts.iter().enumerate().map(bar).collect::<Vec<_>>(), CATEGORIES[0]);
    let (low, high) = ranges.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), r| (l.min(*r), h.max(*r)));
    let share = interval.map_or_else(String::new, |interval| {
        format!(
            ", {:.0} % of the ambiguity interval of {interval:.3} m. The longest periodic term has that wavelength: \
             where ranges cover little of it, it can't be told from the offset",
            100.0 * (high - low) / interval
        )
    });
    vec![(canvas.finish(), format!("{low:.3} m to {high:.3} m{share}."))]
}
