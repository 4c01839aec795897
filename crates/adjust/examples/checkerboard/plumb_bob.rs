//! A point of a checkerboard in an image, modelled with the lens of OpenCV and ROS (`plumb_bob`).

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation, RigidPose};
use nalgebra::{Matrix2, Matrix2x3, Matrix3x6, Point3, SMatrix, Vector3};

/// `fx, fy, cx, cy, k1, k2, p1, p2, k3`: pixels, and without unit.
pub const NAMES: [&str; 9] = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];

/// An image point `(col, row)`, pixel, of a point of the board.
pub struct ImagePoint {
    /// `camera_from_board` (axes of computer vision), then the camera.
    pub blocks: [BlockId; 2],
    /// Point of the board, its own axes.
    pub board: Point3<f64>,
    /// Observed image point.
    pub observed: [f64; 2],
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
        let camera_from_board = RigidPose::isometry(parameters[0])?;
        let point = camera_from_board * self.board;
        if point.z <= 0.0 {
            return Err(EvaluationFailure::new("the point lies behind the camera"));
        }
        let &[fx, fy, cx, cy, k1, k2, p1, p2, k3] = parameters[1] else {
            return Err(EvaluationFailure::new("the camera has nine parameters"));
        };
        let (x, y) = (point.x / point.z, point.y / point.z);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        residual[0] = self.observed[0] - (fx * xd + cx);
        residual[1] = self.observed[1] - (fy * yd + cy);
        let Some(jacobians) = jacobians else { return Ok(()) };

        let growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = x * y * growth + 2.0 * (p1 * x + p2 * y);
        let lens = Matrix2::new(
            fx * (radial + x * x * growth + 2.0 * p1 * y + 6.0 * p2 * x),
            fx * mixed,
            fy * mixed,
            fy * (radial + y * y * growth + 6.0 * p1 * y + 2.0 * p2 * x),
        );
        let perspective = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / point.z;
        // d(R exp(dθ) b + t) / d[dt, dθ] = [I, −R [b]×]
        let mut motion = Matrix3x6::zeros();
        motion.fixed_columns_mut::<3>(0).copy_from(&nalgebra::Matrix3::identity());
        let arm: Vector3<f64> = self.board.coords;
        let turned = -(camera_from_board.rotation.to_rotation_matrix().matrix() * arm.cross_matrix());
        motion.fixed_columns_mut::<3>(3).copy_from(&turned);
        jacobians.set(0, &(lens * perspective * motion));

        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let camera = SMatrix::<f64, 2, 9>::from_row_slice(&[
            xd,
            0.0,
            1.0,
            0.0,
            fx * x * r2,
            fx * x * r4,
            fx * 2.0 * x * y,
            fx * (r2 + 2.0 * x * x),
            fx * x * r6,
            0.0,
            yd,
            0.0,
            1.0,
            fy * y * r2,
            fy * y * r4,
            fy * (r2 + 2.0 * y * y),
            fy * 2.0 * x * y,
            fy * y * r6,
        ]);
        jacobians.set(1, &camera);
        Ok(())
    }
}
