//! Planes through groups of points from their moments, with the scatter that is left.

use nalgebra::{Matrix3, Vector3};

use crate::eigen::{eigenvalues3, eigenvector3};

/// Smallest ratio of the two variances within a plane: a third of the length in width.
const NARROWEST: f64 = 0.1;

/// Sums over the points of a group, about an origin near them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    count: f64,
    sum: Vector3<f64>,
    products: Matrix3<f64>,
}

/// A plane through a group of points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub normal: Vector3<f64>,
    /// Variance of a point across the plane, metre².
    pub variance: f64,
    /// Smaller variance of the points within the plane, metre².
    pub spread: f64,
}

impl Moments {
    pub(super) fn add(&mut self, point: &Vector3<f64>) {
        self.count += 1.0;
        self.sum += point;
        self.products += point * point.transpose();
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.products += other.products;
    }

    pub(super) fn count(&self) -> f64 {
        self.count
    }

    pub(super) fn mean(&self) -> Vector3<f64> {
        self.sum / self.count
    }

    /// `None` where the points form a line or a blob.
    pub(super) fn plane(&self) -> Option<Plane> {
        if self.count < 4.0 {
            return None;
        }
        let mean = self.mean();
        let scatter = self.products / self.count - mean * mean.transpose();
        let [smallest, middle, largest] = eigenvalues3(&scatter);
        // Points across a plane scatter less than a quarter as far as along it; the second test refuses strips, such as
        // the bevels that smoothed normals make of creases.
        if !(smallest <= 0.06 * middle && middle > NARROWEST * largest) {
            return None;
        }
        let normal = eigenvector3(&scatter, smallest)?;
        // Three of the points' degrees of freedom went into the plane.
        let variance = smallest.max(0.0) * self.count / (self.count - 3.0);
        Some(Plane { normal, variance, spread: middle })
    }
}
