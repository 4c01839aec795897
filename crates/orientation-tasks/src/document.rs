//! What was found, for people.

use std::fmt;

use report::{Column, Document};

use crate::summary::{InertialSummary, MountingSummary, OrientSummary};

/// Rows of a table on the terminal; the page and `summary.json` have all.
const MOST_LISTED: usize = 200;

impl fmt::Display for OrientSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it.
pub(crate) fn document(summary: &OrientSummary) -> Document {
    let by = match summary.by {
        "imu" => "by an inertial unit",
        "tracker" => "by a tracker",
        _ => "by targets",
    };
    let lead = format!("Stations of {} oriented {by}; calibration {}.", summary.survey, summary.calibration);
    let mut document = Document::new("rangecam: orient", lead);
    let all = summary.stations.len() + summary.not_oriented.len();
    document.merits([
        (format!("{} of {all}", summary.stations.len()), "stations oriented"),
        (worst(summary, |station| station.position_sigma_m, "m"), "largest standard deviation of a position"),
        (worst(summary, |station| station.attitude_sigma_deg, "degrees"), "largest standard deviation of an attitude"),
    ]);
    document.warnings(&summary.doubts);
    document.section("The stations");
    document.explanation(format!(
        "Positions in metre in {}, attitudes as omega, phi, kappa in degree; standard deviations in space and about all axes.",
        summary.datum
    ));
    stations(&mut document, summary);
    document.list(&summary.findings);
    if let Some(mounting) = &summary.mounting {
        document.section("How the camera sits on what was tracked");
        of_mounting(&mut document, mounting);
    }
    if let Some(inertial) = &summary.inertial {
        document.section("What the inertial unit is worth");
        of_unit(&mut document, inertial);
    }
    if !summary.rejected.is_empty() {
        document.section("Values that contradict");
        let row = |value: &crate::summary::RejectedValue| {
            let line = if value.line == 0 { String::new() } else { value.line.to_string() };
            vec![value.station.clone(), value.target.clone(), value.part.to_owned(), line]
        };
        let rows = summary.rejected.iter().take(MOST_LISTED).map(row).collect();
        document.table(
            [Column::words("station"), Column::words("target"), Column::words("part"), Column::number("line")],
            rows,
        );
    }
    document.closing(format!(
        "took {:.1} s; written to {}: stations.csv, summary.json, report.html",
        summary.seconds,
        summary.out.display()
    ));
    document
}

fn worst(summary: &OrientSummary, of: fn(&crate::OrientedStation) -> Option<f64>, unit: &str) -> String {
    let worst = summary.stations.iter().filter_map(of).fold(f64::NAN, f64::max);
    if worst.is_nan() { "none".to_owned() } else { format!("{worst:.4} {unit}") }
}

fn stations(document: &mut Document, summary: &OrientSummary) {
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
    let row = |station: &crate::OrientedStation| {
        let mut row = vec![station.name.clone()];
        row.extend(station.position_m.map(|value| format!("{value:.4}")));
        row.extend(station.attitude_deg.map(|value| format!("{value:.3}")));
        row.extend([number(station.position_sigma_m), number(station.attitude_sigma_deg)]);
        row.push(station.targets.map_or_else(String::new, |targets| targets.to_string()));
        row
    };
    let columns = [
        Column::words("station"),
        Column::number("x"),
        Column::number("y"),
        Column::number("z"),
        Column::number("omega"),
        Column::number("phi"),
        Column::number("kappa"),
        Column::number("sigma, m"),
        Column::number("sigma, degree"),
        Column::number("targets"),
    ];
    document.table(columns, summary.stations.iter().take(MOST_LISTED).map(row).collect());
    let left_out = summary.stations.len().saturating_sub(MOST_LISTED);
    if left_out > 0 {
        document.paragraph(format!("{left_out} further stations are in stations.csv."));
    }
}

fn of_mounting(document: &mut Document, mounting: &MountingSummary) {
    let [x, y, z] = mounting.lever_arm_m;
    let [sx, sy, sz] = mounting.lever_arm_sigma_m;
    let [a, b, c] = mounting.boresight_deg;
    document.paragraph(format!(
        "Lever arm ({x:.4}, {y:.4}, {z:.4}) m +- ({sx:.4}, {sy:.4}, {sz:.4}) m in the axes of the tracker's file; rotation \
         ({a:.3}, {b:.3}, {c:.3}) degrees about these axes, +- {:.3} degrees.",
        mounting.boresight_sigma_deg
    ));
    if let Some([offset, sigma]) = mounting.time_offset_s {
        document.paragraph(format!("The tracker's clock is ahead of the camera's by {offset:.4} s +- {sigma:.4} s."));
    }
    let sigma0 = mounting.sigma0.map_or_else(|| "none".to_owned(), |sigma0| format!("{sigma0:.2}"));
    document.paragraph(format!(
        "From {} known stations; redundancy {}, sigma0 {sigma0}.",
        mounting.known_stations, mounting.redundancy
    ));
}

fn of_unit(document: &mut Document, unit: &InertialSummary) {
    let three = |values: [f64; 3]| format!("({:.5}, {:.5}, {:.5})", values[0], values[1], values[2]);
    document.paragraph(format!(
        "Velocity and biases from {}: rates {} rad/s, forces {} m/s².",
        if unit.start == "rest" { "the rest before the first known pose" } else { "the sequence of known poses" },
        three(unit.gyro_bias_rad_s),
        three(unit.accel_bias_m_s2)
    ));
    let row = |one: &crate::SigmaAtTime| {
        vec![format!("{:.2}", one.seconds), format!("{:.4}", one.position_m), format!("{:.3}", one.attitude_deg)]
    };
    document.table(
        [
            Column::number("seconds since a known pose"),
            Column::number("sigma of the position, m"),
            Column::number("sigma of the attitude, degree"),
        ],
        unit.growth.iter().map(row).collect(),
    );
}
