//! Dense range differences: what a frame shows of a known plane against the reference ranges.

use camera_model::Camera;
use nalgebra::Isometry3;
use range_image::{Flags, RangeFrame};

use crate::{Error, Plane, Result};

/// One observed range beside its reference range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeDifference {
    /// Range shown by the camera, unwrapped, metre.
    pub observed_range_m: f64,
    /// Reference range, metre.
    pub reference_range_m: f64,
    /// Observed image coordinate x from the principal point, millimetre.
    pub x_mm: f64,
    /// Observed image coordinate y from the principal point, millimetre.
    pub y_mm: f64,
    /// Amplitude in the camera's unit; NaN where there is none (it matters for the hyperbola only).
    pub amplitude: f64,
    /// Standard deviation of the difference, metre.
    pub sigma_m: f64,
}

/// Which pixels of a frame become range differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DifferenceOptions {
    /// Pixels with any of these flags are left out. Default: all but `OUTSIDE_SPAN`, which speaks of an older
    /// calibration.
    pub exclude: Flags,
    /// Pixels that see the plane under a larger angle of incidence are left out, radian. Default 60°.
    pub largest_incidence_rad: f64,
    /// Every so many columns and rows is used. Default 1: all.
    pub step: usize,
    /// First and last column, first and last row used; `None`, the default, stands for all. A target that does not fill
    /// the frame needs it.
    pub window: Option<[[usize; 2]; 2]>,
    /// Standard deviation of a range where the frame gives none, metre. Default 1 cm; the posterior deviations do
    /// not depend on it where the frame gives none at all.
    pub unknown_sigma_m: f64,
}

impl Default for DifferenceOptions {
    fn default() -> Self {
        Self {
            exclude: Flags::all() - Flags::OUTSIDE_SPAN,
            largest_incidence_rad: std::f64::consts::FRAC_PI_3,
            step: 1,
            window: None,
            unknown_sigma_m: 0.01,
        }
    }
}

/// The differences of a frame to a known plane, row by row: two-step methods of Sect. 5.3, and the laboratory
/// method with [`Plane::facing_camera`].
///
/// `camera` gives the rays with its lens taken off, `world_from_camera` the pose at the exposure. Ranges must be
/// unwrapped. Averaged frames give smaller differences their smaller sigma.
pub fn differences_to_plane(
    frame: &RangeFrame,
    camera: &Camera,
    world_from_camera: &Isometry3<f64>,
    plane: &Plane,
    options: &DifferenceOptions,
) -> Result<Vec<RangeDifference>> {
    frame.validate()?;
    camera.validate()?;
    options.validate()?;
    let (width, height) = (camera.format.width, camera.format.height);
    if (frame.width(), frame.height()) != (width, height) {
        let (found_width, found_height) = (frame.width(), frame.height());
        let mismatch = range_image::Error::SizeMismatch { what: "frame", width, height, found_width, found_height };
        return Err(Error::Image(mismatch));
    }
    let smallest_cosine = options.largest_incidence_rad.cos();
    let mut differences = Vec::new();
    for [col, row] in options.positions(width, height) {
        let usable = frame.range[(col, row)].is_finite() && !frame.flags[(col, row)].intersects(options.exclude);
        let seen = plane.reference_range(camera, world_from_camera, [col as f64, row as f64]).ok();
        let Some((reference, _)) = seen.filter(|(_, cosine)| usable && *cosine >= smallest_cosine) else {
            continue;
        };
        differences.push(difference(frame, camera, [col, row], reference, options.unknown_sigma_m));
    }
    Ok(differences)
}

fn difference(
    frame: &RangeFrame,
    camera: &Camera,
    [col, row]: [usize; 2],
    reference_range_m: f64,
    unknown_sigma_m: f64,
) -> RangeDifference {
    let [x, y] = camera.format.image_from_pixel([col as f64, row as f64]);
    let [xp, yp] = camera.interior.principal_point_mm;
    let sigma = f64::from(frame.sigma[(col, row)]);
    RangeDifference {
        observed_range_m: f64::from(frame.range[(col, row)]),
        reference_range_m,
        x_mm: x - xp,
        y_mm: y - yp,
        amplitude: f64::from(frame.amplitude[(col, row)]),
        sigma_m: if sigma > 0.0 && sigma.is_finite() { sigma } else { unknown_sigma_m },
    }
}

impl DifferenceOptions {
    /// Columns and rows of the pixels that window and step choose, row by row.
    pub fn positions(&self, width: usize, height: usize) -> impl Iterator<Item = [usize; 2]> + use<> {
        let step = self.step.max(1);
        let [cols, rows] = self.window.unwrap_or([[0, width - 1], [0, height - 1]]);
        let along = move |span: [usize; 2], size: usize| (span[0]..=span[1].min(size - 1)).step_by(step);
        along(rows, height).flat_map(move |row| along(cols, width).map(move |col| [col, row]))
    }

    /// Refuses options outside their domain.
    pub fn validate(&self) -> Result<()> {
        let refuse = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
        if self.step == 0 {
            return refuse("step", 0.0, "every n-th pixel, n at least 1");
        }
        if !(self.unknown_sigma_m > 0.0 && self.unknown_sigma_m.is_finite()) {
            return refuse("unknown_sigma_m", self.unknown_sigma_m, "a standard deviation is positive and finite");
        }
        if !(0.0..=std::f64::consts::FRAC_PI_2).contains(&self.largest_incidence_rad) {
            return refuse("largest_incidence_rad", self.largest_incidence_rad, "an angle between 0 and pi/2");
        }
        Ok(())
    }
}
