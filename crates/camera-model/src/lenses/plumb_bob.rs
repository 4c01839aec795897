//! The distortion model of `OpenCV` and ROS (`plumb_bob`), and the way to and from ours.
//!
//! The two run in opposite directions: `plumb_bob` distorts the ideal point, `x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) +
//! 2 p1 x y + p2 (r² + 2 x²)`, ours corrects the observed one. Neither polynomial is the inverse of the other, so a
//! conversion is a fit over the image, and it states what it leaves.

use nalgebra::{Matrix2, Vector2};
use range_image::ImageFormat;

use crate::lenses::lens_fit::{Pair, fit_lens};
use crate::{Camera, Error, InteriorOrientation, LensDistortion, Result};

/// Positions along each side of the image at which a lens is fitted.
const FIT_NODES: usize = 33;
/// Positions along each side at which the residual is looked for: the nodes of the fit and those half-way between.
const CHECK_NODES: usize = 2 * FIT_NODES - 1;

/// Camera matrix and distortion coefficients as `OpenCV` and ROS `CameraInfo` (`plumb_bob`) hold them: pixels, camera
/// axes x right, y down, z forward; the pixel origin is the centre of the upper left pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct PlumbBob {
    /// Focal length in columns.
    pub fx: f64,
    /// Focal length in rows.
    pub fy: f64,
    /// Column of the principal point.
    pub cx: f64,
    /// Row of the principal point.
    pub cy: f64,
    /// Radial.
    pub k1: f64,
    /// Radial.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial.
    pub k3: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl PlumbBob {
    /// The model as a "correction" that leads from the ideal to the distorted point: `x_d = x - D(x)`, normalised
    /// coordinates with y **up**. With the names of Eqs. 12, 13 its `p1` is their `p2` and turning y over changes the
    /// sign of the other.
    fn as_correction_of_ideal(&self) -> LensDistortion {
        let (k1, k2, k3) = (-self.k1, -self.k2, -self.k3);
        LensDistortion { k1, k2, k3, p1: -self.p2, p2: self.p1, ..LensDistortion::default() }
    }

    /// The ideal point (normalised, y up) that the model shows at a pixel; fails beyond its fold.
    fn ideal(&self, [col, row]: [f64; 2]) -> Result<Vector2<f64>> {
        let distorted = Vector2::new((col - self.cx) / self.fx, (self.cy - row) / self.fy);
        let lens = self.as_correction_of_ideal();
        lens.observed_from_corrected(distorted).ok_or(Error::PlumbBobFold { col, row })
    }
}

impl Camera {
    /// The camera whose rays agree best, over the image, with those of a `plumb_bob` model, and the largest residual
    /// in pixels: how far a point lies on the image from where `plumb_bob` puts it.
    ///
    /// `pixel_pitch_mm` is that along a row; it sets the scale of the image plane and nothing else. Principal point
    /// and distance are taken over exactly (`fy / fx` goes into the pitch along a column); the lens is fitted so that the
    /// largest residual, in the corners of most cameras, is small. Fails with [`Error::PlumbBobFold`] where the given model folds over inside its image.
    pub fn from_plumb_bob(model: &PlumbBob, pixel_pitch_mm: f64) -> Result<(Self, f64)> {
        let derivative = |ideal| model.as_correction_of_ideal().derivative(ideal);
        fit_camera(pinhole(model, pixel_pitch_mm)?, |pixel| model.ideal(pixel), derivative)
    }

    /// The `plumb_bob` model that agrees best, over the image, with this camera, and the largest residual in pixels:
    /// how far `plumb_bob` puts a point from where this camera sees it.
    ///
    /// Affinity becomes `fx / fy`, as `fx = c / (pitch (1 - b1))`. Shear has no counterpart: what it moves is in the
    /// residual.
    ///
    /// Fails with [`Error::FoldInsideImage`] where the lens model folds over inside the image.
    pub fn to_plumb_bob(&self) -> Result<(PlumbBob, f64)> {
        self.validate()?;
        crate::ray_table::require_no_fold(self)?;
        let c = self.interior.principal_distance_mm;
        let scale = Matrix2::new(1.0 - self.lens.b1, 0.0, 0.0, 1.0) / c;
        // An affinity of 1 or more has been refused as a fold.
        let mm_by_misfit = Matrix2::new(c / (1.0 - self.lens.b1), 0.0, 0.0, c);
        let pixel_by_misfit = pixels_per_mm(&self.format) * mm_by_misfit;
        let pair = |pixel| {
            let observed = self.interior.reduced(self.format.image_from_pixel(pixel));
            Pair { from: (observed - self.lens.at(observed)) / c, to: scale * observed, pixel_by_misfit }
        };
        let pairs: Vec<_> = nodes(&self.format, FIT_NODES).map(pair).collect();
        let lens = fit_lens(&pairs)?;
        let largest = nodes(&self.format, CHECK_NODES).map(|pixel| pair(pixel).misfit(&lens)).fold(0.0, f64::max);
        let [pitch_x, pitch_y] = self.format.pixel_pitch_mm;
        let (fx, fy) = (c / (pitch_x * (1.0 - self.lens.b1)), c / pitch_y);
        let [cx, cy] = self.format.pixel_from_image(self.interior.principal_point_mm);
        let ImageFormat { width, height, .. } = self.format;
        let (k1, k2, k3) = (-lens.k1, -lens.k2, -lens.k3);
        Ok((PlumbBob { fx, fy, cx, cy, k1, k2, p1: lens.p2, p2: -lens.p1, k3, width, height }, largest))
    }
}

/// This camera with the lens that agrees best, over the image, with a model that tells the ideal point (normalised, y up) of a
/// pixel and the derivative of the distorted by the ideal point; and the largest residual in pixels.
pub(super) fn fit_camera(
    mut camera: Camera,
    ideal: impl Fn([f64; 2]) -> Result<Vector2<f64>>,
    derivative: impl Fn(Vector2<f64>) -> Matrix2<f64>,
) -> Result<(Camera, f64)> {
    let c = camera.interior.principal_distance_mm;
    let per_mm = pixels_per_mm(&camera.format);
    let pairs = nodes(&camera.format, FIT_NODES)
        .map(|pixel| {
            let from = camera.interior.reduced(camera.format.image_from_pixel(pixel));
            let ideal = ideal(pixel)?;
            // What the fit leaves of the ideal point, the given model carries to the image.
            Ok(Pair { from, to: ideal * c, pixel_by_misfit: per_mm * derivative(ideal) })
        })
        .collect::<Result<Vec<_>>>()?;
    camera.lens = fit_lens(&pairs)?;
    let mut largest = 0.0_f64;
    for pixel in nodes(&camera.format, CHECK_NODES) {
        let observed = camera.observed_reduced(ideal(pixel)? * c)?;
        let found = camera.format.pixel_from_image(camera.image_from_reduced(observed));
        largest = largest.max((found[0] - pixel[0]).hypot(found[1] - pixel[1]));
    }
    Ok((camera, largest))
}

/// The camera of a `plumb_bob` model without its lens.
pub(super) fn pinhole(model: &PlumbBob, pitch: f64) -> Result<Camera> {
    for (name, value) in [("fx", model.fx), ("fy", model.fy)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::OutOfDomain { name, value, expected: "a focal length is positive and finite" });
        }
    }
    // What is not finite among the others is found as the principal point or the lens that it becomes.
    model_lens_is_finite(model)?;
    let format = ImageFormat::new(model.width, model.height, [pitch, pitch * model.fx / model.fy])?;
    let interior = InteriorOrientation {
        principal_point_mm: format.image_from_pixel([model.cx, model.cy]),
        principal_distance_mm: model.fx * pitch,
    };
    Camera::new(format, interior, LensDistortion::default())
}

fn model_lens_is_finite(model: &PlumbBob) -> Result<()> {
    let named = [("k1", model.k1), ("k2", model.k2), ("p1", model.p1), ("p2", model.p2), ("k3", model.k3)];
    match named.iter().find(|(_, value)| !value.is_finite()) {
        Some(&(name, value)) => Err(Error::OutOfDomain { name, value, expected: "a lens coefficient is finite" }),
        None => Ok(()),
    }
}

/// Columns and rows for each millimetre of the image, y up or down alike.
fn pixels_per_mm(format: &ImageFormat) -> Matrix2<f64> {
    let [pitch_x, pitch_y] = format.pixel_pitch_mm;
    Matrix2::new(1.0 / pitch_x, 0.0, 0.0, 1.0 / pitch_y)
}

/// Pixel positions from corner to corner, `count` along each side.
fn nodes(format: &ImageFormat, count: usize) -> impl Iterator<Item = [f64; 2]> + use<> {
    let step = [format.width, format.height].map(|size| (size as f64 - 1.0) / (count as f64 - 1.0));
    (0..count).flat_map(move |row| (0..count).map(move |col| [col as f64 * step[0], row as f64 * step[1]]))
}
