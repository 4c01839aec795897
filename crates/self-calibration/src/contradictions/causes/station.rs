//! What explains the sightings of one station.

use calibration_network::functional_model::{Calibration, Misfit, Scales, implausibility};
use calibration_network::start_values::{start_limit, station_pose};
use nalgebra::{Isometry3, Point3};
use statistics::upper_median;

use super::BELIEVED;
use super::fit::Fit;
use crate::contradictions::catalogue::{Alternative, of_labels, of_sightings};
use crate::findings::contradiction::{Cause, CauseKind};
use crate::{Network, Sighting};

/// Explanations of a station that are fitted together with all other stations: those that fit it best beside them.
const FITTED: usize = 3;
/// Share by which ranges of another modulation frequency differ at least.
const SMALLEST_CHANGE: f64 = 0.03;

/// What explains the sightings of one station: alternatives are compared beside the other stations as they are, and those
/// that fit best adjusted together with these, which may have followed the wrong ones.
pub(super) fn of_station(base: &Fit<'_>, station: usize) -> Option<Cause> {
    let network = base.setup.network;
    let name = &network.stations[station].name;
    let (calibration, targets) = (&base.setup.calibration, base.setup.start.targets.as_slice());
    let judge = Judge { calibration, targets, scales: base.scales(), station };
    let given = base.setup.start.stations[station];
    let unmoved = judge.resected(network);
    let (before, pose) = judge.best(network, [Some(given), unmoved])?;
    let mut alternatives = of_sightings(network, Some(station));
    alternatives.extend(of_labels(network, station));
    alternatives.extend(judge.unwrapped(network, &pose));
    alternatives.extend(judge.of_other_frequency(network, &pose));
    let judged = alternatives.into_iter().filter_map(|alternative| {
        let ranges = alternative.kind.is_of_ranges();
        let found = if ranges { unmoved } else { judge.resected(&alternative.network) };
        let (after, pose) = judge.best(&alternative.network, [Some(pose), found])?;
        Some((after, pose, alternative))
    });
    let mut judged: Vec<(f64, Isometry3<f64>, Alternative)> = judged.collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    judged.retain(|(_, pose, alternative)| judge.is_near(&alternative.network, pose));
    judged.truncate(FITTED);
    if judged.is_empty() {
        return None;
    }
    // As it is, it may fit as well once the others have been found from it.
    let before = base.with_station(network, station, pose).map_or(before, |unchanged| before.min(unchanged));
    let fitted = judged.into_iter().filter_map(|(_, pose, alternative)| {
        let after = base.with_station(&alternative.network, station, pose)?;
        (before - after > BELIEVED).then_some((after, alternative))
    });
    let (after, found) = fitted.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Cause {
        kind: found.kind,
        station: Some(name.clone()),
        names: vec![name.clone()],
        words: format!("station `{name}`: {}", found.words),
        remedy: found.remedy,
        log_odds: before - after,
    })
}

/// Judges one station against targets and calibration found with the others.
struct Judge<'f> {
    calibration: &'f Calibration,
    targets: &'f [Option<Point3<f64>>],
    scales: Scales,
    station: usize,
}

impl Judge<'_> {
    /// The pose that the image points of a network give the station.
    fn resected(&self, network: &Network) -> Option<Isometry3<f64>> {
        station_pose(network, self.calibration, self.targets, self.station)
    }

    /// Implausibility and pose, of the pose that fits best.
    fn best(&self, network: &Network, poses: [Option<Isometry3<f64>>; 2]) -> Option<(f64, Isometry3<f64>)> {
        let of = |pose: &Isometry3<f64>| implausibility(self.misfits(network, pose).iter(), self.scales);
        let judged = poses.into_iter().flatten().map(|pose| (of(&pose), pose));
        judged.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Whether the image points typically are as near as start values must be.
    fn is_near(&self, network: &Network, pose: &Isometry3<f64>) -> bool {
        let mut pixels: Vec<f64> = self.misfits(network, pose).iter().filter_map(Misfit::pixels).collect();
        upper_median(&mut pixels) <= start_limit(network)
    }

    fn misfits(&self, network: &Network, pose: &Isometry3<f64>) -> Vec<Misfit> {
        let own = network.sightings.iter().filter(|seen| seen.station == self.station);
        let misfit = |seen: &Sighting| match &self.targets[seen.target] {
            Some(point) => Misfit::new(network, self.calibration, pose, point, seen),
            None => Misfit::default(),
        };
        own.map(misfit).collect()
    }

    /// The network with the station's ranges as many times as long as fits: those of another modulation frequency.
    fn of_other_frequency(&self, network: &Network, pose: &Isometry3<f64>) -> Option<Alternative> {
        let own = || network.sightings.iter().filter(|seen| seen.station == self.station);
        let ratios = own().filter_map(|seen| {
            let distance = (self.targets[seen.target]?.coords - pose.translation.vector).norm();
            Some(distance / seen.range_m?)
        });
        let factor = upper_median(&mut ratios.collect::<Vec<f64>>());
        // Units are told as such.
        let is_unit = [1.0, 1e-2, 1e-3].iter().any(|unit| (factor / unit).ln().abs() < SMALLEST_CHANGE);
        if !factor.is_finite() || is_unit {
            return None;
        }
        let mut other = network.clone();
        let changed = other.sightings.iter_mut().filter(|seen| seen.station == self.station);
        changed.for_each(|seen| seen.range_m = seen.range_m.map(|range| range * factor));
        let words = format!(
            "the ranges fit if they are {factor:.3} times as long: the modulation frequency that they were computed with is \
             {factor:.3} times that of the frame"
        );
        let remedy = "compute its ranges with the modulation frequency of its frame, or leave it out";
        Some(Alternative { kind: CauseKind::ModulationFrequency, words, remedy, network: other })
    }

    /// The network with those ranges of the station moved by whole intervals that fit then.
    fn unwrapped(&self, network: &Network, pose: &Isometry3<f64>) -> Option<Alternative> {
        let interval = network.range_model.ambiguity_interval_m;
        let mut other = network.clone();
        let mut moved = Vec::new();
        for seen in other.sightings.iter_mut().filter(|seen| seen.station == self.station) {
            let Some(point) = &self.targets[seen.target] else { continue };
            let off = Misfit::new(network, self.calibration, pose, point, seen).range_m.unwrap_or(0.0);
            let count = (off / interval).round();
            if count.is_finite() && count.abs() >= 1.0 {
                seen.range_m = seen.range_m.map(|range| range - count * interval);
                moved.push(network.targets[seen.target].name.clone());
            }
        }
        let named = moved.iter().take(3).cloned().collect::<Vec<_>>().join("`, `");
        let words = format!(
            "{} ranges (targets `{named}`{}) fit if they are whole ambiguity intervals ({interval:.3} m) off",
            moved.len(),
            if moved.len() > 3 { ", ..." } else { "" }
        );
        let remedy = "mend the column `range` of observations.csv, or unwrap that station anew";
        (!moved.is_empty()).then_some(Alternative { kind: CauseKind::WholeIntervals, words, remedy, network: other })
    }
}
