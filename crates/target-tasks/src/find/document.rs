//! What was found, for people: a table of the stations, and every target drawn over its image.

use std::fmt;

use pipeline::Result;
use report::{Column, Document, Figure, Mark, marked_figure};
use statistics::quantile;

use crate::find::sightings::Sighting;
use crate::find::summary::TargetsSummary;
use crate::kind::TargetKind;

/// Stations that are drawn; of longer surveys those that lack the board come first.
const MOST_DRAWN: usize = 60;

/// Shares of the grey values that are drawn black and white: a lamp in the image must not leave the board dark.
const BLACK_AND_WHITE: [f64; 2] = [0.01, 0.99];

impl fmt::Display for TargetsSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        text(self).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &TargetsSummary, sightings: &[Sighting], kind: &TargetKind) -> Result<Document> {
    let mut document = text(summary);
    let mut shown: Vec<&Sighting> = sightings.iter().collect();
    shown.sort_by_key(|sighting| sighting.board.is_ok());
    document.section("The images");
    document.explanation(
        "A ring marks each point that was found, a filled one node (0, 0); the line runs along the first row. What is not \
         marked takes no part.",
    );
    let left_out = shown.len().saturating_sub(MOST_DRAWN);
    if left_out > 0 {
        document.explanation(format!("{left_out} further stations are not drawn; those without the board come first."));
    }
    let figures = shown.into_iter().take(MOST_DRAWN).map(|sighting| picture(sighting, kind));
    document.figures(figures.collect::<Result<Vec<_>>>()?);
    Ok(document)
}

fn text(summary: &TargetsSummary) -> Document {
    let stations = summary.boards.len() + summary.missing.len();
    let lead = format!("Targets in the images of {}: {}.", summary.survey, summary.kind);
    let mut document = Document::new("rangecam: targets", lead);
    document.merits([
        (format!("{} of {stations}", summary.boards.len()), "stations show the board"),
        (summary.points.to_string(), "image points"),
        (summary.ranges.to_string(), "ranges"),
    ]);
    document.warnings(&summary.doubts);
    document.section("The stations");
    document.explanation(
        "Deviation from a smooth map: of the points from a projective map that bends with a lens; sigma: what the noise of \
         the image leaves of a coordinate, in the median.",
    );
    let rows = summary.boards.iter().map(|board| {
        let ways = if board.ambiguity == 1 { "one".to_owned() } else { board.ambiguity.to_string() };
        vec![
            board.station.clone(),
            format!("{} of {}", board.points, board.of),
            board.ranges.to_string(),
            ways,
            format!("{:.3}", board.residual_px),
            format!("{:.3}", board.sigma_px),
        ]
    });
    let columns = [
        Column::words("station"),
        Column::number("points"),
        Column::number("ranges"),
        Column::number("ways to number them"),
        Column::number("deviation, pixel"),
        Column::number("sigma, pixel"),
    ];
    document.table(columns, rows.collect());
    document.paragraph(format!(
        "Principal distance {:.1} pixels ({}).",
        summary.principal_distance_px,
        match summary.principal_distance_from {
            "boards" => "from the perspective of the boards: a start value",
            "given" => "as given",
            _ => "of the survey",
        }
    ));
    document.closing(format!(
        "took {:.1} s; written to {}: survey.ron, observations.csv, targets.csv, summary.json, report.html",
        summary.seconds,
        summary.out.display()
    ));
    document
}

fn picture(sighting: &Sighting, kind: &TargetKind) -> Result<Figure> {
    let light = &sighting.light;
    let finite = || light.as_slice().iter().filter(|value| value.is_finite()).map(|value| f64::from(*value));
    let [black, white] = BLACK_AND_WHITE.map(|share| quantile(&mut finite().collect::<Vec<_>>(), share));
    let grey = |value: &f32| match f64::from(*value) {
        value if value.is_finite() && white > black => (255.0 * (value - black) / (white - black)) as u8,
        _ => 0,
    };
    let grey: Vec<u8> = light.as_slice().iter().map(grey).collect();
    let (marks, line, caption) = match &sighting.board {
        Ok(board) => {
            let mark = |seen: &targets::NodePoint| Mark { at: seen.point.pixel, is_filled: seen.node == [0, 0] };
            let line = board.nodes.iter().filter(|seen| seen.node[1] == 0).map(|seen| seen.point.pixel);
            let [columns, rows] = kind.size();
            let caption = format!("{} of {} points", board.nodes.len(), columns * rows);
            (board.nodes.iter().map(mark).collect(), line.collect(), caption)
        }
        Err(reason) => (Vec::new(), Vec::new(), format!("Not found: {reason}.")),
    };
    Ok(marked_figure(&sighting.station, light.width(), &grey, &marks, &line)?.caption(caption))
}
