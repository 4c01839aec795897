//! Whether what corrections leave over is random (Sect. 4.3): tests of residuals for trends, in words and figures.

pub(crate) mod residuals;
pub(crate) mod section;

pub use section::trends_of_calibration;

use std::fmt;

use residual_tests::{TrendReport, TrendTest, TrendVerdict};
use serde::Serialize;

pub(crate) use residuals::Residuals;

/// The test of the residuals against one variable.
#[derive(Debug, Clone, Serialize)]
pub struct TrendSummary {
    /// The variable, with its unit.
    pub variable: &'static str,
    /// `random`, `trend`, or why it was not tested.
    pub verdict: String,
    /// Probability of means as different by chance; `None` where it was not tested.
    pub p_value: Option<f64>,
    /// Root mean square of the trend, chance taken off, metre.
    pub rms_m: Option<f64>,
    /// What counted as independent: `pixels`, cells of `n x n` tested pixels, or `frames`; `None` where it was not tested.
    pub independent: Option<String>,
    /// Middle of each bin, mean residual and its standard error, metre.
    pub bins: Vec<[f64; 3]>,
}

/// What a run leaves of the ranges' errors, and whether that is random.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RemainingErrors {
    /// What the residuals are: `truth`, `planes`, or `none`.
    pub basis: &'static str,
    /// The same in a sentence, with what such residuals cannot show.
    pub basis_words: String,
    /// Whether they are random, in a sentence; empty where there are none.
    pub verdict: String,
    /// Residuals tested: every so many columns and rows.
    pub pixels: usize,
    /// Gross errors among these pixels, which were left out.
    pub gross_errors: usize,
    /// One test a variable.
    pub variables: Vec<TrendSummary>,
}

impl fmt::Display for RemainingErrors {
    /// The verdict with its basis, or why there is none.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.basis {
            "truth" => write!(f, "{} (against the truth, {} pixels)", self.verdict, self.pixels),
            "planes" => write!(f, "{} (to planes in the frames, {} pixels)", self.verdict, self.pixels),
            _ => f.write_str(self.basis_words.trim_end_matches('.')),
        }
    }
}

impl TrendSummary {
    /// The figures of a test.
    pub fn new(test: &TrendTest) -> Self {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let bins = test.bins.iter().map(|bin| [f64::midpoint(bin.low, bin.high), bin.mean_m, bin.standard_error_m]);
        Self {
            variable: test.variable.name(),
            verdict: words(test.verdict),
            p_value: finite(test.p_value),
            rms_m: finite(test.rms_m),
            independent: test.p_value.is_finite().then(|| match test.cell {
                Some(1) => "pixels".to_owned(),
                Some(side) => format!("{side} x {side} pixels"),
                None => WHOLE_FRAMES.to_owned(),
            }),
            bins: bins.collect(),
        }
    }

    /// Whether the residuals depend on the variable significantly.
    pub fn is_trend(&self) -> bool {
        self.verdict == "trend"
    }
}

/// What is independent where the pixels of a frame are not.
const WHOLE_FRAMES: &str = "frames";

fn words(verdict: TrendVerdict) -> String {
    match verdict {
        TrendVerdict::Random => "random".to_owned(),
        TrendVerdict::Trend => "trend".to_owned(),
        TrendVerdict::NotTested(reason) => format!("not tested: {reason}"),
    }
}

/// One sentence without its full stop; `None` where nothing was tested.
pub fn sentence(trends: &[TrendSummary]) -> Option<String> {
    let tested: Vec<&TrendSummary> = trends.iter().filter(|trend| trend.p_value.is_some()).collect();
    if tested.is_empty() {
        return None;
    }
    let found: Vec<String> = tested
        .iter()
        .filter(|trend| trend.is_trend())
        .map(|trend| format!("{} (rms {:.2} mm)", trend.variable, 1e3 * trend.rms_m.unwrap_or(f64::NAN)))
        .collect();
    if found.is_empty() {
        let names: Vec<&str> = tested.iter().map(|trend| trend.variable).collect();
        return Some(format!("the residuals show no trend in {}{}", names.join(", "), shared(trends)));
    }
    Some(format!("the residuals still depend on {}{}", found.join(", "), shared(trends)))
}

/// That pixels of a frame are not independent, which is no sign of randomness, and what could not be tested for it.
fn shared(trends: &[TrendSummary]) -> String {
    let reason = words(TrendVerdict::NotTested(TrendReport::TOO_FEW_CELLS));
    let names: Vec<&str> = trends.iter().filter(|trend| trend.verdict == reason).map(|trend| trend.variable).collect();
    if !names.is_empty() {
        return format!("; pixels of a frame share errors, and there are too few frames to test {}", names.join(", "));
    }
    if trends.iter().any(|trend| trend.independent.as_deref() == Some(WHOLE_FRAMES)) {
        return "; pixels of a frame share errors".to_owned();
    }
    String::new()
}
