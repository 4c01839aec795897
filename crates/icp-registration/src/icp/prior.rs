//! The guess as an observation.

use nalgebra::{Isometry3, Matrix6};

use crate::error::{Error, Result};
use rigid_pose::{InputError, Uncertain};

/// The pose of least squares between what the pairs say (`found`) and the guess with its covariance.
pub(super) fn fused_with_prior(found: &Uncertain, guess: &Isometry3<f64>, prior: &Matrix6<f64>) -> Result<Uncertain> {
    // The prior's rotations are about the axes of the source at the guess, which differ from those at the pose only by
    // the turn between them: exp(w_guess) seen from the pose is the same rotation in turned axes.
    let turn = (found.pose.rotation.inverse() * guess.rotation).to_rotation_matrix().into_inner();
    let mut carried = Matrix6::identity();
    carried.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    let prior = Uncertain { pose: *guess, covariance: carried * prior * carried.transpose() };
    let singular = "a covariance is not positive definite";
    Ok(found.combined(&prior).ok_or(InputError::Numerical { what: "the fusion with the prior", why: singular })?)
}

/// Refuses a covariance that is not positive definite.
pub(super) fn validate(prior: Option<&Matrix6<f64>>) -> Result<()> {
    let Some(prior) = prior else {
        return Err(Error::Incompatible { what: "holding at a prior", with: "a guess without covariance" });
    };
    let diagonal = prior.diagonal();
    match (0..6).find(|&k| !(diagonal[k] > 0.0 && diagonal[k].is_finite())) {
        Some(index) => Err(InputError::NotPositive { what: "prior_covariance", index, value: diagonal[index] }.into()),
        None if prior.cholesky().is_none() => {
            Err(InputError::Numerical { what: "the covariance of the prior", why: "it is not positive definite" }
                .into())
        }
        None => Ok(()),
    }
}
