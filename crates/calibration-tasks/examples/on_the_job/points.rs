//! Errors of the points of a result against what is stated of them, by what they lie on.

use std::path::Path;

use camera_model::Camera;
use common_errors::CommonErrorsFile;
use common_errors::point_uncertainty::{CommonErrors, PointErrors, StationErrors, point_covariance};
use nalgebra::{Matrix3, Point3, Vector3};
use range_image::Raster;
use range_io::calibration::Calibration;
use range_io::clouds::CloudFile;
use range_io::ply::read_cloud;
use range_io::ron_text;
use range_io::survey::{Survey, TruthFrame, read_truth};
use range_io::tables::read_stations;
use serde::{Deserialize, Serialize};

/// What a point lies on.
pub const CLASSES: [&str; 6] = ["all", "near", "far", "dark", "grazing", "beside edges"];

/// Nearer and farther than these is near and far, metre.
const NEAR_M: f64 = 2.5;
const FAR_M: f64 = 4.0;
/// Part of the points that is dark.
const DARK: f64 = 0.2;
/// Cosine of the angle of incidence below which light grazes: 60 degrees.
const GRAZING: f64 = 0.5;
/// Part of the range by which its second difference shows an edge, within two pixels.
const EDGE: f64 = 0.02;

/// Squared errors over covariances, in the directions in which a point has a covariance, and the number of these directions.
#[derive(Serialize, Deserialize, Clone, Copy, Default)]
pub struct Squares {
    pub squared: f64,
    pub directions: f64,
    pub points: usize,
    /// Points off by more than five standard deviations along their ray.
    pub off: usize,
}

/// The cloud of a result with what is stated of its errors.
struct Stated {
    camera: Camera,
    file: CloudFile,
    stations: Vec<StationErrors>,
    common: CommonErrors,
}

impl Stated {
    fn read(result: &Path) -> Self {
        let errors: CommonErrorsFile = ron_text::read(result.join(CommonErrorsFile::FILE_NAME)).unwrap();
        let calibration = Calibration::read(result.join(errors.calibration.as_ref().unwrap())).unwrap();
        let camera = calibration.camera().unwrap();
        let station = |(number, frame): (usize, &common_errors::FrameErrors)| {
            let model = frame.range_model.map(|index| calibration.range_models[index].to_model().unwrap());
            let (pose, columns) = (frame.world_from_camera(), frame.columns.clone());
            StationErrors::new(number as u32, &camera, model.as_ref(), &pose, columns, errors.errors.len()).unwrap()
        };
        let stations = errors.frames.iter().enumerate().map(station).collect();
        let common = errors.common().unwrap();
        Self { camera, file: read_cloud(result.join("cloud.ply")).unwrap().in_world(), stations, common }
    }

    fn point(&self, index: usize) -> Point3<f64> {
        self.file.points[index].into()
    }

    fn station(&self, index: usize) -> &StationErrors {
        &self.stations[self.file.frame.as_ref().unwrap()[index] as usize]
    }

    /// The pixel that sees a point of its station's frame, in a raster of this width.
    fn pixel(&self, local: &Point3<f64>, width: usize) -> usize {
        let [col, row] = self.camera.project(local).unwrap().map(|at| at.round() as usize);
        row * width + col
    }

    fn amplitude(&self, index: usize) -> f64 {
        self.file.intensity.as_ref().map_or(f64::NAN, |all| f64::from(all[index]))
    }
}

impl PointErrors for Stated {
    fn noise(&self, index: usize) -> Matrix3<f64> {
        let sigma_m = f64::from(self.file.sigma.as_ref().unwrap()[index]);
        self.station(index).noise(&self.point(index), sigma_m)
    }
    fn sensor(&self, _: usize) -> Option<(u64, Vector3<f64>)> {
        None
    }
    fn common(&self, index: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.station(index).common(&self.point(index), self.amplitude(index), derivatives);
    }
}

/// Squared errors of all unflagged points of a result, in the order of [`CLASSES`]. The result has a view for each station, and no
/// point where a pixel has no data.
pub fn squared_errors(result: &Path, survey_folder: &Path) -> [Squares; CLASSES.len()] {
    let stated = Stated::read(result);
    let survey = Survey::read(survey_folder).unwrap();
    let true_stations = read_stations(survey_folder.join("truth/stations.csv")).unwrap();
    let width = survey.camera.width;
    let views = stated.file.frame.as_ref().unwrap();
    let flags = stated.file.flags.as_ref().unwrap();
    let mut amplitudes: Vec<f64> =
        (0..flags.len()).filter(|at| flags[*at] == 0).map(|at| stated.amplitude(at)).collect();
    let dark = statistics::quantile(&mut amplitudes, DARK);
    let mut sums = [Squares::default(); CLASSES.len()];
    for (view, station) in stated.stations.iter().enumerate() {
        let frame = survey.frames.iter().position(|frame| frame.station == true_stations[view].station).unwrap();
        let truth = read_truth(&survey, survey_folder, frame).unwrap().unwrap();
        let seen = Seen { camera: &stated.camera, truth, width };
        for index in (0..flags.len()).filter(|at| views[*at] as usize == view && flags[*at] == 0) {
            let local = station.world_from_camera().inverse_transform_point(&stated.point(index));
            let (pixel, range_m) = (stated.pixel(&local, width), local.coords.norm());
            let Some(true_m) = seen.range(pixel, range_m) else { continue };
            let target = true_stations[view].world_from_camera * Point3::from(local.coords * (true_m / range_m));
            let error = stated.point(index) - target;
            let ray = station.ray(&stated.point(index));
            let covariance = point_covariance(index, &stated, &stated.common);
            let found = squares(&error, &covariance, &ray);
            let is = [
                true,
                range_m < NEAR_M,
                range_m > FAR_M,
                stated.amplitude(index) < dark,
                seen.incidence(pixel) < GRAZING,
                seen.is_beside_an_edge(pixel),
            ];
            for (sum, _) in sums.iter_mut().zip(is).filter(|(_, is)| *is) {
                sum.squared += found.squared;
                sum.directions += found.directions;
                sum.points += 1;
                sum.off += found.off;
            }
        }
    }
    sums
}

/// Variances below this part of the largest are rounding: a station that the datum holds errs along its rays alone.
const NO_VARIANCE: f64 = 1e-9;

fn squares(error: &Vector3<f64>, covariance: &Matrix3<f64>, ray: &Vector3<f64>) -> Squares {
    let eigen = covariance.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let mut found = Squares { points: 1, ..Squares::default() };
    for (variance, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *variance > NO_VARIANCE * largest {
            found.squared += axis.dot(error).powi(2) / variance;
            found.directions += 1.0;
        }
    }
    let along = ray.dot(error).powi(2) / ray.dot(&(covariance * ray));
    found.off = usize::from(along > 25.0);
    found
}

/// What a station sees in truth.
struct Seen<'a> {
    camera: &'a Camera,
    truth: TruthFrame,
    width: usize,
}

impl Seen<'_> {
    /// True range of a pixel; of one that sees several surfaces, that of the one its own range is nearest to: those beside it
    /// continued straight in the inverse range, as planes are.
    fn range(&self, pixel: usize, observed_m: f64) -> Option<f64> {
        let (col, row) = (pixel % self.width, pixel / self.width);
        let own = Some(f64::from(self.truth.range[(col, row)])).filter(|range| range.is_finite())?;
        if !self.truth.mixed[(col, row)] {
            return Some(own);
        }
        let beside = |dx: isize, dy: isize| {
            let at = |count: isize| beside(&self.truth.range, [col, row], [dx * count, dy * count]);
            Some(1.0 / (2.0 / at(1)? - 1.0 / at(2)?)).filter(|range| *range > 0.0)
        };
        let all = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [dx, dy])).filter_map(|[dx, dy]| beside(dx, dy));
        let distance = |range: &f64| (range - observed_m).abs();
        all.chain([own]).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    fn is_beside_an_edge(&self, pixel: usize) -> bool {
        let (col, row) = (pixel % self.width, pixel / self.width);
        let bends = |at: [usize; 2], step: [isize; 2]| {
            let [before, own, after] =
                [-1, 0, 1].map(|count| beside(&self.truth.range, at, step.map(|part| part * count)));
            before
                .zip(own)
                .zip(after)
                .is_some_and(|((before, own), after)| (before + after - 2.0 * own).abs() > EDGE * own)
        };
        (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| [dx, dy])).any(|[dx, dy]: [isize; 2]| {
            let at = col.checked_add_signed(dx).zip(row.checked_add_signed(dy));
            at.is_some_and(|(col, row)| bends([col, row], [1, 0]) || bends([col, row], [0, 1]))
        })
    }

    /// Cosine of the angle between the ray and the normal of the surface; one where neighbours are missing.
    fn incidence(&self, pixel: usize) -> f64 {
        let at = [pixel % self.width, pixel / self.width];
        let point = |step: [isize; 2]| {
            let range_m = beside(&self.truth.range, at, step)?;
            Some(self.camera.ray([at[0] as f64 + step[0] as f64, at[1] as f64 + step[1] as f64]) * range_m)
        };
        let across = |step: [isize; 2]| Some(point(step)? - point(step.map(|part| -part))?);
        let Some((by_col, by_row)) = across([1, 0]).zip(across([0, 1])) else { return 1.0 };
        by_col.cross(&by_row).normalize().dot(&self.camera.ray(at.map(|part| part as f64))).abs()
    }
}

fn beside(range: &Raster<f32>, [col, row]: [usize; 2], [dx, dy]: [isize; 2]) -> Option<f64> {
    let (col, row) = (col.checked_add_signed(dx)?, row.checked_add_signed(dy)?);
    range.get(col, row).map(|range| f64::from(*range)).filter(|range| range.is_finite())
}
