//! A registration for people.

mod figures;
mod residuals;

use std::fmt;

use commands::tiles::cloud_file;
use report::{Column, Document, Merit, millimetres};

pub(crate) use figures::Figures;

use crate::register::summary::{RegisterSummary, RegisteredLoop};

/// Rows of the table of loops; the worst come first.
const MOST_LOOPS: usize = 20;

impl fmt::Display for RegisterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Figures::default()).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &RegisterSummary, figures: Figures) -> Document {
    let points: usize = summary.stations.iter().map(|station| station.points).sum();
    let how = match summary.method {
        "multi" => "all stations adjusted at once",
        _ => "each onto the one before",
    };
    let lead = format!(
        "{} stations, {points} usable points, {how}. Start: {}. Datum: {}.",
        summary.stations.len(),
        summary.start,
        summary.datum
    );
    let mut document = Document::new("rangecam: registration", lead);
    document.merits(merits(summary));
    document.warnings(&summary.doubts);
    document.section("Before the registration");
    document.figures(figures.before);
    document.section("After the registration");
    document.figures(figures.after);
    if let Some(residuals) = figures.residuals {
        document.section("Distances between surfaces");
        document.paragraph(residuals.words);
        document.figures(residuals.distribution);
        document.figures(residuals.pictures);
    }
    document.section("Stations");
    document.figures(figures.graph);
    stations(&mut document, summary);
    pairs(&mut document, summary);
    loops(&mut document, summary);
    if !summary.refused.is_empty() {
        document.subsection("Pairs left out");
        document.list(&summary.refused);
    }
    document.closing(format!(
        "written to {}: report.html, summary.json, {}, stations.csv, trajectory.txt",
        summary.out,
        cloud_file(summary.tiles.as_ref(), "cloud.ply")
    ));
    document
}

fn merits(summary: &RegisterSummary) -> Vec<Merit> {
    let mut merits = vec![Merit::new(summary.stations.len().to_string(), "stations")];
    let mut add = |value: Option<f64>, name: &str| {
        if value.is_some() {
            merits.push(Merit::new(millimetres(value), name));
        }
    };
    add(summary.pairs.iter().map(|pair| pair.rms_m).max_by(f64::total_cmp), "largest rms of a pair");
    add(summary.position_sigma_max_m, "largest sigma of a position");
    add(summary.largest_misclosure().map(|worst| worst.0), "largest misclosure of a loop");
    add(summary.position_error_max_m, "largest error of a position (truth)");
    if let Some(degrees) = summary.attitude_error_max_deg {
        merits.push(Merit::new(format!("{degrees:.3}°"), "largest error of an attitude (truth)"));
    }
    if let (Some(sigma0), Some(redundancy)) = (summary.sigma0, summary.redundancy) {
        merits.push(Merit::new(format!("{sigma0:.2}"), format!("sigma0, redundancy {redundancy}")));
    }
    merits.push(Merit::new(format!("{:.1} s", summary.seconds), "time"));
    merits
}

fn degrees(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |degrees| format!("{degrees:.4}"))
}

fn in_millimetres(metres: Option<f64>) -> String {
    metres.map_or_else(|| "-".to_owned(), |metres| format!("{:.2}", 1e3 * metres))
}

fn stations(document: &mut Document, summary: &RegisterSummary) {
    let truth = summary.position_error_max_m.is_some();
    let mut columns = vec![Column::words("station"), Column::number("points")];
    columns.extend(["x", "y", "z"].map(|axis| Column::number(axis).unit("m")));
    columns.push(Column::number("sigma of position").unit("mm"));
    columns.push(Column::number("sigma of attitude").unit("°"));
    if truth {
        columns.push(Column::number("position error").unit("mm"));
        columns.push(Column::number("attitude error").unit("°"));
    }
    columns.extend([Column::words("contradicting"), Column::words("verdict")]);
    let rows = summary.stations.iter().enumerate().map(|(index, station)| {
        let mut row = vec![station.name.clone(), station.points.to_string()];
        row.extend(station.position_m.map(|x| format!("{x:.4}")));
        row.extend([in_millimetres(station.position_sigma_m), degrees(station.attitude_sigma_deg)]);
        if truth {
            row.extend([in_millimetres(station.position_error_m), degrees(station.attitude_error_deg)]);
        }
        row.push(station.placement.as_ref().map_or_else(|| "-".to_owned(), ToString::to_string));
        row.push(match (index, station.undetermined.is_empty()) {
            (0, _) => "datum".to_owned(),
            (_, true) => "determined".to_owned(),
            (_, false) => format!("open: {}", station.undetermined.join("; ")),
        });
        row
    });
    document.table(columns, rows.collect());
}

fn pairs(document: &mut Document, summary: &RegisterSummary) {
    document.section("Pairs");
    let rows = summary.pairs.iter().map(|pair| {
        vec![
            format!("{} onto {}", pair.source, pair.target),
            format!("{:.0}", 100.0 * pair.overlap),
            in_millimetres(Some(pair.rms_m)),
            in_millimetres(pair.mean_m),
            if pair.undetermined.is_empty() { "determined".to_owned() } else { pair.undetermined.join("; ") },
        ]
    });
    let columns = [
        Column::words("pair"),
        Column::number("overlap").unit("%"),
        Column::number("rms").unit("mm"),
        Column::number("mean distance").unit("mm"),
        Column::words("the pair by itself"),
    ];
    document.table(columns, rows.collect());
}

fn loops(document: &mut Document, summary: &RegisterSummary) {
    if summary.loops.is_empty() {
        return;
    }
    document.subsection("Loops");
    let mut loops: Vec<&RegisteredLoop> = summary.loops.iter().collect();
    loops.sort_by(|a, b| b.translation_m.total_cmp(&a.translation_m));
    if loops.len() > MOST_LOOPS {
        document.paragraph(format!("The worst {MOST_LOOPS} of {}.", loops.len()));
    }
    let rows = loops.iter().take(MOST_LOOPS).map(|closure| {
        vec![
            format!("{} – {}", closure.stations.join(" – "), closure.stations.first().map_or("", String::as_str)),
            in_millimetres(Some(closure.translation_m)),
            format!("{:.4}", closure.rotation_deg),
        ]
    });
    let columns =
        [Column::words("loop"), Column::number("misclosure").unit("mm"), Column::number("in attitude").unit("°")];
    document.table(columns, rows.collect());
}
