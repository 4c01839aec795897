//! A calibration for people: sections in the order in which it is judged.

use std::fmt;

use pipeline::trends::trends_of_calibration;
use report::{Document, heat_map};

use crate::calibrate::document::figures::Figures;
use crate::calibrate::document::{certificate_parts, tables};
use crate::calibrate::results::certificate::HeldOut;
use crate::calibrate::{CalibrationSummary, CorrelationSummary, is_notorious, notorious_pairs};

impl fmt::Display for CalibrationSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Figures::default()).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &CalibrationSummary, figures: Figures) -> Document {
    let lead = format!(
        "Calibration of {} by the {} method ({}). Start values: {}.",
        summary.survey,
        summary.method.replace('-', " "),
        summary.describe,
        summary.start
    );
    let mut document = Document::new("rangecam: calibration", lead);
    tables::figures_of_merit(&mut document, summary);
    document.warnings(&summary.doubts);
    tables::diagnosis(&mut document, &summary.diagnosis);
    tables::parameters(&mut document, summary, &figures.significance_p);
    if let Some(certificate) = &summary.certificate {
        document.section("Verdicts");
        certificate_parts::verdicts(&mut document, certificate);
        if let HeldOut::Made(check) = &certificate.hold_out {
            document.remark(check.to_string());
        }
        document.section("For what it holds");
        certificate_parts::span(&mut document, certificate);
    }
    document.section("Range error against range, before and after, and coverage of the range");
    document.figures(figures.range_errors);
    document.figures(figures.range_coverage);
    if !figures.range_terms.is_empty() {
        document.section("Range terms part by part");
        document.figures(figures.range_terms);
    }
    if let Some(table) = &summary.offset_table {
        document.section("The offset of each pixel");
        document.paragraph(format!(
            "Look-up table beside d0 ({0} x {0} pixels, {1} known, {2} not): {3}.",
            table.block_px, table.known_blocks, table.unknown_blocks, table.verdict
        ));
        document.figures(figures.offsets);
    }
    if !figures.point_uncertainty.is_empty() {
        document.section("What the calibration's uncertainty means for a point");
        document.explanation(
            "Standard deviation of a point's position in the camera's frame that comes from the calibration alone, by \
             propagation of the covariance of all estimated parameters (prior-scaled). It is common to all points of a \
             pixel and does not average out; the noise of the observation comes on top.",
        );
        document.figures(figures.point_uncertainty);
    }
    if let Some(certificate) = &summary.certificate {
        certificate_parts::uncertainty(&mut document, certificate);
    }
    correlations(&mut document, &summary.correlation);
    document.section("Residuals, and coverage of the image");
    document.figures(figures.image_residuals);
    document.figures(figures.residuals);
    trends_of_calibration(&mut document, &summary.trends);
    document.section("Network");
    document.figures(figures.network);
    tables::groups(&mut document, summary);
    tables::rejected(&mut document, summary);
    tables::decisions(&mut document, summary);
    if let Some(certificate) = &summary.certificate {
        document.section("Camera, conditions and files");
        certificate_parts::conditions(&mut document, certificate, summary);
        certificate_parts::inputs(&mut document, certificate);
    }
    document.closing(if summary.converged {
        format!(
            "took {:.1} s; written to {}: report.html, {}summary.json, calibration.ron, adjusted_stations.csv, \
             adjusted_targets.csv, residuals.csv",
            summary.seconds,
            summary.out.display(),
            if summary.certificate.is_some() { "certificate.html, " } else { "" }
        )
    } else {
        format!("refused; written to {}: summary.json", summary.out.display())
    });
    document
}

/// Correlations with the notorious pairs.
pub(crate) fn correlations(document: &mut Document, correlation: &CorrelationSummary) {
    if correlation.names.is_empty() {
        return;
    }
    document.section("Correlations");
    let caption =
        "Outlined: pairs that are known to be hard to separate. Numbers where the correlation is 0.5 or more.";
    let title = "Correlations of the estimated parameters";
    document.figures([heat_map(title, &correlation.names, &correlation.matrix, is_notorious).caption(caption)]);
    certificate_parts::pairs(document, &notorious_pairs(correlation));
}
