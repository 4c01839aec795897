//! Every figure of an estimation of noise, by name.

use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged};
use error_models::{AmplitudeScale, ParameterStatus, RangeNoise, SharedNoise};
use sensor_noise::{SigmaCheck, SigmaVerdict, VarianceEstimator, VarianceFit};
use serde::Serialize;

use crate::noise::NoiseRequest;
use crate::noise::estimate::{Estimate, NoiseTerm};

/// Random errors and how well they are known.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseSummary {
    /// The survey.
    pub survey: String,
    /// The calibration that the noise was added to.
    pub calibration: String,
    /// What has the noise: `samples` or `ranges`.
    pub noise_of: &'static str,
    /// What the camera's amplitude is: `as received`, `times squared range`, or that it shows none.
    pub amplitude_scale: &'static str,
    /// What neighbouring pixels have in common of the noise of ranges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shared: Option<SharedSummary>,
    /// Its parameters.
    pub parameters: Vec<NoiseParameter>,
    /// Correlation of the two estimated variances; `None` where one is held.
    pub correlation: Option<f64>,
    /// How variances were taken, and why.
    pub variances: &'static str,
    /// Standard deviation of unit weight of the class means.
    pub sigma0: f64,
    /// Class means less unknowns.
    pub redundancy: i64,
    /// Root mean square of the relative differences between variances observed and modelled.
    pub misfit: f64,
    /// Probability of a misfit as large, were no variance modelled worse than to 5 %.
    pub misfit_p_value: f64,
    /// Repeated values.
    pub values: usize,
    /// Of so many pixels the values of one were taken: 1 for all, more where all stations together have too many.
    pub every: usize,
    /// Share of them that scatter as no noise does; left out.
    pub moved_share: f64,
    /// Each station.
    pub stations: Vec<NoiseStation>,
    /// Variances by light (samples) or amplitude (ranges).
    pub bins: Vec<NoiseBin>,
    /// Whether the sigma that the noise gives to pixels is true, in words.
    pub sigma_verdict: String,
    /// Whether it is, to a tenth.
    pub sigma_holds: bool,
    /// Variance of the pixels over the frames, over the variance that they are given.
    pub sigma_ratio: f64,
    /// The same by amplitude.
    pub sigma_bins: Vec<SigmaBinSummary>,
    /// What a reader should know before the noise is used.
    pub doubts: Vec<Doubt>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

/// One parameter of the noise.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseParameter {
    /// Its name.
    pub name: String,
    /// Its unit; `amplitude` stands for the unit of samples and amplitudes.
    pub unit: String,
    /// Estimate.
    pub value: f64,
    /// Standard deviation; zero where the value was held.
    pub sigma: f64,
    /// Whether it was held.
    pub held: bool,
}

/// Whether the frames of a station are alike.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseStation {
    /// Station.
    pub station: String,
    /// Frames.
    pub frames: usize,
    /// Variance from successive differences over variance about the mean; `None` below three frames.
    pub drift_ratio: Option<f64>,
    /// Its standard deviation without a drift.
    pub drift_ratio_sigma: Option<f64>,
    /// Whether it is below 1 significantly and noticeably.
    pub drifts: bool,
    /// Scatter of each frame over the noise, both as variances.
    pub frame_factors: Vec<f64>,
}

/// Variances of values of like light.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseBin {
    /// Mean sample, or received amplitude.
    pub light: f64,
    /// Standard deviation observed, sample units or metre.
    pub sigma_observed: f64,
    /// Standard deviation modelled.
    pub sigma_modelled: f64,
    /// Values.
    pub values: usize,
}

/// Standardised residuals of pixels of like amplitude.
#[derive(Debug, Clone, Serialize)]
pub struct SigmaBinSummary {
    /// Smallest and largest amplitude.
    pub amplitude: [f64; 2],
    /// Values.
    pub values: usize,
    /// Variance observed over variance claimed.
    pub ratio: f64,
    /// Where it lies in 999 of 1000 cases, over all classes, if sigma is true.
    pub limits: [f64; 2],
}

/// What neighbouring pixels have in common of the noise.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SharedSummary {
    /// Part of a pixel's variance.
    pub share: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Width of a neighbourhood, pixel.
    pub width_px: f64,
}

fn shared(estimate: &Estimate) -> Option<SharedSummary> {
    match estimate.term {
        NoiseTerm::Ranges(RangeNoise { shared: Some(SharedNoise { share, width_px }), .. }) => {
            Some(SharedSummary { share, sigma: estimate.shared_sigma?, width_px })
        }
        _ => None,
    }
}

impl NoiseSummary {
    pub(crate) fn new(request: &NoiseRequest, calibration: &str, estimate: &Estimate) -> Self {
        let fit = &estimate.fit;
        let [[a, b], [_, d]] = fit.covariance;
        let of_samples = matches!(estimate.term, NoiseTerm::Samples(_));
        let bin = |bin: &sensor_noise::VarianceBin| NoiseBin {
            light: if of_samples { bin.regressor } else { bin.regressor.powf(-0.5) },
            sigma_observed: bin.variance.sqrt(),
            sigma_modelled: (fit.slope * bin.regressor + fit.level).sqrt(),
            values: bin.values,
        };
        Self {
            survey: request.survey.display().to_string(),
            calibration: calibration.to_owned(),
            noise_of: if of_samples { "samples" } else { "ranges" },
            amplitude_scale: match estimate.term {
                NoiseTerm::Ranges(RangeNoise { amplitude_scale: AmplitudeScale::TimesSquaredRange, .. }) => {
                    "times squared range"
                }
                NoiseTerm::Ranges(RangeNoise { amplitude_scale: AmplitudeScale::InverseSquaredRange, .. }) => {
                    "not shown: one over the squared range stands for it"
                }
                _ => "as received",
            },
            shared: shared(estimate),
            parameters: estimate.parameters.iter().map(NoiseParameter::new).collect(),
            correlation: Some(b / (a * d).sqrt()).filter(|correlation| correlation.is_finite()),
            variances: match fit.estimator {
                VarianceEstimator::AboutMean => "about the mean of the frames: nothing drifts",
                VarianceEstimator::SuccessiveDifferences => {
                    "from successive differences: the frames drift, and these hide it"
                }
            },
            sigma0: fit.sigma0,
            redundancy: fit.redundancy,
            misfit: fit.misfit,
            misfit_p_value: fit.misfit_p_value,
            values: fit.values,
            every: fit.every,
            moved_share: fit.moved as f64 / fit.values as f64,
            stations: fit.steadiness.iter().map(NoiseStation::new).collect(),
            bins: fit.bins.iter().map(bin).collect(),
            sigma_verdict: estimate.check.verdict.to_string(),
            sigma_holds: matches!(estimate.check.verdict, SigmaVerdict::True | SigmaVerdict::Close),
            sigma_ratio: estimate.check.ratio,
            sigma_bins: sigma_bins(&estimate.check),
            doubts: misfit_doubt(fit).into_iter().collect(),
            seconds: 0.0,
            out: request.out.clone(),
        }
    }
}

/// Variances that do not follow the line: chance alone does that once in a thousand estimates.
const LEAST_P_VALUE: f64 = 1e-3;

fn misfit_doubt(fit: &VarianceFit) -> Option<Doubt> {
    (fit.misfit_p_value < LEAST_P_VALUE).then(|| {
        let words = format!(
            "the scatter of the pixels does not follow the model: its variances are off by {:.1} % (rms over {} classes of \
             light), beyond the 5 % that would do no harm; sigma is wrong by about half of that. See the figure of standard \
             deviation against light, and give more frames or leave out what the camera treats apart",
            100.0 * fit.misfit,
            fit.bins.len()
        );
        Doubt::new(DoubtKind::Noise, words)
    })
}

impl Judged for NoiseSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

impl NoiseParameter {
    fn new(parameter: &error_models::NamedParameter) -> Self {
        Self {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            value: parameter.value,
            sigma: parameter.sigma,
            held: parameter.status == ParameterStatus::Held,
        }
    }
}

impl NoiseStation {
    fn new(steadiness: &sensor_noise::Steadiness) -> Self {
        let known = |value: f64| Some(value).filter(|value| value.is_finite());
        Self {
            station: steadiness.station.clone(),
            frames: steadiness.frames,
            drift_ratio: known(steadiness.ratio),
            drift_ratio_sigma: known(steadiness.ratio_sigma),
            drifts: steadiness.drifts,
            frame_factors: steadiness.frame_factors.clone(),
        }
    }
}

fn sigma_bins(check: &SigmaCheck) -> Vec<SigmaBinSummary> {
    let bin = |bin: &sensor_noise::SigmaBin| SigmaBinSummary {
        amplitude: bin.amplitude,
        values: bin.values,
        ratio: bin.ratio,
        limits: bin.limits,
    };
    check.bins.iter().map(bin).collect()
}
