//! A comparison for people.

use std::fmt;

use commands::Judged;
use nalgebra::Vector3;
use report::{Column, Document};

use crate::compare::figures::Figures;
use crate::compare::{
    CloudComparison, Comparison, PoseComparison, TrajectoryComparison, TrajectoryStatistics, millimetres_of as mm,
};

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Figures::default()).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(comparison: &Comparison, figures: Figures) -> Document {
    let lead = format!("{} against {}, which is taken as the reference.", comparison.first, comparison.second);
    let mut document = Document::new("rangecam: comparison", lead);
    document.warnings(comparison.doubts());
    if let Some(clouds) = &comparison.clouds {
        document.section("Clouds");
        cloud_section(&mut document, clouds);
        document.figures(figures.clouds);
        document.figures(figures.distances);
    }
    if let Some(poses) = &comparison.poses {
        station_section(&mut document, poses);
    }
    if let Some(trajectory) = &comparison.trajectory {
        trajectory_section(&mut document, trajectory);
        document.figures(figures.trajectory);
    }
    if let Some(report) = &comparison.report {
        document.closing(format!("report: {}", report.display()));
    }
    document
}

fn cloud_section(document: &mut Document, clouds: &CloudComparison) {
    document.paragraph(format!(
        "{} points against {} ({} more are flagged or without position, {} too far away).",
        clouds.points, clouds.reference_points, clouds.left_out, clouds.beyond
    ));
    if let Some(alignment) = &clouds.alignment {
        let ([x, y, z], [a, b, c]) = (alignment.translation_m, alignment.rotation_deg);
        document.paragraph(format!(
            "Registered before: moved by ({x:.4}, {y:.4}, {z:.4}) m, turned by ({a:.3}, {b:.3}, {c:.3}) degrees; {:.0} % of \
             the points have a partner, rms {}.",
            100.0 * alignment.overlap,
            mm(alignment.rms_m)
        ));
    }
    let mut rows = vec![vec![
        "nearest point".to_owned(),
        mm(clouds.distance_median_m),
        mm(clouds.distance_p95_m),
        mm(clouds.distance_rms_m),
        mm(clouds.distance_max_m),
        "-".to_owned(),
        clouds.points.to_string(),
    ]];
    if let Some(plane) = &clouds.plane {
        rows.push(vec![
            "local plane".to_owned(),
            mm(plane.absolute_median_m),
            mm(plane.absolute_p95_m),
            mm(plane.rms_m),
            mm(plane.absolute_max_m),
            mm(plane.mean_m),
            plane.points.to_string(),
        ]);
    }
    let numbers = ["median", "95 % below", "rms", "largest", "mean, signed", "points"].map(Column::number);
    document.table(std::iter::once(Column::words("distance to")).chain(numbers), rows);
    if let Some(plane) = &clouds.plane {
        document.paragraph(format!("Signed distances are positive {}.", plane.positive));
    }
}

fn station_section(document: &mut Document, poses: &PoseComparison) {
    document.section("Stations");
    document.merits([
        (mm(poses.position_rms_m), "rms difference of the positions"),
        (mm(poses.position_max_m), "largest"),
        (format!("{:.4}°", poses.attitude_max_deg), "largest difference of the attitudes"),
    ]);
    document.paragraph(format!(
        "{} stations in common, {} only in the first, {} only in the second. Differences are first less second.",
        poses.poses, poses.only_first, poses.only_second
    ));
    let rows = poses.stations.iter().map(|row| {
        let length = Vector3::from(row.position_m).norm();
        let [x, y, z] = row.position_m.map(mm);
        vec![row.station.clone(), x, y, z, mm(length), format!("{:.4}°", row.attitude_deg)]
    });
    let numbers = ["x", "y", "z", "length", "attitude"].map(Column::number);
    document.long_table(std::iter::once(Column::words("station")).chain(numbers), rows.collect());
}

fn trajectory_section(document: &mut Document, trajectory: &TrajectoryComparison) {
    document.section("Trajectory");
    let [a, b] = trajectory.poses;
    document.paragraph(format!("{} poses in common, of {a} and {b}.", trajectory.matched));
    let row = |name: String, metres: &TrajectoryStatistics, degrees: &TrajectoryStatistics, steps: String| {
        let mut cells = vec![name];
        cells.extend([metres.rms, metres.median, metres.max].map(mm));
        cells.extend([degrees.rms, degrees.median, degrees.max].map(|value| format!("{value:.3}°")));
        cells.push(steps);
        cells
    };
    let absolute = trajectory.absolute.iter().map(|line| {
        let name = match line.alignment {
            "with scale" => format!("absolute, with scale {:.5}", line.scale),
            "rigid" => "absolute, rigidly aligned".to_owned(),
            other => format!("absolute, {other}"),
        };
        row(name, &line.position_m, &line.attitude_deg, String::new())
    });
    let relative = trajectory.relative.iter().map(|line| {
        row(format!("relative over {}", line.step), &line.translation_m, &line.rotation_deg, line.steps.to_string())
    });
    let numbers =
        ["position rms", "median", "largest", "attitude rms", "median", "largest", "steps"].map(Column::number);
    document.table(std::iter::once(Column::words("error")).chain(numbers), absolute.chain(relative).collect());
    let worst: Vec<String> =
        trajectory.worst.iter().map(|[time, error]| format!("{} at {time:.3} s", mm(*error))).collect();
    document.paragraph(format!("Largest errors: {}.", worst.join(", ")));
}
