//! What the registration with the reference claims, and what others must meet beside it.

use nalgebra::{Isometry3, Matrix6};

use crate::motion_model::motion::diagonal;
use crate::motion_model::prediction::{Grounds, Prediction};
use crate::stream::locate::Measured;
use rigid_pose::Uncertain;

/// Share of the radius (and radian) by which a camera that starts or stops may miss the prediction, or go where its velocity is not known,
/// as a standard deviation: what is carried elsewhere is carried farther.
const JUMP: f64 = 0.05;

/// What the registration with the reference, or that there is none, says about others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Claim {
    /// Nothing else needs to be looked at.
    pub(crate) is_settled: bool,
    /// Reference from camera, where another registration must find the camera. Where the velocity bears the reference out, what contradicts
    /// moves by itself, and would draw another pose along; where it does not, the reference may have been drawn along.
    held: Option<Uncertain>,
    is_doubtful: bool,
    grounded: bool,
    radius_m: f64,
}

impl Claim {
    pub(crate) fn of(first: Option<&Measured>, prediction: &Prediction, radius_m: f64) -> Self {
        let firm = first.is_some_and(|measured| measured.is_firm(radius_m));
        let borne_out = first.is_some_and(|measured| measured.determined && prediction.bears_out(&measured.own()));
        let grounded = prediction.grounds != Grounds::Nothing;
        Self {
            is_settled: firm && (borne_out || !grounded),
            held: (firm || borne_out).then_some(prediction.own),
            is_doubtful: !first.is_some_and(Measured::agrees),
            grounded,
            radius_m,
        }
    }

    /// Whether a registration is worth leaving the reference for.
    pub(crate) fn is_helped_by(&self, measured: &Measured) -> bool {
        measured.is_firm(self.radius_m) || self.is_doubtful && measured.is_sound()
    }

    /// Whether the reference's own registration says where the camera is, alone or with the prediction.
    pub(crate) fn is_usable(&self, measured: &Measured) -> bool {
        measured.determined || self.grounded
    }

    /// Whether another registration finds the camera where it can be.
    pub(crate) fn is_met_by(&self, measured: &Measured, keyframe_from_reference: &Isometry3<f64>) -> bool {
        !self.held.is_some_and(|held| measured.contradicts(&held, keyframe_from_reference))
    }
}

/// Where the camera can be since the frame before, by what is known of its motion.
pub(crate) fn reachable(prediction: &Prediction, radius_m: f64) -> Uncertain {
    let known = if prediction.grounds == Grounds::Nothing { Matrix6::zeros() } else { prediction.own.covariance };
    let covariance = known + diagonal([(JUMP * radius_m).powi(2), JUMP * JUMP]);
    Uncertain { covariance, ..prediction.own }
}
