//! Figures of merit and tables of a calibration.

use std::collections::BTreeMap;

use report::{Block, Column, Document, Merit, Place, Table};

use crate::calibrate::results::summary::{DecisionSummary, GroupSummary, ParameterSummary, RejectedObservation};
use crate::calibrate::{CalibrationSummary, readable, value_words};

pub(crate) fn figures_of_merit(document: &mut Document, summary: &CalibrationSummary) {
    let mut merits = vec![
        Merit::new(summary.observations.to_string(), "observed values"),
        Merit::new(summary.unknowns.to_string(), "unknowns"),
        Merit::new(summary.datum_defect.to_string(), "datum defect"),
        Merit::new(summary.redundancy.to_string(), "redundancy"),
    ];
    if let Some(sigma0) = summary.sigma0 {
        merits.push(Merit::new(format!("{sigma0:.3}"), "sigma0 (1: as noisy as stated)"));
    }
    merits.push(Merit::new(summary.rejected.len().to_string(), "observed values rejected"));
    merits.push(Merit::new(summary.iterations.to_string(), "iterations"));
    document.merits(merits);
}

pub(crate) fn diagnosis(document: &mut Document, diagnosis: &[String]) {
    document.section("Diagnosis");
    if diagnosis.is_empty() {
        document.explanation("Nothing is weakly determined.");
    }
    document.list(diagnosis);
}

/// All parameters with both deviations, and their significance where it is known.
pub(crate) fn parameters(
    document: &mut Document,
    summary: &CalibrationSummary,
    significance_p: &BTreeMap<String, f64>,
) {
    if summary.parameters.0.is_empty() {
        return;
    }
    document.section("Parameters");
    document.explanation(
        "Prior: from the standard deviations that were given to the observations. Posterior: scaled with sigma0. \
         p: probability of a value this far from zero if the parameter were zero.",
    );
    let mut columns = vec![
        Column::words("parameter"),
        Column::number("value"),
        Column::number("sigma prior"),
        Column::number("sigma posterior"),
        Column::words("unit"),
        Column::words("status"),
    ];
    let tested = !significance_p.is_empty();
    if tested {
        columns.extend([Column::number("value / sigma"), Column::number("p"), Column::words("verdict")]);
    }
    let row = |(name, parameter): &(String, ParameterSummary)| {
        let mut row = parameter_row(name, parameter);
        if tested {
            row.extend(test(name, parameter, significance_p.get(name).copied().unwrap_or(f64::NAN)));
        }
        row
    };
    document.table(columns, summary.parameters.0.iter().map(row).collect());
}

fn dash() -> String {
    "–".to_owned()
}

fn parameter_row(name: &str, parameter: &ParameterSummary) -> Vec<String> {
    let estimated = parameter.status == "estimated";
    let sigma = |value: f64| if estimated && value.is_finite() { format!("{value:.2e}") } else { dash() };
    vec![
        name.to_owned(),
        value_words(parameter.value, parameter.sigma_prior),
        sigma(parameter.sigma_prior),
        sigma(parameter.sigma_posterior),
        parameter.unit.clone(),
        parameter.status.to_owned(),
    ]
}

/// Whether a parameter differs from zero.
fn test(name: &str, parameter: &ParameterSummary, p: f64) -> [String; 3] {
    let ratio = parameter.value.abs() / parameter.sigma_prior;
    // A principal distance of zero is no hypothesis worth a test.
    let (ratio, p) = if name == "c" { (f64::NAN, f64::NAN) } else { (ratio, p) };
    [
        if parameter.status == "estimated" && ratio.is_finite() { format!("{ratio:.1}") } else { dash() },
        if p.is_finite() { probability(p) } else { dash() },
        match p {
            p if p.is_nan() => dash(),
            p if p < 0.05 => "significant".to_owned(),
            _ => "not significant".to_owned(),
        },
    ]
}

fn probability(p: f64) -> String {
    if p < 0.0005 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

pub(crate) fn groups(document: &mut Document, summary: &CalibrationSummary) {
    document.section("Observation groups and variance components");
    document.explanation(
        "sigma0 of a group is how much larger its standard deviations are than they were given: 1 where the weights \
         are right.",
    );
    let row = |group: &GroupSummary| {
        let (rms, unit) = readable(group.rms, group.unit);
        vec![
            group.name.clone(),
            group.observations.to_string(),
            format!("{:.1}", group.redundancy),
            format!("{rms:.3}"),
            unit.to_owned(),
            group.sigma0.map_or_else(dash, |sigma0| format!("{sigma0:.3}")),
        ]
    };
    let columns = [
        Column::words("group"),
        Column::number("observed values"),
        Column::number("redundancy"),
        Column::number("rms of the residuals"),
        Column::words("unit"),
        Column::number("sigma0"),
    ];
    let groups = summary.groups.iter().chain(&summary.amplitude_classes);
    if groups.clone().next().is_some() {
        document.table(columns, groups.map(row).collect());
    }
}

/// Rejected values in the table; a reader looks at the worst, and `residuals.csv` has all.
const MOST_REJECTED: usize = 100;
/// And in the text.
const NAMED_REJECTIONS: usize = 8;

pub(crate) fn rejected(document: &mut Document, summary: &CalibrationSummary) {
    document.section("Rejected observations");
    if summary.rejected.is_empty() {
        document.explanation("None.");
        return;
    }
    let mut largest: Vec<&RejectedObservation> = summary.rejected.iter().collect();
    largest.sort_by(|a, b| b.residual_in_sigmas.abs().total_cmp(&a.residual_in_sigmas.abs()));
    for (most, place) in [(MOST_REJECTED, Place::Page), (NAMED_REJECTIONS, Place::Text)] {
        if let Some(left) = largest.len().checked_sub(most).filter(|left| *left > 0) {
            let words = format!(
                "The {most} that are furthest off in their standard deviations; {left} more are in residuals.csv (verdict \
                 `rejected`)."
            );
            document.add(Block::Paragraph(words), place);
        }
        let rows = largest.iter().take(most).map(|gross| rejected_row(gross)).collect();
        document.add(Block::Table(Table::new(rejected_columns(), rows)), place);
    }
}

fn rejected_columns() -> [Column; 8] {
    [
        Column::words("station"),
        Column::words("target"),
        Column::words("component"),
        Column::number("line of observations.csv"),
        Column::number("observed"),
        Column::number("observed minus predicted"),
        Column::words("unit"),
        Column::number("in sigmas"),
    ]
}

fn rejected_row(gross: &RejectedObservation) -> Vec<String> {
    let (residual, unit) = readable(gross.residual, gross.unit);
    vec![
        gross.station.clone(),
        gross.target.clone(),
        gross.component.to_owned(),
        gross.line.map_or_else(dash, |line| line.to_string()),
        format!("{:.4}", gross.observed),
        format!("{residual:.3}"),
        unit.to_owned(),
        format!("{:.1}", gross.residual_in_sigmas),
    ]
}

pub(crate) fn decisions(document: &mut Document, summary: &CalibrationSummary) {
    if summary.decisions.is_empty() {
        return;
    }
    document.section("Choice of terms");
    document.explanation(
        "All are estimated, each with what cameras show of it. Which of them the observations speak for: negative changes of \
         Schwarz's criterion do. Of the others no more is known than that, and their doubt is in all deviations.",
    );
    let row = |decision: &DecisionSummary| {
        vec![
            decision.terms.join(", "),
            if decision.taken { "shown".to_owned() } else { "open".to_owned() },
            if decision.significance_p.is_finite() { probability(decision.significance_p) } else { dash() },
            if decision.delta_bic.is_finite() { format!("{:+.1}", decision.delta_bic) } else { dash() },
            decision.reason.clone(),
        ]
    };
    let columns = [
        Column::words("terms"),
        Column::words("by the observations"),
        Column::number("p"),
        Column::number("change of BIC"),
        Column::words("reason"),
    ];
    document.long_table(columns, summary.decisions.iter().map(row).collect());
}
