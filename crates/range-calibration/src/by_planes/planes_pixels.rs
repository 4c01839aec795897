//! The pixels of one capture of a plane.

use camera_model::Camera;
use error_models::{AmplitudeHyperbola, RangeErrorModel};
use nalgebra::{Isometry3, Vector3};

use crate::by_planes::planes_geometry::PlaneChart;
use crate::{DifferenceOptions, Error, PlaneCapture, Result};

/// A pixel that may be used, the same for all captures of a camera.
pub(crate) struct ChosenPixel {
    position: [usize; 2],
    /// Image point from the principal point, millimetre.
    point_mm: [f64; 2],
    /// Unit ray in the camera frame.
    ray: Vector3<f64>,
}

/// The pixels that options choose and the model holds for.
pub(crate) fn chosen_pixels(camera: &Camera, model: &RangeErrorModel, options: &DifferenceOptions) -> Vec<ChosenPixel> {
    let [xp, yp] = camera.interior.principal_point_mm;
    let surface = model.further.surface.as_ref();
    let chosen = options.positions(camera.format.width, camera.format.height).filter_map(|position| {
        let pixel = position.map(|index| index as f64);
        let [x, y] = camera.format.image_from_pixel(pixel);
        let point_mm = [x - xp, y - yp];
        let holds = surface.is_none_or(|surface| surface.in_span(point_mm[0], point_mm[1]));
        holds.then(|| ChosenPixel { position, point_mm, ray: camera.ray(pixel) })
    });
    chosen.collect()
}

/// The pixels of one capture, by what the adjustment asks of them.
#[derive(Default)]
pub(crate) struct PlanePixels {
    /// Unit rays in the camera frame.
    pub(crate) rays: Vec<Vector3<f64>>,
    /// Observed ranges, a held hyperbola and a known drift taken off, metre.
    pub(crate) ranges_m: Vec<f64>,
    /// One over the standard deviation.
    pub(crate) roots_of_weight: Vec<f64>,
    /// Design rows of the range terms, one behind the other. In single precision, as the observed ranges: that changes a
    /// correction of centimetres by nanometres.
    rows: Vec<f32>,
    /// Whether a pixel takes part.
    pub(crate) used: Vec<bool>,
    /// Observed ranges as they were shown, metre.
    pub(crate) observed_m: Vec<f32>,
    columns: usize,
}

impl PlanePixels {
    /// Takes what is usable of a capture.
    pub(crate) fn new(
        capture: &PlaneCapture<'_>,
        camera: &Camera,
        chosen: &[ChosenPixel],
        model: &RangeErrorModel,
        hyperbola: Option<&AmplitudeHyperbola>,
        options: &DifferenceOptions,
    ) -> Result<Self> {
        let frame = capture.frame;
        frame.validate()?;
        let (width, height) = (camera.format.width, camera.format.height);
        if (frame.width(), frame.height()) != (width, height) {
            let (found_width, found_height) = (frame.width(), frame.height());
            let mismatch = range_image::Error::SizeMismatch { what: "frame", width, height, found_width, found_height };
            return Err(Error::Image(mismatch));
        }
        let mut pixels = Self::with_capacity(chosen.len(), model.parameter_count());
        let mut row = vec![0.0; pixels.columns];
        for ChosenPixel { position: [col, row_index], point_mm: [x, y], ray } in chosen {
            let place = (*col, *row_index);
            let (observed, sigma) = (frame.range[place], f64::from(frame.sigma[place]));
            let range = f64::from(observed);
            let usable = range > 0.0 && !frame.flags[place].intersects(options.exclude) && model.range_in_span(range);
            let amplitude_m = hyperbola.map_or(Some(0.0), |terms| terms.correction(frame.amplitude[place].into()));
            let Some(amplitude_m) = amplitude_m.filter(|_| usable) else { continue };
            model.design_row_into(range, *x, *y, &mut row)?;
            pixels.rows.extend(row.iter().map(|value| *value as f32));
            pixels.rays.push(*ray);
            pixels.ranges_m.push(range - amplitude_m - capture.drift_m);
            let sigma = if sigma > 0.0 && sigma.is_finite() { sigma } else { options.unknown_sigma_m };
            pixels.roots_of_weight.push(sigma.recip());
            pixels.used.push(true);
            pixels.observed_m.push(observed);
        }
        Ok(pixels)
    }

    fn with_capacity(count: usize, columns: usize) -> Self {
        Self {
            rays: Vec::with_capacity(count),
            ranges_m: Vec::with_capacity(count),
            roots_of_weight: Vec::with_capacity(count),
            rows: Vec::with_capacity(count * columns),
            used: Vec::with_capacity(count),
            observed_m: Vec::with_capacity(count),
            columns,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Design row of a pixel.
    pub(crate) fn row(&self, pixel: usize) -> impl Iterator<Item = f64> + '_ {
        self.rows[pixel * self.columns..(pixel + 1) * self.columns].iter().map(|value| f64::from(*value))
    }

    /// What the reference range and the terms leave of the observed range of a pixel, metre.
    pub(crate) fn left_over(&self, pixel: usize, reference_m: f64, terms: &[f64]) -> f64 {
        let linear: f64 = self.row(pixel).zip(terms).map(|(derivative, term)| derivative * term).sum();
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
        let kept: Vec<usize> = (0..self.len()).filter(|pixel| wanted(&self.rays[*pixel])).collect();
        if kept.len() < self.len() {
            *self = self.taken(kept.into_iter());
        }
    }

    /// At most so many pixels, one from each run of equal length. Where in its run follows no pattern that the columns
    /// of the image might share.
    pub(crate) fn thinned(&self, at_most: usize) -> Self {
        let run = self.len().div_ceil(at_most).max(1);
        let within = |first: usize| ((first as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as usize % run;
        self.taken((0..self.len()).step_by(run).map(|first| first + within(first)).filter(|pixel| *pixel < self.len()))
    }

    fn taken(&self, chosen: impl Iterator<Item = usize>) -> Self {
        let mut taken = Self::with_capacity(chosen.size_hint().0, self.columns);
        for pixel in chosen {
            taken.rays.push(self.rays[pixel]);
            taken.ranges_m.push(self.ranges_m[pixel]);
            taken.observed_m.push(self.observed_m[pixel]);
            taken.roots_of_weight.push(self.roots_of_weight[pixel]);
            taken.rows.extend_from_slice(&self.rows[pixel * self.columns..(pixel + 1) * self.columns]);
            taken.used.push(self.used[pixel]);
        }
        taken
    }

    /// The points that the observed ranges give, in the camera frame, metre.
    pub(crate) fn points(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.rays.iter().zip(&self.ranges_m).map(|(ray, range)| ray * *range)
    }

    pub(crate) fn used_count(&self) -> usize {
        self.used.iter().filter(|used| **used).count()
    }
}
