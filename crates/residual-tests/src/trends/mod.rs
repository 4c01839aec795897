//! Whether what a correction leaves over is random: tests of the residuals for trends (Sect. 4.3: "the remaining errors,
//! after subtraction of the modelled systematic behaviour, should only be random").

mod cells;
mod wald;

use crate::{Error, Result};

use cells::Cells;
use wald::{Binned, BinnedTest};

/// A residual with what it may still depend on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TrendSample {
    /// Observed minus modelled range, metre.
    pub residual_m: f64,
    /// Its standard deviation, metre: a weight, nothing else.
    pub sigma_m: f64,
    /// Observed range, metre.
    pub range_m: f64,
    /// Amplitude in the camera's unit; NaN where it is not known.
    pub amplitude: f64,
    /// Column of the pixel.
    pub column: f64,
    /// Row of the pixel.
    pub row: f64,
    /// Time of the frame, second; NaN where it is not known.
    pub time_s: f64,
    /// The frame: pixels of one frame may share errors, those of different frames do not.
    pub frame: usize,
}

/// What a residual may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrendVariable {
    /// Observed range, metre.
    Range,
    /// Amplitude, camera's unit.
    Amplitude,
    /// Column, pixel.
    Column,
    /// Row, pixel.
    Row,
    /// Time, second.
    Time,
}

/// Options of [`test_trends`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrendOptions {
    /// Probability that residuals without any trend are said to have one, over all variables together. Default 1 %.
    pub level: f64,
    /// Bins of each variable, with equal numbers of samples; fewer where there are few independent cells. Default 12.
    pub bins: usize,
}

impl Default for TrendOptions {
    fn default() -> Self {
        Self { level: 0.01, bins: 12 }
    }
}

/// Residuals of one bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrendBin {
    /// Smallest value of the variable.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Weighted mean residual, metre.
    pub mean_m: f64,
    /// Standard error of the mean from the scatter of independent cells, metre.
    pub standard_error_m: f64,
    /// Samples.
    pub samples: usize,
}

/// The test of one variable.
#[derive(Debug, Clone, PartialEq)]
pub struct TrendTest {
    /// The variable.
    pub variable: TrendVariable,
    /// Bins in ascending order; empty where it was not tested.
    pub bins: Vec<TrendBin>,
    /// Probability of means as different as these without a trend; NaN where it was not tested.
    pub p_value: f64,
    /// The verdict, with all variables minded.
    pub verdict: TrendVerdict,
    /// Root mean square of the trend itself, the scatter of the means taken off, metre.
    pub rms_m: f64,
    /// Side of the cells that count as independent, in steps of the sampled pixels; `None`: whole frames.
    pub cell: Option<usize>,
}

/// Whether residuals depend on a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrendVerdict {
    /// The means differ no more than they scatter.
    Random,
    /// They differ significantly.
    Trend,
    /// It could not be tested, and why.
    NotTested(&'static str),
}

/// The tests of all variables.
#[derive(Debug, Clone, PartialEq)]
pub struct TrendReport {
    /// One test a variable, in the order of [`TrendVariable::ALL`].
    pub tests: Vec<TrendTest>,
    /// Level of all tests together.
    pub level: f64,
}

impl TrendVariable {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Range, Self::Amplitude, Self::Column, Self::Row, Self::Time];

    /// Name and unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Range => "range (m)",
            Self::Amplitude => "amplitude",
            Self::Column => "column (pixel)",
            Self::Row => "row (pixel)",
            Self::Time => "time (s)",
        }
    }

    fn of(self, sample: &TrendSample) -> f64 {
        match self {
            Self::Range => sample.range_m,
            Self::Amplitude => sample.amplitude,
            Self::Column => sample.column,
            Self::Row => sample.row,
            Self::Time => sample.time_s,
        }
    }
}

impl TrendReport {
    /// Why a variable is not tested where neighbours share errors and there are too few frames to average over these.
    pub const TOO_FEW_CELLS: &'static str = "too few independent frames or cells";

    /// Variables on which the residuals depend significantly.
    pub fn trends(&self) -> impl Iterator<Item = &TrendTest> {
        self.tests.iter().filter(|test| test.verdict == TrendVerdict::Trend)
    }

    /// Whether something was tested and no trend found.
    pub fn is_random(&self) -> bool {
        self.trends().next().is_none() && self.tests.iter().any(|test| test.verdict == TrendVerdict::Random)
    }
}

/// Tests residuals for trends in range, amplitude, column, row and time.
///
/// Along each variable the residuals are averaged in bins, and the means compared with one another by Hotelling's T²
/// with the covariance that the residuals themselves show. Neighbouring pixels need not be independent: the residuals
/// of one frame are put together in square cells, and the smallest cells whose sums are not correlated with those of
/// their neighbours (after the means were taken off) count as independent of each other, or the next larger ones if those
/// are not single pixels; whole frames where none are.
/// The variables share the level after Holm `[Holm1979]`.
///
/// An error that a whole frame has in common is a trend in range and time where each frame stands at a range and a time of
/// its own, and none in the image.
///
/// Where a model was fitted to the same samples the residuals cannot follow its terms any more, and the test finds a
/// little less often than the level what is not there.
///
/// # Errors
/// [`Error::OutOfDomain`] for options and samples that are no numbers; [`Error::TooFewResiduals`] below two samples a
/// bin.
pub fn test_trends(samples: &[TrendSample], options: &TrendOptions) -> Result<TrendReport> {
    check(samples, options)?;
    let mut tests: Vec<TrendTest> =
        TrendVariable::ALL.into_iter().map(|variable| test_variable(samples, variable, options)).collect();
    let of_all = statistics::holm(&tests.iter().map(|test| test.p_value).collect::<Vec<f64>>());
    for (test, p_value) in tests.iter_mut().zip(of_all) {
        if p_value <= options.level {
            test.verdict = TrendVerdict::Trend;
        }
    }
    Ok(TrendReport { tests, level: options.level })
}

fn check(samples: &[TrendSample], options: &TrendOptions) -> Result<()> {
    let refuse = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
    if !(options.level > 0.0 && options.level < 1.0) {
        return refuse("level", options.level, "a probability between 0 and 1");
    }
    if options.bins < wald::FEWEST_BINS {
        return refuse("bins", options.bins as f64, "at least three bins");
    }
    if samples.len() < 2 * options.bins {
        return Err(Error::TooFewResiduals { residuals: samples.len(), needed: 2 * options.bins });
    }
    for sample in samples {
        for (name, value) in [("residual_m", sample.residual_m), ("column", sample.column), ("row", sample.row)] {
            if !value.is_finite() {
                return refuse(name, value, "a finite number");
            }
        }
        if !(sample.sigma_m > 0.0 && sample.sigma_m.is_finite()) {
            return refuse("sigma_m", sample.sigma_m, "a positive, finite standard deviation");
        }
    }
    Ok(())
}

fn test_variable(samples: &[TrendSample], variable: TrendVariable, options: &TrendOptions) -> TrendTest {
    let not_tested = |reason| TrendTest {
        variable,
        bins: Vec::new(),
        p_value: f64::NAN,
        verdict: TrendVerdict::NotTested(reason),
        rms_m: f64::NAN,
        cell: None,
    };
    let values: Vec<f64> = samples.iter().map(|sample| variable.of(sample)).collect();
    if values.iter().any(|value| !value.is_finite()) {
        return not_tested("not known of all samples");
    }
    let mut bins = options.bins;
    loop {
        let Some(binned) = Binned::new(samples, &values, bins) else { return not_tested("it hardly varies") };
        match test_with_cells(samples, &binned) {
            Some(BinnedTest { p_value, rms_m, errors_m, cell }) => {
                let bins = binned.bins(&errors_m);
                return TrendTest { variable, bins, p_value, verdict: TrendVerdict::Random, rms_m, cell };
            }
            None if bins > wald::FEWEST_BINS => bins = (bins / 2).max(wald::FEWEST_BINS),
            None => return not_tested(TrendReport::TOO_FEW_CELLS),
        }
    }
}

/// Tests with the smallest cells that are independent. Where single pixels are not, with the next larger ones, if there
/// are enough of them: a correlation too small to be seen still makes a false alarm.
fn test_with_cells(samples: &[TrendSample], binned: &Binned) -> Option<BinnedTest> {
    let mut smallest = None;
    for (index, size) in Cells::sizes().enumerate() {
        let found = binned.test_with(samples, &Cells::new(samples, size));
        match (found, smallest) {
            (Some(found), None) if index == 0 => return Some(found),
            (Some(found), None) => smallest = Some(found),
            (found, Some(earlier)) => return found.or(Some(earlier)),
            (None, None) => smallest = None,
        }
    }
    smallest
}
