//! The adjustment of the keyframes where loops were closed.
//!
//! Unknown are the poses of all keyframes but the first, which is held, and the field of the sensor's shared error, which is
//! observed with its variances as 0 (least squares by Gauss and Newton). The poses are eliminated; what the observations
//! scatter beyond their covariances enlarges all of them (a-posteriori variance factor). Each pose is joined with few others, so the
//! factor is sparse: of 64 keyframes a whole one takes some 25 ms longer, in a frame that has to wait for it.
//!
//! The part of the field that differs from place to place is not estimated: loops would average what their neighbours
//! share, and promise too much. It enters the covariances once, as one field of the whole path `[Schmidt1966]`.

use nalgebra::{DMatrix, DVector, Isometry3, Vector6};

use super::graph::{Edge, Graph};
use super::relation::Relation;
use projective_registration::{COEFFICIENTS, Field, FieldMatrix};
use rigid_pose::{Uncertain, pose_difference, relative_jacobians, step_pose, symmetrised};
use sparse_matrices::BlockMatrix;

const MAX_ITERATIONS: usize = 10;
/// Steps (metre, radian) below which the adjustment has converged: far below every standard deviation.
const STEP: f64 = 1e-7;

/// Normal equations of all poses but the first: their matrix, its product with their derivatives by the field (a column a
/// coefficient), right-hand side, and the parts of the field.
struct Normal {
    matrix: BlockMatrix,
    cross: DMatrix<f64>,
    right: DVector<f64>,
    field: FieldMatrix,
    field_right: Field,
}

impl Graph {
    /// Adjusts all poses; leaves them as they are where the observations do not determine them.
    pub(crate) fn adjust(&mut self) {
        let mut poses: Vec<Isometry3<f64>> = self.poses.iter().map(|p| *p.pose()).collect();
        let mut field = self.field;
        let mut last = None;
        for _ in 0..MAX_ITERATIONS {
            let normal = self.normal_equations(&poses, &(field - self.field));
            let Some(factor) = normal.matrix.factor() else { return };
            let (mut by_field, mut alone) = (normal.cross.clone(), normal.right.clone());
            by_field.column_iter_mut().for_each(|mut column| factor.solve(column.as_mut_slice()));
            factor.solve(alone.as_mut_slice());
            let Some((change, covariance)) = self.field_step(&normal, &by_field, &field) else { return };
            let step = alone + &by_field * change;
            if !step.iter().all(|v| v.is_finite()) {
                return;
            }
            field += change;
            for (k, pose) in poses.iter_mut().enumerate().skip(1) {
                *pose = step_pose(pose, &Vector6::from_fn(|i, _| step[6 * (k - 1) + i]));
            }
            last = Some((factor, by_field, covariance));
            if step.amax() < STEP {
                break;
            }
        }
        let Some((factor, by_field, covariance)) = last else { return };
        let random = factor.selected_inverse();
        for (k, (kept, pose)) in self.poses.iter_mut().zip(poses).enumerate().skip(1) {
            let row = 6 * (k - 1);
            let Some(block) = random.block(k - 1, k - 1) else { continue };
            let block = symmetrised(&block.fixed_view::<6, 6>(0, 0).into_owned());
            let by_field = by_field.fixed_view::<6, COEFFICIENTS>(row, 0).into_owned();
            *kept = Relation { random: Uncertain { pose, covariance: block }, by_field };
        }
        let change = field - self.field;
        for edge in &mut self.edges {
            edge.a_from_b = edge.a_from_b.moved(&change);
        }
        (self.field, self.covariance) = (field, covariance + FieldMatrix::from_diagonal(&self.shared.local()));
        self.set_factor();
    }

    /// Sets the variance factor after an adjustment, and enlarges the covariances by it.
    fn set_factor(&mut self) {
        let square = |edge: &Edge| {
            let v = pose_difference(&self.relative(edge.a, edge.b), edge.a_from_b.pose());
            self.weighed(&edge.a_from_b, edge.alike).random.covariance.cholesky().map_or(0.0, |c| v.dot(&c.solve(&v)))
        };
        let squares: f64 = self.edges.iter().map(square).sum();
        let redundancy = 6 * (self.edges.len() + 1).saturating_sub(self.poses.len());
        // As one more observation of the factor that is assumed now.
        let change = (squares + 6.0) / (redundancy as f64 + 6.0);
        let factor = (self.factor * change).max(1.0);
        for pose in &mut self.poses {
            pose.random.covariance *= factor / self.factor;
        }
        self.factor = factor;
    }

    /// The step of the field, all poses following it (`by_field`), and its covariance. In units of the standard deviations
    /// of the coefficients, since some may be 0.
    fn field_step(&self, normal: &Normal, by_field: &DMatrix<f64>, field: &Field) -> Option<(Field, FieldMatrix)> {
        let sigma = self.shared.everywhere().map(f64::sqrt);
        let scale = FieldMatrix::from_diagonal(&sigma);
        let followed = normal.cross.transpose() * by_field;
        let reduced = normal.field - FieldMatrix::from_fn(|r, c| followed[(r, c)]);
        let matrix = scale * reduced * scale + FieldMatrix::identity();
        let right = by_field.transpose() * &normal.right;
        let right = normal.field_right + Field::from_fn(|k, _| right[k]);
        // What the linear equations say about the whole field, not about its step.
        let right = right + reduced * field;
        let factor = ((matrix + matrix.transpose()) * 0.5).cholesky()?;
        let whole = scale * factor.solve(&(scale * right));
        Some((whole - field, scale * factor.inverse() * scale))
    }

    /// `change`: what the field is assumed to be more than when the observations were corrected by it.
    fn normal_equations(&self, poses: &[Isometry3<f64>], change: &Field) -> Normal {
        let size = 6 * (poses.len() - 1);
        let mut normal = Normal {
            matrix: BlockMatrix::new(&vec![6; poses.len() - 1]),
            cross: DMatrix::zeros(size, COEFFICIENTS),
            right: DVector::zeros(size),
            field: FieldMatrix::zeros(),
            field_right: Field::zeros(),
        };
        for edge in &self.edges {
            let model = poses[edge.a].inverse() * poses[edge.b];
            let observed = self.weighed(&edge.a_from_b.moved(change), edge.alike);
            let v = pose_difference(&model, observed.pose());
            let Some(factor) = observed.random.covariance.cholesky() else { continue };
            let information = factor.inverse();
            let by_field = information * observed.by_field;
            normal.field += observed.by_field.transpose() * by_field;
            normal.field_right -= by_field.transpose() * v;
            let [by_a, by_b] = relative_jacobians(&poses[edge.a], &model);
            let jacobians = [(edge.a, by_a), (edge.b, by_b)];
            for (k, jk) in jacobians.iter().filter(|(k, _)| *k != 0) {
                let row = 6 * (k - 1);
                let weighted = jk.transpose() * information;
                let mut part = normal.right.fixed_rows_mut::<6>(row);
                part += weighted * v;
                let mut part = normal.cross.fixed_view_mut::<6, COEFFICIENTS>(row, 0);
                part += jk.transpose() * by_field;
                // Blocks beside the diagonal stand for both of their sides.
                for (l, jl) in jacobians.iter().filter(|(l, _)| *l != 0 && l <= k) {
                    let block = weighted * jl;
                    normal.matrix.add(k - 1, l - 1, |i, j| block[(i, j)]);
                }
            }
        }
        normal
    }
}
