//! Distance from tangent planes.

use super::{ErrorMetric, Row, Rows};
use crate::parts::scene::{Pair, Scene};

/// `(n_q · (m − q))²`: distance of the source point from the tangent plane of its partner `[ChenMedioni1992]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PointToPlane;

impl ErrorMetric for PointToPlane {
    fn accepts(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        !pair.normal.x.is_nan()
    }

    fn rows(&self, _: &Scene<'_>, pair: &Pair, rows: &mut Rows) {
        rows.push(Row::along(pair.normal, pair.normal.dot(&pair.offset())));
    }
}

/// `((n_p + n_q)/2 · (m − q))²` `[Rusinkiewicz2019]`: zero wherever the two points lie on one circle that both normals
/// belong to, so that curved surfaces match to second order. n_p turns with the source.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SymmetricPlanes;

impl ErrorMetric for SymmetricPlanes {
    fn accepts(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        pair.has_normals()
    }

    fn rows(&self, _: &Scene<'_>, pair: &Pair, rows: &mut Rows) {
        let (mean, offset) = ((pair.source_normal + pair.normal) * 0.5, pair.offset());
        let turn = pair.source_normal.cross(&offset) * 0.5;
        rows.push(Row { gradient: mean, turn, residual: mean.dot(&offset), channel: 0 });
    }
}
