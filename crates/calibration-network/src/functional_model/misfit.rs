//! Residuals of a network at given poses, coordinates and calibration, without an adjustment.

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use statistics::{CHI_MEDIANS, upper_median};

use crate::functional_model::setup::{Calibration, Setup, Start};
use crate::{Network, Sighting};

/// Width of Cauchy's kernel with 95 % efficiency for normal errors, in standard deviations.
pub const CAUCHY: f64 = 2.385;
/// Squared residuals, in variances, do not count beyond this: where the model has no value at all.
const LARGEST_SQUARE: f64 = 1e12;

/// Observed minus modelled values of a sighting; infinite where the model has no value (a target behind the camera).
#[derive(Debug, Clone, Copy, Default)]
pub struct Misfit {
    /// Column and row, pixel; `None` where no image point was observed, or the target has no coordinates.
    pub pixel: Option<[f64; 2]>,
    /// Range, metre.
    pub range_m: Option<f64>,
    /// Length of the image residual in standard deviations.
    pub image: Option<f64>,
    /// Absolute range residual in standard deviations.
    pub range: Option<f64>,
}

impl Misfit {
    /// Of one sighting, from a station at `pose` to a target at `point`.
    pub fn new(
        network: &Network,
        calibration: &Calibration,
        pose: &Isometry3<f64>,
        point: &Point3<f64>,
        seen: &Sighting,
    ) -> Self {
        let camera = &calibration.camera;
        let pixel = seen.pixel.map(|pixel| {
            let modelled = modelled_pixel(camera, pose, point);
            modelled.map_or([f64::INFINITY; 2], |modelled| [pixel[0] - modelled[0], pixel[1] - modelled[1]])
        });
        let range_m = seen.pixel.zip(seen.range_m).map(|(pixel, range_m)| {
            let distance = (point.coords - pose.translation.vector).norm();
            corrected_range(network, calibration, seen, pixel, range_m) - distance
        });
        let image = pixel.map(|[col, row]| (col / seen.sigma_pixel[0]).hypot(row / seen.sigma_pixel[1]));
        let range = range_m.map(|residual| residual.abs() / seen.sigma_range_m);
        Self { pixel, range_m, image, range }
    }

    /// Length of the image residual, pixel.
    pub fn pixels(&self) -> Option<f64> {
        self.pixel.map(|[col, row]| col.hypot(row))
    }
}

/// The image point of a target; `None` where the camera does not see it.
pub fn modelled_pixel(camera: &Camera, pose: &Isometry3<f64>, point: &Point3<f64>) -> Option<[f64; 2]> {
    camera.observe(pose, point).ok().map(|seen| camera.format.pixel_from_image(seen.image_mm))
}

/// An observed range without its range errors and drift, metre.
pub(crate) fn corrected_range(
    network: &Network,
    calibration: &Calibration,
    seen: &Sighting,
    pixel: [f64; 2],
    range_m: f64,
) -> f64 {
    let station = &network.stations[seen.station];
    let set = calibration.sets.iter().find(|set| set.time == station.integration_time_s);
    let [x, y] = calibration.camera.format.image_from_pixel(pixel);
    let [xp, yp] = calibration.camera.interior.principal_point_mm;
    let amplitude = seen.amplitude.unwrap_or(f64::NAN);
    let corrected = set.map(|set| set.model.corrected_range(range_m, x - xp, y - yp, amplitude));
    corrected.filter(|corrected| corrected.is_finite()).unwrap_or(range_m) - station.drift_m
}

/// Residuals of all sightings, in their order.
pub(crate) fn misfits(network: &Network, calibration: &Calibration, start: &Start) -> Vec<Misfit> {
    let misfit = |seen: &Sighting| {
        let (pose, point) = (start.stations.get(seen.station), start.targets.get(seen.target).copied().flatten());
        let (Some(pose), Some(point)) = (pose, point) else { return Misfit::default() };
        Misfit::new(network, calibration, pose, &point, seen)
    };
    network.sightings.iter().map(misfit).collect()
}

/// Robust standard deviations of unit weight of image points and of ranges: 1 where they scatter as stated. NaN where
/// there are none.
#[derive(Debug, Clone, Copy)]
pub struct Scales {
    /// Of image points.
    pub image: f64,
    /// Of ranges.
    pub range: f64,
}

impl Scales {
    /// From the medians of the residuals of sightings that take part.
    pub fn new<'m>(misfits: impl Iterator<Item = &'m Misfit> + Clone) -> Self {
        let image = median(misfits.clone().filter_map(|misfit| misfit.image).collect()) / CHI_MEDIANS[1];
        let range = median(misfits.filter_map(|misfit| misfit.range).collect()) / CHI_MEDIANS[0];
        Self { image, range }
    }

    /// The same, at least 1; 1 as well where there is no telling.
    #[must_use]
    pub fn at_least_one(self) -> Self {
        let known = |scale: f64| if scale.is_finite() { scale.max(1.0) } else { 1.0 };
        Self { image: known(self.image), range: known(self.range) }
    }
}

/// Negative logarithm of the likelihood of residuals, up to a constant, where errors have the long tails of Cauchy's
/// kernel and the standard deviations are `scales` times those stated: comparable between explanations of the same number of values.
pub fn implausibility<'m>(misfits: impl Iterator<Item = &'m Misfit>, scales: Scales) -> f64 {
    let cost = |size: f64| {
        let square = (size * size).min(LARGEST_SQUARE);
        0.5 * CAUCHY * CAUCHY * (square / (CAUCHY * CAUCHY)).ln_1p()
    };
    let scaled =
        |misfit: &Misfit| [misfit.image.map(|size| size / scales.image), misfit.range.map(|size| size / scales.range)];
    misfits.flat_map(scaled).flatten().map(cost).sum()
}

impl Setup<'_> {
    /// Residuals of all sightings at the start values.
    pub fn misfits(&self) -> Vec<Misfit> {
        let mut misfits = misfits(self.network, &self.calibration, &self.start);
        for (misfit, seen) in misfits.iter_mut().zip(&self.network.sightings) {
            if !self.ranged[seen.station] {
                (misfit.range, misfit.range_m) = (None, None);
            }
        }
        misfits
    }
}

/// The [`upper_median`] of values that are not needed any more; NaN of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    upper_median(&mut values)
}
