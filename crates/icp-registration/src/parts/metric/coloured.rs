//! Distance from tangent planes, and intensity within them.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use rigid_pose::{InputError, require_length};

use super::{ErrorMetric, Row, Rows, normal_twins};
use crate::error::Result;
use crate::parts::scene::{Pair, Scene};
use crate::target::IcpTarget;
use point_cloud::Cloud;
use point_cloud::NeighbourTree;
use point_cloud::{UnorganisedNormalOptions, normals_with_tree};

/// Points that an intensity gradient is fitted to.
const NEIGHBOURS: usize = 16;

/// Coloured ICP `[Park2017]`: besides the distance from the plane the difference of the intensities, the target's
/// continued linearly within its tangent plane: `I_q + d_q · (m − q) − I_p`. What a plane leaves open, its texture closes.
///
/// Instead of a fixed λ the two kinds of residuals are weighted by their scales, as found among the pairs, so that the
/// unit of the intensity does not matter. Pairs without known intensity keep their plane.
#[derive(Debug)]
pub struct Coloured {
    source: Vec<Vector3<f64>>,
    target: Vec<Vector3<f64>>,
}

impl Coloured {
    /// Fits the gradients of both clouds. Normals of the source are estimated where there are none.
    ///
    /// # Errors
    /// [`InputError::Empty`] where a cloud has no points or no intensity, [`InputError::NonFinite`], [`InputError::LengthMismatch`].
    pub fn new(source: &Cloud, target: &IcpTarget) -> Result<Self> {
        source.validate("the source cloud")?;
        let tree = NeighbourTree::new(&source.points)?;
        let estimated;
        let normals = if let Some(normals) = &source.normals {
            normals
        } else {
            estimated = normals_with_tree(&source.points, &tree, &UnorganisedNormalOptions::default())?;
            &estimated
        };
        let source_gradients = gradients(source, normals, &tree, "intensities of the source cloud")?;
        let target_gradients =
            gradients(&target.cloud, &target.normals, &target.tree, "intensities of the target cloud")?;
        Ok(Self { source: source_gradients, target: target_gradients })
    }

    /// Gradient of the target at the partner; `None` where unknown.
    fn gradient(&self, pair: &Pair) -> Option<(usize, Vector3<f64>)> {
        let index = pair.target?;
        let gradient = self.target[index];
        (!gradient.x.is_nan()).then_some((index, gradient))
    }
}

impl ErrorMetric for Coloured {
    fn accepts(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        !pair.normal.x.is_nan()
    }

    fn rows(&self, scene: &Scene<'_>, pair: &Pair, rows: &mut Rows) {
        let offset = pair.offset();
        rows.push(Row::along(pair.normal, pair.normal.dot(&offset)));
        let planes = (&scene.source.intensity, scene.target.cloud.and_then(|cloud| cloud.intensity.as_ref()));
        let ((Some(source), Some(target)), Some((index, gradient))) = (planes, self.gradient(pair)) else { return };
        let residual = target[index] + gradient.dot(&offset) - source[pair.source];
        if residual.is_finite() {
            rows.push(Row { gradient, turn: Vector3::zeros(), residual, channel: 1 });
        }
    }

    fn degrees_of_freedom(&self) -> usize {
        2
    }

    fn channels(&self) -> usize {
        2
    }

    fn twins(&self, scene: &Scene<'_>, pair: &Pair, a: &mut Rows, b: &mut Rows) {
        normal_twins(scene, pair, a, b);
        let source = self.source[pair.source];
        if let (Some((_, gradient)), false) = (self.gradient(pair), source.x.is_nan()) {
            let row = |gradient| Row { gradient, turn: Vector3::zeros(), residual: 0.0, channel: 1 };
            a.push(row(gradient));
            b.push(row(scene.moment.pose.rotation * source));
        }
    }

    fn validate(&self, scene: &Scene<'_>) -> Result<()> {
        let target = scene.target.cloud.map_or(0, Cloud::len);
        require_length("intensity gradients of the source", scene.source.len(), self.source.len())?;
        Ok(require_length("intensity gradients of the target", target, self.target.len())?)
    }
}

/// Gradients of the intensity within the tangent planes, in the cloud's unit per metre; NaN where unknown.
fn gradients(
    cloud: &Cloud,
    normals: &[Vector3<f64>],
    tree: &NeighbourTree,
    what: &'static str,
) -> Result<Vec<Vector3<f64>>> {
    let Some(intensity) = &cloud.intensity else { return Err(InputError::Empty { what }.into()) };
    let gradient = |i: usize| -> Result<Vector3<f64>> {
        let neighbours = tree.k_nearest(&cloud.points[i], NEIGHBOURS)?;
        let about = neighbours.iter().map(|n| (cloud.points[n.index] - cloud.points[i], intensity[n.index]));
        Ok(fit(&about.collect::<Vec<_>>(), intensity[i], &normals[i]).unwrap_or_else(|| Vector3::repeat(f64::NAN)))
    };
    (0..cloud.len()).into_par_iter().with_min_len(256).map(gradient).collect()
}

/// Least-squares gradient of intensities at offsets from a point, at right angles to the normal.
fn fit(about: &[(Vector3<f64>, f64)], at: f64, normal: &Vector3<f64>) -> Option<Vector3<f64>> {
    let extent = about.iter().map(|(d, _)| d.norm_squared()).sum::<f64>();
    // The normal as a direction without change closes the rank.
    let mut matrix = normal * normal.transpose() * extent;
    let mut right = Vector3::zeros();
    for (offset, value) in about {
        let within = offset - normal * normal.dot(offset);
        matrix += within * within.transpose();
        right += within * (value - at);
    }
    // Neighbours on a line do not give a gradient.
    let scaled: Matrix3<f64> = matrix / extent;
    let gradient = scaled.try_inverse().filter(|_| scaled.determinant() > 1e-4)? * right / extent;
    gradient.iter().all(|v| v.is_finite()).then_some(gradient)
}
