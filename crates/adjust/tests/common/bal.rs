//! Bundle adjustment in the large: problems of cameras with nine parameters (axis and angle, translation, focal length,
//! two radial distortions) and points.

use adjust::{Adjustment, BlockId, Covariance, EvaluationFailure, Jacobians, Observation, ParameterBlock};
use nalgebra::{Matrix3, Vector3};

/// One image point, pixel.
pub struct ImagePoint {
    pub blocks: [BlockId; 2],
    pub observed: [f64; 2],
}

/// `R(w) X`, and its derivative with respect to w and to X.
fn rotate(w: &Vector3<f64>, point: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
    let angle = w.norm();
    // (sin θ)/θ and (1 − cos θ)/θ with their limits.
    let (sinc, cosc, axis) = if angle > 1e-8 {
        (angle.sin() / angle, (1.0 - angle.cos()) / angle, w / angle)
    } else {
        (1.0, 0.5 * angle, Vector3::zeros())
    };
    let (outer, cross) = (axis * axis.transpose(), axis.cross_matrix());
    let rotation = Matrix3::identity() * angle.cos() + outer * (1.0 - angle.cos()) + cross * angle.sin();
    let left = Matrix3::identity() * sinc + outer * (1.0 - sinc) + cross * cosc;
    let turned = rotation * point;
    (turned, -turned.cross_matrix() * left, rotation)
}

impl Observation for ImagePoint {
    fn dimension(&self) -> usize {
        2
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let &[wx, wy, wz, tx, ty, tz, f, k1, k2] = parameters[0] else {
            return Err(EvaluationFailure::new("a camera has nine parameters"));
        };
        let (turned, by_angle, rotation) =
            rotate(&Vector3::new(wx, wy, wz), &Vector3::from_column_slice(parameters[1]));
        let p = turned + Vector3::new(tx, ty, tz);
        if p.z == 0.0 {
            return Err(EvaluationFailure::new("the point lies in the plane of the camera"));
        }
        let (u, v) = (-p.x / p.z, -p.y / p.z);
        let r2 = u * u + v * v;
        let distortion = 1.0 + r2 * (k1 + k2 * r2);
        residual[0] = self.observed[0] - f * distortion * u;
        residual[1] = self.observed[1] - f * distortion * v;
        let Some(jacobians) = jacobians else { return Ok(()) };
        let slope = 2.0 * (k1 + 2.0 * k2 * r2);
        let by_uv = [
            [f * (distortion + slope * u * u), f * slope * u * v],
            [f * slope * u * v, f * (distortion + slope * v * v)],
        ];
        for (row, [du, dv]) in by_uv.into_iter().enumerate() {
            let own = if row == 0 { u } else { v };
            let by_point = Vector3::new(-du / p.z, -dv / p.z, -(du * u + dv * v) / p.z);
            let out = jacobians.row(0, row);
            out[..3].copy_from_slice((by_angle.tr_mul(&by_point)).as_slice());
            out[3..6].copy_from_slice(by_point.as_slice());
            out[6..].copy_from_slice(&[distortion * own, f * r2 * own, f * r2 * r2 * own]);
            jacobians.row(1, row).copy_from_slice((rotation.tr_mul(&by_point)).as_slice());
        }
        Ok(())
    }
}

/// A problem with its blocks.
pub struct Bundle {
    pub adjustment: Adjustment<'static>,
    pub cameras: Vec<BlockId>,
    pub points: Vec<BlockId>,
}

/// Reads the text of a problem; `None` where it is none.
pub fn bundle(text: &str) -> Option<Bundle> {
    let mut words = text.split_ascii_whitespace();
    let mut count = || words.next()?.parse::<usize>().ok();
    let (cameras, points, images) = (count()?, count()?, count()?);
    let mut number = || words.next()?.parse::<f64>().ok();
    let mut observed = Vec::new();
    for _ in 0..images {
        observed.push((number()? as usize, number()? as usize, [number()?, number()?]));
    }
    let mut adjustment = Adjustment::new();
    let mut block = |size: usize| -> Option<BlockId> {
        let values = (0..size).map(|_| number()).collect::<Option<Vec<f64>>>()?;
        Some(adjustment.add_block(ParameterBlock::euclidean(values)))
    };
    let cameras = (0..cameras).map(|_| block(9)).collect::<Option<Vec<_>>>()?;
    let points = (0..points).map(|_| block(3)).collect::<Option<Vec<_>>>()?;
    let group = adjustment.add_group("image points");
    let sigma = Covariance::from_sigmas(&[1.0, 1.0]);
    for (camera, point, observed) in observed {
        let blocks = [*cameras.get(camera)?, *points.get(point)?];
        adjustment.add_observation(group, ImagePoint { blocks, observed }, &sigma).ok()?;
    }
    Some(Bundle { adjustment, cameras, points })
}
