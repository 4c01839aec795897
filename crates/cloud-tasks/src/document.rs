//! What was measured, for people.

use std::fmt;

use point_uncertainty::Source;
use report::{Column, Document, Figure, rounded};

use crate::summary::{LengthSummary, MeasureSummary, RegionSummary};

/// Most digits behind the point: a nanometre.
const MOST_DIGITS: f64 = 9.0;

impl fmt::Display for MeasureSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Vec::new()).fmt(f)
    }
}

/// All of it.
pub(crate) fn document(summary: &MeasureSummary, pictures: Vec<Figure>) -> Document {
    let calibration = summary.calibration.as_deref().unwrap_or("none");
    let lead = format!("Lengths in the cloud of {}; calibration {calibration}.", summary.result);
    let mut document = Document::new("rangecam: measure", lead);
    let measured = summary.lengths.iter().filter(|length| length.refused.is_none()).count();
    document.merits([
        (format!("{measured} of {}", summary.lengths.len()), "lengths measured"),
        (summary.common_errors.to_string(), "common errors that take part"),
        (summary.points.to_string(), "points of the cloud"),
    ]);
    document.warnings(&summary.doubts);
    document.section("The lengths");
    document.explanation(
        "Standard deviations from all sources; the interval holds the true value in 95 of 100 cases. Shares are those of the \
         variance: what is noise goes down with more points, what is calibration, drift or poses does not.",
    );
    lengths(&mut document, summary);
    document.list(&summary.findings);
    document.section("What they would seem without a source of errors");
    without(&mut document, summary);
    document.figures(pictures);
    document.section("The regions");
    regions(&mut document, summary);
    document.closing(format!("lengths.csv, summary.json and report.html are in {}", summary.out.display()));
    document
}

fn lengths(document: &mut Document, summary: &MeasureSummary) {
    let mut columns = vec![
        Column::words("name"),
        Column::words("quantity"),
        Column::number("value"),
        Column::number("sigma"),
        Column::number("95 % interval"),
    ];
    columns.extend(Source::ALL.into_iter().map(|source| Column::number(format!("{}, %", source.name()))));
    document.table(columns, summary.lengths.iter().map(row).collect());
}

fn row(length: &LengthSummary) -> Vec<String> {
    let with_unit = |text: String| format!("{text} {}", length.unit);
    let scale = scale(length);
    let text = |value: Option<f64>| value.map(|value| digits(value, scale, 2));
    let value = text(length.value).map_or_else(|| "not measured".to_owned(), with_unit);
    let sigma = text(length.sigma).map_or_else(|| "-".to_owned(), with_unit);
    let interval = length.interval.map(|ends| ends.map(|end| digits(end, scale, 2)));
    let interval = interval.map_or_else(|| "-".to_owned(), |[low, high]| format!("{low} to {high}"));
    let mut cells = vec![length.name.clone(), length.kind.to_owned(), value, sigma, interval];
    cells.extend(Source::ALL.into_iter().map(|source| {
        length.shares.get(source.name()).map_or_else(|| "-".to_owned(), |share| rounded(100.0 * share, 1))
    }));
    cells
}

/// Where a length has no standard deviation, its interval tells its digits.
fn scale(length: &LengthSummary) -> Option<f64> {
    length.sigma.or(length.interval.map(|[low, high]| high - low))
}

fn without(document: &mut Document, summary: &MeasureSummary) {
    let rows = summary.lengths.iter().flat_map(|length| {
        length.without.iter().map(|rest| {
            let [low, high] = rest.interval.map(|end| digits(end, scale(length), 2));
            let sigma = format!("{} {}", digits(rest.sigma, scale(length), 2), length.unit);
            vec![length.name.clone(), rest.source.to_owned(), sigma, format!("{low} to {high}")]
        })
    });
    let rows: Vec<Vec<String>> = rows.collect();
    if !rows.is_empty() {
        let columns = [
            Column::words("name"),
            Column::words("left out"),
            Column::number("sigma of the rest"),
            Column::number("interval of the rest"),
        ];
        document.long_table(columns, rows);
    }
}

fn regions(document: &mut Document, summary: &MeasureSummary) {
    let row = |(name, region): (&String, &RegionSummary)| {
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
        let probability = region.probability.map_or_else(|| "-".to_owned(), |value| format!("{value:.1e}"));
        let words = region.refused.clone().unwrap_or_default();
        let counts = [region.points, region.left_out, region.unusable].map(|count| count.to_string());
        let mut cells = vec![name.clone(), region.kind.to_owned()];
        cells.extend(counts);
        cells.extend([number(region.sigma0), probability, words]);
        cells
    };
    let columns = [
        Column::words("region"),
        Column::words("shows"),
        Column::number("points"),
        Column::number("of something else"),
        Column::number("unusable"),
        Column::number("sigma0"),
        Column::number("probability"),
        Column::words("refused"),
    ];
    document.table(columns, summary.regions.iter().map(row).collect());
}

/// A number with so many significant digits of its standard deviation; with all of them where there is none.
pub(crate) fn digits(value: f64, scale: Option<f64>, significant: u32) -> String {
    match scale.filter(|scale| *scale > 0.0 && scale.is_finite()) {
        Some(scale) => {
            let behind = (f64::from(significant) - 1.0 - scale.log10().floor()).clamp(0.0, MOST_DIGITS);
            rounded(value, behind as usize)
        }
        None => format!("{value}"),
    }
}
