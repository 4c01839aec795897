//! What a pixel's flags mean, who set them, and how far it was from the threshold.

use error_models::OutsideModel;
use range_image::Flags;
use statistics::Distribution;

use crate::explain::{FlagReason, PixelState};
use commands::plan::{FlagOptions, Stage};
use pipeline::View;

/// Notes the flags as stages set them.
#[derive(Default)]
pub(super) struct FlagWatch {
    found: Vec<(Flags, FlagReason)>,
}

/// What stands behind a flag: words, and the threshold in standard deviations.
type Reason = (String, Option<f64>);

impl FlagWatch {
    /// Notes what the frame came with.
    pub(super) fn start(&mut self, from_the_start: Flags) {
        for (flag, name) in named(from_the_start) {
            let reason = "the frame has no range here".to_owned();
            self.found.push((flag, FlagReason { flag: name, stage: None, reason, threshold_sigmas: None }));
        }
    }

    /// Notes what a stage set.
    pub(super) fn after(
        &mut self,
        stage: &Stage,
        view: &View,
        pixel: [usize; 2],
        before: &PixelState,
        after: &PixelState,
    ) {
        for (flag, name) in named(after.flags - before.flags) {
            let (reason, threshold_sigmas) = reason(flag, stage, view, pixel, after);
            self.found.push((flag, FlagReason { flag: name, stage: Some(stage.name()), reason, threshold_sigmas }));
        }
    }

    /// The reasons of the flags that are still set.
    pub(super) fn reasons(self, at_the_end: Flags) -> Vec<FlagReason> {
        let kept = self.found.into_iter().filter(|(flag, _)| at_the_end.contains(*flag));
        kept.map(|(_, reason)| reason).collect()
    }
}

fn named(flags: Flags) -> impl Iterator<Item = (Flags, &'static str)> {
    Flags::NAMED.into_iter().filter(move |(flag, _)| flags.contains(*flag))
}

fn reason(flag: Flags, stage: &Stage, view: &View, pixel: [usize; 2], state: &PixelState) -> Reason {
    match (flag, stage) {
        (Flags::OUTSIDE_SPAN, _) => outside(view, pixel, state),
        (Flags::LOW_AMPLITUDE, Stage::Demodulate(options)) => low_amplitude(options.low_amplitude, None, state),
        (Flags::LOW_AMPLITUDE, Stage::Flag(options)) => {
            low_amplitude(options.low_amplitude, options.maximum_sigma_m, state)
        }
        (Flags::MIXED_PIXEL, Stage::Flag(options)) => mixed(options, state),
        (Flags::MOTION, Stage::Demodulate(options)) => {
            let level = options.consistency.as_ref().map(|check| check.false_alarm_probability);
            by_false_alarms("the samples contradict each other: the scene or the camera moved", level)
        }
        (Flags::MOTION, Stage::FuseExposures(options)) => by_false_alarms(
            "exposures contradict each other: something moved, or the longer one is not to be trusted",
            Some(options.false_alarm_probability),
        ),
        (Flags::INTERFERENCE, Stage::Demodulate(options)) => {
            let level = options.consistency.as_ref().map(|check| check.false_alarm_probability);
            by_false_alarms(
                "the samples contradict each other wherever there is light, which nothing that moves does: \
                 another camera, flickering light, or a noise model that says too little",
                level,
            )
        }
        (Flags::INTERFERENCE, Stage::Average(options)) => by_false_alarms(
            "it beats from frame to frame as all lit pixels do, or the samples of most frames contradict each other: \
             another camera in the same band, or flickering light",
            Some(options.interference.false_alarm_probability),
        ),
        (Flags::MOTION, Stage::Average(options)) => by_false_alarms(
            "its values differ from frame to frame, or the samples of most frames contradict each other: something moved",
            Some(options.rest.moved_probability),
        ),
        (Flags::MULTIPATH, Stage::Multipath(options)) => {
            let risk = view.multipath_risk_m.as_ref().map(|risk| f64::from(risk[(pixel[0], pixel[1])]));
            match options.flag_risk_above_m.zip(risk).filter(|(limit, risk)| risk > limit) {
                Some((limit, risk)) => at_risk(limit, risk, state),
                None => by_false_alarms("the frequencies contradict each other", Some(options.false_alarm_probability)),
            }
        }
        (Flags::MULTIPATH, Stage::Deconvolve(_)) => (
            "its share of scattered light depends on light that is not known: saturated or from outside the image"
                .to_owned(),
            None,
        ),
        (Flags::UNWRAP_UNSURE, Stage::Unwrap(options)) => unsure(options.minimum_confidence),
        (Flags::UNWRAP_UNSURE, Stage::RepairWraps(options)) => unsure(options.minimum_confidence),
        (Flags::SATURATED, Stage::FuseExposures(_)) => {
            ("it is saturated in all exposures: there is no range".to_owned(), None)
        }
        (_, Stage::FuseExposures(_)) => ("an exposure that went into the mean carries it".to_owned(), None),
        (Flags::LOW_AMPLITUDE, Stage::Average(_)) => (
            "the amplitude of the mean is below the threshold of single frames over the root of their number"
                .to_owned(),
            None,
        ),
        (Flags::SATURATED, Stage::Average(_)) => {
            ("so many frames are saturated here that the mean of the others may be off".to_owned(), None)
        }
        (_, Stage::Average(_)) => ("more than half of the frames that went into the mean carry it".to_owned(), None),
        (Flags::NO_DATA, Stage::CorrectRange(_)) => ("it sees the camera's optical reference".to_owned(), None),
        (Flags::NO_DATA, _) => ("there is no range here".to_owned(), None),
        (Flags::SATURATED, _) => ("a raw sample reached the largest value of the sensor".to_owned(), None),
        _ => (format!("set by stage {}", stage.name()), None),
    }
}

fn outside(view: &View, pixel: [usize; 2], state: &PixelState) -> Reason {
    let ledger = view.correction.as_ref().map(|record| record.pixel(pixel)).unwrap_or_default();
    let mut sigmas = None;
    let mut words: Vec<String> = ledger
        .outside
        .iter()
        .map(|reason| match *reason {
            OutsideModel::Range { range_m, span_m: [low, high] } => {
                let beyond_m = (low - range_m).max(range_m - high);
                sigmas = state.sigma_m.map(|sigma| beyond_m / sigma);
                format!(
                    "the range of {range_m:.3} m lies {:.1} mm outside the calibrated {low:.3} m to {high:.3} m: not corrected",
                    1e3 * beyond_m
                )
            }
            OutsideModel::Amplitude { amplitude, span: [low, high] } => {
                let beyond = (low - amplitude).max(amplitude - high);
                sigmas = state.amplitude_sigma.map(|sigma| beyond / sigma);
                format!(
                    "the amplitude of {amplitude:.1} lies outside the calibrated {low:.1} to {high:.1}: its error was left in"
                )
            }
            OutsideModel::Radicand { amplitude } => {
                format!("the amplitude hyperbola has no value at an amplitude of {amplitude:.1}: its error was left in")
            }
            OutsideModel::ImagePoint { point_mm: [x, y] } => {
                format!("the image point ({x:.3}, {y:.3}) mm lies beside the calibrated surface: the value at its edge was taken")
            }
            _ => "the calibration does not cover it".to_owned(),
        })
        .collect();
    words.extend(ledger.outside_span);
    (words.join("; "), sigmas)
}

fn low_amplitude(threshold: Option<f64>, maximum_sigma_m: Option<f64>, state: &PixelState) -> Reason {
    match (threshold, maximum_sigma_m, state.amplitude, state.sigma_m) {
        (Some(threshold), _, Some(amplitude), _) if amplitude < threshold => (
            format!("the amplitude of {amplitude:.1} is below the threshold of {threshold:.1}"),
            state.amplitude_sigma.map(|sigma| threshold / sigma),
        ),
        (_, Some(limit), _, Some(sigma)) if sigma > limit => (
            format!("the range is known to {:.1} mm only, {:.1} mm are asked for", 1e3 * sigma, 1e3 * limit),
            Some(limit / sigma),
        ),
        _ => ("the amplitude is too low".to_owned(), None),
    }
}

fn mixed(options: &FlagOptions, state: &PixelState) -> Reason {
    let (sigmas, floor_m) = (options.mixed_pixels.sigmas, options.mixed_pixels.floor_m);
    // The surfaces at its sides are taken to be as noisy as the pixel, and as their neighbours alone.
    let threshold_m = sigmas * state.sigma_m.map_or(floor_m, |sigma| (2.0 * sigma * sigma).sqrt().hypot(floor_m));
    let words = format!(
        "it lies between the surfaces at its two sides, off both by more than {:.1} mm ({sigmas} sigma of noise and of \
         {:.1} mm of shape)",
        1e3 * threshold_m,
        1e3 * floor_m
    );
    (words, state.sigma_m.map(|sigma| threshold_m / sigma))
}

fn at_risk(limit_m: f64, risk_m: f64, state: &PixelState) -> Reason {
    let words = format!(
        "light that bounced once in the scene is expected to add {:.1} mm, more than the threshold of {:.1} mm",
        1e3 * risk_m,
        1e3 * limit_m
    );
    (words, state.sigma_m.map(|sigma| limit_m / sigma))
}

/// A test of a given level, whose threshold is said as that of a normal variable.
fn by_false_alarms(what: &str, level: Option<f64>) -> Reason {
    match level {
        Some(level) => (
            format!("{what}; noise alone does so once in {:.0} pixels", 1.0 / level),
            Some(Distribution::Normal.critical(level)),
        ),
        None => (what.to_owned(), None),
    }
}

fn unsure(minimum: f64) -> Reason {
    (format!("the number of whole ambiguity intervals is not sure: its confidence is below {minimum}"), None)
}
