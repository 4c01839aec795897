//! The certificate: a page to be printed and signed.

use report::Document;

use crate::calibrate::document::certificate_parts as parts;
use crate::calibrate::{CalibrationSummary, Certificate, CertifiedStation, CertifiedTarget, Observed, value_words};

/// The whole page; the date is the only thing on it that a second run on another day would change.
pub(crate) fn render_certificate(certificate: &Certificate, summary: &CalibrationSummary, date: &str) -> String {
    let conditions = &certificate.conditions;
    let given = |words: &Option<String>| words.clone().unwrap_or_else(|| "not given".to_owned());
    let lead = format!(
        "Camera: {}; date: {date}; operator: {}; software: {}",
        given(&conditions.camera_identity),
        given(&conditions.operator),
        certificate.software
    );
    let mut page = Document::for_print("Certificate of calibration", lead);
    page.section("Result");
    result(&mut page, summary);
    page.section("Camera and conditions");
    parts::conditions(&mut page, certificate, summary);
    page.section("For what it holds");
    parts::span(&mut page, certificate);
    page.sheet("Parameters");
    parameters(&mut page, summary);
    parts::uncertainty(&mut page, certificate);
    page.sheet("Verdicts");
    parts::verdicts(&mut page, certificate);
    page.subsection("Correlations of pairs that are hard to separate");
    if certificate.notorious_pairs.is_empty() {
        page.paragraph("None of them are both estimated.");
    }
    parts::pairs(&mut page, &certificate.notorious_pairs);
    stations(&mut page, &certificate.stations);
    targets(&mut page, &certificate.targets);
    page.sheet("Files read");
    parts::inputs(&mut page, certificate);
    page.signature("Place, date, signature");
    page.html()
}

fn result(page: &mut Document, summary: &CalibrationSummary) {
    let sigma0 = summary.sigma0.map_or_else(|| "not known".to_owned(), |sigma0| format!("{sigma0:.3}"));
    let verdict = if summary.doubts.is_empty() {
        "Nothing speaks against this calibration.".to_owned()
    } else {
        format!("{} doubts speak against using this calibration before they are cleared:", summary.doubts.len())
    };
    page.paragraph(format!(
        "{verdict} {} observed values, {} unknowns, datum defect {}, redundancy {}, sigma0 {sigma0}, {} values rejected.",
        summary.observations,
        summary.unknowns,
        summary.datum_defect,
        summary.redundancy,
        summary.rejected.len()
    ));
    page.list(&summary.doubts);
    page.list(&summary.diagnosis);
}

fn parameters(page: &mut Document, summary: &CalibrationSummary) {
    page.paragraph("Standard deviations are posterior ones, k = 1, as in calibration.ron.");
    let row = |(name, parameter): &(String, crate::calibrate::ParameterSummary)| {
        let estimated = parameter.status == "estimated";
        let sigma =
            if parameter.sigma_posterior.is_finite() { parameter.sigma_posterior } else { parameter.sigma_prior };
        vec![
            name.clone(),
            value_words(parameter.value, parameter.sigma_prior),
            if estimated { format!("{sigma:.2e}") } else { "–".to_owned() },
            parameter.unit.clone(),
            parameter.status.to_owned(),
        ]
    };
    let rows: Vec<_> = summary.parameters.0.iter().map(row).collect();
    page.table(["parameter", "value", "standard deviation", "unit", "status"], rows);
}

const DETECTABLE: &str =
    "The largest gross error in pixels and in ranges that the test might not find: larger ones are found with 80 %.";

fn stations(page: &mut Document, stations: &[CertifiedStation]) {
    if stations.is_empty() {
        return;
    }
    page.sheet("Stations");
    page.paragraph(format!("Positions and prior-scaled standard deviations along the axes of the world. {DETECTABLE}"));
    let row = |station: &CertifiedStation| {
        let mut row = vec![station.station.clone(), coordinates(station.position_m)];
        row.push(station.sigma_position_m.map_or_else(held, millimetres));
        row.push(station.sigma_attitude_deg.map_or_else(held, |[a, b, c]| format!("{a:.4}, {b:.4}, {c:.4}")));
        row.extend(observed(&station.observed));
        row
    };
    let rows: Vec<_> = stations.iter().map(row).collect();
    let head = [
        "station",
        "x, y, z, m",
        "sigma x, y, z, mm",
        "sigma omega, phi, kappa, deg",
        "used",
        "rejected",
        "detectable, px",
        "mm",
    ];
    page.table(head, rows);
}

fn targets(page: &mut Document, targets: &[CertifiedTarget]) {
    if targets.is_empty() {
        return;
    }
    page.sheet("Targets");
    page.paragraph(format!("Positions and prior-scaled standard deviations. {DETECTABLE}"));
    let row = |target: &CertifiedTarget| {
        let mut row = vec![target.target.clone(), coordinates(target.position_m), millimetres(target.sigma_m)];
        row.extend(observed(&target.observed));
        row
    };
    let rows: Vec<_> = targets.iter().map(row).collect();
    page.table(["target", "x, y, z, m", "sigma x, y, z, mm", "used", "rejected", "detectable, px", "mm"], rows);
}

fn held() -> String {
    "held".to_owned()
}

fn coordinates([x, y, z]: [f64; 3]) -> String {
    format!("{x:.4}, {y:.4}, {z:.4}")
}

fn millimetres(metres: [f64; 3]) -> String {
    let [x, y, z] = metres.map(|metres| format!("{:.2}", 1e3 * metres));
    format!("{x}, {y}, {z}")
}

fn observed(observed: &Observed) -> [String; 4] {
    let size =
        |size: Option<f64>, factor: f64| size.map_or_else(|| "–".to_owned(), |size| format!("{:.2}", factor * size));
    let Observed { values, rejected, detectable_px, detectable_range_m, .. } = *observed;
    [values.to_string(), rejected.to_string(), size(detectable_px, 1.0), size(detectable_range_m, 1e3)]
}
