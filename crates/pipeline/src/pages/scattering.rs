//! The report of an estimation of scattering.

use crate::Result;
use crate::scattering::{ScatteringSummary, Shift};
use crate::statistics::quantile;
use crate::summary::millimetres;
use report::{Axes, CATEGORIES, ColourMap, Document, Figure, Scale, Series, curves, raster_figure};

/// Stations whose pictures are shown.
const PICTURED_STATIONS: usize = 8;
/// Points of the curve of the point spread function.
const CURVE_POINTS: usize = 120;

/// The whole page.
pub(crate) fn render_scattering(summary: &ScatteringSummary, shifts: &[Shift]) -> Result<String> {
    let lead = format!(
        "Internal scattering, estimated from {} (with objects in the foreground) and {} (without). Calibration: {}.",
        summary.with_object, summary.without_object, summary.calibration
    );
    let mut page = Document::new("rangecam: internal scattering", &lead);
    cards(&mut page, summary);
    parameters(&mut page, summary);
    pictures(&mut page, shifts)?;
    captures(&mut page, summary);
    Ok(page.html())
}

fn cards(page: &mut Document, summary: &ScatteringSummary) {
    let mut cards = vec![(summary.verdict.clone(), "verdict".to_owned())];
    if let Some(share) = summary.scattered_share {
        cards.push((format!("{:.2} %", 100.0 * share), "of the light scattered".to_owned()));
    }
    cards.push((millimetres(summary.shift_median_m), "median move of the background's ranges".to_owned()));
    cards.push((millimetres(summary.shift_restored_median_m), "the same after restoration".to_owned()));
    if let Some(sigma0) = summary.sigma0 {
        cards.push((format!("{sigma0:.2}"), "sigma0".to_owned()));
    }
    page.merits(cards);
}

fn parameters(page: &mut Document, summary: &ScatteringSummary) {
    if summary.parameters.is_empty() {
        return;
    }
    page.section("The point spread function");
    page.paragraph("A sum of Gaussians without the central impulse; weights are shares of a pixel's light.");
    let rows: Vec<Vec<String>> = summary
        .parameters
        .iter()
        .zip(&summary.correlation)
        .map(|(parameter, row)| {
            let mut cells = vec![
                parameter.name.clone(),
                format!("{:.5}", parameter.value),
                format!("{:.5}", parameter.sigma),
                parameter.unit.to_owned(),
            ];
            cells.extend(row.iter().map(|value| format!("{value:.2}")));
            cells
        })
        .collect();
    let mut head = vec!["parameter", "value", "sigma", "unit"];
    head.extend(summary.parameters.iter().map(|parameter| parameter.name.as_str()));
    page.table(head, rows);
    page.paragraph("The columns behind the unit are correlations.");
    page.figures([(profile(summary), "Light beside a single bright pixel, on a row, in parts of its own.".to_owned())]);
    let tried: Vec<Vec<String>> = summary
        .candidates
        .iter()
        .map(|candidate| {
            let criterion = candidate.bic.map_or_else(|| "-".to_owned(), |bic| format!("{bic:.1}"));
            vec![candidate.terms.to_string(), criterion, candidate.refused.clone().unwrap_or_default()]
        })
        .collect();
    page.subsection("Numbers of Gaussians tried");
    page.table(["Gaussians", "Schwarz's criterion", "not taken because"], tried);
}

/// Decadic logarithm of the point spread function along a row.
fn profile(summary: &ScatteringSummary) -> Figure {
    let value =
        |name: &str| summary.parameters.iter().find(|parameter| parameter.name == name).map(|found| found.value);
    let terms: Vec<(f64, [f64; 2])> = (1..)
        .map_while(|term| {
            let weight = value(&format!("weight {term}"))?;
            let round = value(&format!("sigma_px {term}"));
            let across = round.or_else(|| value(&format!("sigma_px across {term}")))?;
            let down = round.or_else(|| value(&format!("sigma_px down {term}")))?;
            Some((weight, [across, down]))
        })
        .collect();
    let widest = terms.iter().map(|term| term.1[0]).fold(1.0, f64::max);
    let points: Vec<(f64, f64)> = (0..CURVE_POINTS)
        .map(|index| {
            let offset = 3.0 * widest * index as f64 / (CURVE_POINTS - 1) as f64;
            let gaussian = |(weight, [across, down]): &(f64, [f64; 2])| {
                weight * (-0.5 * (offset / across).powi(2)).exp() / (std::f64::consts::TAU * across * down)
            };
            (offset, terms.iter().map(gaussian).sum::<f64>().log10())
        })
        .collect();
    let axes = Axes { title: "Point spread function", x: "distance, pixels", y: "log10 of the share" };
    curves(&axes, &[Series { name: "scattered share", colour: CATEGORIES[0], values: points }])
}

fn pictures(page: &mut Document, shifts: &[Shift]) -> Result<()> {
    if shifts.is_empty() {
        return Ok(());
    }
    page.section("How far the objects move the background");
    page.paragraph(
        "Ranges with the object less those without it. Grey: the object and its rim, and pixels with too little light.",
    );
    for shift in shifts.iter().take(PICTURED_STATIONS) {
        page.subsection(&format!("Station {}", shift.station));
        let mut sizes: Vec<f64> = shift.observed_mm.iter().map(|value| value.abs()).collect();
        let wide = quantile(&mut sizes, 0.95);
        let high = if wide.is_finite() { wide.max(1.0) } else { 1.0 };
        let scale = Scale { map: ColourMap::Diverging, low: -high, high, unit: "mm" };
        let observed = raster_figure("As observed", shift.width, &shift.observed_mm, &scale)?;
        let restored = raster_figure("Restored", shift.width, &shift.restored_mm, &scale)?;
        page.figures([(observed, String::new()), (restored, String::new())]);
    }
    Ok(())
}

fn captures(page: &mut Document, summary: &ScatteringSummary) {
    page.section("The captures");
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
    let rows: Vec<Vec<String>> = summary
        .captures
        .iter()
        .map(|capture| {
            vec![
                capture.station.clone(),
                capture.frequency.to_string(),
                capture.object_pixels.to_string(),
                format!("{} ({} given up)", capture.blocks, capture.rejected_blocks),
                number(capture.rms_before),
                number(capture.rms_after),
                number(capture.rms_held_out),
                millimetres(capture.shift_median_m),
                millimetres(capture.shift_restored_median_m),
                capture.unused.clone().unwrap_or_default(),
            ]
        })
        .collect();
    let head = [
        "station",
        "frequency",
        "object, pixels",
        "blocks",
        "rms",
        "rms left",
        "rms left by the others' model",
        "ranges moved",
        "restored",
        "not used because",
    ];
    page.table(head, rows);
}
