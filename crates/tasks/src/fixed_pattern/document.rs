//! An estimation of a fixed pattern for people.

use std::fmt;

use report::{Column, Document, Figure, millimetres};

use crate::fixed_pattern::summary::FixedPatternSummary;

impl fmt::Display for FixedPatternSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Vec::new()).fmt(f)
    }
}

/// All of it, with figures of the pattern.
pub(crate) fn document(summary: &FixedPatternSummary, pattern: Vec<Figure>) -> Document {
    let lead = format!(
        "Range offsets of single pixels, estimated from {} frames of the walls of {}. Calibration applied before: {}.",
        summary.walls.len(),
        summary.survey,
        summary.calibration
    );
    let mut document = Document::new("rangecam: fixed pattern", lead);
    document.merits([
        (summary.verdict.clone(), "verdict".to_owned()),
        (millimetres(Some(summary.offset_rms_m)), format!("offsets of {} pixels, rms", summary.pixels)),
        (millimetres(Some(summary.deviation_rms_m)), "their standard deviation".to_owned()),
        (millimetres(Some(summary.rms_without_m)), format!("held-out {}, rms without", summary.held_out)),
        (millimetres(Some(summary.rms_with_m)), "with the others' pattern".to_owned()),
    ]);
    document.section("The offsets");
    document.figures(pattern);
    test(&mut document, summary);
    walls(&mut document, summary);
    let left_out = if summary.applied { "with the pattern" } else { "without a pattern" };
    let out = summary.out.display();
    document.closing(format!(
        "took {:.1} s; written to {out}: calibration.ron {left_out}, summary.json, report.html",
        summary.seconds
    ));
    document
}

fn test(document: &mut Document, summary: &FixedPatternSummary) {
    document.section("Does it raise the precision?");
    document.explanation(format!(
        "The {} were held out in turn, in {} parts, and freed of the pattern of the others. {}.",
        summary.held_out, summary.held_out_parts, summary.verdict
    ));
    let row = |name: &str, [without, with]: [f64; 2]| {
        vec![name.to_owned(), format!("{:.2}", 1e3 * without), format!("{:.2}", 1e3 * with)]
    };
    document.table(
        [
            Column::words("held-out residuals, rms"),
            Column::number("without").unit("mm"),
            Column::number("with").unit("mm"),
        ],
        vec![
            row("mean of a wall's frames", [summary.rms_without_m, summary.rms_with_m]),
            row("single frames", [summary.frame_rms_without_m, summary.frame_rms_with_m]),
        ],
    );
    if let (Some(statistic), Some(probability)) = (summary.statistic, summary.probability) {
        document.paragraph(format!(
            "Fall of the squares over {} blocks of pixels: t = {statistic:.2}, by chance with probability {probability:.1e}.",
            summary.blocks
        ));
    }
    if summary.held_out == "frames" {
        document.paragraph("One station: whatever belongs to this wall and place passes for a pattern.");
    }
}

fn walls(document: &mut Document, summary: &FixedPatternSummary) {
    document.section("The walls");
    let rows = summary.walls.iter().map(|wall| {
        vec![
            wall.station.clone(),
            wall.pixels.to_string(),
            format!("{:.1}", 100.0 * wall.outlier_share),
            format!("{:.2}", 1e3 * wall.residual_rms_m),
            format!("{:.2}", wall.sigma0),
            format!("{:.2}", wall.systematic_sigmas),
        ]
    });
    let columns = [
        Column::words("station"),
        Column::number("pixels"),
        Column::number("elsewhere").unit("%"),
        Column::number("residuals, rms").unit("mm"),
        Column::number("sigma0"),
        Column::number("shared by neighbours").unit("sigmas"),
    ];
    document.long_table(columns, rows.collect());
}
