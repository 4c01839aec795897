//! The errors that a calibration brings, and the columns of the frames that have them.

use nalgebra::DMatrix;
use point_uncertainty::{Columns, CommonError, Source};
use range_io::calibration::Calibration;

use crate::{Error, Result};

/// What a calibration was used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corrected {
    /// Rays were made with its camera.
    pub rays: bool,
    /// Ranges were corrected with its terms.
    pub ranges: bool,
}

/// The parameters of a calibration that are not known exactly, with their covariance.
#[derive(Debug, Clone, Default)]
pub(crate) struct CalibratedErrors {
    pub(crate) errors: Vec<CommonError>,
    pub(crate) covariance: DMatrix<f64>,
    camera: Vec<(usize, usize)>,
    /// Of each range model: its terms, and its hyperbola.
    range: Vec<[Vec<(usize, usize)>; 2]>,
}

impl CalibratedErrors {
    pub(crate) fn new(calibration: &Calibration, corrected: Corrected) -> Result<Self> {
        let (mut names, mut camera) = (Vec::new(), Vec::new());
        if corrected.rays {
            for (position, (name, _)) in Calibration::CAMERA_PARAMETERS.into_iter().enumerate() {
                if is_uncertain(calibration, name) {
                    camera.push((position, names.len()));
                    names.push(name.to_owned());
                }
            }
        }
        let several = calibration.range_models.len() > 1;
        let mut range = Vec::new();
        for (index, written) in calibration.range_models.iter().enumerate().filter(|_| corrected.ranges) {
            let mut columns = [Vec::new(), Vec::new()];
            let model = written.to_model().map_err(|error| Error::Model(error.to_string()))?;
            let terms = model.parameter_names().into_iter().enumerate().map(|(at, name)| (0, at, name));
            let hyperbola = error_models::AmplitudeHyperbola::NAMES.into_iter().enumerate();
            for (kind, at, name) in terms.chain(hyperbola.map(|(at, name)| (1, at, name.to_owned()))) {
                let name = if several { format!("{name}[{index}]") } else { name };
                if is_uncertain(calibration, &name) {
                    columns[kind].push((at, names.len()));
                    names.push(name);
                }
            }
            range.push(columns);
        }
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        let covariance = calibration.covariance(&known)?;
        let errors = names.into_iter().map(|name| CommonError { name, source: Source::Calibration }).collect();
        Ok(Self { errors, covariance, camera, range })
    }

    /// Columns of a frame that was corrected with this range model.
    pub(crate) fn columns(&self, range_model: Option<usize>) -> Columns {
        let of_model = range_model.and_then(|index| self.range.get(index));
        let [range, hyperbola] = of_model.cloned().unwrap_or_default();
        Columns { camera: self.camera.clone(), range, hyperbola, ..Columns::default() }
    }
}

fn is_uncertain(calibration: &Calibration, name: &str) -> bool {
    calibration.covariance(&[name]).is_ok_and(|covariance| covariance[(0, 0)] > 0.0)
}
