//! The drifts of two calibrations: their parameters and what they do.

use error_models::NamedParameter;
use nalgebra::DMatrix;
use pipeline::Result;
use range_io::calibration::{CalibratedDrift, Calibration};
use residual_tests::{DriftDifference, DriftSide, compare_drifts};
use serde::Serialize;

use crate::diff::refused;
use crate::diff::sides::Listed;

/// What stands before the names of a drift's parameters.
const PREFIX: &str = "warm-up ";

/// The drift of a warming camera in both files.
#[derive(Debug, Clone, Serialize)]
pub struct DriftLine {
    /// Largest difference.
    pub largest: DriftPlace,
    /// Largest difference in units of its band.
    pub clearest: DriftPlace,
    /// Root mean square of the difference over the times, temperatures and frame rates of both files, metre.
    pub rms_m: f64,
    /// Whether it leaves the band anywhere.
    pub significant: bool,
    /// The difference along the time at a medium temperature and frame rate.
    pub along_time: Vec<DriftPlace>,
}

/// A difference of drifts at a time, a temperature and a frame rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DriftPlace {
    /// Second minus first, metre.
    pub difference_m: f64,
    /// Half the width of the band that holds everywhere at once, metre.
    pub band_m: f64,
    /// Time since power-on, second, where a drift depends on it.
    pub time_s: Option<f64>,
    /// Temperature, degree Celsius, where a drift depends on it.
    pub temperature_c: Option<f64>,
    /// Frame rate since power-on, hertz, where a drift depends on it.
    pub rate_hz: Option<f64>,
}

/// Parameters that mean the same in both files: those of exponentials only where there are equally many.
pub(crate) fn common_parameters(first: &Calibration, second: &Calibration) -> Vec<String> {
    let models = [first, second].map(|calibration| calibration.warm_up.as_ref().map(|drift| &drift.model));
    let [Some(first), Some(second)] = models else { return Vec::new() };
    let same = first.transients.len() == second.transients.len();
    let names = second.parameter_names();
    let common = |name: &String| names.contains(name) && (same || ["cT", "cF", "tauF"].contains(&name.as_str()));
    first.parameter_names().into_iter().filter(common).collect()
}

/// The parameters of those names.
pub(crate) fn listed(calibration: &Calibration, names: &[String]) -> Vec<Listed> {
    let all = calibration.warm_up.iter().flat_map(CalibratedDrift::parameters);
    let kept = all.filter(|parameter| names.contains(&parameter.name));
    kept.map(|parameter| {
        let name = format!("{PREFIX}{}", parameter.name);
        Listed { in_file: name.clone(), name: name.clone(), parameter: NamedParameter { name, ..parameter } }
    })
    .collect()
}

/// Fills in what the matrix of the whole file does not know: variances and covariances of the drift.
pub(crate) fn add_covariance(calibration: &Calibration, names: &[&str], all: &mut DMatrix<f64>) -> Result<()> {
    let Some(drift) = &calibration.warm_up else { return Ok(()) };
    let own = drift.covariance()?;
    let known = drift.model.parameter_names();
    let place = |name: &str| known.iter().position(|known| name.strip_prefix(PREFIX) == Some(known));
    let places: Vec<Option<usize>> = names.iter().map(|name| place(name)).collect();
    for (i, row) in places.iter().enumerate() {
        for (j, column) in places.iter().enumerate() {
            if let (Some(row), Some(column)) = (row, column) {
                all[(i, j)] = own[(*row, *column)];
            }
        }
    }
    Ok(())
}

/// The comparison of the drifts; `None` where not both files have one.
pub(crate) fn line(first: &Calibration, second: &Calibration, level: f64) -> Result<Option<DriftLine>> {
    let (Some(one), Some(other)) = (&first.warm_up, &second.warm_up) else { return Ok(None) };
    let one = DriftSide { model: &one.model, covariance: one.covariance()? };
    let other = DriftSide { model: &other.model, covariance: other.covariance()? };
    let found = compare_drifts(&one, &other, level).map_err(|error| refused(&error))?;
    Ok(Some(DriftLine {
        largest: place(&found.largest),
        clearest: place(&found.clearest),
        rms_m: found.rms_m,
        significant: found.significant,
        along_time: found.along_time.iter().map(place).collect(),
    }))
}

fn place(at: &DriftDifference) -> DriftPlace {
    let DriftDifference { time_s, temperature_c, rate_hz, difference_m, band_m } = *at;
    DriftPlace { difference_m, band_m, time_s, temperature_c, rate_hz }
}

/// The drift of a file where the other has none.
pub(crate) fn alone(here: &Calibration, there: &Calibration) -> Option<String> {
    (here.warm_up.is_some() && there.warm_up.is_none()).then(|| "drift of the warming camera".to_owned())
}
