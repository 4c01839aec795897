//! What is minimised.

mod coloured;
mod plane_to_plane;
mod planes;
mod point_to_point;

pub use coloured::Coloured;
pub use plane_to_plane::PlaneToPlane;
pub use planes::{PointToPlane, SymmetricPlanes};
pub use point_to_point::PointToPoint;

use nalgebra::Vector3;

use super::scene::{Pair, Scene};
use crate::error::Result;

/// Rows that a pair may have at most.
const MAX_ROWS: usize = 4;

/// A residual and how it changes with the source point and with its turning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Derivative with respect to the moved source point, target axes.
    pub gradient: Vector3<f64>,
    /// Derivative with respect to a rotation vector about the source point, target axes, metre (zero where the residual
    /// sees nothing of the source but its point).
    pub turn: Vector3<f64>,
    /// The residual, metre (channel 0) or any other unit (channel 1).
    pub residual: f64,
    /// Kind of residual: 0 for lengths, 1 for another quantity. Residuals of channel 1 are brought to metres by the ratio
    /// of the scales of the two channels.
    pub channel: usize,
}

impl Row {
    /// A residual in metre that depends on the source point alone.
    pub fn along(gradient: Vector3<f64>, residual: f64) -> Self {
        Self { gradient, turn: Vector3::zeros(), residual, channel: 0 }
    }
}

/// The rows of one pair.
#[derive(Debug, Clone, Copy)]
pub struct Rows {
    rows: [Row; MAX_ROWS],
    len: usize,
}

impl Default for Rows {
    fn default() -> Self {
        Self { rows: [Row::along(Vector3::zeros(), 0.0); MAX_ROWS], len: 0 }
    }
}

impl Rows {
    /// Adds a row; beyond the fourth it is ignored.
    pub fn push(&mut self, row: Row) {
        if self.len < MAX_ROWS {
            self.rows[self.len] = row;
            self.len += 1;
        }
    }

    /// Takes all rows out.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The rows in the order in which they were added.
    pub fn as_slice(&self) -> &[Row] {
        &self.rows[..self.len]
    }
}

/// The residuals of a pair, whose weighted squares are minimised.
pub trait ErrorMetric: Sync {
    /// Whether the pair has what the metric needs.
    fn accepts(&self, _scene: &Scene<'_>, _pair: &Pair) -> bool {
        true
    }

    /// Residuals of the pair with their derivatives, added to the empty `rows`. The kernel judges the root of the sum of
    /// their squares.
    fn rows(&self, scene: &Scene<'_>, pair: &Pair, rows: &mut Rows);

    /// Number of rows of similar standard deviation when the pair fits (1 to 4): the median of the root of the sum of
    /// squares is compared with that of a chi distribution.
    fn degrees_of_freedom(&self) -> usize {
        1
    }

    /// 2 where rows of channel 1 occur.
    fn channels(&self) -> usize {
        1
    }

    /// Derivatives of the pair twice, from measurements with independent errors: the products `aᵢ bᵢᵀ` are what the pair
    /// says about the pose without what the noise of normals imitates. By default the directions of both normals; where
    /// the source has none and those of the target are exact, the target's twice.
    fn twins(&self, scene: &Scene<'_>, pair: &Pair, a: &mut Rows, b: &mut Rows) {
        normal_twins(scene, pair, a, b);
    }

    /// Factor on the products of all twins. A weight that the noise of both normals decides pair by pair favours pairs in
    /// which that noise agrees, and would give the products back the bias they are there to avoid.
    fn twin_weight(&self, _scene: &Scene<'_>, _pairs: &[Pair]) -> f64 {
        1.0
    }

    /// Whether the metric is the squared distance of points, as closed forms need.
    fn is_point_to_point(&self) -> bool {
        false
    }

    /// Refuses parameters outside their domain, and attributes that are needed and missing.
    fn validate(&self, _scene: &Scene<'_>) -> Result<()> {
        Ok(())
    }
}

/// The directions of both normals.
fn normal_twins(scene: &Scene<'_>, pair: &Pair, a: &mut Rows, b: &mut Rows) {
    if pair.has_normals() {
        a.push(Row::along(pair.normal, 0.0));
        b.push(Row::along(pair.source_normal, 0.0));
    } else if scene.target.exact_normals && !pair.normal.x.is_nan() {
        a.push(Row::along(pair.normal, 0.0));
        b.push(Row::along(pair.normal, 0.0));
    }
}
