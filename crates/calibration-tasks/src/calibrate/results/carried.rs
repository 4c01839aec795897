//! What a new calibration has from the one that it started from, what it has not, and for which integration time it holds.

use error_models::ParameterStatus;
use pipeline::survey::UNKNOWN_INTEGRATION_TIME_S;
use range_io::calibration::Calibration;
use self_calibration::CalibrationOutcome;

use crate::calibrate::start::Start;

/// Times (relative) that are the same: they went through a file or a unit's conversion.
const SAME: f64 = 1e-6;
/// Modulation frequencies (relative) that are the same, as where a calibration is held against a survey.
const SAME_FREQUENCY: f64 = 1e-3;

/// Parts of a calibration beside camera and range terms, by their field, with a name for people.
fn parts(known: &Calibration) -> impl Iterator<Item = (&'static str, &'static str)> {
    let parts = [
        (known.noise.is_some(), "noise", "noise of the samples"),
        (known.range_noise.is_some(), "range_noise", "noise of the ranges"),
        (known.scattering.is_some(), "scattering", "scattering"),
        (known.fixed_pattern.is_some(), "fixed_pattern", "fixed pattern"),
        (known.warm_up.is_some(), "warm_up", "drift while warming up"),
    ];
    parts.into_iter().filter(|(is_known, ..)| *is_known).map(|(_, field, words)| (field, words))
}

/// Fields of `calibration.ron` that are handed on from the start calibration; a new table of offsets stands in place of
/// an older fixed pattern.
pub(crate) fn taken_over(start: &Start, finds_table: bool) -> Vec<&'static str> {
    let known = start.calibration.iter().flat_map(parts);
    known.map(|(field, _)| field).filter(|field| !(finds_table && *field == "fixed_pattern")).collect()
}

/// What is to be said of all that, in sentences.
pub(crate) fn notes(start: &Start, outcome: &CalibrationOutcome, finds_table: bool) -> Vec<String> {
    let times: Vec<Option<f64>> = outcome.range_models.iter().map(|(time, _)| *time).collect();
    let mut notes = Vec::new();
    if !start.light_alone {
        notes.extend(untimed(start, &times));
    }
    let Some(known) = &start.calibration else { return notes };
    let taken = taken_over(start, finds_table);
    let words: Vec<&str> = parts(known).filter(|(field, _)| taken.contains(field)).map(|(_, words)| words).collect();
    if !words.is_empty() {
        notes.push(format!("taken over from {}, as they are: {}", start.words, words.join(", ")));
    }
    notes.extend(left_behind(start, known, &times));
    notes.extend(held(start, known, outcome, &times));
    notes
}

fn is_same(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs())
}

/// Range terms that belong to no integration time.
fn untimed(start: &Start, times: &[Option<f64>]) -> Option<String> {
    times.contains(&None).then(|| {
        let whose = if times.len() > 1 { "some stations" } else { "the stations" };
        format!(
            "no integration time is known of {whose}: neither observations.csv (column `integration_time_s`) nor {} ({} \
             frames) gives one. Their range terms are written for {UNKNOWN_INTEGRATION_TIME_S} s and fit frames that state no \
             time either; for all others, state `integration_time_s` in observations.csv or of a frame of each station in \
             survey.ron, or give --integration-time SECOND",
            start.survey_file.display(),
            start.conditions.frames
        )
    })
}

/// Range terms of the start calibration that the new one has not.
fn left_behind(start: &Start, known: &Calibration, times: &[Option<f64>]) -> Option<String> {
    let frequency = start.modulation.frequency_hz();
    let replaced = |time_s: f64, hz: f64| {
        let same_time = |time: &Option<f64>| time.is_some_and(|time| is_same(time, time_s, SAME));
        // A time that is not known stands for whatever the file has.
        is_same(hz, frequency, SAME_FREQUENCY) && (times.contains(&None) || times.iter().any(same_time))
    };
    let left = known.range_models.iter().filter(|model| !replaced(model.integration_time_s, model.modulation_hz));
    let left: Vec<String> = left
        .map(|model| format!("{} s at {} MHz", model.integration_time_s, model.modulation_hz.round() / 1e6))
        .collect();
    (!left.is_empty()).then(|| {
        let pattern = if known.fixed_pattern.is_some() { "; the fixed pattern was found with them" } else { "" };
        format!(
            "range terms of {} stay behind in {}: they belong to another integration time or frequency than those of this \
             survey{pattern}. Frames like that need a calibration of their own",
            left.join(", "),
            start.words
        )
    })
}

/// Terms held at the values of another integration time.
fn held(start: &Start, known: &Calibration, outcome: &CalibrationOutcome, times: &[Option<f64>]) -> Option<String> {
    // The start values are those of the shortest time.
    let frequency = start.modulation.frequency_hz();
    let own = known.range_models.iter().filter(|model| is_same(model.modulation_hz, frequency, SAME_FREQUENCY));
    let first = own.map(|model| model.integration_time_s).min_by(f64::total_cmp)?;
    if times.iter().all(|time| time.is_none_or(|time| is_same(time, first, SAME))) {
        return None;
    }
    let range_terms = start.range_model.parameter_names();
    let is_held = |parameter: &&self_calibration::CalibratedParameter| {
        parameter.status == ParameterStatus::Held && parameter.value != 0.0 && range_terms.contains(&parameter.name)
    };
    let names: Vec<&str> = outcome.parameters.iter().filter(is_held).map(|held| held.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} are held at what {} has for {first} s, another integration time than that of this survey: estimate them",
            names.join(", "),
            start.words
        )
    })
}
