//! Planes through groups of points from their moments, with the scatter that is left.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use point_cloud::{eigenvalues3, eigenvector3};

/// Cosine of the largest angle between normals of one plane (15 degrees).
pub(crate) const SAME_DIRECTION: f64 = 0.966;
/// Smallest ratio of the two variances within a plane: a third of the length in width.
const NARROWEST: f64 = 0.1;

/// Sums over the points of a group, about an origin near them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments {
    count: f64,
    sum: Vector3<f64>,
    products: Matrix3<f64>,
}

/// A plane through a group of points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub normal: Vector3<f64>,
    /// Variance of a point across the plane, metre².
    pub variance: f64,
    /// Smaller variance of the points within the plane, metre².
    pub spread: f64,
}

impl Moments {
    /// Of some points about an origin.
    pub(crate) fn of(points: &[Point3<f64>], indices: &[u32], origin: &Vector3<f64>) -> Self {
        let mut moments = Self::default();
        for &index in indices {
            let point = points[index as usize].coords - origin;
            moments.count += 1.0;
            moments.sum += point;
            moments.products += point * point.transpose();
        }
        moments
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.products += other.products;
    }

    /// The moments of the points moved by `pose`, about another origin.
    pub(crate) fn moved(&self, from: &Vector3<f64>, pose: &Isometry3<f64>, to: &Vector3<f64>) -> Self {
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let mean = rotation * (from + self.mean()) + pose.translation.vector - to;
        let scatter = rotation * self.scatter() * rotation.transpose();
        Self { count: self.count, sum: mean * self.count, products: (scatter + mean * mean.transpose()) * self.count }
    }

    /// Second central moments.
    pub(crate) fn scatter(&self) -> Matrix3<f64> {
        let mean = self.mean();
        self.products / self.count - mean * mean.transpose()
    }

    pub(crate) fn count(&self) -> f64 {
        self.count
    }

    pub(crate) fn mean(&self) -> Vector3<f64> {
        self.sum / self.count
    }

    /// `None` where the points form a line or a blob, or a strip, such as the bevels that smoothed normals make of creases.
    pub(crate) fn plane(&self) -> Option<Plane> {
        self.fit(NARROWEST)
    }

    /// The plane of many groups, which may be long and narrow.
    pub(crate) fn region_plane(&self) -> Option<Plane> {
        self.fit(0.0)
    }

    fn fit(&self, narrowest: f64) -> Option<Plane> {
        if self.count < 4.0 {
            return None;
        }
        let scatter = self.scatter();
        let [smallest, middle, largest] = eigenvalues3(&scatter);
        // Points across a plane scatter less than a quarter as far as along it.
        if !(smallest <= 0.06 * middle && middle > narrowest * largest) {
            return None;
        }
        let normal = eigenvector3(&scatter, smallest)?;
        // Three of the points' degrees of freedom went into the plane.
        let variance = smallest.max(0.0) * self.count / (self.count - 3.0);
        Some(Plane { normal, variance, spread: middle })
    }
}
