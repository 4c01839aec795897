//! The pixels of a station as the model of its points needs them.

use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::Vector3;
use point_cloud::{Cloud, organised_normals};
use range_image::Flags;

use super::{SurfaceCalibrationOptions, SurfaceCapture};
use crate::{Error, Result};

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
        let values = model.parameter_values();
        let [xp, yp] = camera.interior.principal_point_mm;
        let mut kept = Self { columns: known.columns.len(), ..Self::default() };
        let mut points = vec![[f64::NAN; 3]; width * height];
        let mut row = vec![0.0; model.parameter_count()];
        for (index, point) in points.iter_mut().enumerate() {
            let place = (index % width, index / width);
            let range = f64::from(frame.range[place]);
            if !(range > 0.0 && range.is_finite()) || frame.flags[place].intersects(options.exclude | Flags::NO_DATA) {
                continue;
            }
            let pixel = [place.0 as f64, place.1 as f64];
            let [x, y] = camera.format.image_from_pixel(pixel);
            let (x, y) = (x - xp, y - yp);
            let amplitude = frame.amplitude[place];
            let correction = model.correction(range, x, y, f64::from(amplitude));
            if correction.outside_span {
                continue;
            }
            model.design_row_into(range, x, y, &mut row)?;
            let asked: f64 = known.columns.iter().map(|&column| row[column] * values[column]).sum();
            let by_amplitude = model.hyperbola.filter(|_| known.amplitude);
            let by_amplitude = by_amplitude.and_then(|hyperbola| hyperbola.correction(f64::from(amplitude)));
            let ray = camera.ray(pixel);
            *point = (ray * (range - correction.total_m())).into();
            kept.pixels.push([place.0 as f32, place.1 as f32]);
            kept.rays.push(ray);
            kept.ranges_m.push(range - correction.total_m() + asked + by_amplitude.unwrap_or(0.0));
            kept.by_known_hyperbola_m.push(by_amplitude.unwrap_or(0.0) as f32);
            kept.amplitudes.push(amplitude);
            kept.rows.extend(known.columns.iter().map(|&column| row[column] as f32));
        }
        let fail = |error: point_cloud::Error| Error::registration(capture.name, error);
        let normals = organised_normals(&points, width, height, &options.normals).map_err(fail)?;
        let cloud = Cloud::from_frame(&points, Some(&normals), Some(frame.sigma.as_slice())).map_err(fail)?;
        Ok((kept, cloud))
    }

    /// Design row of a pixel.
    pub(super) fn row(&self, index: usize) -> &[f32] {
        &self.rows[index * self.columns..(index + 1) * self.columns]
    }
}
