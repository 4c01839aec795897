//! Residual arrows over the image.

use std::collections::BTreeMap;
use std::fmt::Write;

use camera_model::ImageFormat;
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};

use crate::report::colour::{CATEGORIES, hex};
use crate::report::picture::open_svg;
use crate::statistics::quantile;

const WIDTH: f64 = 560.0;
/// Length of the arrow at the 90 % quantile, in pixels of the figure.
const TYPICAL_ARROW: f64 = 22.0;

/// An image point with the residuals of its column and row, pixel.
struct Arrow {
    pixel: [f64; 2],
    residual: [f64; 2],
    rejected: bool,
}

pub(super) fn figures(outcome: &CalibrationOutcome) -> Vec<(String, String)> {
    let arrows = arrows(&outcome.residuals);
    let mut lengths: Vec<f64> =
        arrows.iter().filter(|arrow| !arrow.rejected).map(|arrow| arrow.residual[0].hypot(arrow.residual[1])).collect();
    let typical = quantile(&mut lengths, 0.9);
    if typical.is_nan() || typical <= 0.0 {
        return Vec::new();
    }
    let format = outcome.camera.format;
    let scale = WIDTH / format.width as f64;
    let exaggeration = round_factor(TYPICAL_ARROW / (typical * scale));
    let caption = format!(
        "Residuals of the image points, {exaggeration} times exaggerated against the image; dots are the observed \
         points, red those rejected. 90 % of the arrows are shorter than {typical:.3} px. A pattern (all outwards, all \
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

fn picture(arrows: &[Arrow], format: &ImageFormat, scale: f64, exaggeration: f64) -> String {
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
    svg
}

/// The next smaller of 1, 2, 5, 10, ...
pub(super) fn round_factor(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let factor = [5.0, 2.0, 1.0].into_iter().find(|factor| factor * power <= value).unwrap_or(1.0);
    let rounded = factor * power;
    // Powers below one carry rounding; whole numbers above need none.
    if rounded >= 1.0 { rounded.round() } else { rounded }
}
