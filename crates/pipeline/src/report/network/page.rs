//! The page: sections in the order in which a calibration is judged.

use self_calibration::CalibrationOutcome;

use super::point_uncertainty::{self, PointUncertainty};
use super::{coverage, heat_map, image_residuals, map, range_error, residuals, tables};
use crate::Result;
use crate::calibrate::{CalibrationSummary, FoundTable};
use crate::report::fixed_pattern::pattern_figures;
use crate::report::page::Page;
use crate::report::trends::trends_of_calibration;

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
    let mut page = Page::new("rangecam: calibration", &lead);
    page.doubts(&summary.doubts);
    tables::figures_of_merit(&mut page, summary);
    tables::diagnosis(&mut page, &summary.diagnosis);
    tables::parameters(&mut page, outcome);
    range_errors(&mut page, outcome);
    if let Some(table) = table {
        page.section("The offset of each pixel");
        page.paragraph(&format!("Look-up table beside d0: {}.", table.summary.verdict));
        page.figures(&pattern_figures(&table.pattern)?);
    }
    uncertainty(&mut page, outcome)?;
    correlations(&mut page, &summary.correlation.names, &summary.correlation.matrix);
    residual_figures(&mut page, outcome);
    trends_of_calibration(&mut page, &summary.trends);
    network(&mut page, outcome);
    tables::groups(&mut page, summary);
    tables::rejected(&mut page, summary);
    tables::decisions(&mut page, outcome);
    Ok(page.finish())
}

fn range_errors(page: &mut Page, outcome: &CalibrationOutcome) {
    let figures = range_error::figures(outcome);
    if !figures.is_empty() {
        page.section("Range error against range, before and after, and coverage of the range");
        page.figures(&figures);
        page.figures(&coverage::range_figure(outcome));
    }
}

fn uncertainty(page: &mut Page, outcome: &CalibrationOutcome) -> Result<()> {
    let source = PointUncertainty { camera: &outcome.camera, range_models: &outcome.range_models };
    let figures = source.figures(
        &outcome.estimated,
        &outcome.first_order_covariance,
        point_uncertainty::amplitude_of(outcome),
    )?;
    if figures.is_empty() {
        return Ok(());
    }
    page.section("What the calibration's uncertainty means for a point");
    page.paragraph(
        "Standard deviation of a point's position in the camera's frame that comes from the calibration alone, by \
         propagation of the covariance of all estimated parameters (prior-scaled). It is common to all points of a \
         pixel and does not average out; the noise of the observation comes on top.",
    );
    page.figures(&figures);
    Ok(())
}

/// Correlations with the notorious pairs.
pub(super) fn correlations(page: &mut Page, names: &[String], matrix: &[Vec<f64>]) {
    if names.is_empty() {
        return;
    }
    page.section("Correlations");
    let caption =
        "Outlined: pairs that are known to be hard to separate. Numbers where the correlation is 0.5 or more.";
    page.figures(&[(heat_map::heat_map(names, matrix), caption.to_owned())]);
    let pairs = heat_map::notorious_pairs(names, matrix);
    if !pairs.is_empty() {
        page.table(&["notorious pair", "correlation", "what separates it"], &pairs);
    }
}

fn residual_figures(page: &mut Page, outcome: &CalibrationOutcome) {
    page.section("Residuals, and coverage of the image");
    let mut figures = image_residuals::figures(outcome);
    figures.extend(coverage::image_figure(outcome));
    page.figures(&figures);
    page.figures(&residuals::figures(outcome));
}

fn network(page: &mut Page, outcome: &CalibrationOutcome) {
    if outcome.stations.is_empty() {
        return;
    }
    page.section("Network");
    page.figures(&map::figures(&outcome.camera, &outcome.stations, &outcome.targets, &[]));
}
