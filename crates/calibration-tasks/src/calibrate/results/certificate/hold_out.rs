//! The check on stations that took no part.

use std::fmt;

use commands::{Doubt, DoubtKind};
use self_calibration::{HoldOut, Prediction};
use serde::Serialize;

/// Whether a calibration predicts what stations observed that took no part in it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum HeldOut {
    /// No such check.
    NotMade {
        /// Why.
        reason: String,
    },
    /// What it gave.
    Made(Box<HeldOutCheck>),
}

/// A hold-out check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutCheck {
    /// Every so many stations were left out.
    pub every: usize,
    /// The stations left out.
    pub stations: Vec<String>,
    /// Their image points, pixel.
    pub image: HeldOutPart,
    /// Their ranges, metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<HeldOutPart>,
}

/// What was predicted of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutPart {
    /// Values.
    pub values: usize,
    /// Root mean square of observed minus predicted, in [`Self::unit`].
    pub rms: f64,
    /// Their mean.
    pub mean: f64,
    /// Unit.
    pub unit: &'static str,
    /// What the values add to vᵀPv.
    pub chi_squared: Option<f64>,
    /// What they should add on average.
    pub degrees: Option<f64>,
    /// Probability of a sum as far off by chance.
    pub p_value: Option<f64>,
    /// Whether the prediction is worse than observations and calibration are said to be.
    pub fails: bool,
    /// The test as it was made, to be printed.
    #[serde(skip)]
    pub(crate) test: Option<String>,
}

impl HeldOutPart {
    fn new(part: &Prediction, unit: &'static str) -> Self {
        Self {
            values: part.values,
            rms: part.rms,
            mean: part.mean,
            unit,
            chi_squared: part.test.as_ref().map(|test| test.statistic),
            degrees: part.test.as_ref().map(|test| test.redundancy),
            p_value: part.test.as_ref().map(|test| test.p_value),
            fails: part.fails(),
            test: part.test.as_ref().map(ToString::to_string),
        }
    }
}

impl HeldOut {
    pub(crate) fn new(every: Option<usize>, check: Option<Result<HoldOut, self_calibration::Error>>) -> Self {
        match check {
            None if every.is_some() => {
                Self::NotMade { reason: "the method does not adjust the stations of a network together".to_owned() }
            }
            None => Self::not_asked(),
            Some(Err(error)) => Self::NotMade { reason: error.to_string() },
            Some(Ok(check)) => Self::made(every.unwrap_or(0), check),
        }
    }

    /// No check, as nobody asked for one.
    pub fn not_asked() -> Self {
        Self::NotMade { reason: "not asked for (--hold-out N)".to_owned() }
    }

    /// A check for which every so many stations were left out.
    pub fn made(every: usize, check: HoldOut) -> Self {
        let image = HeldOutPart::new(&check.image, "px");
        let range = check.range.as_ref().map(|range| HeldOutPart::new(range, "m"));
        Self::Made(Box::new(HeldOutCheck { every, image, range, stations: check.stations }))
    }

    /// Why a check that was asked for was not made, as a sentence.
    pub fn excuse(&self, every: Option<usize>) -> Option<String> {
        let Self::NotMade { reason } = self else { return None };
        every.map(|_| format!("the check on stations left out was not made: {reason}"))
    }

    /// A doubt where the prediction fails.
    pub fn doubt(&self) -> Option<Doubt> {
        let Self::Made(check) = self else { return None };
        let parts = [("image points", Some(&check.image)), ("ranges", check.range.as_ref())];
        let failed: Vec<String> = parts
            .into_iter()
            .filter_map(|(what, part)| Some((what, part?)))
            .filter(|(_, part)| part.fails)
            .map(|(what, part)| format!("{what} ({part})"))
            .collect();
        (!failed.is_empty()).then(|| {
            let words = format!(
                "stations left out do not show what the calibration from the others predicts: {}. A term is missing (the \
                 figures of residuals show which), stated standard deviations are too small, or the stations left out show \
                 ranges or parts of the image that the others do not: calibrate with more terms, or with more stations there",
                failed.join("; ")
            );
            Doubt::new(DoubtKind::Prediction, words)
        })
    }
}

impl fmt::Display for HeldOutCheck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "stations left out ({}): image points: {}", self.stations.len(), self.image)?;
        self.range.as_ref().map_or(Ok(()), |range| write!(f, "; ranges: {range}"))
    }
}

impl fmt::Display for HeldOutPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (factor, unit, digits) = if self.unit == "m" { (1e3, "mm", 2) } else { (1.0, self.unit, 4) };
        let Self { values, rms, mean, .. } = self;
        let test = self
            .test
            .as_deref()
            .unwrap_or("not decided: there is no redundancy, or automatic terms were others without these stations");
        write!(
            f,
            "{values} values, rms {:.digits$} {unit}, mean {:+.digits$} {unit}; {test}",
            factor * rms,
            factor * mean
        )
    }
}
