//! A tracked sequence for people.

use std::fmt;

use report::{Column, Document, Merit, millimetres};

use crate::track::figures::Figures;
use crate::track::outcome::TrackVerdict;
use crate::track::summary::TrackSummary;

impl fmt::Display for TrackSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Figures::default()).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &TrackSummary, figures: Figures) -> Document {
    let verdict = match summary.verdict {
        TrackVerdict::Tracked => "every one has a pose",
        TrackVerdict::Interrupted => "interrupted",
        TrackVerdict::Lost => "lost",
    };
    let lead = format!(
        "{} frames over {:.2} s, {verdict}. Datum: {}. Frames are expected by: {}. Calibration: {}.",
        summary.frames, summary.duration_s, summary.datum, summary.prior, summary.calibration
    );
    let mut document = Document::new("rangecam: tracking", lead);
    document.merits(merits(summary));
    document.paragraph(summary.grounds_of_sigma());
    document.warnings(&summary.doubts);
    document.section("Path");
    document.figures(figures.path);
    document.section("Over time");
    document.figures(figures.time);
    loss_section(&mut document, summary);
    document.section("Map");
    document.figures(figures.map);
    document.closing(format!(
        "took {:.1} s; written to {}: report.html, summary.json, trajectory.txt, trajectory_adjusted.txt, stations.csv, cloud.ply",
        summary.seconds, summary.out
    ));
    document
}

fn merits(summary: &TrackSummary) -> Vec<Merit> {
    let mut merits = Vec::new();
    let mut add = |value: String, name: &str| merits.push(Merit::new(value, name));
    add(summary.frames.to_string(), "frames");
    add(format!("{} ({:.1} %)", summary.lost, 100.0 * summary.lost_share), "without a pose");
    add(summary.relocalised.to_string(), "times found again");
    add(format!("{:.3} m", summary.path_length_m), "length of the path");
    add(format!("{:.3} m", summary.start_to_end_m), "first to last");
    add(millimetres(Some(summary.position_sigma_median_m)), "median sigma of a position");
    add(millimetres(Some(summary.position_sigma_max_m)), "largest sigma of a position");
    add(summary.keyframes.to_string(), "keyframes");
    add(summary.map_points.to_string(), "points of the map");
    add(summary.loops_closed.to_string(), "loops closed");
    add(millimetres(Some(summary.adjusted_by_max_m)), "largest shift by loops");
    let time = |median: f64, p95: f64| format!("{median:.1} ms (95 %: {p95:.1})");
    add(time(summary.track_median_ms, summary.track_p95_ms), "median time a frame");
    add(time(summary.total_median_ms, summary.total_p95_ms), "the same with reading");
    if let Some(truth) = &summary.truth {
        add(millimetres(Some(truth.position_error_rms_m)), "rms position error (truth)");
        add(millimetres(Some(truth.adjusted_position_error_rms_m)), "the same, adjusted (truth)");
        add(millimetres(Some(truth.position_error_max_m)), "largest position error (truth)");
    }
    merits
}

fn loss_section(document: &mut Document, summary: &TrackSummary) {
    if summary.losses.is_empty() {
        return;
    }
    document.section("Losses");
    let rows = summary.losses.iter().map(|loss| {
        vec![
            format!("{:.3}", loss.from_s),
            loss.found_s.map_or_else(|| "not found again".to_owned(), |time| format!("{time:.3}")),
            loss.frames.to_string(),
            loss.reason.to_owned(),
        ]
    });
    let columns = [
        Column::number("lost at").unit("s"),
        Column::number("found at").unit("s"),
        Column::number("frames"),
        Column::words("reason at first"),
    ];
    document.table(columns, rows.collect());
}
