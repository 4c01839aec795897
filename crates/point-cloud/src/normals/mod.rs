//! Surface normals of frames and of clouds.

mod organised;
mod unorganised;

pub use organised::{OrganisedNormalOptions, organised_normals};
pub use unorganised::{UnorganisedNormalOptions, normals_with_tree, unorganised_normals};

use nalgebra::{Matrix3, Vector3};

use crate::eigen::{eigenvalues3, eigenvector3};

/// Cosine of the largest angle between normals of one surface: two that scatter by 20 degrees each, as through few noisy points, enclose 45
/// in one of a hundred cases. With 0.5 surfaces across an edge pass for one.
pub const SAME_SURFACE_COSINE: f64 = 0.7;

/// Largest ratio of the smallest to the middle eigenvalue of the neighbourhood's scatter at which it still counts as a
/// surface: noise as large as half the neighbourhood's width.
const LARGEST_FLATNESS_RATIO: f64 = 0.25;

/// Running moments of a neighbourhood about a reference point.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Neighbourhood {
    count: usize,
    sum: Vector3<f64>,
    products: [f64; 6],
}

impl Neighbourhood {
    /// Adds a point given relative to the reference.
    pub(crate) fn add(&mut self, d: &Vector3<f64>) {
        self.count += 1;
        self.sum += d;
        let products = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
        for (sum, product) in self.products.iter_mut().zip(products) {
            *sum += product;
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Unit normal of the least-squares plane; `None` where the points do not form a surface.
    pub(crate) fn normal(&self, min_neighbours: usize) -> Option<Vector3<f64>> {
        if self.count < min_neighbours.max(3) {
            return None;
        }
        let mean = self.sum / self.count as f64;
        let [xx, xy, xz, yy, yz, zz] = self.products.map(|s| s / self.count as f64);
        let scatter = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) - mean * mean.transpose();
        let [smallest, middle, largest] = eigenvalues3(&scatter);
        // The second test refuses a line: its middle eigenvalue is rounding.
        if !(smallest <= LARGEST_FLATNESS_RATIO * middle && middle > 1e-7 * largest) {
            return None;
        }
        eigenvector3(&scatter, smallest)
    }
}

/// NaN in all three components: no normal.
#[must_use]
pub fn no_normal() -> Vector3<f64> {
    Vector3::repeat(f64::NAN)
}

/// Turns a normal to the side of the viewpoint, given the vector from the surface to the viewpoint.
pub(crate) fn facing(normal: Vector3<f64>, to_viewpoint: &Vector3<f64>) -> Vector3<f64> {
    if normal.dot(to_viewpoint) < 0.0 { -normal } else { normal }
}
