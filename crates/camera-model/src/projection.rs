//! Pixel, image point, ray and point, both ways.

use nalgebra::{Point3, Vector2, Vector3};

use crate::{Camera, Error, Result};

impl Camera {
    /// The corrected image point of an observed one, `x - dx(x, y)`, millimetre.
    pub fn corrected_image_point(&self, observed_mm: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = self.lens.correction(&self.interior, observed_mm);
        [observed_mm[0] - dx, observed_mm[1] - dy]
    }

    /// The observed image point whose correction gives `corrected_mm`, to machine precision.
    ///
    /// Fails with [`Error::NoObservedPoint`] where the lens model folds over before it gets there.
    pub fn observed_image_point(&self, corrected_mm: [f64; 2]) -> Result<[f64; 2]> {
        let observed = self.observed_reduced(self.interior.reduced(corrected_mm))?;
        Ok(self.image_from_reduced(observed))
    }

    /// Unit vector in the camera frame along which the pixel `(col, row)` looks, lens taken off.
    ///
    /// NaN for a pixel that is not finite. Beyond the fold of the lens model, if it has one, rays are not unique;
    /// [`crate::RayTable::new`] refuses a camera with such a fold inside its image.
    pub fn ray(&self, pixel: [f64; 2]) -> Vector3<f64> {
        self.image_vector(self.format.image_from_pixel(pixel)).normalize()
    }

    /// The pixel `(col, row)` at which a point of the camera frame (metre) is seen, lens applied.
    ///
    /// It may lie outside the image; see [`Self::contains`].
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Result<[f64; 2]> {
        let observed = self.observed_reduced(self.collinear(&point_in_camera.coords)?)?;
        Ok(self.format.pixel_from_image(self.image_from_reduced(observed)))
    }

    /// The point in the camera frame (metre) that the pixel `(col, row)` sees at a range (metre), Eq. 3.
    pub fn point(&self, pixel: [f64; 2], range_m: f64) -> Point3<f64> {
        Point3::from(self.ray(pixel) * range_m)
    }

    /// Whether a pixel position lies on the image: within half a pixel around the outermost pixels' centres.
    pub fn contains(&self, [col, row]: [f64; 2]) -> bool {
        let inside = |position: f64, size: usize| position >= -0.5 && position < size as f64 - 0.5;
        inside(col, self.format.width) && inside(row, self.format.height)
    }

    /// `p = (x - xp, y - yp, -c)` of Eq. 1 from the corrected image point, millimetre.
    pub(crate) fn image_vector(&self, observed_mm: [f64; 2]) -> Vector3<f64> {
        let reduced = self.interior.reduced(observed_mm);
        let corrected = reduced - self.lens.at(reduced);
        Vector3::new(corrected.x, corrected.y, -self.interior.principal_distance_mm)
    }

    /// Collinearity, Eqs. 4 and 5 without corrections and counted from the principal point: `-c (U, V) / W`.
    pub(crate) fn collinear(&self, point_in_camera: &Vector3<f64>) -> Result<Vector2<f64>> {
        let z = point_in_camera.z;
        if z.is_nan() || z >= 0.0 {
            return Err(Error::BehindCamera { z_m: z });
        }
        Ok(point_in_camera.xy() * (-self.interior.principal_distance_mm / z))
    }

    /// The observed image point from the principal point, of a corrected one from the principal point.
    pub(crate) fn observed_reduced(&self, corrected: Vector2<f64>) -> Result<Vector2<f64>> {
        if let Some(&value) = corrected.iter().find(|value| !value.is_finite()) {
            return Err(Error::OutOfDomain {
                name: "corrected image point",
                value,
                expected: "an image point is finite",
            });
        }
        self.lens.observed_from_corrected(corrected).ok_or_else(|| self.no_observed_point(corrected))
    }

    /// The error for a corrected image point (from the principal point) that the lens model does not reach.
    pub(crate) fn no_observed_point(&self, corrected: Vector2<f64>) -> Error {
        let [x_mm, y_mm] = self.image_from_reduced(corrected);
        Error::NoObservedPoint { x_mm, y_mm }
    }

    /// Image coordinates of a point counted from the principal point, millimetre.
    pub(crate) fn image_from_reduced(&self, reduced: Vector2<f64>) -> [f64; 2] {
        let [xp, yp] = self.interior.principal_point_mm;
        [reduced.x + xp, reduced.y + yp]
    }
}
