//! The report of a planned network.

use nalgebra::Matrix3;
use report::Document;
use self_calibration::{AdjustedStation, AdjustedTarget, Network, PlanOutcome};

use crate::calibrate::document::page::correlations;
use crate::calibrate::document::tables;
use crate::calibrate::figures::map::{self, Proposed};
use crate::calibrate::figures::point_uncertainty;
use crate::calibrate::point_uncertainty::PointUncertainty;
use crate::plan::PlanSummary;
use pipeline::Result;

/// Candidates drawn and listed; the summary has them all.
const SHOWN_CANDIDATES: usize = 8;

/// The whole page.
pub(crate) fn render_plan(network: &Network, outcome: &PlanOutcome, summary: &PlanSummary) -> Result<String> {
    let lead = format!(
        "Expected quality of a calibration of {} as planned: {} stations, {} targets. Camera: {}.",
        summary.survey,
        network.stations.len(),
        network.targets.len(),
        summary.start
    );
    let mut page = Document::new("rangecam: plan of a calibration network", &lead);
    figures_of_merit(&mut page, summary);
    tables::diagnosis(&mut page, &summary.diagnosis);
    expected(&mut page, outcome);
    candidates(&mut page, summary);
    drawing(&mut page, network, outcome);
    points(&mut page, network, outcome)?;
    correlations(&mut page, &summary.correlation.names, &summary.correlation.matrix);
    sightings(&mut page, summary);
    Ok(page.html())
}

fn figures_of_merit(page: &mut Document, summary: &PlanSummary) {
    let mut cards = vec![
        (if summary.accepted { "yes" } else { "no" }.to_owned(), "strong enough to calibrate".to_owned()),
        (summary.observations.to_string(), "observed values".to_owned()),
        (summary.unknowns.to_string(), "unknowns".to_owned()),
        (summary.redundancy.to_string(), "redundancy".to_owned()),
    ];
    if let Some(inflation) = summary.inflation {
        cards.push((format!("{inflation:.0}"), "inflation of the weakest combination".to_owned()));
    }
    for point in &summary.point_sigma {
        cards.push((format!("{:.2} mm", 1e3 * point.sigma_m), format!("of a point at {} m", point.range_m)));
    }
    page.merits(cards);
}

fn expected(page: &mut Document, outcome: &PlanOutcome) {
    page.section("Expected standard deviations");
    page.paragraph("From the planned noise of the observations; the values of the parameters hardly matter for them.");
    let estimated = outcome.parameters.iter().filter(|parameter| outcome.estimated.contains(&parameter.name));
    let rows: Vec<Vec<String>> = estimated
        .map(|parameter| {
            let gain = outcome.candidates.first().and_then(|best| best.gain.iter().find(|(n, _)| *n == parameter.name));
            vec![
                parameter.name.clone(),
                format!("{:.2e}", parameter.sigma_prior),
                parameter.unit.clone(),
                gain.map_or("–".to_owned(), |(_, gain)| format!("{:.2e}", parameter.sigma_prior * gain)),
            ]
        })
        .collect();
    page.table(["parameter", "expected sigma", "unit", "with the best further station"], rows);
}

fn candidates(page: &mut Document, summary: &PlanSummary) {
    if summary.candidates.is_empty() {
        return;
    }
    page.section("Further stations, the most helpful first");
    let row = |(rank, candidate): (usize, &crate::plan::CandidateSummary)| {
        let mut gains: Vec<&(String, f64)> = candidate.gain.iter().collect();
        gains.sort_by(|a, b| a.1.total_cmp(&b.1));
        let best: Vec<String> =
            gains.iter().take(3).map(|(name, gain)| format!("{name} to {:.0} %", 100.0 * gain)).collect();
        let [x, y, z] = candidate.position_m;
        vec![
            format!("N{}", rank + 1),
            candidate.description.clone(),
            format!("{x:.2}, {y:.2}, {z:.2}"),
            candidate.targets.to_string(),
            format!("{:.0} %", 100.0 * candidate.score.exp()),
            best.join(", "),
        ]
    };
    let rows: Vec<_> = summary.candidates.iter().take(SHOWN_CANDIDATES).enumerate().map(row).collect();
    let head = ["station", "where", "x, y, z in m", "targets", "deviations on the mean", "largest gains"];
    page.table(head, rows);
}

fn drawing(page: &mut Document, network: &Network, outcome: &PlanOutcome) {
    page.section("Network");
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
    page.figures(map::figures(&network.camera, &stations, &targets, &proposed));
}

fn points(page: &mut Document, network: &Network, outcome: &PlanOutcome) -> Result<()> {
    page.section("What the calibration's uncertainty would mean for a point");
    let models = [(None, network.range_model.clone())];
    let source = PointUncertainty { camera: &network.camera, range_models: &models };
    page.figures(point_uncertainty::figures(&source, &outcome.estimated, &outcome.covariance, f64::NAN)?);
    Ok(())
}

fn sightings(page: &mut Document, summary: &PlanSummary) {
    page.section("Targets in the image of each station");
    let rows: Vec<_> =
        summary.sightings_per_station.iter().map(|(name, count)| vec![name.clone(), count.to_string()]).collect();
    page.table(["station", "targets"], rows);
}
