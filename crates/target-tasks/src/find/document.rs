//! What was found, for people: a table of the stations, and every target drawn over its image.

use std::fmt;

use pipeline::Result;
use report::{Column, Document, Figure, marked_figure};
use statistics::quantile;

use crate::find::station::{LeftOut, Seen, StationPicture};
use crate::find::summary::TargetsSummary;

/// Stations that are drawn; of longer surveys those that lack the targets come first.
const MOST_DRAWN: usize = 60;

/// Shares of the grey values that are drawn black and white: a lamp in the image must not leave the board dark.
const BLACK_AND_WHITE: [f64; 2] = [0.01, 0.99];

impl fmt::Display for TargetsSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        text(self).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &TargetsSummary, stations: &[StationPicture]) -> Result<Document> {
    let mut document = text(summary);
    let mut shown: Vec<&StationPicture> = stations.iter().collect();
    shown.sort_by_key(|station| station.seen.is_ok());
    document.section("The images");
    document.explanation(
        "A ring marks each point that was found; of a board a filled one node (0, 0), and the line runs along its first row. \
         Single targets have their names beside them; what has a mark and no name is none of those with coordinates.",
    );
    let left_out = shown.len().saturating_sub(MOST_DRAWN);
    if left_out > 0 {
        document.explanation(format!("{left_out} further stations are not drawn; those without targets come first."));
    }
    let figures = shown.into_iter().take(MOST_DRAWN).map(picture);
    document.figures(figures.collect::<Result<Vec<_>>>()?);
    Ok(document)
}

fn text(summary: &TargetsSummary) -> Document {
    let stations = summary.stations.len() + summary.missing.len();
    let lead = format!("Targets in the images of {}: {}.", summary.survey, summary.kind);
    let mut document = Document::new("rangecam: targets", lead);
    document.merits([
        (format!("{} of {stations}", summary.stations.len()), "stations show the targets"),
        (summary.points.to_string(), "image points"),
        (summary.ranges.to_string(), "ranges"),
    ]);
    document.warnings(&summary.doubts);
    document.section("The stations");
    document.explanation(
        "Deviation: of a board's points from a projective map that bends with a lens, or of single targets from where their \
         coordinates put them (the lens is in it); sigma: what the noise of the image leaves of a coordinate, in the median.",
    );
    let rows = summary.stations.iter().map(|station| {
        let ways = if station.ambiguity == 1 { "one".to_owned() } else { station.ambiguity.to_string() };
        vec![
            station.station.clone(),
            format!("{} of {}", station.points, station.of),
            station.ranges.to_string(),
            ways,
            station.residual_px.map_or_else(String::new, |residual| format!("{residual:.3}")),
            format!("{:.3}", station.sigma_px),
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
    let unchecked: usize = summary.stations.iter().map(|station| station.unchecked).sum();
    if unchecked > 0 {
        document.paragraph(format!(
            "{unchecked} points are named by their codes alone, and nothing checks these names: a code that was read wrongly would not \
             show. The coordinates of six rings or more in targets.csv would check them, and so would other stations that see them and share \
             six rings."
        ));
    }
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

fn picture(station: &StationPicture) -> Result<Figure> {
    let light = &station.light;
    let finite = || light.as_slice().iter().filter(|value| value.is_finite()).map(|value| f64::from(*value));
    let [black, white] = BLACK_AND_WHITE.map(|share| quantile(&mut finite().collect::<Vec<_>>(), share));
    let grey = |value: &f32| match f64::from(*value) {
        value if value.is_finite() && white > black => (255.0 * (value - black) / (white - black)) as u8,
        _ => 0,
    };
    let grey: Vec<u8> = light.as_slice().iter().map(grey).collect();
    let (marks, line, caption) = match &station.seen {
        Ok(seen) => (seen.marks.as_slice(), seen.line.as_slice(), caption(seen, station.observations.len())),
        Err(reason) => (&[][..], &[][..], format!("Not found: {reason}.")),
    };
    Ok(marked_figure(&station.station, light.width(), &grey, marks, line)?.caption(caption))
}

/// How many there are, and why others are not among them.
fn caption(seen: &Seen, points: usize) -> String {
    let mut sentences = vec![format!("{points} of {} points.", seen.of)];
    if seen.unnamed > 0 {
        sentences.push(format!("{} look like targets and are none.", seen.unnamed));
    }
    let reason = |left: &LeftOut| format!("{}: {}.", left.target, left.reason);
    sentences.extend(seen.left_out.iter().filter(|left| !left.target.is_empty()).map(reason));
    if !seen.hidden.is_empty() {
        sentences.push(format!("In the image, and not seen: {}.", seen.hidden.join(", ")));
    }
    sentences.join(" ")
}
