//! How the points of one station move with the errors of its range, its calibration, its drift and its pose.

use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::{Error, Result, SharedErrorGrid};

/// Where the common errors of a station stand.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Columns {
    /// Interior orientation and lens: position among `[xp, yp, c, k1, k2, k3, p1, p2, b1, b2]`, and column.
    pub camera: Vec<(usize, usize)>,
    /// Range terms: position among the model's `parameter_names`, and column.
    pub range: Vec<(usize, usize)>,
    /// The amplitude's part: position among `[h1, h2, h3]`, and column.
    #[cfg_attr(feature = "serde", serde(default))]
    pub hyperbola: Vec<(usize, usize)>,
    /// The drift of the station's ranges, metre.
    pub drift: Option<usize>,
    /// First of the six columns of the pose: `[dt world axes, dtheta camera axes]`. `None` where it is held.
    pub pose: Option<usize>,
}

/// An error that neighbouring pixels share: of a standard deviation of its own, or as a part of the noise of each pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SharedBySensor {
    /// Standard deviation along the ray, metre, beside the noise of the pixels.
    #[cfg_attr(feature = "serde", serde(default))]
    pub sigma_m: f64,
    /// Part of each pixel's variance that its neighbourhood shares, 0 to 1.
    #[cfg_attr(feature = "serde", serde(default))]
    pub share: f64,
    /// Width of a neighbourhood, pixel.
    pub width_px: f64,
}

/// One station: its pose, its camera, and what its points have in common.
#[derive(Debug, Clone)]
pub struct StationErrors {
    camera: Camera,
    model: Option<RangeErrorModel>,
    world_from_camera: Isometry3<f64>,
    columns: Columns,
    sensor: Option<SharedBySensor>,
    shared_error: Option<SharedErrorGrid>,
    number: u32,
}

impl StationErrors {
    /// A station; `number` is another one for each.
    ///
    /// # Errors
    /// [`Error::Column`] where a column is not below `common_errors`.
    pub fn new(
        number: u32,
        camera: &Camera,
        model: Option<&RangeErrorModel>,
        world_from_camera: &Isometry3<f64>,
        columns: Columns,
        common_errors: usize,
    ) -> Result<Self> {
        let all = columns.camera.iter().chain(&columns.range).chain(&columns.hyperbola).map(|(_, column)| *column);
        let last = all.chain(columns.drift).chain(columns.pose.map(|first| first + 5)).max();
        match last {
            Some(column) if column >= common_errors => Err(Error::Column { column, errors: common_errors }),
            _ => Ok(Self {
                camera: *camera,
                model: model.cloned(),
                world_from_camera: *world_from_camera,
                columns,
                sensor: None,
                shared_error: None,
                number,
            }),
        }
    }

    /// With an error that the pixels of neighbourhoods share.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`].
    pub fn with_sensor(mut self, sensor: SharedBySensor) -> Result<Self> {
        let SharedBySensor { sigma_m, share, width_px } = sensor;
        if !(sigma_m >= 0.0 && sigma_m.is_finite()) {
            let expected = "not negative";
            return Err(Error::OutOfDomain { name: "the error that pixels share", value: sigma_m, expected });
        }
        if !(0.0..=1.0).contains(&share) {
            let expected = "0 to 1";
            return Err(Error::OutOfDomain {
                name: "the share of noise that pixels have in common",
                value: share,
                expected,
            });
        }
        if !(width_px >= 1.0 && width_px.is_finite()) {
            let expected = "at least one pixel";
            return Err(Error::OutOfDomain { name: "the width of a neighbourhood", value: width_px, expected });
        }
        self.sensor = (sigma_m > 0.0 || share > 0.0).then_some(sensor);
        Ok(self)
    }

    /// With an error that it shares with all frames of its sensor.
    ///
    /// # Errors
    /// [`Error::Column`] where a column of the grid is not below `common_errors`.
    pub fn with_shared_error(mut self, grid: SharedErrorGrid, common_errors: usize) -> Result<Self> {
        let end = grid.columns().end;
        if end > common_errors {
            return Err(Error::Column { column: end - 1, errors: common_errors });
        }
        self.shared_error = Some(grid);
        Ok(self)
    }

    /// The pose.
    pub fn world_from_camera(&self) -> &Isometry3<f64> {
        &self.world_from_camera
    }

    /// Direction that a point is seen in, length one, world axes.
    pub fn ray(&self, point: &Point3<f64>) -> Vector3<f64> {
        (point - self.world_from_camera.translation.vector).coords.normalize()
    }

    /// Whether a point lies in the station's image, or at most this many pixels beside it.
    pub fn sees(&self, point: &Point3<f64>, beside_px: f64) -> bool {
        let Ok(pixel) = self.camera.project(&self.world_from_camera.inverse_transform_point(point)) else {
            return false;
        };
        let size = [self.camera.format.width, self.camera.format.height];
        pixel.iter().zip(size).all(|(at, size)| *at >= -0.5 - beside_px && *at <= size as f64 - 0.5 + beside_px)
    }

    /// Covariance of a point whose range has this standard deviation, square metre, world axes, without what its neighbourhood
    /// shares of it.
    pub fn noise(&self, point: &Point3<f64>, sigma_range_m: f64) -> Matrix3<f64> {
        let shift = self.ray(point) * (sigma_range_m * self.own_share().sqrt());
        shift * shift.transpose()
    }

    /// Part of a point's variance that its neighbourhood does not share.
    pub fn own_share(&self) -> f64 {
        self.sensor.map_or(1.0, |sensor| 1.0 - sensor.share)
    }

    /// The neighbourhood of a point whose range has this standard deviation, and its shift by one standard deviation of what the
    /// neighbourhood shares.
    pub fn sensor(&self, point: &Point3<f64>, sigma_range_m: f64) -> Option<(u64, Vector3<f64>)> {
        let SharedBySensor { sigma_m, share, width_px } = self.sensor?;
        let pixel = self.camera.project(&self.world_from_camera.inverse_transform_point(point)).ok()?;
        let cell = pixel.map(|at| ((at + 0.5) / width_px).floor().clamp(0.0, 65_535.0) as u64);
        let neighbourhood = u64::from(self.number) << 32 | cell[0] << 16 | cell[1];
        let part_m = if share > 0.0 { share.sqrt() * sigma_range_m } else { 0.0 };
        Some((neighbourhood, self.ray(point) * sigma_m.hypot(part_m)))
    }

    /// Adds the derivatives of a world point by the common errors: column and metre a unit, world axes. `amplitude` is that of
    /// the pixel, as received; NaN where it is not known, and then the hyperbola's part is left out.
    ///
    /// Errors of the range are taken at the corrected range; the difference to the observed one, millimetres, changes
    /// periodic terms of metres by parts in a thousand. A point that the camera cannot see moves with its pose alone.
    pub fn common(&self, point: &Point3<f64>, amplitude: f64, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        let rotation = self.world_from_camera.rotation.to_rotation_matrix().into_inner();
        let local = self.world_from_camera.inverse_transform_point(point);
        if let Some(first) = self.columns.pose {
            let by_turn = -rotation * local.coords.cross_matrix();
            for axis in 0..3 {
                derivatives.push((first + axis, Vector3::ith(axis, 1.0)));
                derivatives.push((first + 3 + axis, by_turn.column(axis).into_owned()));
            }
        }
        let Ok(pixel) = self.camera.project(&local) else { return };
        let range_m = local.coords.norm();
        let by_range = self.ray(point);
        if let Some(column) = self.columns.drift {
            derivatives.push((column, -by_range));
        }
        if let Some(grid) = self.shared_error {
            // The camera looks along -z.
            let by_inverse_depth = by_range * (local.z * range_m);
            derivatives.extend(grid.around(pixel).map(|(column, weight)| (column, by_inverse_depth * weight)));
        }
        if let Some(model) = self.model.as_ref().filter(|_| !self.columns.range.is_empty()) {
            let [x, y] = self.camera.format.image_from_pixel(pixel);
            let [xp, yp] = self.camera.interior.principal_point_mm;
            let row = model.design_row(range_m, x - xp, y - yp);
            let moving =
                self.columns.range.iter().filter_map(|(at, column)| Some((*column, -by_range * *row.get(*at)?)));
            derivatives.extend(moving);
        }
        let hyperbola = self.model.as_ref().and_then(|model| model.hyperbola?.jacobian(amplitude));
        if let Some(jacobian) = hyperbola {
            let coefficients = self.columns.hyperbola.iter();
            let moving =
                coefficients.filter_map(|(at, column)| Some((*column, -by_range * *jacobian.coefficients.get(*at)?)));
            derivatives.extend(moving);
        }
        if !self.columns.camera.is_empty() {
            let by_camera = rotation * self.camera.point_derivatives(pixel, range_m);
            let columns = self.columns.camera.iter().filter(|(at, _)| *at < by_camera.ncols());
            derivatives.extend(columns.map(|(at, column)| (*column, by_camera.column(*at).into_owned())));
        }
    }
}
