//! Distance of two small disks.

use nalgebra::Vector3;
use rigid_pose::require_positive;

use super::{ErrorMetric, Row, Rows};
use crate::error::Result;
use crate::parts::scene::{Pair, Scene};

/// Generalised ICP `[Segal2009]`: `2ε (m − q)ᵀ (C_q + R C_p Rᵀ)⁻¹ (m − q)`, where each point is a disk with covariance
/// `C = I − (1 − ε) n nᵀ`: known to ε across its plane, unknown within. The factor 2ε makes the residual the distance
/// along the normal where both normals agree; pairs whose normals differ lose weight.
///
/// The eigenvectors of the sum are the mean of the normals, their difference and what is normal to both, so that no
/// matrix is inverted. Its change with the rotation is neglected in the derivative, as in the source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneToPlane {
    /// ε, variance across a plane over that within. Default 0.001.
    pub flatness: f64,
}

impl Default for PlaneToPlane {
    fn default() -> Self {
        Self { flatness: 1e-3 }
    }
}

impl PlaneToPlane {
    /// Eigenvectors of the sum of covariances with the square root of 2ε over their eigenvalues; the first is that
    /// along the normals.
    fn axes(self, pair: &Pair) -> [(Vector3<f64>, f64); 3] {
        let (n, m) = (pair.normal, pair.source_normal);
        let thin = 1.0 - self.flatness;
        let cosine = n.dot(&m).clamp(-1.0, 1.0);
        let mean = (n + m).normalize();
        let difference = n - m;
        let side = difference - mean * mean.dot(&difference);
        // Equal normals have any direction within the plane for their difference.
        let within = if side.norm() > 1e-6 { side.normalize() } else { perpendicular(&mean) };
        let root = |eigenvalue: f64| (2.0 * self.flatness / eigenvalue).sqrt();
        [
            (mean, root(2.0 - thin * (1.0 + cosine))),
            (within, root(2.0 - thin * (1.0 - cosine))),
            (mean.cross(&within), root(2.0)),
        ]
    }
}

/// A unit vector at a right angle to another.
fn perpendicular(v: &Vector3<f64>) -> Vector3<f64> {
    let mut other = Vector3::zeros();
    other[v.iamin()] = 1.0;
    v.cross(&other).normalize()
}

impl ErrorMetric for PlaneToPlane {
    fn accepts(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        pair.has_normals()
    }

    fn rows(&self, _: &Scene<'_>, pair: &Pair, rows: &mut Rows) {
        let offset = pair.offset();
        for (axis, root) in self.axes(pair) {
            rows.push(Row::along(axis * root, offset.dot(&axis) * root));
        }
    }

    /// The mean weight along the normals.
    fn twin_weight(&self, _: &Scene<'_>, pairs: &[Pair]) -> f64 {
        let sum: f64 = pairs.iter().map(|pair| self.axes(pair)[0].1.powi(2)).sum();
        sum / pairs.len().max(1) as f64
    }

    fn validate(&self, _: &Scene<'_>) -> Result<()> {
        Ok(require_positive("flatness", self.flatness)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn axes_are_those_of_the_sum_of_covariances() {
        let metric = PlaneToPlane::default();
        for (n, m) in [([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), ([0.1, 0.2, 1.0], [0.5, 0.0, 1.0])] {
            let (normal, source_normal) = (Vector3::from(n).normalize(), Vector3::from(m).normalize());
            let offset = Vector3::new(0.3, -0.2, 0.1);
            let pair = Pair {
                source: 0,
                target: Some(0),
                moved: offset,
                source_normal,
                point: Vector3::zeros(),
                normal,
                distance_m: offset.norm(),
                weight: 1.0,
            };
            let disk = |n: &Vector3<f64>| Matrix3::identity() - n * n.transpose() * (1.0 - metric.flatness);
            let inverse = (disk(&normal) + disk(&source_normal)).try_inverse().unwrap_or_default();
            let expected = 2.0 * metric.flatness * offset.dot(&(inverse * offset));
            let found: f64 = metric.axes(&pair).iter().map(|(axis, root)| (offset.dot(axis) * root).powi(2)).sum();
            // Inverting a matrix of condition 1000.
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }
}
