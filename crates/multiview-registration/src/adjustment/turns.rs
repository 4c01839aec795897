//! Turns between stations that something else measures: an inertial unit.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion};
use rigid_pose::InputError;

use crate::adjustment::known::SIGMAS;
use crate::error::{Error, Result};
use crate::relative_pose::{RelativePose, Rows};

/// Angle, radian, by which a pose that features propose may differ from what was measured: voxels leave some degrees.
const COARSE_RAD: f64 = 0.15;

/// How the camera turned between two stations, as an inertial unit measures it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredTurn {
    /// Index of one station.
    pub first: usize,
    /// Index of the other.
    pub second: usize,
    /// Attitude of the second in the axes of the first.
    pub first_from_second: UnitQuaternion<f64>,
    /// Covariance of its tangent (axes of the second), radian². Errors of different turns are taken as independent.
    pub covariance: Matrix3<f64>,
}

impl MeasuredTurn {
    /// Refuses turns of stations that are not there, and covariances that are none.
    pub(crate) fn check(&self, stations: usize) -> Result<()> {
        for station in [self.first, self.second] {
            if station >= stations {
                return Err(Error::NoSuchStation { station, count: stations });
            }
        }
        let whole = self.first_from_second.coords.iter().all(|value| value.is_finite()) && self.first != self.second;
        if !whole || self.whitening().is_none() {
            return Err(InputError::NonFinite {
                what: "turns between stations, or their covariance",
                index: self.first,
            }
            .into());
        }
        Ok(())
    }

    /// W with `Wᵀ W` the inverse of the covariance.
    fn whitening(&self) -> Option<Matrix3<f64>> {
        self.covariance.cholesky()?.l().try_inverse().filter(|inverse| inverse.iter().all(|value| value.is_finite()))
    }

    /// As a relative pose, of whose translation nothing is observed.
    pub(crate) fn observed(&self, poses: &[Isometry3<f64>]) -> Option<RelativePose> {
        let translation = (poses[self.first].inverse() * poses[self.second]).translation;
        let mut rows = Rows::zeros(3);
        rows.fixed_columns_mut::<3>(3).copy_from(&-self.whitening()?);
        let first_from_second = Isometry3::from_parts(translation, self.first_from_second);
        Some(RelativePose { stations: [self.first, self.second], first_from_second, rows })
    }
}

/// Whether a relative attitude `first_from_second` is one that was measured, where turns lead from one station to the other.
pub(crate) fn allows(
    turns: &[MeasuredTurn],
    [first, second]: [usize; 2],
    first_from_second: &UnitQuaternion<f64>,
) -> bool {
    let Some((turn, variance)) = between(turns, first, second) else { return true };
    turn.angle_to(first_from_second) <= COARSE_RAD.max(SIGMAS * variance.sqrt())
}

/// The turn from one station to a later one, put together of those between stations that follow each other, and its variance
/// about all axes.
fn between(turns: &[MeasuredTurn], first: usize, second: usize) -> Option<(UnitQuaternion<f64>, f64)> {
    let (mut at, mut turned, mut variance) = (first, UnitQuaternion::identity(), 0.0);
    while at < second {
        let next = turns.iter().find(|turn| turn.first == at && turn.second > at && turn.second <= second)?;
        turned *= next.first_from_second;
        variance += next.covariance.trace();
        at = next.second;
    }
    (at == second && first < second).then_some((turned, variance))
}

#[cfg(test)]
#[path = "../../tests/inside/turns.rs"]
mod tests;
