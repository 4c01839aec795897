//! The pixels of a station as the model of its points needs them.

use camera_model::{Camera, OrganisedCloud, RayTable};
use error_models::RangeErrorModel;
use nalgebra::Vector3;
use point_cloud::{Cloud, organised_normals};
use range_image::Flags;
use statistics::quantile;

use super::holes::filled;
use super::{SurfaceCalibrationOptions, SurfaceCapture};
use crate::{Error, Result};

/// Times the range that one pixel in a hundred exceeds beyond which a range is wild: a scene that goes on so far behind a hundredth of
/// its pixels loses these. Single pixels tell nothing of surfaces; ten times as much would keep what costs time alone.
const WILD: f64 = 3.0;
/// Part of the pixels that may be wild.
const WILD_PART: f64 = 0.01;
/// Largest median range of a frame, metre: no range camera sees rooms from further away, and half a metre in millimetres is more.
const LONGEST_RANGE_M: f64 = 300.0;
/// Usable pixels of one station, in the order of the points of its cloud.
#[derive(Default)]
pub(super) struct StationPixels {
    /// Column and row.
    pub(super) pixels: Vec<[f32; 2]>,
    /// Unit rays in the camera frame.
    pub(super) rays: Vec<Vector3<f64>>,
    /// Observed ranges less what the known model says of terms that are not estimated, metre.
    pub(super) ranges_m: Vec<f64>,
    /// What the known hyperbola takes off where another one is asked for, metre; else zero, and in the ranges.
    pub(super) by_known_hyperbola_m: Vec<f32>,
    /// Amplitudes as received.
    pub(super) amplitudes: Vec<f32>,
    /// Design rows of the asked range terms, one behind the other; single precision as the observed ranges.
    rows: Vec<f32>,
    columns: usize,
}

/// What is taken off the ranges already, and what is asked for.
pub(super) struct Known<'a> {
    pub(super) camera: &'a Camera,
    pub(super) model: &'a RangeErrorModel,
    /// Positions of the asked range terms among the model's parameters.
    pub(super) columns: &'a [usize],
    /// Whether the amplitude's part is asked for.
    pub(super) amplitude: bool,
}

impl StationPixels {
    /// The pixels of a capture and its cloud, corrected by the whole known model, with normals.
    pub(super) fn new(
        capture: &SurfaceCapture<'_>,
        known: &Known<'_>,
        options: &SurfaceCalibrationOptions<'_>,
    ) -> Result<(Self, Cloud)> {
        let (frame, camera, model) = (capture.frame, known.camera, known.model);
        frame.validate()?;
        let (width, height) = (camera.format.width, camera.format.height);
        if (frame.width(), frame.height()) != (width, height) {
            let (found_width, found_height) = (frame.width(), frame.height());
            let mismatch = range_image::Error::SizeMismatch { what: "frame", width, height, found_width, found_height };
            return Err(Error::Image(mismatch));
        }
        let mut points = corrected_points(capture, known, options)?;
        let fail = |error: point_cloud::Error| Error::registration(capture.name, error);
        // Pixels without a range are no edges: neighbours stand in for them where planes are fitted.
        let whole = filled(&points, width, height, options.normals.max_relative_jump);
        let normals = organised_normals(&whole, width, height, &options.normals).map_err(fail)?;
        let seen = OrganisedCloud {
            width,
            height,
            points: points.clone(),
            sigma: frame.sigma.as_slice().to_vec(),
            amplitude: Vec::new(),
            flags: frame.flags.as_slice().to_vec(),
        };
        let footprints = RayTable::new(camera).and_then(|rays| rays.footprints(&seen, Flags::empty()));
        let footprints = footprints.map_err(Error::from)?;
        let values = model.parameter_values();
        let [xp, yp] = camera.interior.principal_point_mm;
        let mut kept = Self { columns: known.columns.len(), ..Self::default() };
        let mut rows = Rows::new(model);
        for (index, point) in points.iter_mut().enumerate().filter(|(_, point)| !point[0].is_nan()) {
            let Some(footprint) = footprints[index] else {
                *point = [f64::NAN; 3];
                continue;
            };
            let place = (index % width, index / width);
            let pixel = [place.0 as f64, place.1 as f64];
            let [x, y] = camera.format.image_from_pixel(pixel);
            let (range, amplitude) = (f64::from(frame.range[place]), frame.amplitude[place]);
            let measured_m = Vector3::from(*point).norm();
            let of_surface_m = range + (footprint.range - 1.0) * measured_m;
            let spread_m = footprint.spread * of_surface_m;
            let (row, change_m) = rows.mean(range, of_surface_m, spread_m, [x - xp, y - yp])?;
            let asked: f64 = known.columns.iter().map(|&column| row[column] * values[column]).sum();
            let by_amplitude = model.hyperbola.filter(|_| known.amplitude);
            let by_amplitude = by_amplitude.and_then(|hyperbola| hyperbola.correction(f64::from(amplitude)));
            let (ray, at_centre) = (camera.ray(pixel), (measured_m - change_m) / (1.0 + footprint.part));
            *point = (ray * at_centre).into();
            kept.pixels.push([place.0 as f32, place.1 as f32]);
            kept.rays.push(ray);
            kept.ranges_m.push(at_centre + asked + by_amplitude.unwrap_or(0.0));
            kept.by_known_hyperbola_m.push(by_amplitude.unwrap_or(0.0) as f32);
            kept.amplitudes.push(amplitude);
            kept.rows.extend(known.columns.iter().map(|&column| row[column] as f32));
        }
        // What is no deviation says as little as one that is not known.
        let known = |sigma: &f32| if *sigma > 0.0 && sigma.is_finite() { *sigma } else { f32::NAN };
        let sigma: Vec<f32> = frame.sigma.as_slice().iter().map(known).collect();
        let cloud = Cloud::from_frame(&points, Some(&normals), Some(&sigma)).map_err(fail)?;
        Ok((kept, cloud))
    }

    /// Design row of a pixel.
    pub(super) fn row(&self, index: usize) -> &[f32] {
        &self.rows[index * self.columns..(index + 1) * self.columns]
    }
}

/// Design rows of a model's terms, as pixels have them.
struct Rows<'a> {
    model: &'a RangeErrorModel,
    values: Vec<f64>,
    /// At a pixel's own range; at both ends of what it sees; in the mean.
    own: Vec<f64>,
    ends: [Vec<f64>; 2],
    mean: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(model: &'a RangeErrorModel) -> Self {
        let row = || vec![0.0; model.parameter_count()];
        Self { model, values: model.parameter_values(), own: row(), ends: [row(), row()], mean: row() }
    }

    /// The row of a pixel, and by how much the model's correction is more with it than at the pixel's own range, metre.
    ///
    /// It is taken at the range of the surface about the pixel: at its own, row and range would err together, which bends what is
    /// estimated. And it is the mean over the ranges that the pixel sees, which scatter by `spread_m`: terms that bend with the range,
    /// `f`, are `f + f'' s²/2` there.
    fn mean(&mut self, own_m: f64, of_surface_m: f64, spread_m: f64, [x_mm, y_mm]: [f64; 2]) -> Result<(&[f64], f64)> {
        self.model.design_row_into(own_m, x_mm, y_mm, &mut self.own)?;
        for (row, end_m) in self.ends.iter_mut().zip([of_surface_m - spread_m, of_surface_m + spread_m]) {
            self.model.design_row_into(end_m, x_mm, y_mm, row)?;
        }
        let mut change_m = 0.0;
        for (at, value) in self.values.iter().enumerate() {
            self.mean[at] = f64::midpoint(self.ends[0][at], self.ends[1][at]);
            change_m += (self.mean[at] - self.own[at]) * value;
        }
        Ok((&self.mean, change_m))
    }
}

/// The points of a frame, corrected by the whole known model; NaN where a pixel takes no part.
fn corrected_points(
    capture: &SurfaceCapture<'_>,
    known: &Known<'_>,
    options: &SurfaceCalibrationOptions<'_>,
) -> Result<Vec<[f64; 3]>> {
    let (frame, camera) = (capture.frame, known.camera);
    let farthest_m = farthest(capture, options)?;
    // Without any, the hyperbola is held; one pixel without says nothing of it.
    let has_amplitudes = frame.amplitude.as_slice().iter().any(|amplitude| *amplitude > 0.0);
    let [xp, yp] = camera.interior.principal_point_mm;
    let point = |index: usize| {
        let place = (index % frame.width(), index / frame.width());
        let range = usable(capture, place, options).filter(|range| *range <= farthest_m)?;
        let amplitude = f64::from(frame.amplitude[place]);
        if known.amplitude && has_amplitudes && !(amplitude > 0.0 && amplitude.is_finite()) {
            return None;
        }
        let pixel = [place.0 as f64, place.1 as f64];
        let [x, y] = camera.format.image_from_pixel(pixel);
        let correction = known.model.correction(range, x - xp, y - yp, amplitude);
        (!correction.outside_span).then(|| (camera.ray(pixel) * (range - correction.total_m())).into())
    };
    let points = (0..frame.width() * frame.height()).map(|index| point(index).unwrap_or([f64::NAN; 3]));
    Ok(points.collect())
}

/// The range of a pixel that takes part.
fn usable(capture: &SurfaceCapture<'_>, place: (usize, usize), options: &SurfaceCalibrationOptions<'_>) -> Option<f64> {
    let (range, flags) = (f64::from(capture.frame.range[place]), capture.frame.flags[place]);
    let is_range = range > 0.0 && range.is_finite();
    (is_range && !flags.intersects(options.exclude | Flags::NO_DATA)).then_some(range)
}

/// The range beyond which one is wild, metre. Refuses a frame without ranges, and one in another unit.
fn farthest(capture: &SurfaceCapture<'_>, options: &SurfaceCalibrationOptions<'_>) -> Result<f64> {
    let (width, height) = (capture.frame.width(), capture.frame.height());
    let places = (0..width * height).map(|index| (index % width, index / width));
    let mut ranges: Vec<f64> = places.filter_map(|place| usable(capture, place, options)).collect();
    if ranges.is_empty() {
        return Err(Error::NoPixels { station: capture.name.to_owned() });
    }
    let median_m = quantile(&mut ranges, 0.5);
    if median_m > LONGEST_RANGE_M {
        return Err(Error::NotInMetre { station: capture.name.to_owned(), median_m, limit_m: LONGEST_RANGE_M });
    }
    Ok(WILD * quantile(&mut ranges, 1.0 - WILD_PART))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use error_models::RangeTerms;

    use super::*;

    #[test]
    fn a_row_is_the_mean_over_the_ranges_that_a_pixel_sees() {
        let terms = RangeTerms::from_array([0.01, 0.004, -0.006, 0.003, 0.002, 0.008, -0.005, 0.0, 0.0]);
        let model = RangeErrorModel { terms, ..RangeErrorModel::error_free(5.0) };
        let (own_m, of_surface_m, spread_m, count) = (3.03, 3.0, 0.03, 1000);
        let mut rows = Rows::new(&model);
        let (row, change_m) = rows.mean(own_m, of_surface_m, spread_m, [1.0, -2.0]).unwrap();
        // Evenly over the pixel: root of three deviations to either side.
        let at = |k: usize| of_surface_m + spread_m * 3.0_f64.sqrt() * ((2 * k + 1) as f64 / count as f64 - 1.0);
        let mut expected = vec![0.0; row.len()];
        for k in 0..count {
            let one = model.design_row(at(k), 1.0, -2.0);
            expected.iter_mut().zip(one).for_each(|(sum, value)| *sum += value / count as f64);
        }
        let own = model.design_row(own_m, 1.0, -2.0);
        // The shortest wave is weaker by a hundredth; fourth orders are left.
        assert!(row.iter().zip(&expected).all(|(found, mean)| (found - mean).abs() < 2e-5), "{row:?} {expected:?}");
        let values = model.parameter_values();
        let change: f64 = expected.iter().zip(&own).zip(&values).map(|((mean, own), value)| (mean - own) * value).sum();
        assert!(change.abs() > 5e-4 && (change_m - change).abs() < 1e-6, "{change_m} {change}");
    }
}
