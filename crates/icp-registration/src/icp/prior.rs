//! The guess as an observation.

use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::error::{Error, Result};
use rigid_pose::{InputError, pose_difference, step_pose, symmetrised};

/// The pose of least squares between what the pairs say (`information`, zero along what they leave open) and the guess
/// with its covariance, and its covariance; both in the tangent `[dt target axes, dtheta source axes]`.
pub(super) fn fused_with_prior(
    pose: &Isometry3<f64>,
    information: &Matrix6<f64>,
    guess: &Isometry3<f64>,
    prior: &Matrix6<f64>,
) -> Result<(Isometry3<f64>, Matrix6<f64>)> {
    // The prior's rotations are about the axes of the source at the guess, which differ from those at the pose only by
    // the turn between them: exp(w_guess) seen from the pose is the same rotation in turned axes.
    let turn = (pose.rotation.inverse() * guess.rotation).to_rotation_matrix().into_inner();
    let mut carried = Matrix6::identity();
    carried.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    let failed =
        InputError::Numerical { what: "the fusion with the prior", why: "a covariance is not positive definite" };
    let weight = scaled_inverse(&(carried * prior * carried.transpose())).ok_or(failed.clone())?;
    let towards_guess = pose_difference(pose, guess);
    let covariance = scaled_inverse(&(information + weight)).ok_or(failed)?;
    let step = covariance * (weight * towards_guess);
    Ok((step_pose(pose, &step), symmetrised(&covariance)))
}

/// Inverse of a positive definite matrix whose diagonal spans many orders of magnitude.
fn scaled_inverse(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let scale = Vector6::from_fn(|k, _| 1.0 / matrix[(k, k)].max(0.0).sqrt());
    let scaling = Matrix6::from_diagonal(&scale);
    let inverse = symmetrised(&(scaling * matrix * scaling)).cholesky()?.inverse();
    Some(scaling * inverse * scaling)
}

/// Refuses a covariance that is not positive definite.
pub(super) fn validate(prior: Option<&Matrix6<f64>>) -> Result<()> {
    let Some(prior) = prior else {
        return Err(Error::Incompatible { what: "holding at a prior", with: "a guess without covariance" });
    };
    let diagonal: Vector6<f64> = prior.diagonal();
    match (0..6).find(|&k| !(diagonal[k] > 0.0 && diagonal[k].is_finite())) {
        Some(index) => Err(InputError::NotPositive { what: "prior_covariance", index, value: diagonal[index] }.into()),
        None if scaled_inverse(prior).is_none() => {
            Err(InputError::Numerical { what: "the covariance of the prior", why: "it is not positive definite" }
                .into())
        }
        None => Ok(()),
    }
}
