//! A planned network for people.

use std::fmt;

use nalgebra::Matrix3;
use pipeline::Result;
use report::{Column, Document, Figure, Merit};
use self_calibration::{AdjustedStation, AdjustedTarget, Network, PlanOutcome};

use crate::calibrate::document::page::correlations;
use crate::calibrate::document::tables;
use crate::calibrate::figures::map::{self, Proposed};
use crate::calibrate::figures::point_uncertainty;
use crate::calibrate::point_uncertainty::PointUncertainty;
use crate::plan::{CandidateSummary, PlanSummary};

/// Candidates drawn and listed; the summary has them all.
const SHOWN_CANDIDATES: usize = 8;
/// Targets that a station should see.
const FEWEST_TARGETS: usize = 3;

/// The figures of each section.
#[derive(Default)]
pub(crate) struct Figures {
    /// Planned targets.
    targets: usize,
    network: Vec<(Figure, String)>,
    points: Vec<(Figure, String)>,
}

impl Figures {
    pub(crate) fn new(network: &Network, outcome: &PlanOutcome) -> Result<Self> {
        let models = [(None, network.range_model.clone())];
        let source = PointUncertainty { camera: &network.camera, range_models: &models };
        let points = point_uncertainty::figures(&source, &outcome.estimated, &outcome.covariance, f64::NAN)?;
        Ok(Self { targets: network.targets.len(), network: drawing(network, outcome), points })
    }
}

impl fmt::Display for PlanSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Figures::default()).fmt(f)
    }
}

/// All of it, with its figures.
pub(crate) fn document(summary: &PlanSummary, figures: Figures) -> Document {
    let lead = format!(
        "Expected quality of a calibration of {} as planned: {} stations. Camera: {}.",
        summary.survey,
        summary.sightings_per_station.len(),
        summary.start
    );
    let mut document = Document::new("rangecam: plan of a calibration network", lead);
    document.merits(merits(summary));
    tables::diagnosis(&mut document, &summary.diagnosis);
    expected(&mut document, summary);
    candidates(&mut document, summary);
    document.section("Network");
    document.explanation(format!("{} targets.", figures.targets));
    document.figures(figures.network);
    document.section("What the calibration's uncertainty would mean for a point");
    document.figures(figures.points);
    correlations(&mut document, &summary.correlation);
    sightings(&mut document, summary);
    document.closing(format!("written to {}: report.html, summary.json", summary.out.display()));
    document
}

fn merits(summary: &PlanSummary) -> Vec<Merit> {
    let mut merits = vec![
        Merit::new(if summary.accepted { "yes" } else { "no" }, "strong enough to calibrate"),
        Merit::new(summary.observations.to_string(), "observed values"),
        Merit::new(summary.unknowns.to_string(), "unknowns"),
        Merit::new(summary.redundancy.to_string(), "redundancy"),
    ];
    if let Some(inflation) = summary.inflation {
        merits.push(Merit::new(format!("{inflation:.0}"), "inflation of the weakest combination"));
    }
    for point in &summary.point_sigma {
        let name = format!("of a point at {} m, from the calibration alone", point.range_m);
        merits.push(Merit::new(format!("{:.2} mm", 1e3 * point.sigma_m), name));
    }
    merits
}

fn expected(document: &mut Document, summary: &PlanSummary) {
    document.section("Expected standard deviations");
    document.explanation(
        "From the planned noise of the observations; the values of the parameters hardly matter for them.",
    );
    let estimated = summary.parameters.0.iter().filter(|(_, parameter)| parameter.status == "estimated");
    let rows = estimated.map(|(name, parameter)| {
        let gain = summary.candidates.first().and_then(|best| best.gain.iter().find(|(known, _)| known == name));
        vec![
            name.clone(),
            format!("{:.2e}", parameter.sigma_prior),
            gain.map_or("–".to_owned(), |(_, gain)| format!("{:.2e}", parameter.sigma_prior * gain)),
            parameter.unit.clone(),
        ]
    });
    let columns = [
        Column::words("parameter"),
        Column::number("expected sigma"),
        Column::number("with the best further station"),
        Column::words("unit"),
    ];
    document.table(columns, rows.collect());
}

fn candidates(document: &mut Document, summary: &PlanSummary) {
    if summary.candidates.is_empty() {
        return;
    }
    document.section("Further stations, the most helpful first");
    let row = |(rank, candidate): (usize, &CandidateSummary)| {
        let mut gains: Vec<&(String, f64)> = candidate.gain.iter().collect();
        gains.sort_by(|a, b| a.1.total_cmp(&b.1));
        let best: Vec<String> =
            gains.iter().take(3).map(|(name, gain)| format!("{name} to {:.0} %", 100.0 * gain)).collect();
        let [x, y, z] = candidate.position_m;
        vec![
            format!("N{}", rank + 1),
            candidate.description.clone(),
            format!("{x:.2}"),
            format!("{y:.2}"),
            format!("{z:.2}"),
            candidate.targets.to_string(),
            format!("{:.0}", 100.0 * candidate.score.exp()),
            best.join(", "),
        ]
    };
    let rows = summary.candidates.iter().take(SHOWN_CANDIDATES).enumerate().map(row).collect();
    let columns = [
        Column::words("station"),
        Column::words("where"),
        Column::number("x").unit("m"),
        Column::number("y").unit("m"),
        Column::number("z").unit("m"),
        Column::number("targets"),
        Column::number("deviations on the mean").unit("%"),
        Column::words("largest gains"),
    ];
    document.table(columns, rows);
}

fn drawing(network: &Network, outcome: &PlanOutcome) -> Vec<(Figure, String)> {
    let stations: Vec<AdjustedStation> = network
        .stations
        .iter()
        .filter_map(|station| {
            let world_from_camera = station.world_from_camera?;
            let covariance = station.covariance.unwrap_or_default();
            Some(AdjustedStation { name: station.name.clone(), world_from_camera, covariance })
        })
        .collect();
    let targets: Vec<AdjustedTarget> = network
        .targets
        .iter()
        .filter_map(|target| {
            Some(AdjustedTarget { name: target.name.clone(), point: target.point?, covariance: Matrix3::zeros() })
        })
        .collect();
    let proposed = outcome.candidates.iter().take(SHOWN_CANDIDATES).enumerate();
    let proposed: Vec<Proposed> = proposed
        .map(|(rank, candidate)| Proposed {
            name: format!("N{}", rank + 1),
            world_from_camera: candidate.world_from_camera,
        })
        .collect();
    map::figures(&network.camera, &stations, &targets, &proposed)
}

fn sightings(document: &mut Document, summary: &PlanSummary) {
    document.section("Targets in the image of each station");
    let rows =
        summary.sightings_per_station.iter().map(|(name, count)| vec![name.clone(), count.to_string()]).collect();
    document.long_table([Column::words("station"), Column::number("targets")], rows);
    for (station, count) in summary.sightings_per_station.iter().filter(|(_, count)| *count < FEWEST_TARGETS) {
        document.paragraph(format!("note: station {station} sees {count} targets"));
    }
}
