//! Calibration, drifts and poses put into one vector of errors with one covariance.

use std::collections::BTreeMap;

use camera_model::Camera;
use nalgebra::{DMatrix, Isometry3, Matrix6};
use point_cloud::Cloud;
use point_uncertainty::{Columns, CommonError, Source, StationErrors};
use range_io::calibration::Calibration;

use crate::calibrated::{CalibratedErrors, Corrected};
use crate::sensitivity::{PoseErrors, pose_errors};
use crate::{CommonErrorsFile, Error, FrameErrors, Result, SharedBySensor};

/// Components of a pose's tangent.
const COMPONENTS: [&str; 6] = ["dx", "dy", "dz", "domega", "dphi", "dkappa"];

/// Drifts with a standard deviation of their own; of more frames, those that are known nearly as well share one. All err together, so
/// that only the size counts, and 256 steps change it by less than a part in 256 of its span.
const MOST_DRIFTS: usize = 256;

/// Frames whose stated poses are errors of their own. Their covariance grows with the square of their number: of 500 it has 4.5 million
/// values, which take half a gigabyte while `common_errors.ron` is written.
const MOST_POSES: usize = 500;

/// A frame of the cloud, or a mean of frames.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Station, and frame or number of frames.
    pub view: String,
    /// Station.
    pub station: String,
    /// Where it stands in the cloud's frame.
    pub world_from_camera: Isometry3<f64>,
    /// How well its pose is known where it was stated, in the tangent `[dt world axes, dtheta camera axes]`; `None` where it was
    /// registered, or is exact.
    pub stated_covariance: Option<Matrix6<f64>>,
    /// Position of its range terms among the calibration's.
    pub range_model: Option<usize>,
    /// Standard deviation of the drift that was taken off, metre; the same curve for all frames.
    pub drift_sigma_m: Option<f64>,
    /// The error that its neighbouring pixels share, where it is known.
    pub sensor: Option<SharedBySensor>,
}

/// The clouds that the frames' poses were registered with, one a frame, in their cameras' frames with normals.
#[derive(Debug, Clone, Copy)]
pub struct Registered<'a> {
    /// The clouds.
    pub clouds: &'a [Cloud],
}

/// Puts together what the points of all frames have in common.
///
/// Where poses were registered, they are registered once more from where they stand, with the errors of the calibration as
/// unknowns beside them: poses err with the calibration that they were found with. The first frame is the datum.
///
/// # Errors
/// [`Error::Registration`] where the stations do not come together again; [`Error::Io`] for a parameter without a known standard
/// deviation.
pub fn common_errors(
    frames: &[Frame],
    camera: &Camera,
    calibration: Option<(&Calibration, Corrected)>,
    registered: Option<Registered<'_>>,
) -> Result<CommonErrorsFile> {
    let calibrated = match calibration {
        Some((calibration, corrected)) => CalibratedErrors::new(calibration, corrected)?,
        None => CalibratedErrors::default(),
    };
    let mut errors = Errors { errors: calibrated.errors.clone(), covariance: calibrated.covariance.clone() };
    let mut columns: Vec<Columns> = frames.iter().map(|frame| calibrated.columns(frame.range_model)).collect();
    let mut not_in_it = Vec::new();
    errors.add_drifts(frames, &mut columns);
    match registered.filter(|registered| registered.clouds.len() == frames.len()) {
        Some(registered) => {
            let stations: Result<Vec<StationErrors>> = frames
                .iter()
                .zip(&columns)
                .map(|(frame, columns)| {
                    let model = calibration.and_then(|(known, _)| known.range_models.get(frame.range_model?));
                    let model = model.map(range_io::calibration::RangeCalibration::to_model).transpose();
                    let model = model.map_err(|error| Error::Model(error.to_string()))?;
                    let columns = Columns { drift: None, ..columns.clone() };
                    let pose = &frame.world_from_camera;
                    Ok(StationErrors::new(0, camera, model.as_ref(), pose, columns, errors.errors.len())?)
                })
                .collect();
            let poses: Vec<Isometry3<f64>> = frames.iter().map(|frame| frame.world_from_camera).collect();
            let (own, covariance) = (&calibrated.errors, &calibrated.covariance);
            let found = pose_errors(registered.clouds, &poses, &stations?, own, covariance)?;
            errors.add_registered(frames, &mut columns, &found, covariance);
        }
        None => not_in_it.extend(errors.add_stated(frames, &mut columns)),
    }
    let described = frames.iter().zip(columns).map(|(frame, columns)| described(frame, columns));
    let size = errors.errors.len();
    Ok(CommonErrorsFile {
        format_version: CommonErrorsFile::FORMAT_VERSION,
        calibration: None,
        frames: described.collect(),
        covariance: (0..size).map(|row| (0..=row).map(|column| errors.covariance[(row, column)]).collect()).collect(),
        errors: errors.errors,
        not_in_it,
    })
}

fn described(frame: &Frame, columns: Columns) -> FrameErrors {
    let pose = &frame.world_from_camera;
    let rotation = pose.rotation.coords;
    FrameErrors {
        view: frame.view.clone(),
        station: frame.station.clone(),
        position_m: pose.translation.vector.into(),
        quaternion_xyzw: [rotation.x, rotation.y, rotation.z, rotation.w],
        range_model: frame.range_model,
        columns,
        sensor: frame.sensor,
    }
}

/// The errors so far.
struct Errors {
    errors: Vec<CommonError>,
    covariance: DMatrix<f64>,
}

impl Errors {
    /// Makes room for further errors.
    fn grow<N: IntoIterator<Item = String>>(&mut self, names: N, source: Source) -> usize {
        let first = self.errors.len();
        self.errors.extend(names.into_iter().map(|name| CommonError { name, source }));
        let size = self.errors.len();
        self.covariance.resize_mut(size, size, 0.0);
        first
    }

    /// One drift a frame; all come from one curve, so that they err together.
    fn add_drifts(&mut self, frames: &[Frame], columns: &mut [Columns]) {
        let drifting: Vec<(usize, f64)> = (0..frames.len())
            .filter_map(|index| Some((index, frames[index].drift_sigma_m.filter(|sigma| *sigma > 0.0)?)))
            .collect();
        let (names, rows, sigmas) = if drifting.len() > MOST_DRIFTS {
            in_steps(&drifting)
        } else {
            let names = drifting.iter().map(|(index, _)| format!("drift {}", frames[*index].view)).collect();
            (names, (0..drifting.len()).collect(), drifting.iter().map(|(_, sigma)| *sigma).collect())
        };
        let first = self.grow::<Vec<String>>(names, Source::Drift);
        for ((index, _), row) in drifting.iter().zip(rows) {
            columns[*index].drift = Some(first + row);
        }
        for (row, sigma) in sigmas.iter().enumerate() {
            for (column, other) in sigmas.iter().enumerate() {
                self.covariance[(first + row, first + column)] = sigma * other;
            }
        }
    }

    /// Poses of which their own covariances are stated; in words, where they are too many.
    fn add_stated(&mut self, frames: &[Frame], columns: &mut [Columns]) -> Option<String> {
        let stated: Vec<&Frame> = frames.iter().filter(|frame| frame.stated_covariance.is_some()).collect();
        let count = stated.len();
        if count > MOST_POSES {
            return Some(format!(
                "poses: the covariance of {count} frames whose poses are stated with standard deviations is too large; at most \
                 {MOST_POSES} are taken, so run the part of the survey that is to be measured"
            ));
        }
        let mut next = self.grow(stated.into_iter().flat_map(names), Source::Pose);
        for (frame, columns) in frames.iter().zip(columns) {
            let Some(covariance) = frame.stated_covariance else { continue };
            let first = next;
            next += COMPONENTS.len();
            columns.pose = Some(first);
            self.covariance.fixed_view_mut::<6, 6>(first, first).copy_from(&rigid_symmetric(&covariance));
        }
        None
    }

    /// Poses that were registered, but that of the datum, with what they owe to the calibration.
    fn add_registered(
        &mut self,
        frames: &[Frame],
        columns: &mut [Columns],
        found: &PoseErrors,
        calibration: &DMatrix<f64>,
    ) {
        let first = self.errors.len();
        for (frame, columns) in frames.iter().zip(columns).skip(1) {
            columns.pose = Some(self.grow(names(frame), Source::Pose));
        }
        let rows = self.errors.len() - first;
        let by = found.by_calibration.rows(6, rows);
        let owed = by * calibration;
        let own = found.alone.view((6, 6), (rows, rows)) + &owed * by.transpose();
        self.covariance.view_mut((first, first), (rows, rows)).copy_from(&(0.5 * (&own + own.transpose())));
        let terms = calibration.nrows();
        self.covariance.view_mut((first, 0), (rows, terms)).copy_from(&owed);
        self.covariance.view_mut((0, first), (terms, rows)).copy_from(&owed.transpose());
    }
}

/// Drifts in steps of their deviations, rounded up: names, the step of each, and the deviations of the steps.
fn in_steps(drifting: &[(usize, f64)]) -> (Vec<String>, Vec<usize>, Vec<f64>) {
    let sigmas = || drifting.iter().map(|(_, sigma)| *sigma);
    let (low, high) = sigmas().fold((f64::INFINITY, 0.0_f64), |(low, high), sigma| (low.min(sigma), high.max(sigma)));
    let width = (high - low) / (MOST_DRIFTS - 1) as f64;
    let step =
        |sigma: f64| if width > 0.0 { (((sigma - low) / width).ceil() as usize).min(MOST_DRIFTS - 1) } else { 0 };
    let mut rows: BTreeMap<usize, usize> = sigmas().map(|sigma| (step(sigma), 0)).collect();
    for (row, place) in rows.values_mut().enumerate() {
        *place = row;
    }
    let steps: Vec<f64> = rows.keys().map(|step| low + *step as f64 * width).collect();
    let names = steps.iter().map(|sigma| format!("drift known to {:.4} mm", 1e3 * sigma)).collect();
    (names, sigmas().map(|sigma| rows[&step(sigma)]).collect(), steps)
}

fn names(frame: &Frame) -> Vec<String> {
    COMPONENTS.iter().map(|component| format!("{} {component}", frame.view)).collect()
}

fn rigid_symmetric(covariance: &Matrix6<f64>) -> Matrix6<f64> {
    (covariance + covariance.transpose()) * 0.5
}
