//! Normals of the averaged points and the side they point to.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::description::reduced::Reduced;
use crate::description::surroundings::{Near, Surroundings};
use crate::options::Viewpoint;
use point_cloud::{eigenvalues3, eigenvector3};

/// Neighbourhood of a normal, voxels: large enough for some 15 neighbours, small enough to follow edges.
const NORMAL_RADIUS_VOXELS: f64 = 2.2;
/// Fewest neighbours within it; what has less floats in the air.
const LEAST_NEIGHBOURS: usize = 5;

/// Unit normals of the points.
#[derive(Debug, Clone)]
pub(crate) struct Normals {
    /// NaN where a point has none.
    pub(crate) vectors: Vec<[f32; 3]>,
    /// Whether their side means something.
    pub(crate) sided: bool,
}

impl Normals {
    pub(crate) fn new(reduced: &Reduced, surroundings: &Surroundings, viewpoint: Viewpoint) -> Self {
        let radius = (NORMAL_RADIUS_VOXELS * reduced.voxel_m) as f32;
        let given = reduced.given_normals.iter().any(|n| n.iter().any(|c| *c != 0.0));
        let eye = viewpoint.about(&reduced.middle);
        let vectors = (0..reduced.len())
            .into_par_iter()
            .map(|i| {
                let near = surroundings.of(i);
                let Some(normal) = plane_normal(&reduced.points, i, near, radius * radius) else {
                    return [f32::NAN; 3];
                };
                let own = Vector3::from(reduced.given_normals[i].map(f64::from));
                let side = match eye {
                    Some(eye) => normal.dot(&(eye - Vector3::from(reduced.points[i].map(f64::from)))),
                    None => normal.dot(&own),
                };
                let normal = if side < 0.0 { -normal } else { normal };
                [normal.x as f32, normal.y as f32, normal.z as f32]
            })
            .collect();
        Self { vectors, sided: eye.is_some() || given }
    }
}

fn plane_normal(points: &[[f32; 3]], i: usize, near: &[Near], limit: f32) -> Option<Vector3<f64>> {
    let p = points[i];
    let (mut count, mut sum, mut products) = (1.0_f32, [0.0_f32; 3], [0.0_f32; 6]);
    for item in near.iter().filter(|item| item.squared <= limit) {
        let q = points[item.index as usize];
        let d = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        count += 1.0;
        for k in 0..3 {
            sum[k] += d[k];
        }
        for (total, (a, b)) in products.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]) {
            *total += d[a] * d[b];
        }
    }
    if count <= LEAST_NEIGHBOURS as f32 {
        return None;
    }
    let mean = Vector3::from(sum.map(|s| f64::from(s / count)));
    let [xx, xy, xz, yy, yz, zz] = products.map(|s| f64::from(s / count));
    let scatter = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) - mean * mean.transpose();
    let [smallest, ..] = eigenvalues3(&scatter);
    eigenvector3(&scatter, smallest)
}
