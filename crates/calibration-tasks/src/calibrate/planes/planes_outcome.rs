//! What planes gave, in the form of a network's outcome.

use error_models::{AmplitudeHyperbola, ModelSet, NamedParameter, ParameterStatus, RangeErrorModel};
use nalgebra::{DMatrix, DVector};
use range_calibration::{PlaneCalibration, RangeCalibration, RangeDifference, Scale};
use range_io::calibration::Calibration;
use self_calibration::{
    CalibratedParameter, CalibrationOutcome, Component, GroupQuality, Method, ObservationQuality, Verdict,
};

use crate::calibrate::start::Start;

/// Gross error in standard deviations of its residual that a test with a level of 0.1 % finds with a power of 80 %.
const NONCENTRALITY: f64 = 4.13;

/// A range difference and where it was seen.
pub(crate) struct Sample {
    pub(crate) station: String,
    pub(crate) plane: String,
    pub(crate) pixel: [f64; 2],
    /// Against the reference range with the known drift on it.
    pub(crate) difference: RangeDifference,
    /// That drift, metre.
    pub(crate) drift_m: f64,
}

/// An estimate with its samples.
pub(crate) struct Found {
    model: RangeErrorModel,
    prior: Vec<NamedParameter>,
    posterior: Vec<NamedParameter>,
    estimated: Vec<String>,
    covariance: DMatrix<f64>,
    residuals: Vec<ObservationQuality>,
    observations: usize,
    redundancy: i64,
    vtpv: f64,
    sigma0: Option<f64>,
    diagnosis: Vec<String>,
}

impl Found {
    /// From differences to known planes.
    pub(crate) fn of_differences(
        samples: Vec<Sample>,
        estimate: &RangeCalibration,
    ) -> Result<Self, range_calibration::Error> {
        let covariance = estimate.covariance(Scale::Prior)?;
        let sigma0 = estimate.sigma0();
        let mut vtpv = 0.0;
        let mut residuals = Vec::with_capacity(samples.len());
        for (sample, residual) in samples.into_iter().zip(estimate.residuals_m()) {
            vtpv += (residual / sample.difference.sigma_m).powi(2);
            let row = design_row(estimate, &sample.difference)?;
            // The redundancy number is 1 - a Q aᵀ / σ² with the design row a.
            let redundancy = 1.0 - row.dot(&(&covariance * &row)) / sample.difference.sigma_m.powi(2);
            let mut quality = quality(sample, *residual);
            quality.redundancy_number = redundancy;
            quality.standardised = residual / (sigma0.unwrap_or(f64::NAN) * quality.sigma * redundancy.sqrt());
            quality.smallest_detectable = NONCENTRALITY * quality.sigma / redundancy.sqrt();
            residuals.push(quality);
        }
        Ok(Self {
            model: estimate.model().clone(),
            prior: estimate.parameters(Scale::Prior)?,
            posterior: estimate.parameters(Scale::Posterior)?,
            estimated: estimate.estimated_names().to_vec(),
            covariance,
            observations: residuals.len(),
            residuals,
            redundancy: estimate.redundancy(),
            vtpv,
            sigma0,
            diagnosis: Vec::new(),
        })
    }

    /// From planes that were found together with the terms. A pixel beyond `rejection` standard deviations counts as
    /// rejected; how much each pixel controls itself is not known.
    pub(crate) fn of_planes(
        samples: Vec<Sample>,
        estimate: &PlaneCalibration,
        rejection: Option<f64>,
    ) -> Result<Self, range_calibration::Error> {
        let model = estimate.model();
        let sigma0 = estimate.sigma0();
        let residual = |sample: Sample| {
            let d = &sample.difference;
            let correction = model.correction(d.observed_range_m, d.x_mm, d.y_mm, d.amplitude).total_m();
            let residual = d.observed_range_m - d.reference_range_m - correction;
            let mut quality = quality(sample, residual);
            let gross = rejection.is_some_and(|limit| residual.abs() > limit * sigma0 * quality.sigma);
            quality.verdict = if gross { Verdict::Rejected } else { Verdict::Used };
            quality
        };
        let planes = estimate.planes().iter().filter(|plane| plane.distance_sigma_m > 0.0);
        let diagnosis = planes.map(|plane| {
            let [first, second] = plane.tilt_sigma_rad.map(f64::to_degrees);
            format!(
                "{} was found to {:.2} mm and {first:.4} and {second:.4} degrees",
                plane.name,
                1e3 * plane.distance_sigma_m
            )
        });
        Ok(Self {
            model: model.clone(),
            prior: estimate.parameters(Scale::Prior)?,
            posterior: estimate.parameters(Scale::Posterior)?,
            estimated: estimate.estimated_names().to_vec(),
            covariance: estimate.covariance(Scale::Prior)?,
            residuals: samples.into_iter().map(residual).collect(),
            observations: estimate.observations(),
            redundancy: i64::try_from(estimate.redundancy()).unwrap_or(i64::MAX),
            vtpv: sigma0 * sigma0 * estimate.redundancy() as f64,
            sigma0: Some(sigma0),
            diagnosis: diagnosis.collect(),
        })
    }

    /// Residuals by capture and pixel.
    pub(crate) fn residuals(&self) -> &[ObservationQuality] {
        &self.residuals
    }

    /// Standard deviation of unit weight.
    pub(crate) fn sigma0(&self) -> Option<f64> {
        self.sigma0
    }

    /// The terms found.
    pub(crate) fn model(&self) -> &RangeErrorModel {
        &self.model
    }

    /// In the form that tables, summary and report are made from.
    pub(crate) fn outcome(self, start: &Start, time: Option<f64>) -> CalibrationOutcome {
        let unknowns = usize::try_from(self.observations as i64 - self.redundancy).unwrap_or(0);
        let used: Vec<&ObservationQuality> = self.residuals.iter().filter(|q| q.verdict == Verdict::Used).collect();
        let squares: f64 = used.iter().map(|quality| quality.residual.powi(2)).sum();
        let group = GroupQuality {
            name: Component::Range.name().to_owned(),
            observations: used.len(),
            redundancy: self.redundancy as f64,
            rms: (squares / used.len().max(1) as f64).sqrt(),
            sigma0: self.sigma0,
        };
        let (n, k) = (self.observations as f64, unknowns as f64);
        CalibrationOutcome {
            method: Method::Laboratory,
            camera: start.camera,
            range_models: vec![(time, self.model)],
            parameters: parameters(start, self.prior, &self.posterior),
            estimated: self.estimated,
            first_order_covariance: self.covariance.clone(),
            covariance: self.covariance,
            stations: Vec::new(),
            targets: Vec::new(),
            residuals: self.residuals,
            groups: vec![group],
            decisions: Vec::new(),
            diagnosis: self.diagnosis,
            doubts: Vec::new(),
            causes: Vec::new(),
            unestimated: Vec::new(),
            observations: self.observations,
            unknowns,
            datum_defect: 0,
            redundancy: self.redundancy,
            vtpv: self.vtpv,
            sigma0: self.sigma0,
            aic: self.vtpv + 2.0 * k,
            bic: self.vtpv + k * n.ln(),
            trace: Vec::new(),
        }
    }
}

/// Camera parameters are held, range terms as the estimate has them.
fn parameters(start: &Start, prior: Vec<NamedParameter>, posterior: &[NamedParameter]) -> Vec<CalibratedParameter> {
    let camera = Calibration::from_models(&start.camera, &ModelSet::default(), None);
    let camera = camera.map_or_else(|_| Vec::new(), |calibration| calibration.parameters);
    let all = camera.into_iter().chain(prior);
    let calibrated = |parameter: NamedParameter| {
        let scaled = posterior.iter().find(|other| other.name == parameter.name);
        let estimated = parameter.status == ParameterStatus::Estimated;
        CalibratedParameter {
            sigma_posterior: scaled.map_or(0.0, |scaled| scaled.sigma),
            sigma_prior: if estimated { parameter.sigma } else { 0.0 },
            name: parameter.name,
            value: parameter.value,
            unit: parameter.unit,
            status: parameter.status,
            significance_p: f64::NAN,
        }
    };
    all.map(calibrated).collect()
}

/// A sample with its residual; what further quality is known is put in by the caller.
fn quality(sample: Sample, residual: f64) -> ObservationQuality {
    let difference = sample.difference;
    ObservationQuality {
        station: sample.station,
        target: sample.plane,
        component: Component::Range,
        observed: difference.observed_range_m,
        sigma: difference.sigma_m,
        residual,
        redundancy_number: f64::NAN,
        standardised: f64::NAN,
        smallest_detectable: f64::NAN,
        verdict: Verdict::Used,
        pixel: sample.pixel,
        range_m: difference.observed_range_m,
        amplitude: difference.amplitude,
        uncorrected_m: difference.observed_range_m - difference.reference_range_m + sample.drift_m,
    }
}

/// Derivatives of the correction by the estimated parameters.
fn design_row(
    estimate: &RangeCalibration,
    difference: &RangeDifference,
) -> Result<DVector<f64>, range_calibration::Error> {
    let model = estimate.model();
    let mut terms = vec![0.0; model.parameter_count()];
    model.design_row_into(difference.observed_range_m, difference.x_mm, difference.y_mm, &mut terms)?;
    let hyperbola = model.hyperbola.and_then(|hyperbola| hyperbola.jacobian(difference.amplitude));
    let hyperbola = hyperbola.map_or([0.0; 3], |jacobian| jacobian.coefficients);
    let names = model.parameter_names().into_iter().chain(AmplitudeHyperbola::NAMES.map(str::to_owned));
    let named: Vec<(String, f64)> = names.zip(terms.into_iter().chain(hyperbola)).collect();
    let value = |name: &String| named.iter().find(|(known, _)| known == name).map_or(0.0, |(_, value)| *value);
    Ok(DVector::from_iterator(estimate.estimated_names().len(), estimate.estimated_names().iter().map(value)))
}
