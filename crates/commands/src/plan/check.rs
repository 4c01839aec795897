//! What a pipeline's file may say: numbers that mean something, and at least one stage.

use crate::plan::{Plan, SimulateSource, Source, Stage};

/// Path of a field and what is wrong with it.
pub type Fault = (String, String);

/// What a number must be.
#[derive(Debug, Clone, Copy)]
pub enum Rule {
    /// Any number but NaN and infinity.
    Finite,
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// Above 0 and below 1.
    Probability,
    /// 0 to 1.
    Share,
}

impl Rule {
    /// Why a value is refused; `None` where it holds.
    pub fn fault(self, value: f64) -> Option<String> {
        let (holds, expected) = match self {
            Self::Finite => (value.is_finite(), "a finite number"),
            Self::Positive => (value.is_finite() && value > 0.0, "a positive number"),
            Self::NotNegative => (value.is_finite() && value >= 0.0, "a finite number that is not negative"),
            Self::Probability => (value > 0.0 && value < 1.0, "a probability between 0 and 1"),
            Self::Share => ((0.0..=1.0).contains(&value), "a part from 0 to 1"),
        };
        (!holds).then(|| format!("is {value}, expected {expected}"))
    }
}

/// The first of several numbers that breaks its rule.
pub fn check_numbers(numbers: impl IntoIterator<Item = (String, f64, Rule)>) -> Result<(), Fault> {
    let fault = |(field, value, rule): (String, f64, Rule)| Some((field, rule.fault(value)?));
    numbers.into_iter().find_map(fault).map_or(Ok(()), Err)
}

/// Windows for normals beyond this are larger than any image they could smooth.
const LARGEST_HALF_WIDTH_PX: usize = 100;

impl Plan {
    /// Refuses a file without stages, which would leave nothing to write. In memory such a plan gives the frames as read.
    pub(super) fn check_stages(&self) -> Result<(), Fault> {
        let reason = || format!("is empty, expected at least one of {}", Stage::NAMES.join(", "));
        if self.stages.is_empty() { Err(("stages".to_owned(), reason())) } else { Ok(()) }
    }

    /// Refuses what no stage could work with.
    pub(super) fn check(&self) -> Result<(), Fault> {
        for (index, stage) in self.stages.iter().enumerate() {
            let named = |(field, value, rule)| (format!("stages[{index}].{field}"), value, rule);
            check_numbers(stage.numbers().into_iter().map(named))?;
            if let Stage::Register(options) = stage
                && !(1..=LARGEST_HALF_WIDTH_PX).contains(&options.normal_half_width_px)
            {
                let found = options.normal_half_width_px;
                let reason = format!("is {found}, expected 1 to {LARGEST_HALF_WIDTH_PX} pixels");
                return Err((format!("stages[{index}].normal_half_width_px"), reason));
            }
        }
        if let Some(calibrate) = &self.calibrate
            && calibrate.terms.is_empty()
        {
            return Err(("calibrate.terms".to_owned(), "is empty, expected the names of terms".to_owned()));
        }
        if let Some(Source::Simulate(source)) = &self.source {
            source.check().map_err(|(field, reason)| (format!("source.{field}"), reason))?;
        }
        Ok(())
    }
}

impl SimulateSource {
    /// Refuses numbers that no simulation can have.
    pub fn check(&self) -> Result<(), Fault> {
        check_numbers([
            ("approximate_position_sigma_m".to_owned(), self.approximate_position_sigma_m, Rule::NotNegative),
            ("approximate_attitude_sigma_deg".to_owned(), self.approximate_attitude_sigma_deg, Rule::NotNegative),
            ("gross_error_share".to_owned(), self.gross_error_share, Rule::Share),
        ])
    }
}

impl Stage {
    /// The numbers among the options, with their rules.
    fn numbers(&self) -> Vec<(&'static str, f64, Rule)> {
        use Rule::{NotNegative, Positive, Probability, Share};
        let optional = |name, value: Option<f64>, rule| value.map(|value| (name, value, rule));
        match self {
            Self::Demodulate(o) => {
                let noise = o.noise.into_iter().flat_map(|noise| {
                    [
                        ("noise.shot_variance_per_unit", noise.shot_variance_per_unit, NotNegative),
                        ("noise.dark_sigma", noise.dark_sigma, NotNegative),
                    ]
                });
                let consistency = o.consistency.iter().flat_map(|check| {
                    [
                        ("consistency.false_alarm_probability", check.false_alarm_probability, Probability),
                        ("consistency.tolerance", check.tolerance, NotNegative),
                    ]
                });
                let low = optional("low_amplitude", o.low_amplitude, NotNegative);
                low.into_iter().chain(noise).chain(consistency).chain(interference(&o.interference)).collect()
            }
            Self::Average(o) => {
                let rest = [
                    ("rest.moved_probability", o.rest.moved_probability, Probability),
                    ("rest.largest_moved_share", o.rest.largest_moved_share, Share),
                    ("rest.largest_drift_sigmas", o.rest.largest_drift_sigmas, NotNegative),
                ];
                rest.into_iter().chain(interference(&o.interference)).collect()
            }
            Self::Deconvolve(o) => vec![("regularisation", o.regularisation, NotNegative)],
            Self::Unwrap(o) => optional("maximum_range_m", o.maximum_range_m, Positive)
                .into_iter()
                .chain([("minimum_confidence", o.minimum_confidence, Share)])
                .collect(),
            Self::RepairWraps(o) => optional("interval_m", o.interval_m, Positive)
                .into_iter()
                .chain([
                    ("maximum_range_m", o.maximum_range_m, Positive),
                    ("minimum_confidence", o.minimum_confidence, Share),
                ])
                .collect(),
            Self::Multipath(o) => optional("flag_risk_above_m", o.flag_risk_above_m, NotNegative)
                .into_iter()
                .chain([
                    ("false_alarm_probability", o.false_alarm_probability, Probability),
                    ("bending_false_alarm_probability", o.bending_false_alarm_probability, Probability),
                    ("floor_m", o.floor_m, NotNegative),
                ])
                .collect(),
            Self::FuseExposures(o) => vec![
                ("false_alarm_probability", o.false_alarm_probability, Probability),
                ("floor_m", o.floor_m, NotNegative),
            ],
            Self::PointCloud(o) => {
                o.sigma_pixel.into_iter().flatten().map(|sigma| ("sigma_pixel", sigma, NotNegative)).collect()
            }
            Self::Flag(o) => optional("low_amplitude", o.low_amplitude, NotNegative)
                .into_iter()
                .chain(optional("maximum_sigma_m", o.maximum_sigma_m, Positive))
                .chain([
                    ("mixed_pixels.sigmas", o.mixed_pixels.sigmas, Positive),
                    ("mixed_pixels.floor_m", o.mixed_pixels.floor_m, NotNegative),
                ])
                .collect(),
            Self::Register(o) => vec![
                ("maximum_distance_m", o.maximum_distance_m, Positive),
                ("minimum_overlap", o.minimum_overlap, Share),
            ],
            Self::Adjust(o) => vec![
                ("maximum_distance_m", o.maximum_distance_m, Positive),
                ("minimum_overlap", o.minimum_overlap, Share),
            ],
            Self::CorrectRange(_) | Self::CorrectImagePoint(_) => Vec::new(),
        }
    }
}

fn interference(options: &range_image::InterferenceOptions) -> [(&'static str, f64, Rule); 2] {
    [
        ("interference.false_alarm_probability", options.false_alarm_probability, Rule::Probability),
        ("interference.least_share", options.least_share, Rule::Probability),
    ]
}
