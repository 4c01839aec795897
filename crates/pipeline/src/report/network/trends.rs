//! Mean residuals in bins of what they might still depend on.

use crate::calibrate::{TrendSummary, trend_sentence};
use crate::report::chart::{Axes, Series, curves};
use crate::report::colour::CATEGORIES;
use crate::report::page::Page;

/// A table of the tests, and a curve with its band of two standard errors for each variable.
pub(super) fn trends(page: &mut Page, trends: &[TrendSummary]) {
    let Some(sentence) = trend_sentence(trends) else { return };
    page.section("Is what is left random?");
    page.paragraph(&format!(
        "Means of the residuals in bins, compared with one another by the scatter of pixels that are independent of each \
         other; all variables together raise a false alarm once in a hundred calibrations. Here {sentence}."
    ));
    let millimetres = |metres: Option<f64>| metres.map_or("–".to_owned(), |metres| format!("{:.2} mm", 1e3 * metres));
    let row = |trend: &TrendSummary| {
        let p =
            trend.p_value.map_or("–".to_owned(), |p| if p < 0.0005 { "< 0.001".to_owned() } else { format!("{p:.3}") });
        vec![trend.variable.to_owned(), trend.verdict.clone(), p, millimetres(trend.rms_m)]
    };
    let rows: Vec<Vec<String>> = trends.iter().map(row).collect();
    page.table(&["residual against", "verdict", "p", "rms of the trend"], &rows);
    let figures: Vec<(String, String)> =
        trends.iter().filter(|trend| !trend.bins.is_empty()).map(|trend| (figure(trend), String::new())).collect();
    page.figures(&figures);
}

fn figure(trend: &TrendSummary) -> String {
    let axes = Axes { title: "Mean residual", x: trend.variable, y: "mm" };
    let curve = |factor: f64| -> Vec<(f64, f64)> {
        trend.bins.iter().map(|[at, mean, error]| (*at, 1e3 * (mean + factor * error))).collect()
    };
    let sets = [
        Series { name: "mean", colour: CATEGORIES[0], values: curve(0.0) },
        Series { name: "plus 2 standard errors", colour: CATEGORIES[7], values: curve(2.0) },
        Series { name: "minus 2 standard errors", colour: CATEGORIES[7], values: curve(-2.0) },
    ];
    curves(&axes, &sets)
}
