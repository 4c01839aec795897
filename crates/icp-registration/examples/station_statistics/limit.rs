//! What the noise allows for stations on a round.

use crate::common::limit::information;
use crate::common::stations::round_poses;
use crate::common::{Pinhole, Scene};

/// Standard deviations of the least known station against the first: position in millimetre and rotation in degree.
pub fn cramer_rao(count: usize) -> (f64, f64) {
    let information = information(&Scene::furnished(), &Pinhole::small(), &round_poses(count));
    let free = information.view((6, 6), (6 * count - 6, 6 * count - 6)).into_owned();
    let Some(covariance) = free.try_inverse() else { return (f64::INFINITY, f64::INFINITY) };
    let sigma = |k: usize, part: usize| (0..3).map(|c| covariance[(6 * k + part + c, 6 * k + part + c)]).sum::<f64>();
    let largest = |part: usize| (0..count - 1).map(|k| sigma(k, part).sqrt()).fold(0.0, f64::max);
    (1e3 * largest(0), largest(3).to_degrees())
}
