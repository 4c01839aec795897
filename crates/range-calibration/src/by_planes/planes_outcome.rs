//! What captures of planes gave.

use adjust::{Diagnosis, Scale, Solution};
use error_models::{NamedParameter, RangeErrorModel, parameter_unit};
use nalgebra::{DMatrix, Isometry3};

use crate::by_planes::planes_problem::{Problem, Solved};
use crate::{Plane, Result};

/// Range terms estimated together with planes, with their quality.
#[derive(Debug)]
pub struct PlaneCalibration {
    model: RangeErrorModel,
    solution: Solution,
    planes: Vec<AdjustedPlane>,
    captures: Vec<CaptureQuality>,
    observations: usize,
    unknowns: usize,
}

/// A plane after the adjustment.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedPlane {
    /// `plane N` in the world, or `plane of STATION` in the camera frame of a capture without a pose.
    pub name: String,
    /// The plane.
    pub plane: Plane,
    /// Standard deviations of two tilts about axes in the plane, radian; prior-scaled, zero where it was given.
    pub tilt_sigma_rad: [f64; 2],
    /// Standard deviation of its distance where it was seen, metre; prior-scaled, zero where it was given.
    pub distance_sigma_m: f64,
}

/// One capture after the adjustment.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureQuality {
    /// Name of the station.
    pub name: String,
    /// Position of its plane in [`PlaneCalibration::planes`].
    pub plane: usize,
    /// Pose, adjusted where it was weighted; `None` where there is none.
    pub world_from_camera: Option<Isometry3<f64>>,
    /// Pixels used.
    pub used: usize,
    /// Pixels left out for their residual.
    pub rejected: usize,
    /// Root mean square of the residuals of the pixels used, in their standard deviations.
    pub rms_standardised: f64,
}

impl PlaneCalibration {
    /// The model to correct frames with. Its span is that of the observed ranges used.
    pub fn model(&self) -> &RangeErrorModel {
        &self.model
    }

    /// All parameters of the model with their standard deviations of the chosen scale, held ones with zero.
    pub fn parameters(&self, scale: Scale) -> Result<Vec<NamedParameter>> {
        let (names, covariance) = (self.estimated_names(), self.covariance(scale)?);
        let mut parameters = self.model.to_parameters();
        for parameter in &mut parameters {
            if let Some(column) = names.iter().position(|name| **name == parameter.name) {
                let sigma = covariance[(column, column)].sqrt();
                *parameter = NamedParameter::estimated(&parameter.name, parameter.value, sigma)?;
            }
        }
        Ok(parameters)
    }

    /// Names of the estimated range terms, in the order of [`Self::covariance`].
    pub fn estimated_names(&self) -> &[String] {
        let names = self.solution.unknown_names();
        &names[..names.iter().take_while(|name| parameter_unit(name).is_some()).count()]
    }

    /// Covariance matrix of the estimated range terms, what is unknown of planes and poses taken into account.
    pub fn covariance(&self, scale: Scale) -> Result<DMatrix<f64>> {
        let count = self.estimated_names().len();
        let factor = match scale {
            Scale::Prior => 1.0,
            Scale::Posterior => self.sigma0().powi(2),
        };
        // The terms are the first block.
        Ok(self.solution.covariance_matrix(Scale::Prior)?.view((0, 0), (count, count)) * factor)
    }

    /// The planes: first seen, first.
    pub fn planes(&self) -> &[AdjustedPlane] {
        &self.planes
    }

    /// The captures in the order given.
    pub fn captures(&self) -> &[CaptureQuality] {
        &self.captures
    }

    /// Pixels used, and weighted components of poses.
    pub fn observations(&self) -> usize {
        self.observations
    }

    /// Observations minus unknowns; positive.
    pub fn redundancy(&self) -> usize {
        self.observations - self.unknowns
    }

    /// Posterior standard deviation of unit weight: 1 where the given standard deviations are right.
    ///
    /// Pixels of one frame share what is not modelled; where this is well above 1, the deviations of the parameters are
    /// too small even when scaled with it.
    pub fn sigma0(&self) -> f64 {
        (self.solution.vtpv() / self.redundancy() as f64).sqrt()
    }

    /// The weakest combination of parameters, and the pairs with a correlation of at least `limit`.
    pub fn diagnosis(&self, limit: f64) -> Diagnosis {
        self.solution.diagnosis(limit)
    }
}

impl Problem<'_> {
    /// Reads the solution.
    pub(crate) fn outcome(&self, solved: Solved) -> Result<PlaneCalibration> {
        let mut model = self.terms.model.clone();
        model.set_parameter_values(solved.solution.values(solved.terms)?)?;
        model.hyperbola = self.hyperbola;
        model.range_span_m = Some(self.range_span_m());
        model.validate()?;
        let planes = (0..self.charts.len()).map(|chart| self.adjusted_plane(&solved, chart)).collect::<Result<_>>()?;
        let captures = self.capture_qualities(&solved)?;
        let (observations, unknowns) = (self.observations(&self.pixels), self.unknowns());
        Ok(PlaneCalibration { model, planes, captures, observations, unknowns, solution: solved.solution })
    }

    fn adjusted_plane(&self, solved: &Solved, index: usize) -> Result<AdjustedPlane> {
        let (chart, block) = (&self.charts[index], solved.planes[index]);
        let sigma = solved.solution.standard_deviations(block, Scale::Prior)?;
        Ok(AdjustedPlane {
            name: chart.name.clone(),
            plane: chart.chart.plane(solved.solution.values(block)?)?,
            tilt_sigma_rad: [sigma[0], sigma[1]],
            distance_sigma_m: sigma[2],
        })
    }

    fn capture_qualities(&self, solved: &Solved) -> Result<Vec<CaptureQuality>> {
        let residuals = self.residuals(&self.pixels, solved)?;
        let mut qualities = Vec::with_capacity(self.captures.len());
        for (index, capture) in self.captures.iter().enumerate() {
            let pixels = &self.pixels[index];
            let pose = solved.pose(index, capture)?;
            let squares = residuals[index].iter().zip(&pixels.used).filter(|(_, used)| **used);
            let sum: f64 = squares.map(|(residual, _)| residual * residual).sum();
            qualities.push(CaptureQuality {
                name: capture.name.clone(),
                plane: self.chart_of[index],
                world_from_camera: capture.world_from_camera.map(|_| pose),
                used: pixels.used_count(),
                rejected: pixels.len() - pixels.used_count(),
                rms_standardised: (sum / pixels.used_count() as f64).sqrt(),
            });
        }
        Ok(qualities)
    }

    /// Smallest and largest observed range used, metre.
    fn range_span_m(&self) -> [f64; 2] {
        let used = self.pixels.iter().flat_map(|pixels| pixels.observed_m.iter().zip(&pixels.used));
        let used = used.filter(|(_, used)| **used).map(|(range, _)| f64::from(*range));
        used.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], range| [low.min(range), high.max(range)])
    }
}
