//! Mean residuals in bins of what they might still depend on.

use report::{Axes, CATEGORIES, Column, Document, Figure, Series, curves};
use residual_tests::TrendVariable;

use crate::trends::{RemainingErrors, TrendSummary, sentence};

const TITLE: &str = "Is what is left random?";

/// The residuals of a calibration.
pub fn trends_of_calibration(page: &mut Document, trends: &[TrendSummary]) {
    let Some(sentence) = sentence(trends) else { return };
    page.section(TITLE);
    let lacks = if trends.iter().any(TrendSummary::is_trend) { ": the model lacks a term" } else { "" };
    page.remark(format!("note: {sentence}{lacks}"));
    tests(page, trends, &sentence);
}

/// What a run leaves of the ranges' errors.
pub fn remaining_errors(page: &mut Document, remaining: &RemainingErrors) {
    page.section(TITLE);
    page.remark(format!("what is left: {remaining}"));
    page.explanation(&remaining.basis_words);
    if remaining.pixels == 0 {
        return;
    }
    let RemainingErrors { pixels, gross_errors, .. } = remaining;
    page.explanation(format!("{pixels} pixels were tested; {gross_errors} more with gross errors were left out."));
    tests(page, &remaining.variables, &remaining.verdict);
}

/// A table of the tests, and a curve with its band of two standard errors for each variable.
fn tests(page: &mut Document, trends: &[TrendSummary], sentence: &str) {
    page.explanation(format!(
        "Means of the residuals in bins, compared with one another by the scatter of pixels that are independent of each \
         other; all variables together raise a false alarm once in a hundred times. Here {sentence}."
    ));
    let millimetres = |metres: Option<f64>| metres.map_or("–".to_owned(), |metres| format!("{:.2}", 1e3 * metres));
    let row = |trend: &TrendSummary| {
        let p =
            trend.p_value.map_or("–".to_owned(), |p| if p < 0.0005 { "< 0.001".to_owned() } else { format!("{p:.3}") });
        let independent = trend.independent.clone().unwrap_or_else(|| "–".to_owned());
        vec![trend.variable.to_owned(), trend.verdict.clone(), p, millimetres(trend.rms_m), independent]
    };
    let rows: Vec<Vec<String>> = trends.iter().map(row).collect();
    let columns = [
        Column::words("residual against"),
        Column::words("verdict"),
        Column::number("p"),
        Column::number("rms of the trend").unit("mm"),
        Column::words("independent of each other"),
    ];
    page.long_table(columns, rows);
    page.figures(trends.iter().filter(|trend| !trend.bins.is_empty()).map(figure));
}

fn figure(trend: &TrendSummary) -> Figure {
    // Most amplitudes are small, and a few very large.
    let by_amplitude = trend.variable == TrendVariable::Amplitude.name();
    let axes = Axes { title: "Mean residual", x: if by_amplitude { "lg amplitude" } else { trend.variable }, y: "mm" };
    let place = |at: f64| if by_amplitude { at.max(f64::MIN_POSITIVE).log10() } else { at };
    let curve = |factor: f64| -> Vec<(f64, f64)> {
        trend.bins.iter().map(|[at, mean, error]| (place(*at), 1e3 * (mean + factor * error))).collect()
    };
    let sets = [
        Series { name: "mean", colour: CATEGORIES[0], values: curve(0.0) },
        Series { name: "plus 2 standard errors", colour: CATEGORIES[7], values: curve(2.0) },
        Series { name: "minus 2 standard errors", colour: CATEGORIES[7], values: curve(-2.0) },
    ];
    curves(&axes, &sets)
}
