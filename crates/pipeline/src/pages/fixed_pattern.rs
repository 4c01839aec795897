//! The report of an estimation of a fixed pattern.

use error_models::FixedPattern;
use report::{Axes, CATEGORIES, ColourMap, Document, Figure, Scale, Series, histogram, raster_figure};
use sensor_noise::PatternEstimate;

use crate::Result;
use crate::fixed_pattern::FixedPatternSummary;
use crate::statistics::quantile;
use crate::summary::millimetres;

/// The whole page.
pub(crate) fn render_fixed_pattern(summary: &FixedPatternSummary, estimate: &PatternEstimate) -> Result<String> {
    let lead = format!(
        "Range offsets of single pixels, estimated from the walls of {}. Calibration applied before: {}.",
        summary.survey, summary.calibration
    );
    let mut page = Document::new("rangecam: fixed pattern", &lead);
    page.merits([
        (summary.verdict.clone(), "verdict".to_owned()),
        (millimetres(Some(summary.offset_rms_m)), "offsets, rms".to_owned()),
        (millimetres(Some(summary.deviation_rms_m)), "their standard deviation".to_owned()),
        (millimetres(Some(summary.rms_without_m)), format!("held-out {}, rms without", summary.held_out)),
        (millimetres(Some(summary.rms_with_m)), "with the others' pattern".to_owned()),
    ]);
    page.section("The offsets");
    page.figures(pattern_figures(&estimate.pattern)?);
    test(&mut page, summary);
    walls(&mut page, summary);
    Ok(page.html())
}

/// Offsets, standard deviations and a histogram.
pub(super) fn pattern_figures(pattern: &FixedPattern) -> Result<Vec<(Figure, String)>> {
    let known = |index: usize| pattern.sigma_m[index].is_finite();
    let plane = |values: &[f32]| -> Vec<f64> {
        let value = |(index, value): (usize, &f32)| if known(index) { 1e3 * f64::from(*value) } else { f64::NAN };
        values.iter().enumerate().map(value).collect()
    };
    let [offsets, deviations] = [plane(&pattern.offset_m), plane(&pattern.sigma_m)];
    let most = |values: &[f64]| {
        let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
        let wide = quantile(&mut sizes, 0.98);
        if wide > 0.0 { wide } else { 1.0 }
    };
    let high = most(&offsets);
    let signed = Scale { map: ColourMap::Diverging, low: -high, high, unit: "mm" };
    let positive = Scale { map: ColourMap::Sequential, low: 0.0, high: most(&deviations), unit: "mm" };
    let axes = Axes { title: "Offsets", x: "offset, mm", y: "percent of the pixels" };
    let set = Series { name: "pixels", colour: CATEGORIES[0], values: offsets.clone() };
    Ok(vec![
        (raster_figure("Offset", pattern.width, &offsets, &signed)?, "Grey: no wall shows the pixel.".to_owned()),
        (raster_figure("Standard deviation", pattern.width, &deviations, &positive)?, String::new()),
        (histogram(&axes, [-high, high], &[set]), String::new()),
    ])
}

fn test(page: &mut Document, summary: &FixedPatternSummary) {
    page.section("Does it raise the precision?");
    page.paragraph(&format!(
        "The {} were held out in turn and freed of the pattern of the others. {}.",
        summary.held_out, summary.verdict
    ));
    let row = |name: &str, without: f64, with: f64| {
        vec![name.to_owned(), millimetres(Some(without)), millimetres(Some(with))]
    };
    page.table(
        ["held-out residuals, rms", "without", "with"],
        vec![
            row("mean of a wall's frames", summary.rms_without_m, summary.rms_with_m),
            row("single frames", summary.frame_rms_without_m, summary.frame_rms_with_m),
        ],
    );
    if let (Some(statistic), Some(probability)) = (summary.statistic, summary.probability) {
        page.paragraph(&format!(
            "Fall of the squares over {} blocks of pixels: t = {statistic:.2}, by chance with probability {probability:.1e}.",
            summary.blocks
        ));
    }
}

fn walls(page: &mut Document, summary: &FixedPatternSummary) {
    page.section("The walls");
    let rows: Vec<Vec<String>> = summary
        .walls
        .iter()
        .map(|wall| {
            vec![
                wall.station.clone(),
                wall.pixels.to_string(),
                format!("{:.1} %", 100.0 * wall.outlier_share),
                millimetres(Some(wall.residual_rms_m)),
                format!("{:.2}", wall.sigma0),
                format!("{:.2}", wall.systematic_sigmas),
            ]
        })
        .collect();
    page.table(["station", "pixels", "elsewhere", "residuals, rms", "sigma0", "shared by neighbours, sigmas"], rows);
}
