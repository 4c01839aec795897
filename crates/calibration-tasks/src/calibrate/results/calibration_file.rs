//! The outcome as `calibration.ron`.

use error_models::{NamedParameter, ParameterStatus};
use pipeline::Result;
use pipeline::survey::UNKNOWN_INTEGRATION_TIME_S;
use range_io::calibration::{Calibration, Correlation, Provenance, RangeCalibration, ValidSpan};
use self_calibration::{CalibratedParameter, CalibrationOutcome, Component, Verdict};

use crate::calibrate::results::certificate::extent;
use crate::calibrate::results::summary::CorrelationSummary;
use crate::calibrate::start::Start;

/// The calibration to write: estimated and held parameters with their quality, and what the start calibration knew of
/// the camera besides (noise, scattering, fixed pattern, warm-up). The drift of the last was taken off the observations, unless
/// that was declined: the offset d0 is that of the warm camera.
pub(crate) fn calibration(
    outcome: &CalibrationOutcome,
    start: &Start,
    survey: &str,
    method: &str,
) -> Result<Calibration> {
    let several = outcome.range_models.len() > 1;
    let mut range_models = Vec::new();
    for (index, (time, model)) in outcome.range_models.iter().enumerate().filter(|_| !start.light_alone) {
        let mut written = RangeCalibration::from_model(time.unwrap_or(UNKNOWN_INTEGRATION_TIME_S), model);
        written.modulation_hz = start.modulation.frequency_hz();
        for parameter in &mut written.parameters {
            let name = outcome_name(&parameter.name, index, *time);
            qualify(parameter, find(outcome, &name));
        }
        range_models.push(written);
    }
    let known = start.calibration.as_ref();
    let mut calibration = Calibration {
        format_version: Calibration::FORMAT_VERSION,
        camera: outcome.camera.format,
        parameters: camera_parameters(outcome)?,
        range_models,
        noise: known.and_then(|known| known.noise),
        range_noise: known.and_then(|known| known.range_noise),
        noise_parameters: known.map(|known| known.noise_parameters.clone()).unwrap_or_default(),
        scattering: known.and_then(|known| known.scattering.clone()),
        scattering_parameters: known.map(|known| known.scattering_parameters.clone()).unwrap_or_default(),
        fixed_pattern: known.and_then(|known| known.fixed_pattern.clone()),
        warm_up: known.and_then(|known| known.warm_up.clone()),
        correlation: None,
        span: span(outcome),
        provenance: Provenance {
            survey: survey.to_owned(),
            method: method.to_owned(),
            redundancy: usize::try_from(outcome.redundancy).ok(),
            sigma0: outcome.sigma0,
            created: None,
        },
    };
    calibration.correlation = correlation(outcome, &calibration, several);
    calibration.validate()?;
    Ok(calibration)
}

fn find<'a>(outcome: &'a CalibrationOutcome, name: &str) -> Option<&'a CalibratedParameter> {
    outcome.parameters.iter().find(|parameter| parameter.name == name)
}

/// Name of a range term in the outcome: the second and further integration times carry theirs.
fn outcome_name(name: &str, index: usize, time: Option<f64>) -> String {
    match time {
        Some(time) if index > 0 => format!("{name}@{time}"),
        _ => name.to_owned(),
    }
}

/// Gives a parameter of a model the quality that the outcome states: the posterior deviation, which is what the
/// residuals bear out, or the prior one where there is no redundancy.
fn qualify(parameter: &mut NamedParameter, quality: Option<&CalibratedParameter>) {
    let Some(quality) = quality else { return };
    parameter.status = quality.status;
    if quality.status == ParameterStatus::Estimated {
        let posterior = quality.sigma_posterior;
        parameter.sigma = if posterior.is_finite() { posterior } else { quality.sigma_prior };
    }
}

fn camera_parameters(outcome: &CalibrationOutcome) -> Result<Vec<NamedParameter>> {
    let models = error_models::ModelSet::default();
    let mut parameters = Calibration::from_models(&outcome.camera, &models, None)?.parameters;
    for parameter in &mut parameters {
        let quality = find(outcome, &parameter.name);
        qualify(parameter, quality);
    }
    Ok(parameters)
}

/// Correlations under the names that the file gives to its parameters.
fn correlation(outcome: &CalibrationOutcome, file: &Calibration, several: bool) -> Option<Correlation> {
    let CorrelationSummary { names, matrix } = CorrelationSummary::new(&outcome.estimated, &outcome.covariance);
    let times: Vec<Option<f64>> = outcome.range_models.iter().map(|(time, _)| *time).collect();
    let file_name = |name: &String| -> String {
        if !several || file.parameter(name).is_some() {
            return name.clone();
        }
        let at = |index: usize, time: Option<f64>| time.is_some_and(|t| index > 0 && name.ends_with(&format!("@{t}")));
        let index = times.iter().enumerate().position(|(index, time)| at(index, *time)).unwrap_or(0);
        format!("{}[{index}]", name.split('@').next().unwrap_or(name))
    };
    (!names.is_empty()).then(|| Correlation { names: names.iter().map(file_name).collect(), matrix })
}

/// Where ranges and amplitudes were observed that the calibration rests on.
fn span(outcome: &CalibrationOutcome) -> ValidSpan {
    let used = || {
        outcome.residuals.iter().filter(|quality| {
            quality.component == Component::Range && matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled)
        })
    };
    ValidSpan {
        range_m: extent(used().map(|quality| quality.observed)),
        amplitude: extent(used().map(|quality| quality.amplitude)),
        integration_time_s: extent(outcome.range_models.iter().filter_map(|(time, _)| *time)),
        temperature_c: None,
    }
}
