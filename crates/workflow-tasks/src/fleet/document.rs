//! A fleet for people.

use std::fmt;

use range_image::Flags;
use report::{Column, Document, Merit};

use super::{Camera, DayCheck, Fleet, RecordingRow};

impl fmt::Display for Fleet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it.
pub(crate) fn document(fleet: &Fleet) -> Document {
    let lead = format!(
        "Recordings: {}; cameras: {}; with a result: {}.",
        fleet.recordings,
        fleet.cameras.len(),
        fleet.with_result
    );
    let mut document = Document::new("rangecam: fleet", lead);
    document.merits(merits(fleet));
    document.warnings(&fleet.doubts);
    calibrations(&mut document, fleet);
    flags(&mut document, fleet);
    failures(&mut document, fleet);
    doubts(&mut document, fleet);
    recordings(&mut document, fleet);
    document.closing(format!("written to {}: fleet.csv, report.html, summary.json", fleet.out.display()));
    document
}

fn merits(fleet: &Fleet) -> Vec<Merit> {
    let moved =
        fleet.cameras.iter().filter(|camera| camera.checks.iter().any(|check| check.matters == Some(true))).count();
    let failed: usize = fleet.failures.iter().map(|failure| failure.steps.len()).sum();
    let flagged = fleet.flags_fraction.get("any").map_or_else(|| "-".to_owned(), |share| percent(*share));
    vec![
        Merit::new(format!("{} of {}", fleet.with_result, fleet.recordings), "recordings with a result"),
        Merit::new(moved.to_string(), "cameras whose calibration moved"),
        Merit::new(flagged, "pixels flagged, mean of recordings"),
        Merit::new(failed.to_string(), "steps without a result"),
    ]
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn calibrations(document: &mut Document, fleet: &Fleet) {
    document.section("Calibrations");
    let row = |camera: &Camera| {
        let (made, sigma0) = camera
            .calibration
            .as_ref()
            .map_or_else(|| ("given".to_owned(), None), |made| (ended(made.recorded.code).to_owned(), made.sigma0));
        let matters = camera.checks.iter().filter(|check| check.matters == Some(true)).count();
        let largest = camera.checks.iter().filter_map(|check| check.change_rms_m).reduce(f64::max);
        vec![
            camera.camera.clone(),
            made,
            sigma0.map_or("-".to_owned(), |sigma0| format!("{sigma0:.2}")),
            camera.checks.len().to_string(),
            matters.to_string(),
            largest.map_or("-".to_owned(), |change| format!("{:.2}", 1e3 * change)),
        ]
    };
    let columns = [
        Column::words("camera"),
        Column::words("calibration"),
        Column::number("sigma0"),
        Column::number("days checked"),
        Column::number("days no longer right"),
        Column::number("largest change").unit("mm"),
    ];
    document.table(columns, fleet.cameras.iter().map(row).collect());
    document.explanation(
        "The change is the root mean square change of the range correction, from surfaces that the stations of the day's check see in \
         common. A day on which the check cannot tell is no sign that the calibration holds.",
    );
    let days = fleet.cameras.iter().flat_map(|camera| camera.checks.iter().map(move |check| (camera, check)));
    let day = |(camera, check): (&Camera, &DayCheck)| {
        let says = match (check.recorded.code, check.moved) {
            (0, Some(true)) => "moved by less than matters",
            (0, _) => "still right",
            (1, _) => "no longer right",
            (3, _) => "cannot tell",
            _ => "failed",
        };
        let change = check.change_rms_m.map_or("-".to_owned(), |change| format!("{:.2}", 1e3 * change));
        vec![camera.camera.clone(), check.day.clone(), says.to_owned(), change]
    };
    let columns = [
        Column::words("camera"),
        Column::words("day"),
        Column::words("calibration"),
        Column::number("change").unit("mm"),
    ];
    document.long_table(columns, days.map(day).collect());
}

/// How a step ended, in a word.
fn ended(code: u8) -> &'static str {
    match code {
        0 => "done",
        1 => "doubtful",
        3 => "refused",
        5 => "done in part",
        _ => "failed",
    }
}

fn flags(document: &mut Document, fleet: &Fleet) {
    document.section("Flags");
    let named = Flags::NAMED.into_iter().map(|(_, name)| name);
    let present: Vec<&str> = named.filter(|name| fleet.flags_fraction.contains_key(*name)).collect();
    let names: Vec<&str> = std::iter::once("any").chain(present).collect();
    let mut columns = vec![Column::words("camera")];
    columns.extend(names.iter().map(|name| Column::number(name.replace('_', " ")).unit("%")));
    let shares = |label: &str, rows: &[&RecordingRow]| {
        let mean = |name: &&str| {
            let counted: Vec<f64> = rows
                .iter()
                .filter(|row| !row.flags_fraction.is_empty())
                .map(|row| row.flags_fraction.get(*name).copied().unwrap_or(0.0))
                .collect();
            if counted.is_empty() {
                return "-".to_owned();
            }
            format!("{:.2}", 100.0 * counted.iter().sum::<f64>() / counted.len() as f64)
        };
        let mut row = vec![label.to_owned()];
        row.extend(names.iter().map(mean));
        row
    };
    let of = |camera: &Camera| -> Vec<&RecordingRow> {
        fleet.rows.iter().filter(|row| row.place[0] == camera.camera).collect()
    };
    let mut rows: Vec<Vec<String>> = fleet.cameras.iter().map(|camera| shares(&camera.camera, &of(camera))).collect();
    rows.push(shares("all", &fleet.rows.iter().collect::<Vec<_>>()));
    document.table(columns, rows);
    document.explanation("Shares of all pixels, mean of the recordings that have a result.");
}

fn failures(document: &mut Document, fleet: &Fleet) {
    document.section("Steps without a result");
    let rows = fleet
        .failures
        .iter()
        .map(|failure| vec![failure.code.to_string(), failure.words.to_owned(), failure.steps.len().to_string()]);
    let columns = [Column::number("exit code"), Column::words("what it says"), Column::number("steps")];
    document.table(columns, rows.collect());
    let steps: Vec<&String> = fleet.failures.iter().flat_map(|failure| &failure.steps).collect();
    document.list(&steps);
}

fn doubts(document: &mut Document, fleet: &Fleet) {
    document.section("Doubts");
    let rows = fleet.doubt_kinds.iter().map(|doubt| vec![doubt.kind.replace('_', " "), doubt.recordings.to_string()]);
    document.table([Column::words("kind"), Column::number("recordings")], rows.collect());
}

fn recordings(document: &mut Document, fleet: &Fleet) {
    document.section("Recordings");
    let row = |row: &RecordingRow| {
        let mut cells = row.place.to_vec();
        cells.push(ended(row.code).to_owned());
        cells.push(row.frames.map_or("-".to_owned(), |frames| frames.to_string()));
        cells.push(row.points.map_or("-".to_owned(), |points| points.to_string()));
        cells.push(row.sigma_range_median_m.map_or("-".to_owned(), |sigma| format!("{:.2}", 1e3 * sigma)));
        cells.push(row.flags_fraction.get("any").map_or("-".to_owned(), |share| format!("{:.1}", 100.0 * share)));
        cells
    };
    let columns = [
        Column::words("camera"),
        Column::words("day"),
        Column::words("recording"),
        Column::words("ended"),
        Column::number("frames"),
        Column::number("points"),
        Column::number("median sigma").unit("mm"),
        Column::number("flagged").unit("%"),
    ];
    document.long_table(columns, fleet.rows.iter().map(row).collect());
}
