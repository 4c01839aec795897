//! Calibration of the range terms from captures of planes whose place is not known (Sect. 5.3, Eq. 17).

use camera_model::Camera;
use nalgebra::{Isometry3, Matrix6};
use range_image::RangeFrame;

use crate::by_planes::planes_problem::Problem;
use crate::{DifferenceOptions, Error, Plane, PlaneCalibration, RangeTermOptions, Result};

/// One frame that shows a plane.
#[derive(Debug, Clone)]
pub struct PlaneCapture<'a> {
    /// Name of the station, for messages.
    pub name: String,
    /// Observed, unwrapped ranges.
    pub frame: &'a RangeFrame,
    /// Pose at the exposure. `None` where it is not known: then the plane is one of its own, in the camera frame, as no
    /// pose can be told from one plane (it may slide along the plane and turn about its normal).
    pub world_from_camera: Option<Isometry3<f64>>,
    /// Covariance of the pose's tangent step `[dt world m, dθ camera rad]`, with which it is adjusted; `None`: it is held.
    pub covariance: Option<Matrix6<f64>>,
    /// What the ranges are known to have drifted by (Sect. 4.7), metre: taken off as d0 is. Zero for a warm camera.
    pub drift_m: f64,
    /// Position of the plane in the list of planes; without meaning where the pose is not known.
    pub plane: usize,
}

/// Options of [`calibrate_planes`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneCalibrationOptions {
    /// Range terms. A hyperbola is held or not there. Default: that of [`RangeTermOptions`].
    pub terms: RangeTermOptions,
    /// Which pixels are used. Default: every fourth column and row, and otherwise as for differences.
    pub pixels: DifferenceOptions,
    /// Pixels whose residual is larger than so many standard deviations are left out (edges, things in front of the
    /// plane); the standard deviation is that of the scatter found, from its median. `None`: all are used. Default 4.
    pub rejection: Option<f64>,
}

impl Default for PlaneCalibrationOptions {
    fn default() -> Self {
        let pixels = DifferenceOptions { step: 4, ..DifferenceOptions::default() };
        Self { terms: RangeTermOptions::default(), pixels, rejection: Some(4.0) }
    }
}

/// Estimates the range terms of one modulation frequency together with the planes that the captures show.
///
/// - A plane given in `planes` is held; `None` there is an unknown plane in the world, shared by all captures that name
///   it and have a pose.
/// - A capture without a pose has an unknown plane of its own, in the camera frame.
///
/// `camera` is held: its rays are taken as they are. All pixels count in one adjustment, reduced capture by capture to as
/// many numbers as there are unknowns.
///
/// # Errors
/// [`Error::PlanesNotDetermined`] where the captures cannot tell parameters apart: the offset d0 and the distance of an
/// unknown plane differ by the curvature over the field of view alone. [`Error::NoPlane`] where a capture shows none;
/// [`Error::UnknownPlane`], [`Error::HyperbolaNotHeld`], [`Error::TooFewDifferences`], [`Error::NothingToEstimate`];
/// [`Error::Model`] if the estimated terms are no usable model; [`Error::Adjust`] where the adjustment did not converge.
pub fn calibrate_planes(
    captures: &[PlaneCapture<'_>],
    planes: &[Option<Plane>],
    camera: &Camera,
    ambiguity_interval_m: f64,
    options: &PlaneCalibrationOptions,
) -> Result<PlaneCalibration> {
    let mut problem = Problem::new(captures, planes, camera, ambiguity_interval_m, options)?;
    let solved = problem.solve_without_gross_errors()?;
    let diagnosis = solved.solution.diagnosis(1.0);
    if diagnosis.weakest_inflation > options.terms.largest_inflation {
        let combination = diagnosis.weakest.to_string();
        return Err(Error::PlanesNotDetermined { combination, inflation: diagnosis.weakest_inflation });
    }
    problem.outcome(solved)
}

impl PlaneCalibrationOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        self.terms.validate()?;
        self.pixels.validate()?;
        match self.rejection {
            Some(value) if !(value.is_finite() && value >= 2.0) => Err(Error::OutOfDomain {
                name: "rejection",
                value,
                expected: "a multiple of the standard deviation, 2 or more: below, many good pixels go",
            }),
            _ => Ok(()),
        }
    }
}
