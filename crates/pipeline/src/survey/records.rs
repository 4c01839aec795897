//! What is kept of stages and views: figures, no rasters.

use std::collections::BTreeMap;

use camera_model::{OrganisedCloud, euler_from_pose, step_pose};
use multiview_registration::Placements;
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3};
use serde::Serialize;

use crate::survey::drift::ViewDrift;
use crate::survey::open::{OpenSurvey, StatedPoses};
use crate::survey::plausibility;
use crate::survey::truth::{RangeTruth, evaluate};
use crate::survey::view::{View, ViewData};
use commands::{Doubt, Tape};
use statistics::quantile;

/// One stage of a run.
#[derive(Debug, Clone, Serialize)]
pub struct StageSummary {
    /// The stage's name.
    pub name: &'static str,
    /// Wall-clock time, second; 0 where durations are left out.
    pub seconds: f64,
    /// What the stage found, with units in the names.
    pub findings: BTreeMap<String, f64>,
    /// Median absolute change of the ranges by the stage, metre (modulo the ambiguity interval).
    pub change_median_m: Option<f64>,
    /// Range errors after the stage, where the truth is known.
    pub truth: Option<RangeTruth>,
}

/// Why the stations are not in one frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RefusedStage {
    /// The stage.
    pub stage: &'static str,
    /// What the data show against it, and what would help.
    pub reason: String,
}

/// What is kept of a view that has gone through the stages.
#[derive(Debug, Clone, Default)]
pub struct ViewRecord {
    /// Name of the station.
    pub station: String,
    /// Station, and frame or number of frames.
    pub name: String,
    /// Time of the first frame, second.
    pub timestamp_s: f64,
    /// Integration time, second, where it is stated.
    pub integration_time_s: Option<f64>,
    /// Approximate or known pose from the survey.
    pub stated: Option<Isometry3<f64>>,
    /// Standard deviations of its position, metre, and attitude, radian, in space, where they are stated.
    pub stated_sigma: [Option<f64>; 2],
    /// True pose of a simulated survey.
    pub true_pose: Option<Isometry3<f64>>,
    /// Median of the unflagged ranges, metre; NaN where there are none.
    pub distance_m: f64,
    /// Unflagged points; `None` where there is no cloud.
    pub points: Option<usize>,
    /// What was taken off as drift.
    pub drift: Option<ViewDrift>,
    /// The ranges against the truth.
    pub truth: Option<RangeTruth>,
    /// What speaks against its pixels.
    pub doubt: Option<Doubt>,
}

impl ViewRecord {
    /// Of a view of a survey whose stations stand as `stated`.
    pub fn new(view: &View, stated: &StatedPoses) -> Self {
        Self {
            station: view.station.clone(),
            name: view.name(),
            timestamp_s: view.timestamp_s,
            integration_time_s: view.integration_time_s,
            stated: view.approximate_world_from_camera,
            stated_sigma: plausibility::stated_sigma(stated, &view.station),
            true_pose: view.truth.as_ref().and_then(|truth| truth.world_from_camera),
            distance_m: distance_m(view),
            points: view.cloud.as_ref().map(|cloud| usable(cloud).count()),
            drift: view.correction.as_ref().and_then(|record| record.drift().cloned()),
            truth: evaluate(view),
            doubt: plausibility::mostly_flagged(view),
        }
    }
}

impl ViewRecord {
    /// Writes what comes from the frames, or takes it over; where the station stands says the survey.
    pub(crate) fn carry(&mut self, tape: &mut Tape, survey: &OpenSurvey) {
        for text in [&mut self.station, &mut self.name] {
            tape.text(text);
        }
        for number in [&mut self.timestamp_s, &mut self.distance_m] {
            tape.number(number);
        }
        tape.option(&mut self.integration_time_s, f64::default, Tape::number);
        tape.option(&mut self.points, usize::default, Tape::count);
        tape.option(&mut self.drift, ViewDrift::default, |tape, drift| drift.carry(tape));
        tape.option(&mut self.truth, RangeTruth::default, |tape, truth| truth.carry(tape));
        let mut doubts: Vec<Doubt> = self.doubt.take().into_iter().collect();
        tape.records(&mut doubts);
        self.doubt = doubts.pop();
        let mut has_truth = self.true_pose.is_some();
        tape.flag(&mut has_truth);
        self.true_pose = has_truth.then(|| survey.true_pose(&self.station)).flatten();
        self.stated = survey.approximate_pose(&self.station);
        self.stated_sigma = plausibility::stated_sigma(&survey.stated, &self.station);
    }
}

/// Median of a view's unflagged ranges.
fn distance_m(view: &View) -> f64 {
    let ViewData::Range(frame) = &view.data else { return f64::NAN };
    let pixels = frame.range.as_slice().iter().zip(frame.flags.as_slice());
    let mut ranges: Vec<f64> =
        pixels.filter(|(_, flags)| flags.is_empty()).map(|(range, _)| f64::from(*range)).collect();
    quantile(&mut ranges, 0.5)
}

/// Poses of all views in one frame: those that were found, or as the survey has them, or the frame of the camera where it
/// has one station alone. `None` where they are not known.
pub fn common_poses(views: &[ViewRecord], found: &[StationPose]) -> Option<Vec<StationPose>> {
    if !found.is_empty() && found.len() == views.len() {
        return Some(found.to_vec());
    }
    let one_station = views.windows(2).all(|pair| pair[0].station == pair[1].station);
    let own = one_station.then(Isometry3::identity);
    let known = |view: &ViewRecord| Some(StationPose { world_from_camera: view.stated.or(own)?, covariance: None });
    views.iter().map(known).collect()
}

/// Pose of one view and how well it is known.
#[derive(Debug, Clone)]
pub struct StationPose {
    /// The pose.
    pub world_from_camera: Isometry3<f64>,
    /// Covariance of its tangent `[dt world, dtheta camera]`, metre and radian; `None` where it was not estimated.
    pub covariance: Option<Matrix6<f64>>,
}

/// Quality of the simultaneous adjustment.
#[derive(Debug, Clone)]
pub struct AdjustmentFigures {
    /// A-posteriori standard deviation of unit weight; `None` without redundancy.
    pub sigma0: Option<f64>,
    /// Redundancy.
    pub redundancy: i64,
    /// Whether the stations lie where what they see agrees with what the others see.
    pub placements: Placements,
}

impl StationPose {
    /// Standard deviations of the position along the world's axes, metre, and of omega, phi, kappa, radian; `None`
    /// where the pose was not estimated or is the datum.
    pub fn sigmas(&self) -> Option<([f64; 3], [f64; 3])> {
        let covariance = self.covariance.filter(|covariance| covariance.trace() > 0.0)?;
        let angles = |axis: usize, step: f64| {
            let mut tangent = [0.0; 6];
            tangent[3 + axis] = step;
            Vector3::from(euler_from_pose(&step_pose(&self.world_from_camera, &tangent)))
        };
        // A step small against the angles and large against their rounding.
        let step = 1e-6;
        let columns = [0, 1, 2].map(|axis| (angles(axis, step) - angles(axis, -step)) / (2.0 * step));
        let jacobian = Matrix3::from_columns(&columns);
        let attitude = jacobian * covariance.fixed_view::<3, 3>(3, 3) * jacobian.transpose();
        let position = [0, 1, 2].map(|axis| covariance[(axis, axis)].sqrt());
        Some((position, [0, 1, 2].map(|axis| attitude[(axis, axis)].sqrt())))
    }

    /// Standard deviation of the position in space, metre.
    pub fn position_sigma_m(&self) -> Option<f64> {
        self.covariance.map(|covariance| (covariance[(0, 0)] + covariance[(1, 1)] + covariance[(2, 2)]).sqrt())
    }
}

/// Indices of the points that are finite and carry no flag.
pub fn usable(cloud: &OrganisedCloud) -> impl Iterator<Item = usize> + '_ {
    (0..cloud.points.len())
        .filter(|&index| cloud.flags[index].is_empty() && cloud.points[index].iter().all(|x| x.is_finite()))
}
