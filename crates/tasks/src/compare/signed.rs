//! Signed distances to the surface that a cloud samples.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use point_cloud::{Cloud, NeighbourTree};

/// Neighbours that a plane is laid through.
const NEIGHBOURS: usize = 10;
/// A point may lie beside its neighbours by this much of their radius; farther out the plane is a guess.
const BESIDE: f64 = 1.5;
/// Second extent over the first below which neighbours are a line.
const LINE: f64 = 1e-3;

/// Planes through the points of a reference.
pub(crate) struct Surface<'a> {
    cloud: &'a Cloud,
    tree: &'a NeighbourTree,
    viewpoint: Point3<f64>,
    positive: &'static str,
}

impl<'a> Surface<'a> {
    pub(crate) fn new(cloud: &'a Cloud, tree: &'a NeighbourTree, viewpoint: Option<Point3<f64>>) -> Self {
        let positive = match (&cloud.normals, viewpoint) {
            (Some(_), _) => "on the side that the reference's normals point to",
            (None, Some(_)) => "nearer to the reference's viewpoint",
            (None, None) => "on the side of the origin of the reference's frame",
        };
        Self { cloud, tree, viewpoint: viewpoint.unwrap_or_else(Point3::origin), positive }
    }

    /// What a positive distance means.
    pub(crate) fn positive(&self) -> &'static str {
        self.positive
    }

    /// Signed distance of a point, metre; NaN where the reference has no surface.
    pub(crate) fn distance(&self, point: &Point3<f64>) -> Result<f64, point_cloud::Error> {
        let neighbours = self.tree.k_nearest(point, NEIGHBOURS)?;
        if neighbours.len() < 3 {
            return Ok(f64::NAN);
        }
        let count = neighbours.len() as f64;
        let at = |index: usize| self.cloud.points[index].coords;
        let centre: Vector3<f64> = neighbours.iter().map(|neighbour| at(neighbour.index)).sum::<Vector3<f64>>() / count;
        let (mut scatter, mut radius) = (Matrix3::zeros(), 0.0_f64);
        for neighbour in &neighbours {
            let offset = at(neighbour.index) - centre;
            scatter += offset * offset.transpose();
            radius = radius.max(offset.norm());
        }
        let Some(eigen) = SymmetricEigen::try_new(scatter, 1e-15, 1000) else { return Ok(f64::NAN) };
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let [least, middle, most] = order.map(|k| eigen.eigenvalues[k].max(0.0));
        // A line or a blob of neighbours has no plane.
        if middle.sqrt() <= LINE * most.sqrt() || least > 0.5 * middle {
            return Ok(f64::NAN);
        }
        let normal: Vector3<f64> = eigen.eigenvectors.column(order[0]).into_owned();
        let offset = point.coords - centre;
        let distance = normal.dot(&offset);
        // A plane that is farther away than the nearest point cuts through scattered neighbours, not along a surface.
        let thickness = (least / count).sqrt();
        let too_far = distance.abs() > neighbours[0].distance_m + 3.0 * thickness;
        if too_far || (offset - normal * distance).norm() > BESIDE * radius {
            return Ok(f64::NAN);
        }
        let nearest = neighbours[0].index;
        let outward = match &self.cloud.normals {
            Some(normals) => normals[nearest],
            None => self.viewpoint - self.cloud.points[nearest],
        };
        let side = normal.dot(&outward);
        Ok(if side.is_nan() { f64::NAN } else { distance * side.signum() })
    }
}
