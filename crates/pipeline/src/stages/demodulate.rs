use range_image::{
    ComplexFrame, ConsistencyOptions, DemodulationOptions, Demodulator, NoiseModel, RawFrame, RulesVerdict,
    check_samples, tell_interference,
};

use crate::command::progress::Progress;
use crate::plan::DemodulateOptions;
use crate::stages::Findings;
use crate::survey::view::ViewData;
use crate::survey::work::Work;
use crate::{Error, Result};

/// Raw samples to complex images, with the conventions that the survey states.
pub(super) fn run(work: &mut Work, options: &DemodulateOptions, progress: &dyn Progress) -> Result<Findings> {
    let (consistency, interference) = (options.consistency.clone(), options.interference);
    let options = demodulation_options(work, options);
    work.low_amplitude = options.low_amplitude;
    // What breaks a rule cannot be told without a measure.
    let consistency = consistency.filter(|check| options.noise.is_known() || check.tolerance > 0.0);
    let demodulator = Demodulator::new(&options).map_err(Error::stage("Demodulate", "options"))?;
    let total = work.outcome.views.len();
    let (mut inconsistent, mut disturbed) = (0, 0);
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        if let ViewData::Samples(raw) = &view.data {
            let mut frame = ComplexFrame::empty();
            let demodulated = demodulator.demodulate_into(raw, &mut frame);
            demodulated.map_err(Error::stage("Demodulate", &view.name()))?;
            if let Some(check) = &consistency {
                let found = check_frame(raw, &options, check, &mut frame);
                inconsistent += found.map_err(Error::stage("Demodulate", &view.name()))?;
                let share = tell_interference(&mut frame, &interference);
                let share = share.map_err(Error::stage("Demodulate", &view.name()))?;
                disturbed += usize::from(share >= interference.least_share);
            }
            view.data = ViewData::Phase(frame);
            view.before = view.snapshot();
        }
        progress.advance(index + 1);
    }
    let mut findings = Findings::from([("frames".to_owned(), total as f64)]);
    if consistency.is_some() {
        findings.insert("inconsistent_px".to_owned(), inconsistent as f64);
        findings.insert("frames_with_interference".to_owned(), disturbed as f64);
    }
    Ok(findings)
}

/// Flags pixels whose samples contradict each other; their number.
fn check_frame(
    raw: &RawFrame,
    options: &DemodulationOptions,
    check: &ConsistencyOptions,
    frame: &mut ComplexFrame,
) -> range_image::Result<usize> {
    match check_samples(raw, options, check, &mut frame.flags)?.rules {
        RulesVerdict::NothingToCheck => Ok(0),
        RulesVerdict::Checked { inconsistent, .. } => Ok(inconsistent),
    }
}

fn demodulation_options(work: &Work, options: &DemodulateOptions) -> DemodulationOptions {
    let stated = options
        .noise
        .map(|noise| NoiseModel { shot_variance_per_unit: noise.shot_variance_per_unit, dark_sigma: noise.dark_sigma });
    let camera = &work.outcome.survey.camera;
    let calibrated = work.calibration.as_ref().and_then(|calibration| calibration.noise);
    DemodulationOptions {
        noise: stated.or(calibrated).unwrap_or_default(),
        low_amplitude: options.low_amplitude,
        phase_sense: camera.phase_sense,
        phase_offset_rad: camera.phase_offset_rad,
        raw_scale: camera.raw_scale,
        saturation: camera.saturation,
    }
}
