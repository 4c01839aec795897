//! The pixels of one capture of a plane.

use camera_model::Camera;
use error_models::{AmplitudeHyperbola, RangeErrorModel};
use nalgebra::{Isometry3, Vector3};
use range_image::RangeFrame;

use crate::planes_geometry::PlaneChart;
use crate::{DifferenceOptions, Error, Result};

/// The pixels of one capture, by what the adjustment asks of them.
pub(crate) struct PlanePixels {
    /// Unit rays in the camera frame.
    pub(crate) rays: Vec<Vector3<f64>>,
    /// Observed ranges, a held hyperbola taken off, metre.
    pub(crate) ranges_m: Vec<f64>,
    /// One over the standard deviation.
    pub(crate) roots_of_weight: Vec<f64>,
    /// Design rows of the range terms, one behind the other.
    pub(crate) rows: Vec<f64>,
    /// Whether a pixel takes part.
    pub(crate) used: Vec<bool>,
    /// Observed ranges as they were shown, metre.
    pub(crate) observed_m: Vec<f64>,
    columns: usize,
}

impl PlanePixels {
    /// Takes what options choose of a frame and the model holds for.
    pub(crate) fn new(
        frame: &RangeFrame,
        camera: &Camera,
        model: &RangeErrorModel,
        hyperbola: Option<&AmplitudeHyperbola>,
        options: &DifferenceOptions,
    ) -> Result<Self> {
        frame.validate()?;
        let (width, height) = (camera.format.width, camera.format.height);
        if (frame.width(), frame.height()) != (width, height) {
            let (found_width, found_height) = (frame.width(), frame.height());
            let mismatch = range_image::Error::SizeMismatch { what: "frame", width, height, found_width, found_height };
            return Err(Error::Image(mismatch));
        }
        let mut pixels = Self::empty(model.parameter_count());
        for [col, row] in options.positions(width, height) {
            let amplitude_m = hyperbola.map_or(Some(0.0), |terms| terms.correction(frame.amplitude[(col, row)].into()));
            let usable = frame.range[(col, row)] > 0.0 && !frame.flags[(col, row)].intersects(options.exclude);
            if let Some(amplitude_m) = amplitude_m.filter(|_| usable) {
                pixels.push(frame, camera, model, [col, row], amplitude_m, options.unknown_sigma_m)?;
            }
        }
        Ok(pixels)
    }

    fn empty(columns: usize) -> Self {
        Self {
            rays: Vec::new(),
            ranges_m: Vec::new(),
            roots_of_weight: Vec::new(),
            rows: Vec::new(),
            used: Vec::new(),
            observed_m: Vec::new(),
            columns,
        }
    }

    fn push(
        &mut self,
        frame: &RangeFrame,
        camera: &Camera,
        model: &RangeErrorModel,
        [col, row]: [usize; 2],
        amplitude_m: f64,
        unknown_sigma_m: f64,
    ) -> Result<()> {
        let pixel = [col as f64, row as f64];
        let (range, sigma) = (f64::from(frame.range[(col, row)]), f64::from(frame.sigma[(col, row)]));
        let [x, y] = camera.format.image_from_pixel(pixel);
        let [xp, yp] = camera.interior.principal_point_mm;
        let (x, y) = (x - xp, y - yp);
        let on_surface = model.further.surface.as_ref().is_none_or(|surface| surface.in_span(x, y));
        if !(model.range_in_span(range) && on_surface) {
            return Ok(());
        }
        let first = self.rows.len();
        self.rows.resize(first + self.columns, 0.0);
        model.design_row_into(range, x, y, &mut self.rows[first..])?;
        self.rays.push(camera.ray(pixel));
        self.ranges_m.push(range - amplitude_m);
        self.roots_of_weight.push(if sigma > 0.0 && sigma.is_finite() { sigma } else { unknown_sigma_m }.recip());
        self.used.push(true);
        self.observed_m.push(range);
        Ok(())
    }

    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Design row of a pixel.
    pub(crate) fn row(&self, pixel: usize) -> &[f64] {
        &self.rows[pixel * self.columns..(pixel + 1) * self.columns]
    }

    /// What the reference range and the terms leave of the observed range of a pixel, metre.
    pub(crate) fn left_over(&self, pixel: usize, reference_m: f64, terms: &[f64]) -> f64 {
        let linear: f64 = self.row(pixel).iter().zip(terms).map(|(derivative, term)| derivative * term).sum();
        self.ranges_m[pixel] - reference_m - linear
    }

    /// Residuals of all pixels in standard deviations; infinite where a pixel does not see the plane.
    pub(crate) fn residuals(
        &self,
        chart: &PlaneChart,
        plane: &[f64],
        terms: &[f64],
        world_from_camera: &Isometry3<f64>,
    ) -> Vec<f64> {
        let seen = chart.seen_from(plane, world_from_camera);
        let residual = |pixel: usize| {
            seen(&self.rays[pixel]).map_or(f64::INFINITY, |reference| {
                self.left_over(pixel, reference.range_m, terms) * self.roots_of_weight[pixel]
            })
        };
        (0..self.len()).map(residual).collect()
    }

    /// Keeps the pixels whose ray is wanted.
    pub(crate) fn retain(&mut self, wanted: impl Fn(&Vector3<f64>) -> bool) {
        let mut kept = Self::empty(self.columns);
        for pixel in (0..self.len()).filter(|pixel| wanted(&self.rays[*pixel])) {
            kept.rays.push(self.rays[pixel]);
            kept.ranges_m.push(self.ranges_m[pixel]);
            kept.observed_m.push(self.observed_m[pixel]);
            kept.roots_of_weight.push(self.roots_of_weight[pixel]);
            kept.rows.extend_from_slice(self.row(pixel));
            kept.used.push(self.used[pixel]);
        }
        *self = kept;
    }

    /// The points that the observed ranges give, in the camera frame, metre.
    pub(crate) fn points(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.rays.iter().zip(&self.ranges_m).map(|(ray, range)| ray * *range)
    }

    pub(crate) fn used_count(&self) -> usize {
        self.used.iter().filter(|used| **used).count()
    }
}
