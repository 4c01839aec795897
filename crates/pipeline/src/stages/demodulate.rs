use range_image::{
    ComplexFrame, ConsistencyOptions, DemodulationOptions, Demodulator, InterferenceOptions, NoiseModel, RawFrame,
    RulesVerdict, check_samples, tell_interference,
};

use crate::stages::line::Making;
use crate::stages::{Found, ViewStage};
use crate::survey::open::OpenSurvey;
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::DemodulateOptions;

/// Raw samples to complex images, with the conventions that the survey states.
pub(super) struct Demodulate {
    options: DemodulationOptions,
    demodulator: Demodulator,
    consistency: Option<ConsistencyOptions>,
    interference: InterferenceOptions,
}

impl Demodulate {
    pub(super) fn new(options: &DemodulateOptions, making: &mut Making<'_>) -> Result<Self> {
        let (consistency, interference) = (options.consistency.clone(), options.interference);
        let options = demodulation_options(making.survey, options);
        making.low_amplitude = options.low_amplitude;
        // What breaks a rule cannot be told without a measure.
        let consistency = consistency.filter(|check| options.noise.is_known() || check.tolerance > 0.0);
        let demodulator = Demodulator::new(&options).map_err(Error::stage("Demodulate", "options"))?;
        Ok(Self { options, demodulator, consistency, interference })
    }
}

impl ViewStage for Demodulate {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        found.add("frames", 1);
        let (mut inconsistent, mut disturbed) = (0, false);
        if let ViewData::Samples(raw) = &view.data {
            let fail = |error| Error::stage("Demodulate", &view.name())(error);
            let mut frame = ComplexFrame::empty();
            self.demodulator.demodulate_into(raw, &mut frame).map_err(fail)?;
            if let Some(check) = &self.consistency {
                inconsistent = check_frame(raw, &self.options, check, &mut frame).map_err(fail)?;
                let share = tell_interference(&mut frame, &self.interference).map_err(fail)?;
                disturbed = share >= self.interference.least_share;
            }
            view.data = ViewData::Phase(frame);
            view.before = view.snapshot();
        }
        if self.consistency.is_some() {
            found.add("inconsistent_px", inconsistent);
            found.add("frames_with_interference", usize::from(disturbed));
        }
        Ok(())
    }
}

/// Flags pixels whose samples contradict each other; their number.
fn check_frame(
    raw: &RawFrame,
    options: &DemodulationOptions,
    check: &ConsistencyOptions,
    frame: &mut ComplexFrame,
) -> std::result::Result<usize, range_image::Error> {
    match check_samples(raw, options, check, &mut frame.flags)?.rules {
        RulesVerdict::NothingToCheck => Ok(0),
        RulesVerdict::Checked { inconsistent, .. } => Ok(inconsistent),
    }
}

fn demodulation_options(survey: &OpenSurvey, options: &DemodulateOptions) -> DemodulationOptions {
    let stated = options
        .noise
        .map(|noise| NoiseModel { shot_variance_per_unit: noise.shot_variance_per_unit, dark_sigma: noise.dark_sigma });
    let camera = &survey.survey.camera;
    let calibrated = survey.calibration.as_ref().and_then(|calibration| calibration.noise);
    DemodulationOptions {
        noise: stated.or(calibrated).unwrap_or_default(),
        low_amplitude: options.low_amplitude,
        phase_sense: camera.phase_sense,
        phase_offset_rad: camera.phase_offset_rad,
        raw_scale: camera.raw_scale,
        saturation: camera.saturation,
    }
}
