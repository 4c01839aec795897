//! Parts of a certificate that a calibration's report shows as well.

use report::{Block, Document, Place};

use crate::calibrate::{COVERAGE, CalibrationSummary, Certificate, ExpandedUncertainty, NotoriousPair, TestVerdict};

const NOT_GIVEN: &str = "not given";

fn or_not_given(words: Option<&String>) -> String {
    words.cloned().unwrap_or_else(|| NOT_GIVEN.to_owned())
}

/// Camera, conditions and program: two columns.
pub(crate) fn conditions(page: &mut Document, certificate: &Certificate, summary: &CalibrationSummary) {
    let conditions = &certificate.conditions;
    let list = |values: Vec<String>, unit: &str| {
        if values.is_empty() { NOT_GIVEN.to_owned() } else { format!("{} {unit}", values.join(", ")) }
    };
    let times = certificate.integration_times_s.iter().map(ToString::to_string).collect();
    let frequencies = conditions.modulation_hz.iter().map(|hz| (hz / 1e6).to_string()).collect();
    let temperature =
        conditions.temperature_c.map(|[from, to]| format!("{from:.1} to {to:.1} degrees Celsius (of the frames)"));
    let [width, height] = conditions.image_px;
    let [pitch_x, pitch_y] = conditions.pixel_pitch_mm;
    let rows = [
        ("camera", or_not_given(conditions.camera_identity.as_ref())),
        ("firmware", or_not_given(conditions.firmware.as_ref())),
        ("image", format!("{width} x {height} pixels of {pitch_x} x {pitch_y} mm")),
        ("modulation", list(frequencies, "MHz")),
        ("integration time", list(times, "s")),
        ("temperature", or_not_given(temperature.as_ref())),
        ("warm-up", certificate.warm_up.clone()),
        ("operator", or_not_given(conditions.operator.as_ref())),
        ("software", certificate.software.clone()),
        ("survey", summary.survey.clone()),
        ("method", format!("{}: {}", summary.method.replace('-', " "), summary.describe)),
        ("start values", summary.start.clone()),
    ];
    page.long_table(["what", "as given"], rows.map(|(what, given)| vec![what.to_owned(), given]).to_vec());
}

/// What every test says, and where its values stand.
pub(crate) fn verdicts(page: &mut Document, certificate: &Certificate) {
    page.explanation("Rows and lines are those of residuals.csv, whose first line is its head.");
    let row = |verdict: &TestVerdict| {
        let passed = match verdict.passed {
            Some(true) => "passed",
            Some(false) => "failed",
            None => "–",
        };
        vec![verdict.test.clone(), passed.to_owned(), verdict.words.clone(), verdict.rows.clone()]
    };
    let rows: Vec<_> = certificate.verdicts.iter().map(row).collect();
    page.long_table(["test", "verdict", "what was found", "rows"], rows);
}

/// For what the calibration holds.
pub(crate) fn span(page: &mut Document, certificate: &Certificate) {
    page.add(Block::List(certificate.span.clone()), Place::Page);
    page.explanation("Outside of this, corrections are extrapolated, and pixels are flagged `outside_span`.");
}

/// Expanded uncertainties at chosen places.
pub(crate) fn uncertainty(page: &mut Document, certificate: &Certificate) {
    if certificate.expanded_uncertainty.is_empty() {
        return;
    }
    page.add(Block::Subtitle("Expanded uncertainty at chosen places".to_owned()), Place::Page);
    page.explanation(format!(
        "Half widths of intervals with the coverage factor k = {COVERAGE} (about 95 %), millimetre. By the calibration: \
         propagated from the covariance of all estimated parameters, scaled with sigma0 where that is above 1; common to all \
         measurements, so that no mean makes it smaller. With noise: that of one frame and pixel at that amplitude added, \
         where the calibration has a noise of ranges."
    ));
    let millimetres = |metres: f64| format!("{:.2}", 1e3 * metres);
    let optional = |metres: Option<f64>| metres.map_or_else(|| "not known".to_owned(), millimetres);
    let row = |of: &ExpandedUncertainty| {
        vec![
            of.place.to_owned(),
            format!("{:.1}, {:.1}", of.pixel[0], of.pixel[1]),
            format!("{:.3} m", of.range_m),
            of.amplitude.map_or_else(|| "not known".to_owned(), |amplitude| format!("{amplitude:.0}")),
            millimetres(of.range_by_calibration_m),
            millimetres(of.point_by_calibration_m),
            optional(of.range_m_with_noise),
            optional(of.point_m_with_noise),
        ]
    };
    let rows: Vec<_> = certificate.expanded_uncertainty.iter().map(row).collect();
    let head = [
        "place",
        "column, row",
        "range",
        "amplitude",
        "U of range",
        "U of point",
        "range, with noise",
        "point, with noise",
    ];
    page.long_table(head, rows);
}

/// Pairs that are hard to separate.
pub(crate) fn pairs(page: &mut Document, pairs: &[NotoriousPair]) {
    if pairs.is_empty() {
        return;
    }
    let row = |pair: &NotoriousPair| {
        vec![
            format!("{} – {}", pair.first, pair.second),
            format!("{:+.3}", pair.correlation),
            pair.separated_by.to_owned(),
        ]
    };
    let rows: Vec<_> = pairs.iter().map(row).collect();
    page.long_table(["notorious pair", "correlation", "what separates it"], rows);
}

/// Digests of the files.
pub(crate) fn inputs(page: &mut Document, certificate: &Certificate) {
    let rows: Vec<_> = certificate
        .inputs
        .iter()
        .map(|input| vec![input.file.clone(), input.bytes.to_string(), input.sha256.clone()])
        .collect();
    page.long_table(["file read", "bytes", "SHA-256"], rows);
}
