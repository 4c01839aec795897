//! The observation equations 4-7 and their derivatives.

use nalgebra::{Isometry3, Matrix2x3, Matrix3, Point3, RowVector3, SMatrix, Vector2, Vector3};

use crate::{Camera, LensDistortion, Result};

/// What a camera observes of one point: image point and range, without random and without range errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Observed image point `(x, y)` (lens included), millimetre.
    pub image_mm: [f64; 2],
    /// Distance from the perspective centre, metre.
    pub range_m: f64,
}

/// Derivatives of an [`Observation`]; rows x (mm), y (mm), range (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservationJacobians {
    /// With respect to the pose's tangent step `[dt (world axes, metre), dtheta (camera axes, radian)]`
    /// of [`crate::step_pose`].
    pub pose: SMatrix<f64, 3, 6>,
    /// With respect to the interior orientation `[xp, yp, c]`, millimetre.
    pub interior: Matrix3<f64>,
    /// With respect to the lens `[k1, k2, k3, p1, p2, b1, b2]`.
    pub lens: SMatrix<f64, 3, 7>,
    /// With respect to the object point in world axes, metre.
    pub point: Matrix3<f64>,
}

impl Camera {
    /// Observes an object point (world frame, metre) from a pose: Eqs. 4-7 with the lens, without range error.
    ///
    /// The lens correction belongs to the observed image point, so that is found by iteration to machine precision.
    pub fn observe(&self, world_from_camera: &Isometry3<f64>, point: &Point3<f64>) -> Result<Observation> {
        let in_camera = world_from_camera.inverse_transform_point(point).coords;
        let observed = self.observed_reduced(self.collinear(&in_camera)?)?;
        Ok(Observation { image_mm: self.image_from_reduced(observed), range_m: in_camera.norm() })
    }

    /// As [`Self::observe`], with all derivatives.
    ///
    /// The observed image point is defined implicitly by `u - D(u) = q` with `q = -c (U, V) / W`, so
    /// `du = (I - D')^-1 (dq + dD)`. Counted from the principal point nothing depends on it, and its derivative is 1.
    pub fn observe_with_jacobians(
        &self,
        world_from_camera: &Isometry3<f64>,
        point: &Point3<f64>,
    ) -> Result<(Observation, ObservationJacobians)> {
        let in_camera = world_from_camera.inverse_transform_point(point).coords;
        let corrected = self.collinear(&in_camera)?;
        let observed = self.observed_reduced(corrected)?;
        let observation = Observation { image_mm: self.image_from_reduced(observed), range_m: in_camera.norm() };
        Ok((observation, self.jacobians(world_from_camera, &in_camera, corrected, observed)?))
    }

    fn jacobians(
        &self,
        world_from_camera: &Isometry3<f64>,
        in_camera: &Vector3<f64>,
        corrected: Vector2<f64>,
        observed: Vector2<f64>,
    ) -> Result<ObservationJacobians> {
        // Inside the fold, where `observed` was found, this matrix is positive definite; at the fold itself it is not.
        let observed_from_corrected =
            self.lens.derivative(observed).try_inverse().ok_or_else(|| self.no_observed_point(corrected))?;
        let by_camera_point = by_camera_point(in_camera, observed_from_corrected * self.image_by_point(in_camera));
        let camera_from_world = *world_from_camera.rotation.inverse().to_rotation_matrix().matrix();
        let point = by_camera_point * camera_from_world;
        let mut pose = SMatrix::<f64, 3, 6>::zeros();
        pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&-point);
        pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&(by_camera_point * in_camera.cross_matrix()));
        let by_distance = observed_from_corrected * corrected / self.interior.principal_distance_mm;
        let interior = Matrix3::new(1.0, 0.0, by_distance.x, 0.0, 1.0, by_distance.y, 0.0, 0.0, 0.0);
        let mut lens = SMatrix::<f64, 3, 7>::zeros();
        lens.fixed_view_mut::<2, 7>(0, 0).copy_from(&(observed_from_corrected * LensDistortion::design(observed)));
        Ok(ObservationJacobians { pose, interior, lens, point })
    }

    /// Derivative of the corrected image point (mm) with respect to the point in the camera frame (m).
    fn image_by_point(&self, in_camera: &Vector3<f64>) -> Matrix2x3<f64> {
        let scale = -self.interior.principal_distance_mm / in_camera.z;
        let [u, v] = [in_camera.x / in_camera.z, in_camera.y / in_camera.z];
        Matrix2x3::new(scale, 0.0, -scale * u, 0.0, scale, -scale * v)
    }
}

/// Stacks the derivatives of image point and range with respect to the point in the camera frame.
fn by_camera_point(in_camera: &Vector3<f64>, image: Matrix2x3<f64>) -> Matrix3<f64> {
    let range: RowVector3<f64> = in_camera.normalize().transpose();
    Matrix3::from_rows(&[image.row(0).into_owned(), image.row(1).into_owned(), range])
}
