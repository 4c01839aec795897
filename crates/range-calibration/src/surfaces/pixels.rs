//! The pixels of a station as the model of its points needs them.

use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::Vector3;
use point_cloud::{Cloud, organised_normals};
use range_image::Flags;

use super::{SurfaceCalibrationOptions, SurfaceCapture};
use crate::{Error, Result};

/// Usable pixels of one station, in the order of the points of its cloud.
pub(super) struct StationPixels {
    /// Unit rays in the camera frame.
    pub(super) rays: Vec<Vector3<f64>>,
    /// Observed ranges less what the known model says of terms that are not estimated, metre.
    pub(super) ranges_m: Vec<f64>,
    /// Design rows of the estimated terms, one behind the other; single precision as the observed ranges.
    pub(super) rows: Vec<f32>,
}

impl StationPixels {
    /// The pixels of a capture and its cloud, corrected by the whole known model, with normals.
    pub(super) fn new(
        capture: &SurfaceCapture<'_>,
        camera: &Camera,
        known: &RangeErrorModel,
        columns: &[usize],
        options: &SurfaceCalibrationOptions<'_>,
    ) -> Result<(Self, Cloud)> {
        let frame = capture.frame;
        frame.validate()?;
        let (width, height) = (camera.format.width, camera.format.height);
        if (frame.width(), frame.height()) != (width, height) {
            let (found_width, found_height) = (frame.width(), frame.height());
            let mismatch = range_image::Error::SizeMismatch { what: "frame", width, height, found_width, found_height };
            return Err(Error::Image(mismatch));
        }
        let values = known.parameter_values();
        let [xp, yp] = camera.interior.principal_point_mm;
        let mut pixels = Self { rays: Vec::new(), ranges_m: Vec::new(), rows: Vec::new() };
        let mut points = vec![[f64::NAN; 3]; width * height];
        let mut row = vec![0.0; known.parameter_count()];
        for (index, point) in points.iter_mut().enumerate() {
            let place = (index % width, index / width);
            let range = f64::from(frame.range[place]);
            if !(range > 0.0 && range.is_finite()) || frame.flags[place].intersects(options.exclude | Flags::NO_DATA) {
                continue;
            }
            let pixel = [place.0 as f64, place.1 as f64];
            let [x, y] = camera.format.image_from_pixel(pixel);
            let (x, y) = (x - xp, y - yp);
            let correction = known.correction(range, x, y, f64::from(frame.amplitude[place]));
            if correction.outside_span {
                continue;
            }
            known.design_row_into(range, x, y, &mut row)?;
            let own: f64 = columns.iter().map(|&column| row[column] * values[column]).sum();
            let ray = camera.ray(pixel);
            *point = (ray * (range - correction.total_m())).into();
            pixels.rays.push(ray);
            pixels.ranges_m.push(range - correction.total_m() + own);
            pixels.rows.extend(columns.iter().map(|&column| row[column] as f32));
        }
        let fail = |error: point_cloud::Error| Error::registration(capture.name, error);
        let normals = organised_normals(&points, width, height, &options.normals).map_err(fail)?;
        let cloud = Cloud::from_frame(&points, Some(&normals), Some(frame.sigma.as_slice())).map_err(fail)?;
        Ok((pixels, cloud))
    }

    /// Range of a pixel with these values of the estimated terms, metre.
    pub(super) fn range_m(&self, index: usize, values: &[f64]) -> f64 {
        self.ranges_m[index] - self.row(index, values.len()).zip(values).map(|(d, value)| d * value).sum::<f64>()
    }

    /// Design row of a pixel.
    pub(super) fn row(&self, index: usize, columns: usize) -> impl Iterator<Item = f64> + '_ {
        self.rows[index * columns..(index + 1) * columns].iter().map(|value| f64::from(*value))
    }
}
