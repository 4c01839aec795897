//! Stations and targets with what is known of them.

use std::collections::BTreeMap;

use pipeline::survey::StationPose;
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};
use serde::Serialize;

/// A station as it was adjusted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedStation {
    /// Name.
    pub station: String,
    /// Perspective centre, metre.
    pub position_m: [f64; 3],
    /// Standard deviations of the position along the axes, metre, prior-scaled; `None` where it was held.
    pub sigma_position_m: Option<[f64; 3]>,
    /// Standard deviations of omega, phi and kappa, degree.
    pub sigma_attitude_deg: Option<[f64; 3]>,
    /// What checks its observations.
    #[serde(flatten)]
    pub observed: Observed,
}

/// A target as it was adjusted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedTarget {
    /// Name.
    pub target: String,
    /// Position, metre.
    pub position_m: [f64; 3],
    /// Standard deviations along the axes, metre, prior-scaled.
    pub sigma_m: [f64; 3],
    /// What checks its observations.
    #[serde(flatten)]
    pub observed: Observed,
}

/// Observed values of a station or a target, and what of gross errors among them would be found.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Observed {
    /// Values used.
    pub values: usize,
    /// Values rejected.
    pub rejected: usize,
    /// Values used that nothing checks.
    pub uncontrolled: usize,
    /// The largest of the smallest detectable errors of columns and rows, pixel: a larger one is found with 80 %.
    pub detectable_px: Option<f64>,
    /// The same of ranges, metre.
    pub detectable_range_m: Option<f64>,
}

impl Observed {
    fn take(&mut self, quality: &ObservationQuality) {
        let (pixel, range) = match quality.component {
            Component::Col | Component::Row => (true, false),
            Component::Range => (false, true),
            _ => (false, false),
        };
        match quality.verdict {
            Verdict::Rejected => self.rejected += 1,
            Verdict::LeftOut => {}
            Verdict::Uncontrolled => {
                self.values += 1;
                self.uncontrolled += 1;
            }
            Verdict::Used => {
                self.values += 1;
                let largest = |known: Option<f64>| {
                    let own = Some(quality.smallest_detectable).filter(|size| size.is_finite());
                    own.map(|own| known.map_or(own, |known| known.max(own))).or(known)
                };
                if pixel {
                    self.detectable_px = largest(self.detectable_px);
                }
                if range {
                    self.detectable_range_m = largest(self.detectable_range_m);
                }
            }
        }
    }
}

pub(crate) fn stations(outcome: &CalibrationOutcome) -> Vec<CertifiedStation> {
    let observed = observed(outcome, |quality| &quality.station);
    let row = |station: &self_calibration::AdjustedStation| {
        let pose = StationPose { world_from_camera: station.world_from_camera, covariance: Some(station.covariance) };
        let sigmas = pose.sigmas().filter(|(p, a)| p.iter().chain(a).all(|sigma| sigma.is_finite() && *sigma > 0.0));
        CertifiedStation {
            station: station.name.clone(),
            position_m: station.world_from_camera.translation.vector.into(),
            sigma_position_m: sigmas.map(|sigmas| sigmas.0),
            sigma_attitude_deg: sigmas.map(|sigmas| sigmas.1.map(f64::to_degrees)),
            observed: observed.get(station.name.as_str()).copied().unwrap_or_default(),
        }
    };
    outcome.stations.iter().map(row).collect()
}

pub(crate) fn targets(outcome: &CalibrationOutcome) -> Vec<CertifiedTarget> {
    let observed = observed(outcome, |quality| &quality.target);
    let row = |target: &self_calibration::AdjustedTarget| CertifiedTarget {
        target: target.name.clone(),
        position_m: target.point.coords.into(),
        sigma_m: [0, 1, 2].map(|axis| target.covariance[(axis, axis)].max(0.0).sqrt()),
        observed: observed.get(target.name.as_str()).copied().unwrap_or_default(),
    };
    outcome.targets.iter().map(row).collect()
}

/// What was observed of each, by its name: image points and ranges of the camera.
fn observed(outcome: &CalibrationOutcome, name: fn(&ObservationQuality) -> &String) -> BTreeMap<&str, Observed> {
    let mut all: BTreeMap<&str, Observed> = BTreeMap::new();
    let own = [Component::Col, Component::Row, Component::Range];
    for quality in outcome.residuals.iter().filter(|quality| own.contains(&quality.component)) {
        all.entry(name(quality)).or_default().take(quality);
    }
    all
}
