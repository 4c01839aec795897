//! Residual arrows over the image.

use std::collections::BTreeMap;
use std::fmt::Write;

use camera_model::ImageFormat;
use report::{CATEGORIES, Figure, hex, open_svg};
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};
use statistics::quantile;

const WIDTH: f64 = 560.0;
/// Length of the arrow at the 90 % quantile, in pixels of the figure.
const TYPICAL_ARROW: f64 = 22.0;

/// Arrows that can be told from each other; of more, the means of cells are drawn.
const MOST_ARROWS: usize = 1_500;
/// Cells along the longer side of the image, and points from which on a mean is worth drawing.
const CELLS: usize = 32;
const FEWEST: usize = 5;

/// An image point with the residuals of its column and row, pixel.
struct Arrow {
    pixel: [f64; 2],
    residual: [f64; 2],
    rejected: bool,
}

pub(crate) fn figures(outcome: &CalibrationOutcome) -> Vec<(Figure, String)> {
    let all = arrows(&outcome.residuals);
    let format = outcome.camera.format;
    let means = all.len() > MOST_ARROWS;
    let arrows = if means { cell_means(&all, &format) } else { all };
    let mut lengths: Vec<f64> =
        arrows.iter().filter(|arrow| !arrow.rejected).map(|arrow| arrow.residual[0].hypot(arrow.residual[1])).collect();
    let typical = quantile(&mut lengths, 0.9);
    if typical.is_nan() || typical <= 0.0 {
        return Vec::new();
    }
    let scale = WIDTH / format.width as f64;
    let exaggeration = round_factor(TYPICAL_ARROW / (typical * scale));
    let what = if means {
        format!(
            "Mean residuals of the image points in each of {CELLS} cells along the longer side that has {FEWEST} points or \
             more, {exaggeration} times exaggerated against the image; red dots are points rejected, at most {MOST_ARROWS}."
        )
    } else {
        format!(
            "Residuals of the image points, {exaggeration} times exaggerated against the image; dots are the observed \
             points, red those rejected."
        )
    };
    let caption = format!(
        "{what} 90 % of the arrows are shorter than {typical:.3} px. A pattern (all outwards, all \
         one way) is a lens term that is missing."
    );
    vec![(picture(&arrows, &format, scale, exaggeration), caption)]
}

/// Pairs the column's and the row's residuals of each sighting.
fn arrows(residuals: &[ObservationQuality]) -> Vec<Arrow> {
    let mut pairs: BTreeMap<(&str, &str), Arrow> = BTreeMap::new();
    for quality in residuals {
        let axis = match quality.component {
            Component::Col => 0,
            Component::Row => 1,
            _ => continue,
        };
        if !quality.residual.is_finite() || quality.verdict == Verdict::LeftOut {
            continue;
        }
        let pair = pairs.entry((&quality.station, &quality.target)).or_insert(Arrow {
            pixel: quality.pixel,
            residual: [0.0; 2],
            rejected: false,
        });
        pair.residual[axis] = quality.residual;
        pair.rejected |= quality.verdict == Verdict::Rejected;
    }
    pairs.into_values().filter(|arrow| arrow.pixel.iter().all(|p| p.is_finite())).collect()
}

/// The mean of the arrows in each cell, from its middle, and some of those rejected as they are.
fn cell_means(arrows: &[Arrow], format: &ImageFormat) -> Vec<Arrow> {
    let side = format.width.max(format.height).max(1) as f64 / CELLS as f64;
    let cell = |pixel: f64| ((pixel + 0.5) / side).floor() as i64;
    let mut cells: BTreeMap<(i64, i64), (usize, [f64; 2])> = BTreeMap::new();
    for arrow in arrows.iter().filter(|arrow| !arrow.rejected) {
        let (count, sum) = cells.entry((cell(arrow.pixel[1]), cell(arrow.pixel[0]))).or_default();
        *count += 1;
        *sum = [sum[0] + arrow.residual[0], sum[1] + arrow.residual[1]];
    }
    let mean = |((row, col), (count, sum)): ((i64, i64), (usize, [f64; 2]))| Arrow {
        pixel: [col, row].map(|place| side * (place as f64 + 0.5) - 0.5),
        residual: sum.map(|sum| sum / count as f64),
        rejected: false,
    };
    let means = cells.into_iter().filter(|(_, (count, _))| *count >= FEWEST).map(mean);
    let rejected = arrows.iter().filter(|arrow| arrow.rejected).take(MOST_ARROWS);
    means.chain(rejected.map(|arrow| Arrow { ..*arrow })).collect()
}

fn picture(arrows: &[Arrow], format: &ImageFormat, scale: f64, exaggeration: f64) -> Figure {
    let height = scale * format.height as f64;
    let mut svg = open_svg("Image residuals", WIDTH, height + 26.0);
    // Writing to a string can't fail.
    let _ = write!(
        svg,
        r##"<defs><marker id="head" viewBox="0 0 6 6" refX="5" refY="3" markerWidth="5" markerHeight="5" orient="auto"><path d="M0 0L6 3L0 6z" fill="#33506e"/></marker></defs><clipPath id="frame"><rect x="0" y="22" width="{WIDTH}" height="{height:.1}"/></clipPath><rect x="0.5" y="22" width="{}" height="{height:.1}" fill="#fbfcfd" stroke="#c5ccd6"/>"##,
        WIDTH - 1.0
    );
    let (mut lines, mut used, mut gross) = (String::new(), String::new(), String::new());
    for arrow in arrows {
        // A pixel's centre has whole coordinates, its left edge is half a pixel before.
        let [x, y] = arrow.pixel.map(|p| scale * (p + 0.5));
        let y = y + 22.0;
        let dots = if arrow.rejected { &mut gross } else { &mut used };
        let _ = write!(dots, "M{x:.1} {y:.1}h0");
        if !arrow.rejected {
            let [dx, dy] = arrow.residual.map(|v| v * scale * exaggeration);
            let _ = write!(lines, r#"<path d="M{x:.1} {y:.1}l{dx:.1} {dy:.1}" marker-end="url(#head)"/>"#);
        }
    }
    let _ = write!(
        svg,
        r##"<g clip-path="url(#frame)" stroke="#33506e" stroke-width="0.9" stroke-opacity="0.75" fill="none">{lines}</g>"##
    );
    for (dots, colour, width) in [(used, CATEGORIES[0], 2.2), (gross, CATEGORIES[3], 6.0)] {
        let _ = write!(
            svg,
            r#"<path d="{dots}" stroke="{}" stroke-width="{width}" stroke-linecap="round" fill="none"/>"#,
            hex(colour)
        );
    }
    svg.push_str("</svg>");
    Figure::new(svg)
}

/// The next smaller of 1, 2, 5, 10, ...
pub(crate) fn round_factor(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let factor = [5.0, 2.0, 1.0].into_iter().find(|factor| factor * power <= value).unwrap_or(1.0);
    let rounded = factor * power;
    // Powers below one carry rounding; whole numbers above need none.
    if rounded >= 1.0 { rounded.round() } else { rounded }
}
