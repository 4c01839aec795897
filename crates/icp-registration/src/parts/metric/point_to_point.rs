//! Distance of the points.

use nalgebra::Vector3;

use super::{ErrorMetric, Row, Rows, normal_twins};
use crate::parts::scene::{Pair, Scene};

/// `|m − q|²` `[BeslMcKay1992]`. Needs no normals, converges slowly, and the sampling of the surface enters the result.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PointToPoint;

impl ErrorMetric for PointToPoint {
    fn rows(&self, _: &Scene<'_>, pair: &Pair, rows: &mut Rows) {
        let offset = pair.offset();
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            rows.push(Row::along(axis, offset.dot(&axis)));
        }
    }

    fn degrees_of_freedom(&self) -> usize {
        3
    }

    /// On a surface neighbouring points slide past each other, so that the normals tell what is determined; where most
    /// points have no normal they are taken as marks that are known by themselves.
    fn twins(&self, scene: &Scene<'_>, pair: &Pair, a: &mut Rows, b: &mut Rows) {
        if scene.is_surface || scene.target.exact_normals {
            normal_twins(scene, pair, a, b);
        } else {
            self.rows(scene, pair, a);
            self.rows(scene, pair, b);
        }
    }

    fn is_point_to_point(&self) -> bool {
        true
    }
}
