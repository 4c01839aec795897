//! A run for people.

use std::fmt;

use commands::tiles::cloud_file;
use range_image::Flags;
use report::{Axes, Block, CATEGORIES, Column, Document, Merit, Place, Series, curves, millimetres};

use crate::run::figures::Figures;
use crate::run::summary::Summary;
use crate::survey::records::StageSummary;
use crate::survey::truth::RangeTruth;
use crate::trends::section::remaining_errors;

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Figures::default()).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &Summary, figures: Figures) -> Document {
    let lead = format!(
        "{} frames of {} stations, {} x {} pixels, input level {}. Calibration: {}.",
        summary.frames, summary.stations, summary.size_px[0], summary.size_px[1], summary.level, summary.calibration
    );
    let mut document = Document::new(format!("rangecam: {}", summary.pipeline), lead);
    document.merits(merits(summary));
    document.warnings(&summary.doubts);
    stages(&mut document, summary);
    if !summary.ruled_out.is_empty() {
        document.subsection("What the input level rules out");
        let rows = summary.ruled_out.iter().map(|(stage, why)| vec![stage.clone(), why.clone()]).collect();
        document.table([Column::words("stage"), Column::words("why")], rows);
    }
    document.section("Errors against the truth");
    document.figures(figures.errors);
    remaining_errors(&mut document, &summary.remaining);
    document.section("The cloud");
    document.figures(figures.cloud);
    own_clouds(&mut document, summary);
    stations(&mut document, summary, &figures.poses);
    pairs(&mut document, summary);
    document.section("Before and after, station by station");
    for (view, figures) in figures.views {
        document.add(Block::Subtitle(view), Place::Page);
        document.figures(figures);
    }
    if figures.not_pictured > 0 {
        document.explanation(format!("{} further stations are not pictured.", figures.not_pictured));
    }
    flags(&mut document, summary);
    document.figures(figures.sigma);
    let clouds = match summary.own_clouds.len() {
        0 => format!(
            "{}, stations.csv, trajectory.txt, common_errors.ron",
            cloud_file(summary.tiles.as_ref(), "cloud.ply")
        ),
        count => format!("clouds/ ({count} clouds, each in the frame of its own camera; no poses)"),
    };
    document.closing(format!("written to {}: report.html, summary.json, {clouds}", summary.out));
    document
}

fn merits(summary: &Summary) -> Vec<Merit> {
    let mut merits = Vec::new();
    let mut add = |value: String, name: &str| merits.push(Merit::new(value, name));
    add(summary.points.to_string(), "points");
    if let Some(sigma) = summary.sigma_range_median_m {
        add(millimetres(Some(sigma)), "median sigma of a range");
    }
    if let Some(truth) = &summary.truth {
        add(millimetres(Some(truth.ranges.range_error_median_m)), "median range error (truth)");
        add(millimetres(Some(truth.ranges.range_error_p95_m)), "95 % of range errors below (truth)");
        add(format!("{:.2} %", 100.0 * truth.ranges.wrap_count_right_fraction), "wrap counts right (truth)");
        add(format!("{:.1} %", 100.0 * truth.ranges.flagged_fraction), "flagged of the pixels with truth");
        if let (Some(position), Some(attitude)) = (truth.position_error_max_m, truth.attitude_error_max_deg) {
            add(millimetres(Some(position)), "largest position error (truth)");
            add(format!("{attitude:.3}°"), "largest attitude error (truth)");
        }
    }
    if let Some(reference) = &summary.reference {
        add(format!("{:.1} mm", 1e3 * reference.constant_m), "constant to the reference range");
        add(millimetres(Some(reference.robust_standard_deviation_m)), "robust deviation from the reference range");
    }
    if let Some(sigma0) = summary.registration.as_ref().and_then(|registration| registration.sigma0) {
        add(format!("{sigma0:.2}"), "sigma0 of the stations");
    }
    add(format!("{:.1} %", 100.0 * summary.flags_fraction.get("any").copied().unwrap_or(0.0)), "pixels flagged");
    if summary.seconds > 0.0 {
        add(format!("{:.1} s", summary.seconds), "time");
    }
    merits
}

fn number(length_m: Option<f64>) -> String {
    length_m.filter(|length| length.is_finite()).map_or_else(|| "-".to_owned(), |length| format!("{:.2}", 1e3 * length))
}

fn stages(document: &mut Document, summary: &Summary) {
    document.section("What each stage did");
    let longest = summary.stages.iter().map(|stage| stage.seconds).fold(f64::MIN_POSITIVE, f64::max);
    let time = |time: f64| if summary.seconds > 0.0 { format!("{time:.0}") } else { "-".to_owned() };
    let row = |stage: &StageSummary| {
        let truth = |pick: fn(&RangeTruth) -> f64| number(stage.truth.as_ref().map(pick));
        vec![
            stage.name.to_owned(),
            time(1e3 * stage.seconds),
            time(100.0 * stage.seconds / longest),
            number(stage.change_median_m),
            truth(|truth| truth.range_error_median_m),
            truth(|truth| truth.range_error_p95_m),
        ]
    };
    let columns = [
        Column::words("stage"),
        Column::number("time").unit("ms"),
        Column::number("of the longest").unit("%"),
        Column::number("median change").unit("mm"),
        Column::number("median error after").unit("mm"),
        Column::number("95 % below").unit("mm"),
    ];
    document.table(columns, summary.stages.iter().map(row).collect());
    let found = summary.stages.iter().filter(|stage| !stage.findings.is_empty()).map(|stage| {
        let findings: Vec<String> = stage.findings.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
        vec![stage.name.to_owned(), findings.join("; ")]
    });
    document.long_table([Column::words("stage"), Column::words("findings")], found.collect());
    gain(document, summary);
}

/// The errors over the stages.
fn gain(document: &mut Document, summary: &Summary) {
    let after = |pick: fn(&RangeTruth) -> f64| -> Vec<(f64, f64)> {
        let errors = summary.stages.iter().enumerate();
        errors.filter_map(|(k, stage)| stage.truth.as_ref().map(|truth| (k as f64, 1e3 * pick(truth)))).collect()
    };
    let median = after(|truth| truth.range_error_median_m);
    if median.len() < 2 {
        return;
    }
    let axes =
        Axes { title: "Range error after each stage", x: "stage, in the order of the table (0 is the first)", y: "mm" };
    let upper = after(|truth| truth.range_error_p95_m);
    let sets = [
        Series { name: "median", colour: CATEGORIES[0], values: median },
        Series { name: "95 % below", colour: CATEGORIES[1], values: upper },
    ];
    document.figures([curves(&axes, &sets).caption("On the pixels that no flag excludes at that stage.")]);
}

fn own_clouds(document: &mut Document, summary: &Summary) {
    if summary.own_clouds.is_empty() {
        return;
    }
    document.paragraph(
        "The stations are in no common frame: each cloud is in the frame of its own camera (x right, y up, looking along -z).",
    );
    let rows = summary.own_clouds.iter().map(|cloud| vec![cloud.view.clone(), cloud.file.clone()]).collect();
    document.long_table([Column::words("view"), Column::words("file")], rows);
}

fn stations(document: &mut Document, summary: &Summary, poses: &[(String, [f64; 3], Option<f64>)]) {
    if summary.registration.is_none() || !summary.own_clouds.is_empty() || poses.is_empty() {
        return;
    }
    let rows = poses.iter().map(|(station, position, sigma_m)| {
        let truth = summary.truth.as_ref().and_then(|truth| truth.stations.get(station));
        let attitude = truth.and_then(|truth| truth.attitude_error_deg);
        let mut row = vec![station.clone()];
        row.extend(position.map(|x| format!("{x:.4}")));
        row.extend([number(*sigma_m), number(truth.and_then(|truth| truth.position_error_m))]);
        row.push(attitude.map_or("-".to_owned(), |error| format!("{error:.4}")));
        row
    });
    let columns = [
        Column::words("station"),
        Column::number("x").unit("m"),
        Column::number("y").unit("m"),
        Column::number("z").unit("m"),
        Column::number("sigma of position").unit("mm"),
        Column::number("position error").unit("mm"),
        Column::number("attitude error").unit("°"),
    ];
    document.long_table(columns, rows.collect());
}

fn pairs(document: &mut Document, summary: &Summary) {
    let Some(registration) = &summary.registration else { return };
    document.subsection("Pairs");
    let rows = registration.pairs.iter().map(|pair| {
        vec![
            format!("{} to {}", pair.source, pair.target),
            format!("{:.0}", 100.0 * pair.overlap),
            number(Some(pair.rms_m)),
            pair.iterations.to_string(),
            format!("{:.4}", pair.distance_m),
        ]
    });
    let columns = [
        Column::words("pair"),
        Column::number("overlap").unit("%"),
        Column::number("rms along the normals").unit("mm"),
        Column::number("iterations"),
        Column::number("distance of the stations").unit("m"),
    ];
    document.table(columns, rows.collect());
}

fn flags(document: &mut Document, summary: &Summary) {
    document.section("Flags by reason");
    document.explanation("A flagged pixel keeps its value; the cloud's figures and pictures leave it out.");
    let rows = Flags::NAMED.iter().zip(COLOUR_NAMES).map(|((_, name), colour)| {
        let fraction = summary.flags_fraction.get(*name).copied().unwrap_or(0.0);
        vec![(*name).replace('_', " "), format!("{:.2}", 100.0 * fraction), colour.to_owned()]
    });
    let columns =
        [Column::words("reason"), Column::number("pixels").unit("%"), Column::words("colour in the pictures")];
    document.table(columns, rows.collect());
}

/// Names of the first colours of [`CATEGORIES`], in the order of [`Flags::NAMED`].
const COLOUR_NAMES: [&str; Flags::NAMED.len()] =
    ["blue", "orange", "green", "red", "purple", "brown", "pink", "grey", "olive"];
