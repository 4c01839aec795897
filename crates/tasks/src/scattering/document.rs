//! An estimation of scattering for people.

use std::fmt;

use pipeline::Result;
use report::{
    Axes, CATEGORIES, ColourMap, Column, Document, Figure, Merit, Scale, Series, curves, millimetres, raster_figure,
};
use statistics::quantile;

use crate::scattering::Shift;
use crate::scattering::summary::ScatteringSummary;

/// Stations whose pictures are shown.
const PICTURED_STATIONS: usize = 8;
/// Points of the curve of the point spread function.
const CURVE_POINTS: usize = 120;

/// A station, and how far the objects move its background: as observed, and restored.
pub(crate) type Pictured = (String, [Figure; 2]);

impl fmt::Display for ScatteringSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Vec::new()).fmt(f)
    }
}

/// All of it, with the pictures of its stations.
pub(crate) fn document(summary: &ScatteringSummary, pictures: Vec<Pictured>) -> Document {
    let lead = format!(
        "Internal scattering, estimated from {} captures of {} (with objects in the foreground) and {} (without). \
         Calibration: {}.",
        summary.captures.len(),
        summary.with_object,
        summary.without_object,
        summary.calibration
    );
    let mut document = Document::new("rangecam: internal scattering", lead);
    document.merits(merits(summary));
    parameters(&mut document, summary);
    moved(&mut document, pictures);
    captures(&mut document, summary);
    document.closing(format!(
        "took {:.1} s; written to {}: calibration.ron, summary.json, report.html",
        summary.seconds,
        summary.out.display()
    ));
    document
}

fn merits(summary: &ScatteringSummary) -> Vec<Merit> {
    let mut merits = vec![Merit::new(&summary.verdict, "verdict")];
    if let Some(share) = summary.scattered_share {
        merits.push(Merit::new(format!("{:.2} %", 100.0 * share), "of the light scattered"));
    }
    merits.push(Merit::new(millimetres(summary.shift_median_m), "median move of the background's ranges"));
    merits.push(Merit::new(millimetres(summary.shift_restored_median_m), "the same after restoration"));
    if let Some(sigma0) = summary.sigma0 {
        merits.push(Merit::new(format!("{sigma0:.2}"), "sigma0"));
        merits.push(Merit::new(summary.redundancy.to_string(), "redundancy"));
        merits.push(Merit::new(format!("{:.1} %", 100.0 * summary.outlier_share), "of the blocks outlying"));
    }
    if let Some(limit) = summary.detection_limit {
        merits.push(Merit::new(format!("{:.2} %", 100.0 * limit), "smallest weight that would have shown"));
    }
    merits
}

fn parameters(document: &mut Document, summary: &ScatteringSummary) {
    if summary.parameters.is_empty() {
        return;
    }
    document.section("The point spread function");
    document.explanation("A sum of Gaussians without the central impulse; weights are shares of a pixel's light.");
    let rows = summary.parameters.iter().zip(&summary.correlation).map(|(parameter, row)| {
        let mut cells = vec![
            parameter.name.clone(),
            format!("{:.5}", parameter.value),
            format!("{:.5}", parameter.sigma),
            parameter.unit.to_owned(),
        ];
        cells.extend(row.iter().map(|value| format!("{value:.2}")));
        cells
    });
    let mut columns =
        vec![Column::words("parameter"), Column::number("value"), Column::number("sigma"), Column::words("unit")];
    columns.extend(summary.parameters.iter().map(|parameter| Column::number(&parameter.name)));
    document.table(columns, rows.collect());
    document.paragraph("The columns behind the unit are correlations.");
    document.figures([profile(summary).caption("Light beside a single bright pixel, on a row, in parts of its own.")]);
    let tried = summary.candidates.iter().map(|candidate| {
        let criterion = candidate.bic.map_or_else(|| "-".to_owned(), |bic| format!("{bic:.1}"));
        vec![candidate.terms.to_string(), criterion, candidate.refused.clone().unwrap_or_default()]
    });
    document.subsection("Numbers of Gaussians tried");
    let columns =
        [Column::number("Gaussians"), Column::number("Schwarz's criterion"), Column::words("not taken because")];
    document.table(columns, tried.collect());
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

/// Pictures of the first stations.
pub(crate) fn pictures(shifts: &[Shift]) -> Result<Vec<Pictured>> {
    let pictured = |shift: &Shift| {
        let mut sizes: Vec<f64> = shift.observed_mm.iter().map(|value| value.abs()).collect();
        let wide = quantile(&mut sizes, 0.95);
        let high = if wide.is_finite() { wide.max(1.0) } else { 1.0 };
        let scale = Scale { map: ColourMap::Diverging, low: -high, high, unit: "mm" };
        let observed = raster_figure("As observed", shift.width, &shift.observed_mm, &scale)?;
        let restored = raster_figure("Restored", shift.width, &shift.restored_mm, &scale)?;
        Ok((shift.station.clone(), [observed, restored]))
    };
    shifts.iter().take(PICTURED_STATIONS).map(pictured).collect()
}

fn moved(document: &mut Document, pictures: Vec<Pictured>) {
    if pictures.is_empty() {
        return;
    }
    document.section("How far the objects move the background");
    document.explanation(
        "Ranges with the object less those without it. Grey: the object and its rim, and pixels with too little light.",
    );
    for (station, figures) in pictures {
        document.subsection(format!("Station {station}"));
        document.figures(figures);
    }
}

fn captures(document: &mut Document, summary: &ScatteringSummary) {
    document.section("The captures");
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
    let millimetres = |metres: Option<f64>| number(metres.map(|metres| 1e3 * metres));
    let rows = summary.captures.iter().map(|capture| {
        vec![
            capture.station.clone(),
            capture.frequency.to_string(),
            capture.object_pixels.to_string(),
            capture.blocks.to_string(),
            capture.rejected_blocks.to_string(),
            number(capture.rms_before),
            number(capture.rms_after),
            number(capture.rms_held_out),
            millimetres(capture.shift_median_m),
            millimetres(capture.shift_restored_median_m),
            capture.unused.clone().unwrap_or_default(),
        ]
    });
    let columns = [
        Column::words("station"),
        Column::number("frequency"),
        Column::number("object").unit("px"),
        Column::number("blocks"),
        Column::number("given up"),
        Column::number("rms"),
        Column::number("rms left"),
        Column::number("left by the others' model"),
        Column::number("ranges moved").unit("mm"),
        Column::number("restored").unit("mm"),
        Column::words("not used because"),
    ];
    document.table(columns, rows.collect());
}
