//! Figures of merit and tables of a calibration's report.

use error_models::ParameterStatus;
use report::Document;
use self_calibration::{CalibratedParameter, CalibrationOutcome};

use crate::calibrate::{CalibrationSummary, readable};

pub(crate) fn figures_of_merit(page: &mut Document, summary: &CalibrationSummary) {
    let mut cards = vec![
        (summary.observations.to_string(), "observed values".to_owned()),
        (summary.unknowns.to_string(), "unknowns".to_owned()),
        (summary.datum_defect.to_string(), "datum defect".to_owned()),
        (summary.redundancy.to_string(), "redundancy".to_owned()),
    ];
    if let Some(sigma0) = summary.sigma0 {
        cards.push((format!("{sigma0:.3}"), "sigma0 (1: as noisy as stated)".to_owned()));
    }
    cards.push((summary.rejected.len().to_string(), "observed values rejected".to_owned()));
    cards.push((summary.iterations.to_string(), "iterations".to_owned()));
    page.merits(cards);
}

pub(crate) fn diagnosis(page: &mut Document, diagnosis: &[String]) {
    page.section("Diagnosis");
    if diagnosis.is_empty() {
        page.paragraph("Nothing is weakly determined.");
    }
    page.list(diagnosis);
}

/// All parameters with both deviations and their significance.
pub(crate) fn parameters(page: &mut Document, outcome: &CalibrationOutcome) {
    page.section("Parameters");
    page.paragraph(
        "Prior: from the standard deviations that were given to the observations. Posterior: scaled with sigma0. \
         p: probability of a value this far from zero if the parameter were zero.",
    );
    let rows: Vec<Vec<String>> = outcome.parameters.iter().map(parameter_row).collect();
    page.table(
        ["parameter", "value", "sigma prior", "sigma posterior", "unit", "value / sigma", "p", "verdict", "status"],
        rows,
    );
}

fn parameter_row(parameter: &CalibratedParameter) -> Vec<String> {
    let estimated = parameter.status == ParameterStatus::Estimated;
    let dash = || "–".to_owned();
    let sigma = |value: f64| if estimated && value.is_finite() { format!("{value:.2e}") } else { dash() };
    let ratio = parameter.value.abs() / parameter.sigma_prior;
    // A principal distance of zero is no hypothesis worth a test.
    let (ratio, p) = if parameter.name == "c" { (f64::NAN, f64::NAN) } else { (ratio, parameter.significance_p) };
    vec![
        parameter.name.clone(),
        value_text(parameter),
        sigma(parameter.sigma_prior),
        sigma(parameter.sigma_posterior),
        parameter.unit.clone(),
        if estimated && ratio.is_finite() { format!("{ratio:.1}") } else { dash() },
        if p.is_finite() { probability(p) } else { dash() },
        match p {
            p if p.is_nan() => dash(),
            p if p < 0.05 => "significant".to_owned(),
            _ => "not significant".to_owned(),
        },
        if estimated { "estimated".to_owned() } else { "held".to_owned() },
    ]
}

/// A value down to a tenth of its standard deviation.
pub(crate) fn value_text(parameter: &CalibratedParameter) -> String {
    let places = 1.0 - parameter.sigma_prior.log10().floor();
    match parameter.value {
        value if parameter.sigma_prior > 0.0 && (0.0..=8.0).contains(&places) => {
            format!("{value:.places$}", places = places as usize)
        }
        0.0 => "0".to_owned(),
        value if (1e-3..1e4).contains(&value.abs()) => format!("{value:.5}"),
        value => format!("{value:.4e}"),
    }
}

fn probability(p: f64) -> String {
    if p < 0.0005 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

pub(crate) fn groups(page: &mut Document, summary: &CalibrationSummary) {
    page.section("Observation groups and variance components");
    page.paragraph(
        "sigma0 of a group is how much larger its standard deviations are than they were given: 1 where the weights \
         are right.",
    );
    let row = |group: &crate::calibrate::GroupSummary| {
        let (rms, unit) = readable(group.rms, group.unit);
        vec![
            group.name.clone(),
            group.observations.to_string(),
            format!("{:.1}", group.redundancy),
            format!("{rms:.3} {unit}"),
            group.sigma0.map_or("–".to_owned(), |sigma0| format!("{sigma0:.3}")),
        ]
    };
    let rows: Vec<_> = summary.groups.iter().chain(&summary.amplitude_classes).map(row).collect();
    page.table(["group", "observed values", "redundancy", "rms of the residuals", "sigma0"], rows);
}

/// Rejected values in the table; a reader looks at the worst, and `residuals.csv` has all.
const MOST_REJECTED: usize = 100;

pub(crate) fn rejected(page: &mut Document, summary: &CalibrationSummary) {
    page.section("Rejected observations");
    if summary.rejected.is_empty() {
        page.paragraph("None.");
        return;
    }
    let row = |gross: &crate::calibrate::RejectedObservation| {
        let (residual, unit) = readable(gross.residual, gross.unit);
        vec![
            gross.station.clone(),
            gross.target.clone(),
            gross.component.to_owned(),
            format!("{:.4}", gross.observed),
            format!("{residual:.3} {unit}"),
            format!("{:.1}", gross.residual_in_sigmas),
        ]
    };
    let mut largest: Vec<_> = summary.rejected.iter().collect();
    largest.sort_by(|a, b| b.residual_in_sigmas.abs().total_cmp(&a.residual_in_sigmas.abs()));
    if largest.len() > MOST_REJECTED {
        let left = largest.len() - MOST_REJECTED;
        largest.truncate(MOST_REJECTED);
        page.paragraph(&format!(
            "The {MOST_REJECTED} that are furthest off in their standard deviations; {left} more are in residuals.csv \
             (verdict `rejected`)."
        ));
    }
    let rows: Vec<_> = largest.into_iter().map(row).collect();
    page.table(["station", "target", "component", "observed", "observed minus predicted", "in sigmas"], rows);
}

pub(crate) fn decisions(page: &mut Document, outcome: &CalibrationOutcome) {
    if outcome.decisions.is_empty() {
        return;
    }
    page.section("Choice of terms");
    page.paragraph(
        "All are estimated, each with what cameras show of it. Which of them the observations speak for: negative changes of \
         Schwarz's criterion do. Of the others no more is known than that, and their doubt is in all deviations.",
    );
    let row = |decision: &self_calibration::TermDecision| {
        vec![
            decision.terms.join(", "),
            if decision.taken { "shown".to_owned() } else { "open".to_owned() },
            if decision.significance_p.is_finite() { probability(decision.significance_p) } else { "–".to_owned() },
            if decision.delta_bic.is_finite() { format!("{:+.1}", decision.delta_bic) } else { "–".to_owned() },
            decision.reason.clone(),
        ]
    };
    let rows: Vec<_> = outcome.decisions.iter().map(row).collect();
    page.table(["terms", "by the observations", "p", "change of BIC", "reason"], rows);
}
