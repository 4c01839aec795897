//! Covariance of a back-projected point.

use nalgebra::{Matrix3, Matrix3x2, SMatrix, Vector3};

use crate::{Camera, LensDistortion};

/// Covariance (square metre, camera frame) of the point that `pixel` sees at `range_m`, by propagation through Eq. 3.
///
/// - `sigma_range_m`: standard deviation of the range, metre;
/// - `sigma_pixel`: standard deviations of the observed image point in pixels (column, row); zero for a pixel's own ray;
/// - `calibration`: covariance of `[xp, yp, c, k1, k2, k3, p1, p2, b1, b2]` in the units of the camera (mm, `mm^-2`,
///   ...); one of the first eight alone goes in through [`with_affinity_held`].
///
/// NaN where an input is NaN or a standard deviation is negative.
pub fn point_covariance(
    camera: &Camera,
    pixel: [f64; 2],
    range_m: f64,
    sigma_range_m: f64,
    sigma_pixel: [f64; 2],
    calibration: Option<&SMatrix<f64, 10, 10>>,
) -> Matrix3<f64> {
    if [sigma_range_m, sigma_pixel[0], sigma_pixel[1]].iter().any(|sigma| sigma.is_nan() || *sigma < 0.0) {
        return Matrix3::from_element(f64::NAN);
    }
    let derivatives = PointDerivatives::new(camera, pixel, range_m);
    let along = derivatives.ray * sigma_range_m;
    let [pitch_x, pitch_y] = camera.format.pixel_pitch_mm;
    let across_x = derivatives.image.column(0) * (sigma_pixel[0] * pitch_x);
    let across_y = derivatives.image.column(1) * (sigma_pixel[1] * pitch_y);
    let observed = along * along.transpose() + across_x * across_x.transpose() + across_y * across_y.transpose();
    match calibration {
        Some(covariance) => {
            let propagated = derivatives.calibration * covariance * derivatives.calibration.transpose();
            // Rounding must not make it asymmetric.
            observed + (propagated + propagated.transpose()) * 0.5
        }
        None => observed,
    }
}

/// The covariance of `[xp, yp, c, k1, k2, k3, p1, p2, b1, b2]` where affinity and shear are known without error: that of
/// the first eight with zeros beside it.
pub fn with_affinity_held(covariance: &SMatrix<f64, 8, 8>) -> SMatrix<f64, 10, 10> {
    let mut padded = SMatrix::<f64, 10, 10>::zeros();
    padded.fixed_view_mut::<8, 8>(0, 0).copy_from(covariance);
    padded
}

impl Camera {
    /// Derivatives of the point that `pixel` sees at `range_m` by `[xp, yp, c, k1, k2, k3, p1, p2, b1, b2]`: metre a unit of each
    /// (mm, `mm^-2`, ...), camera frame.
    pub fn point_derivatives(&self, pixel: [f64; 2], range_m: f64) -> SMatrix<f64, 3, 10> {
        PointDerivatives::new(self, pixel, range_m).calibration
    }
}

/// Derivatives of a back-projected point.
struct PointDerivatives {
    /// By the range: the unit ray.
    ray: Vector3<f64>,
    /// By the observed image point, metre per millimetre.
    image: Matrix3x2<f64>,
    /// By `[xp, yp, c, k1, k2, k3, p1, p2, b1, b2]`.
    calibration: SMatrix<f64, 3, 10>,
}

impl PointDerivatives {
    fn new(camera: &Camera, pixel: [f64; 2], range_m: f64) -> Self {
        let observed_mm = camera.format.image_from_pixel(pixel);
        let reduced = camera.interior.reduced(observed_mm);
        let p = camera.image_vector(observed_mm);
        let ray = p.normalize();
        // d(rho p / |p|) = rho / |p| (I - u u^T) dp
        let by_p = (Matrix3::identity() - ray * ray.transpose()) * (range_m / p.norm());
        let by_corrected: Matrix3x2<f64> = by_p.fixed_columns::<2>(0).into_owned();
        let image = by_corrected * camera.lens.derivative(reduced);
        let mut calibration = SMatrix::<f64, 3, 10>::zeros();
        // The observed point stays where it is: the principal point moves all that is counted from it.
        calibration.fixed_columns_mut::<2>(0).copy_from(&-image);
        calibration.fixed_columns_mut::<1>(2).copy_from(&-by_p.column(2));
        calibration.fixed_columns_mut::<7>(3).copy_from(&(-by_corrected * LensDistortion::design(reduced)));
        Self { ray, image, calibration }
    }
}
