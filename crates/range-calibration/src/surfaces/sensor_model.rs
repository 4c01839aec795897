//! How the points of all stations depend on what is estimated: along their rays by the range terms, with their rays by the lens.

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use multiview_registration::PointModel;
use nalgebra::Point3;

use super::amplitude::{AmplitudeModel, NAMES, PRIOR_SIGMA};
use super::pixels::StationPixels;

/// Names of the camera's parameters, in the order of [`Camera::point_derivatives`].
pub(super) const CAMERA_NAMES: [&str; 10] = ["xp", "yp", "c", "k1", "k2", "k3", "p1", "p2", "b1", "b2"];

/// The parameters with the pixels of all stations. Order: range terms, amplitude, camera.
pub(super) struct SensorModel<'a> {
    /// Range terms: name, start value, prior deviation; in the order of the pixels' rows.
    pub(super) range: Vec<Parameter>,
    /// Asked range terms that are held after all: their columns and values.
    pub(super) held_range: Vec<(usize, f64)>,
    /// Whether the amplitude's part has its own shape already.
    pub(super) shaped: bool,
    /// The amplitude's part; `None` where it is not asked for or held.
    pub(super) amplitude: Option<AmplitudeModel>,
    /// Camera parameters and their positions in [`CAMERA_NAMES`].
    pub(super) lens: Vec<(usize, Parameter)>,
    pub(super) camera: &'a Camera,
    pub(super) stations: &'a [StationPixels],
}

/// A parameter that is estimated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) start: f64,
    pub(super) prior_sigma: f64,
    /// Position among the columns of the pixels' rows; that of a camera parameter is not used.
    pub(super) column: usize,
}

impl SensorModel<'_> {
    /// Number of the amplitude's parameters.
    pub(super) fn amplitudes(&self) -> usize {
        self.amplitude.as_ref().map_or(0, |amplitude| amplitude.free.len())
    }

    /// The camera with these values of its parameters.
    pub(super) fn camera_at(&self, values: &[f64]) -> Camera {
        let mut all = camera_values(self.camera);
        for ((position, _), value) in self.lens.iter().zip(&values[self.range.len() + self.amplitudes()..]) {
            all[*position] = *value;
        }
        camera_of(self.camera, &all)
    }

    /// Root mean square movement of a point by a unit of each parameter, metre per unit.
    pub(super) fn effects(&self, values: &[f64]) -> Vec<f64> {
        let count = values.len();
        let mut squares = vec![0.0; count];
        let mut derivatives = vec![[0.0; 3]; count];
        let mut pixels = 0_usize;
        for (station, of_station) in self.stations.iter().enumerate() {
            // One in seven is enough for a mean of thousands.
            for index in (0..of_station.ranges_m.len()).step_by(7) {
                let _ = self.point(station, index, values, Some(&mut derivatives));
                pixels += 1;
                for (sum, by) in squares.iter_mut().zip(&derivatives) {
                    *sum += by.iter().map(|d| d * d).sum::<f64>();
                }
            }
        }
        squares.into_iter().map(|sum| (sum / pixels.max(1) as f64).sqrt()).collect()
    }
}

impl PointModel for SensorModel<'_> {
    fn names(&self) -> Vec<String> {
        let amplitude = self.amplitude.iter().flat_map(|model| model.free.iter().map(|at| NAMES[*at].to_owned()));
        let range = self.range.iter().map(|parameter| parameter.name.clone());
        range.chain(amplitude).chain(self.lens.iter().map(|(_, parameter)| parameter.name.clone())).collect()
    }

    fn prior(&self) -> (Vec<f64>, Vec<f64>) {
        let amplitude = self.amplitude.iter();
        let amplitude = amplitude.flat_map(|model| model.free.iter().map(|at| (model.start[*at], PRIOR_SIGMA[*at])));
        let of = |parameter: &Parameter| (parameter.start, parameter.prior_sigma);
        let lens = self.lens.iter().map(|(_, parameter)| of(parameter));
        self.range.iter().map(of).chain(amplitude).chain(lens).unzip()
    }

    fn point(
        &self,
        station: usize,
        index: usize,
        parameters: &[f64],
        derivatives: Option<&mut [[f64; 3]]>,
    ) -> Point3<f64> {
        let pixels = &self.stations[station];
        let (terms, rest) = parameters.split_at(self.range.len());
        let (amplitudes, _) = rest.split_at(self.amplitudes());
        let row = pixels.row(index);
        let mut range_m = pixels.ranges_m[index];
        for (parameter, value) in self.range.iter().zip(terms) {
            range_m -= f64::from(row[parameter.column]) * value;
        }
        for (column, value) in &self.held_range {
            range_m -= f64::from(row[*column]) * value;
        }
        let mut by_amplitude = [0.0; 2];
        range_m -= match &self.amplitude {
            Some(model) => model.correction(f64::from(pixels.amplitudes[index]), amplitudes, &mut by_amplitude),
            None => f64::from(pixels.by_known_hyperbola_m[index]),
        };
        let pixel = pixels.pixels[index].map(f64::from);
        let moved = (!self.lens.is_empty()).then(|| self.camera_at(parameters));
        let ray = moved.as_ref().map_or(pixels.rays[index], |camera| camera.ray(pixel));
        if let Some(derivatives) = derivatives {
            let (of_terms, rest) = derivatives.split_at_mut(self.range.len());
            let (of_amplitude, of_lens) = rest.split_at_mut(self.amplitudes());
            for (derivative, parameter) in of_terms.iter_mut().zip(&self.range) {
                *derivative = (ray * -f64::from(row[parameter.column])).into();
            }
            for (derivative, change) in of_amplitude.iter_mut().zip(by_amplitude) {
                *derivative = (ray * -change).into();
            }
            if let Some(camera) = &moved {
                let by_camera = camera.point_derivatives(pixel, range_m);
                for (derivative, (position, _)) in of_lens.iter_mut().zip(&self.lens) {
                    *derivative = by_camera.column(*position).into_owned().into();
                }
            }
        }
        Point3::from(ray * range_m)
    }
}

/// Values in the order of [`CAMERA_NAMES`].
pub(super) fn camera_values(camera: &Camera) -> [f64; 10] {
    let [xp, yp] = camera.interior.principal_point_mm;
    let [k1, k2, k3, p1, p2, b1, b2] = camera.lens.coefficients();
    [xp, yp, camera.interior.principal_distance_mm, k1, k2, k3, p1, p2, b1, b2]
}

fn camera_of(camera: &Camera, [xp, yp, c, k1, k2, k3, p1, p2, b1, b2]: &[f64; 10]) -> Camera {
    Camera {
        format: camera.format,
        interior: InteriorOrientation { principal_point_mm: [*xp, *yp], principal_distance_mm: *c },
        lens: LensDistortion::from_coefficients([*k1, *k2, *k3, *p1, *p2, *b1, *b2]),
    }
}
