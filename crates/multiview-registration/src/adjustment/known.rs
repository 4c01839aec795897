//! How well poses are known beforehand.

use nalgebra::Isometry3;
use rigid_pose::pose_difference;
use statistics::{CHI_MEDIANS, upper_median};

/// Part of a patch that start poses are not taken to be better known than: from there the last rounds find their way. It guards against starts
/// that are right for half of the stations, and must stay below what the movements of all tell otherwise: half a patch is more than the 58 mm of
/// a building of a thousand stations, where those held so loosely met other planes and went on together by 2 mm a round.
const BEST: f64 = 0.25;

/// Standard deviations beyond which nothing is by chance: of measured turns, of where a station began (one in a million is farther off along
/// some axis), and by which more of its points must lie on planes elsewhere, or fewer contradict, even if points come in groups of some five.
/// Elsewhere stations of simulated buildings that are right come to 2.1, those 4 to 14 cm off from 19 to 42; with less, right ones are moved
/// and doubted.
pub(crate) const SIGMAS: f64 = 5.0;

/// Standard deviations of a component of the position, metre, and of the attitude, radian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Known {
    pub position_m: f64,
    attitude_rad: f64,
}

impl Known {
    /// The same length for positions and for what is at this distance.
    pub(crate) fn at(length_m: f64, radius_m: f64) -> Self {
        Self { position_m: length_m, attitude_rad: length_m / radius_m }
    }

    /// From how far stations have moved since: half of them no farther than the median of three components. Those that have slid to
    /// where they should not be are fewer. No better than a part of a patch, and no worse than how far poses may be off.
    pub(crate) fn estimated(
        start: &[Isometry3<f64>],
        now: &[Isometry3<f64>],
        (size_m, reach_m): (f64, f64),
        radius_m: f64,
    ) -> Self {
        let [least, most] = [BEST * size_m, reach_m].map(|length_m| Self::at(length_m, radius_m));
        let moved = |part: usize| {
            let norm = |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| pose_difference(a, b).fixed_rows::<3>(part).norm();
            upper_median(&mut start.iter().zip(now).map(norm).collect::<Vec<f64>>()) / CHI_MEDIANS[2]
        };
        Self {
            position_m: moved(0).max(least.position_m).min(most.position_m),
            attitude_rad: moved(3).max(least.attitude_rad).min(most.attitude_rad),
        }
    }

    /// One over the variance of a component of a pose.
    pub(crate) fn weight(self, component: usize) -> f64 {
        if component < 3 { self.position_m.powi(-2) } else { self.attitude_rad.powi(-2) }
    }
}
