//! Every figure of an estimation of a drift, by name.

use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged};
use error_models::WarmUp;
use serde::Serialize;
use warm_up::{DriftEstimate, DriftVerdict, TransientTest};

use crate::warm_up::series::Series;
use crate::warm_up::{ReferenceUse, WarmUpRequest};

/// A drift and how well it is known.
#[derive(Debug, Clone, Serialize)]
pub struct WarmUpSummary {
    /// The survey.
    pub survey: String,
    /// The calibration that the drift was added to; `None` where none was asked for.
    pub calibration: Option<String>,
    /// When the camera was switched on, and who says so.
    pub power_on: String,
    /// Whose change of range it is: that of the scene, of the optical reference, or of the one less the other.
    pub change_of: &'static str,
    /// The verdict in words.
    pub verdict: String,
    /// Whether the drift stays within the tolerance at the end.
    pub stable: bool,
    /// From when on it does, or is expected to, second since power-on.
    pub stable_after_s: f64,
    /// What block means deviate by now; `None` where the drift goes on.
    pub within_m: Option<f64>,
    /// Modelled drift at the end of a capture that is not stable yet, metre.
    pub remaining_m: Option<f64>,
    /// Drift within which the camera counts as stable, metre.
    pub tolerance_m: f64,
    /// Parameters of the drift; none where there is no drift.
    pub parameters: Vec<WarmUpParameter>,
    /// Correlations of the parameters.
    pub correlation: Vec<Vec<f64>>,
    /// Temperature at which its part of the drift is zero, degree Celsius.
    pub reference_temperature_c: Option<f64>,
    /// Frame rates, phase by phase.
    pub phases: Vec<WarmUpPhase>,
    /// Frame rate at which its part of the drift is zero, hertz: that of the first phase.
    pub reference_rate_hz: Option<f64>,
    /// Whether the drift follows the frame rate; `None` where there is one rate only, which does not tell.
    pub rate_test: Option<WarmUpRateTest>,
    /// Times since power-on that were seen, second.
    pub time_span_s: [f64; 2],
    /// Frames.
    pub frames: usize,
    /// Pixels that tell the change.
    pub pixels: usize,
    /// Share of them that wander from the change of all; they take part.
    pub moved_share: f64,
    /// How many exponentials, test by test.
    pub tests: Vec<WarmUpTest>,
    /// Correlation of neighbouring blocks that the deviations allow for.
    pub autocorrelation: f64,
    /// How much more blocks scatter than the noise of the pixels says.
    pub sigma0: f64,
    /// Blocks less unknowns.
    pub redundancy: i64,
    /// What a reader should know before using the result.
    pub doubts: Vec<Doubt>,
    /// What the figures do not show by themselves, and nothing to doubt.
    pub notes: Vec<String>,
    /// The block means.
    pub blocks: Vec<WarmUpBlock>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

/// One parameter of a drift.
#[derive(Debug, Clone, Serialize)]
pub struct WarmUpParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Estimate.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
}

/// A stretch of one frame rate.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct WarmUpPhase {
    /// Its begin, second since power-on.
    pub since_s: f64,
    /// Frames a second.
    pub rate_hz: f64,
    /// Frames in it.
    pub frames: usize,
}

/// Whether the drift follows the frame rate.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct WarmUpRateTest {
    /// Its best time constant, second.
    pub time_constant_s: Option<f64>,
    /// Probability of so much where it does not.
    pub p_value: f64,
    /// Whether the model has it.
    pub taken: bool,
}

/// Whether there is one exponential more.
#[derive(Debug, Clone, Serialize)]
pub struct WarmUpTest {
    /// Exponentials that it is tested beside.
    pub beside: usize,
    /// Its best time constant, second.
    pub time_constant_s: Option<f64>,
    /// Probability of so much where there is none.
    pub p_value: f64,
    /// Whether the model has it.
    pub taken: bool,
}

/// The mean over one stretch of time.
#[derive(Debug, Clone, Serialize)]
pub struct WarmUpBlock {
    /// Time since power-on, second.
    pub time_s: f64,
    /// Change of range against the warm camera, metre.
    pub change_m: f64,
    /// What the model leaves of it, metre.
    pub residual_m: f64,
    /// Temperature, degree Celsius.
    pub temperature_c: Option<f64>,
    /// Frames in it.
    pub frames: usize,
}

impl WarmUpSummary {
    pub(crate) fn new(
        request: &WarmUpRequest,
        series: &Series,
        estimate: &DriftEstimate,
        calibration: Option<&String>,
    ) -> Self {
        let (stable, stable_after_s, within_m, remaining_m) = match estimate.verdict {
            DriftVerdict::Stable { after_s, within_m } => (true, after_s, Some(within_m), None),
            DriftVerdict::StillDrifts { expected_after_s, remaining_m } => {
                (false, expected_after_s, None, Some(remaining_m))
            }
        };
        let correlation = estimate.correlation();
        Self {
            survey: request.survey.display().to_string(),
            calibration: calibration.cloned(),
            power_on: series.power_on.clone(),
            change_of: match request.reference {
                ReferenceUse::Ignore => "scene",
                ReferenceUse::Subtract => "scene less optical reference",
                ReferenceUse::Instead => "optical reference",
            },
            verdict: estimate.verdict.to_string(),
            stable,
            stable_after_s,
            within_m,
            remaining_m,
            tolerance_m: estimate.tolerance_m,
            parameters: parameters(estimate),
            correlation: correlation.row_iter().map(|row| row.iter().copied().collect()).collect(),
            reference_temperature_c: estimate.model.temperature.map(|part| part.reference_c),
            phases: phases(series, estimate),
            reference_rate_hz: estimate.model.frame_rate.map(|part| part.reference_hz),
            rate_test: estimate.rate_test.map(|test| WarmUpRateTest {
                time_constant_s: test.time_constant_s,
                p_value: test.p_value,
                taken: test.taken,
            }),
            time_span_s: estimate.model.time_span_s.unwrap_or([f64::NAN; 2]),
            frames: series.samples.len(),
            pixels: series.pixels,
            moved_share: series.moved_share,
            tests: estimate.tests.iter().map(WarmUpTest::new).collect(),
            autocorrelation: estimate.autocorrelation,
            sigma0: estimate.sigma0,
            redundancy: estimate.redundancy,
            doubts: doubts(request, estimate),
            notes: notes(estimate),
            blocks: blocks(estimate),
            seconds: 0.0,
            out: request.out.clone(),
        }
    }
}

fn parameters(estimate: &DriftEstimate) -> Vec<WarmUpParameter> {
    let values = estimate.model.parameter_values().into_iter().zip(estimate.deviations());
    let named = estimate.model.parameter_names().into_iter().zip(values);
    named
        .map(|(name, (value, sigma))| WarmUpParameter {
            unit: WarmUp::parameter_unit(&name).unwrap_or("1"),
            name,
            value,
            sigma,
        })
        .collect()
}

/// Phases without frames, as before the first one, are left out.
fn phases(series: &Series, estimate: &DriftEstimate) -> Vec<WarmUpPhase> {
    let phases = estimate.rates.phases();
    let ends = phases.iter().skip(1).map(|phase| phase.since_s).chain([f64::INFINITY]);
    let mut begin = 0;
    let with_frames = phases.iter().zip(ends).map(|(phase, end_s)| {
        let end = series.samples.partition_point(|sample| sample.time_s < end_s);
        let frames = end - std::mem::replace(&mut begin, end);
        WarmUpPhase { since_s: phase.since_s, rate_hz: phase.rate_hz, frames }
    });
    with_frames.filter(|phase| phase.frames > 0).collect()
}

fn blocks(estimate: &DriftEstimate) -> Vec<WarmUpBlock> {
    let blocks = estimate.blocks.iter().zip(&estimate.residuals_m);
    blocks
        .map(|(block, residual_m)| WarmUpBlock {
            time_s: block.time_s,
            change_m: block.change_m - estimate.warm_change_m,
            residual_m: *residual_m,
            temperature_c: block.temperature_c,
            frames: block.samples,
        })
        .collect()
}

fn notes(estimate: &DriftEstimate) -> Vec<String> {
    let nothing = "No drift was found beside the noise: the camera was warm, or drifts less than the blocks scatter.";
    estimate.model.is_empty().then(|| nothing.to_owned()).into_iter().collect()
}

fn doubts(request: &WarmUpRequest, estimate: &DriftEstimate) -> Vec<Doubt> {
    let unexplained = estimate.tests.last().filter(|last| last.p_value < request.options.level);
    let words = unexplained.map(|last| {
        format!(
            "The model does not explain everything: one exponential more, of about {:.0} s, is significant \
             (p = {:.1e}) but cannot be told. Look at the residuals.",
            last.time_constant_s.unwrap_or(f64::NAN),
            last.p_value
        )
    });
    words.map(|words| Doubt::new(DoubtKind::Drift, words)).into_iter().collect()
}

impl Judged for WarmUpSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

impl WarmUpTest {
    fn new(test: &TransientTest) -> Self {
        Self { beside: test.beside, time_constant_s: test.time_constant_s, p_value: test.p_value, taken: test.taken }
    }
}
