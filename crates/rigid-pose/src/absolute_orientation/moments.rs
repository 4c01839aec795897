//! Weighted moments of point pairs, and what follows from them once the rotation is known.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, UnitQuaternion, Vector3};

use super::Orientation;
use crate::error::{InputError, Result};
use crate::requirements::{require_length, require_points};
use crate::tangent::symmetrised;

/// Second principal extent over the first below which points count as collinear: the rotation about the line would be
/// known to no better than rounding over this ratio.
const COLLINEAR_RATIO: f64 = 1e-7;

/// Weighted first and second moments of both point sets.
pub(super) struct Moments {
    count: usize,
    pub weight: f64,
    source_mean: Vector3<f64>,
    target_mean: Vector3<f64>,
    pub source_scatter: Matrix3<f64>,
    /// `Σ w p' q'^T` about the means.
    pub cross: Matrix3<f64>,
}

impl Moments {
    pub fn new(source: &[Point3<f64>], target: &[Point3<f64>], weights: Option<&[f64]>) -> Result<Self> {
        check_input(source, target, weights)?;
        let weight_of = |i: usize| weights.map_or(1.0, |w| w[i]);
        let count = (0..source.len()).filter(|&i| weight_of(i) > 0.0).count();
        if count < 3 {
            return Err(InputError::TooFewPoints { what: "absolute orientation", found: count, needed: 3 });
        }
        let weight: f64 = (0..source.len()).map(weight_of).sum();
        let mean = |points: &[Point3<f64>]| {
            points.iter().enumerate().fold(Vector3::zeros(), |sum, (i, p)| sum + p.coords * (weight_of(i) / weight))
        };
        let (source_mean, target_mean) = (mean(source), mean(target));
        let (mut source_scatter, mut target_scatter, mut cross) =
            (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        for (i, (p, q)) in source.iter().zip(target).enumerate() {
            let (p, q, w) = (p.coords - source_mean, q.coords - target_mean, weight_of(i));
            source_scatter += p * p.transpose() * w;
            target_scatter += q * q.transpose() * w;
            cross += p * q.transpose() * w;
        }
        check_spread("source points", &source_scatter)?;
        check_spread("target points", &target_scatter)?;
        Ok(Self { count, weight, source_mean, target_mean, source_scatter, cross })
    }

    pub fn orientation(
        &self,
        source: &[Point3<f64>],
        target: &[Point3<f64>],
        weights: Option<&[f64]>,
        rotation: UnitQuaternion<f64>,
        scale: f64,
        unknowns: usize,
    ) -> Orientation {
        let translation = self.target_mean - rotation * (self.source_mean * scale);
        let target_from_source = Isometry3::from_parts(translation.into(), rotation);
        let squares: f64 = (0..source.len())
            .map(|i| {
                let left = target[i] - target_from_source * (source[i] * scale);
                weights.map_or(1.0, |w| w[i]) * left.norm_squared()
            })
            .sum();
        let redundancy = 3 * self.count - unknowns;
        let sigma0_m = if redundancy > 0 { (squares / redundancy as f64).sqrt() } else { f64::NAN };
        let cofactor = self.cofactor(&rotation, scale);
        Orientation {
            target_from_source,
            rms_m: (squares / self.weight).sqrt(),
            sigma0_m,
            redundancy,
            cofactor,
            covariance: cofactor * (sigma0_m * sigma0_m),
        }
    }

    /// Inverse normal matrix in closed form: about the centroid, rotation and translation do not mix.
    fn cofactor(&self, rotation: &UnitQuaternion<f64>, scale: f64) -> Matrix6<f64> {
        // d(R s p')/dtheta = -R [s p']x; the normal block is Σ w s² (|p'|² I − p' p'^T) in source axes.
        let inertia = (Matrix3::identity() * self.source_scatter.trace() - self.source_scatter) * (scale * scale);
        let q_rotation = inertia.try_inverse().unwrap_or_else(|| Matrix3::from_element(f64::INFINITY));
        // t = mean_q − R s mean_p, so dt picks up R [s mean_p]x dtheta.
        let lever = rotation.to_rotation_matrix() * (self.source_mean * scale).cross_matrix();
        let mut cofactor = Matrix6::zeros();
        let q_translation = Matrix3::identity() / self.weight + lever * q_rotation * lever.transpose();
        cofactor.fixed_view_mut::<3, 3>(0, 0).copy_from(&q_translation);
        cofactor.fixed_view_mut::<3, 3>(0, 3).copy_from(&(lever * q_rotation));
        cofactor.fixed_view_mut::<3, 3>(3, 0).copy_from(&(lever * q_rotation).transpose());
        cofactor.fixed_view_mut::<3, 3>(3, 3).copy_from(&q_rotation);
        symmetrised(&cofactor)
    }
}

fn check_input(source: &[Point3<f64>], target: &[Point3<f64>], weights: Option<&[f64]>) -> Result<()> {
    require_length("target points", source.len(), target.len())?;
    require_points("source points", source)?;
    require_points("target points", target)?;
    let Some(weights) = weights else { return Ok(()) };
    require_length("weights", source.len(), weights.len())?;
    for (index, &value) in weights.iter().enumerate() {
        if !value.is_finite() {
            return Err(InputError::NonFinite { what: "weights", index });
        }
        if value < 0.0 {
            return Err(InputError::NotPositive { what: "weights", index, value });
        }
    }
    Ok(())
}

fn check_spread(what: &'static str, scatter: &Matrix3<f64>) -> Result<()> {
    // From the invariants: trace ≈ largest, sum of principal minors ≈ largest · (middle + smallest). Unlike the roots
    // of the cubic this keeps all digits where the two smaller eigenvalues coincide.
    let minor = |i: usize, j: usize| scatter[(i, i)] * scatter[(j, j)] - scatter[(i, j)].powi(2);
    let minors = minor(0, 1) + minor(0, 2) + minor(1, 2);
    let largest = scatter.trace();
    let ratio = if largest > 0.0 { (minors.max(0.0)).sqrt() / largest } else { 0.0 };
    if ratio < COLLINEAR_RATIO { Err(InputError::Collinear { what, ratio }) } else { Ok(()) }
}
