//! The page: sections in the order in which a calibration is judged.

use report::{Document, heat_map};
use self_calibration::CalibrationOutcome;

use crate::calibrate::document::{certificate_parts, tables};
use crate::calibrate::figures::{coverage, image_residuals, map, point_uncertainty, range_error, residuals};
use crate::calibrate::point_uncertainty::{PointUncertainty, amplitude_of};
use crate::calibrate::{CalibrationSummary, CorrelationSummary, FoundTable, is_notorious, notorious_pairs};
use pipeline::Result;
use pipeline::figures::pattern_figures;
use pipeline::trends::trends_of_calibration;

/// The whole page.
pub(crate) fn render_calibration(
    outcome: &CalibrationOutcome,
    table: Option<&FoundTable>,
    summary: &CalibrationSummary,
) -> Result<String> {
    let lead = format!(
        "Calibration of {} by the {} method ({}). Start values: {}.",
        summary.survey,
        summary.method.replace('-', " "),
        summary.describe,
        summary.start
    );
    let mut page = Document::new("rangecam: calibration", &lead);
    page.warnings(&summary.doubts);
    tables::figures_of_merit(&mut page, summary);
    tables::diagnosis(&mut page, &summary.diagnosis);
    tables::parameters(&mut page, outcome);
    if let Some(certificate) = &summary.certificate {
        page.section("Verdicts");
        certificate_parts::verdicts(&mut page, certificate);
        page.section("For what it holds");
        certificate_parts::span(&mut page, certificate);
    }
    range_errors(&mut page, outcome);
    if let Some(table) = table {
        page.section("The offset of each pixel");
        page.paragraph(&format!("Look-up table beside d0: {}.", table.summary.verdict));
        page.figures(pattern_figures(&table.pattern)?);
    }
    uncertainty(&mut page, outcome)?;
    if let Some(certificate) = &summary.certificate {
        certificate_parts::uncertainty(&mut page, certificate);
    }
    correlations(&mut page, &summary.correlation.names, &summary.correlation.matrix);
    residual_figures(&mut page, outcome);
    trends_of_calibration(&mut page, &summary.trends);
    network(&mut page, outcome);
    tables::groups(&mut page, summary);
    tables::rejected(&mut page, summary);
    tables::decisions(&mut page, outcome);
    if let Some(certificate) = &summary.certificate {
        page.section("Camera, conditions and files");
        certificate_parts::conditions(&mut page, certificate, summary);
        certificate_parts::inputs(&mut page, certificate);
    }
    Ok(page.html())
}

fn range_errors(page: &mut Document, outcome: &CalibrationOutcome) {
    let figures = range_error::figures(outcome);
    if !figures.is_empty() {
        page.section("Range error against range, before and after, and coverage of the range");
        page.figures(figures);
        page.figures(coverage::range_figure(outcome));
    }
}

fn uncertainty(page: &mut Document, outcome: &CalibrationOutcome) -> Result<()> {
    let source = PointUncertainty { camera: &outcome.camera, range_models: &outcome.range_models };
    let covariance = &outcome.first_order_covariance;
    let figures = point_uncertainty::figures(&source, &outcome.estimated, covariance, amplitude_of(outcome))?;
    if figures.is_empty() {
        return Ok(());
    }
    page.section("What the calibration's uncertainty means for a point");
    page.paragraph(
        "Standard deviation of a point's position in the camera's frame that comes from the calibration alone, by \
         propagation of the covariance of all estimated parameters (prior-scaled). It is common to all points of a \
         pixel and does not average out; the noise of the observation comes on top.",
    );
    page.figures(figures);
    Ok(())
}

/// Correlations with the notorious pairs.
pub(crate) fn correlations(page: &mut Document, names: &[String], matrix: &[Vec<f64>]) {
    if names.is_empty() {
        return;
    }
    page.section("Correlations");
    let caption =
        "Outlined: pairs that are known to be hard to separate. Numbers where the correlation is 0.5 or more.";
    page.figures([(
        heat_map("Correlations of the estimated parameters", names, matrix, is_notorious),
        caption.to_owned(),
    )]);
    let correlation = CorrelationSummary { names: names.to_vec(), matrix: matrix.to_vec() };
    certificate_parts::pairs(page, &notorious_pairs(&correlation));
}

fn residual_figures(page: &mut Document, outcome: &CalibrationOutcome) {
    page.section("Residuals, and coverage of the image");
    let mut figures = image_residuals::figures(outcome);
    figures.extend(coverage::image_figure(outcome));
    page.figures(figures);
    page.figures(residuals::figures(outcome));
}

fn network(page: &mut Document, outcome: &CalibrationOutcome) {
    if outcome.stations.is_empty() {
        return;
    }
    page.section("Network");
    page.figures(map::figures(&outcome.camera, &outcome.stations, &outcome.targets, &[]));
}
