//! Whether a calibration is one of the camera that a survey was taken with, in the mode in which it was taken.

use camera_model::Camera;
use error_models::ModelSet;
use range_image::Modulation;
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey};

use crate::survey::drift::DriftCurve;
use crate::survey::view::view_name;
use crate::{Error, Result};
use commands::plan::{DriftTreatment, Stage};
use commands::{Doubt, DoubtKind};

/// Integration time written where neither tables nor frames state one. A correction chooses the only model there is,
/// whatever its time, for frames that state none either.
pub const UNKNOWN_INTEGRATION_TIME_S: f64 = 1.0;

/// Pitches (relative) that are the same: data sheets round to two or three digits, and the sensors of one format differ
/// by tens of per cent.
const SAME_PITCH: f64 = 0.01;
/// Principal distances (relative) of one lens: makers state focal lengths to 5 %, focusing on half a metre adds 2 % to
/// one of 10 mm. The lenses that one camera is sold with differ by 25 % and more.
const SAME_LENS: f64 = 0.10;
/// Modulation frequencies (relative) that are the same: a group refractive index of air makes 0.0003; the channels that
/// keep cameras apart differ by 0.03. At 10 m it is 10 mm.
const SAME_FREQUENCY: f64 = 1e-3;
/// Times (relative) that are the same: they went through a file or a unit's conversion.
const SAME_TIME: f64 = 1e-6;

/// What the calibration is wanted for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Its camera alone, start values, or the file that a further term is added to.
    Camera,
    /// Its range models are taken off the ranges of all frames, and its drift as told.
    Ranges(DriftTreatment),
}

/// A calibration that fits a survey.
#[derive(Debug)]
pub struct Fit {
    /// The calibrated camera.
    pub camera: Camera,
    /// Frames that the calibration says nothing of.
    pub doubts: Vec<Doubt>,
}

impl Purpose {
    /// What stages do with a calibration.
    pub fn of(stages: &[Stage]) -> Self {
        let corrects = stages.iter().find_map(|stage| match stage {
            Stage::CorrectRange(options) => Some(options.warm_up),
            _ => None,
        });
        corrects.map_or(Self::Camera, Self::Ranges)
    }
}

/// Holds a calibration against what `survey.ron` says of camera and frames.
///
/// # Errors
/// [`Error::Incompatible`] with both values and what to do, for another camera (size or pitch of the pixels, principal
/// distance) or modulation frequency, and where ranges are to be corrected, for integration times without a model, times
/// and temperatures outside the drift of a warming camera, and a span that no frame is in.
pub fn compatible(survey: &Survey, calibration: &Calibration, purpose: Purpose) -> Result<Fit> {
    let camera = camera(survey, calibration)?;
    let set = model_set(survey, calibration)?;
    let mut doubts = Vec::new();
    if let Purpose::Ranges(drift) = purpose {
        integration_times(survey, calibration, &set)?;
        if drift == DriftTreatment::Apply {
            drift_known(survey, calibration)?;
        }
        doubts = spans(survey, calibration)?;
    }
    Ok(Fit { camera, doubts })
}

fn refused(words: String) -> Error {
    Error::Incompatible(words)
}

fn differs(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() > relative * a.abs().max(b.abs())
}

fn camera(survey: &Survey, calibration: &Calibration) -> Result<Camera> {
    let (camera, nominal) = (calibration.camera()?, survey.camera.nominal_camera()?);
    let (have, want) = (camera.format, nominal.format);
    if (have.width, have.height) != (want.width, want.height) {
        return Err(refused(format!(
            "the calibration is for {} x {} pixels, the survey has {} x {}: name the calibration of this camera",
            have.width, have.height, want.width, want.height
        )));
    }
    let ([x, y], [nominal_x, nominal_y]) = (have.pixel_pitch_mm, want.pixel_pitch_mm);
    if differs(x, nominal_x, SAME_PITCH) || differs(y, nominal_y, SAME_PITCH) {
        return Err(refused(format!(
            "the calibration is for pixels of {x} x {y} mm, survey.ron states {nominal_x} x {nominal_y} mm: name the \
             calibration of this camera, or correct camera.pixel_pitch_mm"
        )));
    }
    let (c, nominal_c) = (camera.interior.principal_distance_mm, nominal.interior.principal_distance_mm);
    if differs(c, nominal_c, SAME_LENS) {
        return Err(refused(format!(
            "the calibration has a principal distance of {c} mm, survey.ron states {nominal_c} mm, {:.0} % apart (lenses of \
             one kind stay within {:.0} %): name the calibration of this camera, or correct camera.principal_distance_mm",
            100.0 * (c - nominal_c).abs() / c.max(nominal_c),
            100.0 * SAME_LENS
        )));
    }
    Ok(camera)
}

/// The range models for the frequencies of a survey, in their order there; all models where the survey states none.
pub fn model_set(survey: &Survey, calibration: &Calibration) -> Result<ModelSet> {
    let mut set = calibration.model_set()?;
    let (wanted, known) = (survey.camera.modulations()?, calibration.modulations()?);
    if wanted.is_empty() || known.is_empty() {
        return Ok(set);
    }
    let place = |one: &Modulation| {
        let off = |other: &Modulation| (other.frequency_hz() / one.frequency_hz() - 1.0).abs();
        let nearest = (0..known.len()).min_by(|&a, &b| off(&known[a]).total_cmp(&off(&known[b])));
        nearest.filter(|&index| off(&known[index]) <= SAME_FREQUENCY)
    };
    let places: Vec<Option<usize>> = wanted.iter().map(place).collect();
    // The one range of a camera that has made it of its frequencies has one model, named after any of them.
    let places: Vec<usize> = match survey.level {
        Level::Range | Level::Depth if places.iter().any(Option::is_some) => places.into_iter().flatten().collect(),
        _ => places
            .into_iter()
            .zip(&wanted)
            .map(|(place, one)| place.ok_or_else(|| without_model(one, &known)))
            .collect::<Result<_>>()?,
    };
    for (_, models) in &mut set.entries {
        *models = places.iter().map(|&place| models[place].clone()).collect();
    }
    Ok(set)
}

fn without_model(wanted: &Modulation, known: &[Modulation]) -> Error {
    refused(format!(
        "the survey's frames are modulated at {}, the calibration has range models for {}: name a calibration for {}, or \
         correct camera.modulation_hz in survey.ron",
        megahertz(wanted),
        known.iter().map(megahertz).collect::<Vec<_>>().join(", "),
        megahertz(wanted)
    ))
}

/// A frequency to the hertz, as a conversion from an interval may have changed its last digits.
fn megahertz(modulation: &Modulation) -> String {
    format!("{} MHz", modulation.frequency_hz().round() / 1e6)
}

fn integration_times(survey: &Survey, calibration: &Calibration, set: &ModelSet) -> Result<()> {
    if set.entries.is_empty() {
        return Ok(());
    }
    let have: Vec<String> = set.entries.iter().map(|(time, _)| format!("{time} s")).collect();
    let have = have.join(", ");
    let mut sound: Vec<f64> = Vec::new();
    for (index, frame) in survey.frames.iter().enumerate() {
        match frame.integration_time_s {
            Some(time) if sound.contains(&time) => {}
            Some(time) => {
                set.at(time).map_err(|error| match error {
                    error_models::Error::NoModelForIntegrationTime { .. } if is_untimed(calibration) => {
                        refused(without_time(calibration, time, index))
                    }
                    error_models::Error::NoModelForIntegrationTime { .. } => refused(format!(
                        "no range model for an integration time of {time} s (frame {index}); the calibration has {have}: \
                         calibrate at {time} s as well, or correct integration_time_s of the frame in survey.ron"
                    )),
                    error => refused(format!("integration time of {time} s (frame {index}): {error}")),
                })?;
                sound.push(time);
            }
            None if set.entries.len() > 1 => {
                return Err(refused(format!(
                    "the survey states no integration time of frame {index}, which the calibration's models are chosen by; \
                     it has {have}: state integration_time_s of the frame in survey.ron"
                )));
            }
            None => {}
        }
    }
    Ok(())
}

/// Whether a calibration's own survey stated no integration time.
fn is_untimed(calibration: &Calibration) -> bool {
    let stand_in = |time: f64| time.to_bits() == UNKNOWN_INTEGRATION_TIME_S.to_bits();
    calibration.span.integration_time_s.is_none()
        && calibration.range_models.iter().all(|model| stand_in(model.integration_time_s))
}

fn without_time(calibration: &Calibration, time: f64, frame: usize) -> String {
    let survey = &calibration.provenance.survey;
    let of = if survey.is_empty() {
        "the survey that it was made from".to_owned()
    } else {
        format!("`{survey}`, which it was made from,")
    };
    format!(
        "survey.ron states integration_time_s {time} of frame {frame}, and the calibration belongs to no integration time \
         ({UNKNOWN_INTEGRATION_TIME_S} s in it is a stand-in), as {of} stated none in observations.csv or survey.ron: state \
         integration_time_s there, or give `rangecam calibrate --integration-time {time}` if it was the same, and calibrate \
         again"
    )
}

/// The drift of a warming camera must be known at all frames, unless the survey has an optical reference instead.
fn drift_known(survey: &Survey, calibration: &Calibration) -> Result<()> {
    let Some(calibrated) = calibration.warm_up.as_ref().filter(|_| survey.reference_path.is_none()) else {
        return Ok(());
    };
    let curve = DriftCurve::new(calibrated, survey).map_err(|error| refused(error.to_string()))?;
    for (index, frame) in survey.frames.iter().enumerate() {
        let view = view_name(&frame.station, &[index]);
        let known = curve.of_frames(String::new(), &[index], survey);
        known.map_err(|error| refused(format!("{view}: {error}")))?;
    }
    Ok(())
}

/// Integration times and temperatures of the frames that the calibration's span leaves out.
fn spans(survey: &Survey, calibration: &Calibration) -> Result<Vec<Doubt>> {
    let span = &calibration.span;
    let frames = || survey.frames.iter();
    let times = frames().map(|frame| frame.integration_time_s).collect();
    let temperatures = frames().map(|frame| frame.temperature_c).collect();
    let kinds = [
        ("integration time", "s", "integration_time_s", span.integration_time_s, times),
        ("temperature", "degrees Celsius", "temperature_c", span.temperature_c, temperatures),
    ];
    let mut doubts = Vec::new();
    for (what, unit, field, span, values) in kinds {
        let Some([low, high]) = span else { continue };
        let values: Vec<Option<f64>> = values;
        let known = values.iter().flatten().count();
        let beyond = |value: f64| value < low - SAME_TIME * low.abs() || value > high + SAME_TIME * high.abs();
        let outside: Vec<(usize, f64)> = values
            .iter()
            .enumerate()
            .filter_map(|(index, value)| value.filter(|value| beyond(*value)).map(|value| (index, value)))
            .collect();
        let Some((first, value)) = outside.first() else { continue };
        let words = format!(
            "the calibration's span of {what} is {low} to {high} {unit}, and {} of {known} frames are outside it (frame \
             {first}: {value} {unit}): calibrate there, or correct {field} in survey.ron",
            outside.len()
        );
        if outside.len() == known {
            return Err(refused(words));
        }
        doubts.push(Doubt::new(DoubtKind::OutsideSpan, words));
    }
    Ok(doubts)
}
