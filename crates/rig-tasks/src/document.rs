//! A rig for people: sections in the order in which it is judged.

use std::fmt;

use report::{Axes, CATEGORIES, Column, Document, Figure, Merit, Series, curves, heat_map};

use crate::certificate::verdicts;
use crate::summary::{CameraSummary, EpochResidual, RigSummary};

/// Correlations from here on are outlined.
const STRONG: f64 = 0.9;

impl fmt::Display for RigSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &RigSummary) -> Document {
    let names: Vec<&str> = summary.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let lead = format!("Rig {}: cameras {} in one adjustment.", summary.rig, names.join(", "));
    let mut document = Document::new("rangecam: calibration of a rig", lead);
    let mut merits = vec![
        Merit::new(summary.cameras.len().to_string(), "cameras"),
        Merit::new(summary.epochs.to_string(), "epochs"),
        Merit::new(summary.observations.to_string(), "observed values"),
        Merit::new(summary.unknowns.to_string(), "unknowns"),
        Merit::new(summary.redundancy.to_string(), "redundancy"),
    ];
    merits.extend(summary.sigma0.map(|sigma0| Merit::new(format!("{sigma0:.3}"), "sigma0 (1: as noisy as stated)")));
    document.merits(merits);
    document.warnings(&summary.doubts);
    document.section("Diagnosis");
    if summary.diagnosis.is_empty() {
        document.explanation("Nothing is weakly determined.");
    }
    document.list(&summary.diagnosis);
    if let Some(certificate) = &summary.certificate {
        document.section("Verdicts");
        document.explanation(
            "What every test says; those of each camera are in its own certificate. Epochs left out (--hold-out) are predicted camera by \
             camera: the other cameras give the pose of the rig, and mounting, lens and range terms come from the other epochs.",
        );
        verdicts(&mut document, certificate);
    }
    mountings(&mut document, summary);
    by_epoch(&mut document, &summary.cameras);
    cameras(&mut document, &summary.cameras);
    document.closing(if summary.converged {
        format!(
            "took {:.1} s; written to {}: report.html, certificate.html, summary.json, mountings.csv, adjusted_epochs.csv, \
             adjusted_targets.csv, and a folder for each camera with its calibration.ron, residuals, report and certificate",
            summary.seconds,
            summary.out.display()
        )
    } else {
        format!("refused; written to {}: summary.json", summary.out.display())
    });
    document
}

fn mountings(document: &mut Document, summary: &RigSummary) {
    document.section("Mountings");
    document.explanation(
        "Perspective centre and rotation of each camera in the frame of the first one, with prior-scaled standard deviations. \
         One mounting holds for all epochs.",
    );
    let names = ["x", "y", "z", "omega", "phi", "kappa"];
    let row = |camera: &CameraSummary| {
        let values = camera.position_m.map(|value| format!("{value:.5}")).into_iter();
        let values = values.chain(camera.angles_deg.map(|value| format!("{value:.4}")));
        std::iter::once(camera.name.clone()).chain(values).collect()
    };
    let columns = ["x, m", "y, m", "z, m", "omega, deg", "phi, deg", "kappa, deg"].map(Column::number);
    let columns: Vec<Column> = std::iter::once(Column::words("camera")).chain(columns).collect();
    document.table(columns, summary.cameras.iter().map(row).collect());
    let sigmas = |camera: &CameraSummary| {
        let (position, angles) = camera.sigma_position_m.zip(camera.sigma_angles_deg)?;
        let position = position.map(|sigma| format!("{:.3}", 1e3 * sigma)).into_iter();
        let values = position.chain(angles.map(|sigma| format!("{sigma:.5}")));
        Some(std::iter::once(camera.name.clone()).chain(values).collect())
    };
    let columns = names
        .iter()
        .enumerate()
        .map(|(index, name)| Column::number(format!("sigma {name}, {}", if index < 3 { "mm" } else { "deg" })));
    let columns: Vec<Column> = std::iter::once(Column::words("camera")).chain(columns).collect();
    document.table(columns, summary.cameras.iter().filter_map(sigmas).collect());
    let mountings = &summary.mountings;
    if !mountings.names.is_empty() {
        let value = |first: &str, second: &str| {
            let place = |name: &str| mountings.names.iter().position(|known| known == name);
            Some(mountings.correlation[place(first)?][place(second)?])
        };
        let is_strong = |first: &str, second: &str| value(first, second).is_some_and(|value| value.abs() >= STRONG);
        let title = "Correlations of the mountings";
        document.figures([heat_map(title, &mountings.names, &mountings.correlation, is_strong)
            .caption("Steps along the rig's axes and about the camera's; outlined: 0.9 and more.")]);
    }
}

fn by_epoch(document: &mut Document, cameras: &[CameraSummary]) {
    if cameras.iter().all(|camera| camera.by_epoch.is_empty()) {
        return;
    }
    document.section("Mounting residuals by epoch");
    document.explanation(
        "Where each camera sat at an epoch by what it observed there alone, against the mounting of all epochs: a camera that \
         moved on the rig, or was exposed at another moment, stands out. In sigmas: the largest of the six components over \
         its standard deviation from that epoch's observations.",
    );
    let mounted = || cameras.iter().filter(|camera| !camera.by_epoch.is_empty());
    let length = |values: &[f64; 3]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let figure = |title: &str, y: &str, value: &dyn Fn(&EpochResidual) -> f64| -> Figure {
        let series: Vec<Series<'_, (f64, f64)>> = mounted()
            .enumerate()
            .map(|(index, camera)| Series {
                name: &camera.name,
                colour: CATEGORIES[index % CATEGORIES.len()],
                values: camera.by_epoch.iter().enumerate().map(|(i, residual)| (i as f64, value(residual))).collect(),
            })
            .collect();
        curves(&Axes { title, x: "epoch, in the order of the table", y }, &series)
    };
    document.figures([
        figure("Shift of the mounting by epoch", "mm", &|residual| length(&residual.shift_mm)),
        figure("Turn of the mounting by epoch", "degrees", &|residual| length(&residual.turn_deg)),
        figure("Largest component by epoch", "standard deviations", &|residual| residual.largest_in_sigmas),
    ]);
    let rows = mounted().flat_map(|camera| {
        camera.by_epoch.iter().map(move |residual| {
            let shift = residual.shift_mm.map(|value| format!("{value:+.2}"));
            let turn = residual.turn_deg.map(|value| format!("{value:+.4}"));
            let names = [camera.name.clone(), residual.epoch.clone()].into_iter();
            names.chain(shift).chain(turn).chain([format!("{:.1}", residual.largest_in_sigmas)]).collect()
        })
    });
    let numbers =
        ["x, mm", "y, mm", "z, mm", "about x, deg", "about y, deg", "about z, deg", "in sigmas"].map(Column::number);
    let columns: Vec<Column> = ["camera", "epoch"].map(Column::words).into_iter().chain(numbers).collect();
    document.long_table(columns, rows.collect());
}

fn cameras(document: &mut Document, cameras: &[CameraSummary]) {
    document.section("Cameras");
    document.explanation(
        "Observed values of each camera; the scale says how much larger its standard deviations are than they were given. \
         Parameters and residuals of a camera are in the report of its own folder.",
    );
    let rows = cameras.iter().flat_map(|camera| {
        camera.groups.iter().map(move |(name, observations, _, sigma0)| {
            vec![
                camera.name.clone(),
                name.clone(),
                observations.to_string(),
                sigma0.map_or_else(|| "–".to_owned(), |sigma0| format!("{sigma0:.3}")),
                camera.rejected.to_string(),
            ]
        })
    });
    let columns = [
        Column::words("camera"),
        Column::words("group"),
        Column::number("observed values"),
        Column::number("sigma0"),
        Column::number("values of the camera rejected"),
    ];
    document.table(columns, rows.collect());
    for camera in cameras {
        document.subsection(format!("Estimated parameters of {}", camera.name));
        let estimated = camera.parameters.0.iter().filter(|(_, parameter)| parameter.status == "estimated");
        let row = |(name, parameter): &(String, calibration_tasks::ParameterSummary)| {
            let (value, sigma) = (parameter.value, parameter.sigma_prior);
            vec![name.clone(), format!("{value:.6e}"), format!("{sigma:.1e}"), parameter.unit.clone()]
        };
        let columns =
            [Column::words("parameter"), Column::number("value"), Column::number("sigma prior"), Column::words("unit")];
        document.table(columns, estimated.map(row).collect());
    }
}
