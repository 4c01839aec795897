//! What a run holds in its hands: views, clouds, poses, and the record of the stages.

use std::collections::BTreeMap;

use camera_model::{Camera, OrganisedCloud, euler_from_pose, step_pose};
use multiview_registration::{PairAlignment, Placements, RefusedPair};
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3};
use range_io::survey::Survey;
use range_io::tables::Station;
use serde::Serialize;

use crate::command::verdict::Doubt;
use crate::survey::truth::RangeTruth;
use crate::survey::view::View;

/// Everything that a run has made.
#[derive(Debug)]
pub struct Outcome {
    /// What was captured.
    pub survey: Survey,
    /// The calibration in use, in words.
    pub calibration: String,
    /// The camera whose rays made the clouds.
    pub camera: Camera,
    /// One view a station, or a frame where frames were not averaged.
    pub views: Vec<View>,
    /// One cloud a view, in the camera's frame, once [`crate::Stage::PointCloud`] ran.
    pub clouds: Vec<OrganisedCloud>,
    /// Points on the two surfaces of split mixed pixels.
    pub further_points: Vec<FurtherPoint>,
    /// One pose a view, once it is known.
    pub poses: Vec<StationPose>,
    /// Aligned pairs.
    pub pairs: Vec<PairAlignment>,
    /// Pairs that overlap but could not be aligned reliably.
    pub refused: Vec<RefusedPair>,
    /// The simultaneous adjustment, where it ran.
    pub adjustment: Option<AdjustmentFigures>,
    /// What each stage did.
    pub stages: Vec<StageSummary>,
    /// The stage of registration that the data refused, behind which none ran.
    pub refusal: Option<RefusedStage>,
    /// What speaks against survey and result so far.
    pub doubts: Vec<Doubt>,
    /// What `stations.csv` says of the stations.
    pub stated: Vec<Station>,
    /// Index of the world's axis that points up: z where poses came with the survey, y in a camera's own frame.
    pub vertical_axis: usize,
}

/// One stage of a run.
#[derive(Debug, Clone, Serialize)]
pub struct StageSummary {
    /// The stage's name.
    pub name: &'static str,
    /// Wall-clock time, second.
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

/// A point that belongs to no single pixel of an organised cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FurtherPoint {
    /// Index of the view.
    pub view: usize,
    /// Position in the camera's frame, metre.
    pub point: [f64; 3],
    /// Standard deviation along the ray, metre.
    pub sigma_m: f32,
    /// Amplitude in the camera's unit.
    pub amplitude: f32,
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

impl Outcome {
    /// Poses of all views in one frame: estimated, or as the survey has them, or the frame of the camera where it has
    /// one station alone. `None` where they are not known: registration was refused, or was needed and did not run.
    pub fn common_poses(&self) -> Option<Vec<StationPose>> {
        if self.refusal.is_some() {
            return None;
        }
        if self.poses.len() == self.views.len() {
            return Some(self.poses.clone());
        }
        let one_station = self.views.windows(2).all(|pair| pair[0].station == pair[1].station);
        let known = |view: &View| {
            let stated = view.approximate_world_from_camera;
            let own = one_station.then(Isometry3::identity);
            Some(StationPose { world_from_camera: stated.or(own)?, covariance: None })
        };
        self.views.iter().map(known).collect()
    }
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

/// The unflagged points of a view in the world's frame, metre.
pub fn world_points(cloud: &OrganisedCloud, world_from_camera: &Isometry3<f64>) -> Vec<[f64; 3]> {
    usable(cloud).map(|index| (world_from_camera * Point3::from(cloud.points[index])).coords.into()).collect()
}

/// Indices of the points that are finite and carry no flag.
pub fn usable(cloud: &OrganisedCloud) -> impl Iterator<Item = usize> + '_ {
    (0..cloud.points.len())
        .filter(|&index| cloud.flags[index].is_empty() && cloud.points[index].iter().all(|x| x.is_finite()))
}
