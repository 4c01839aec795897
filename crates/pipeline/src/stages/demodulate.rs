use range_image::{ComplexFrame, DemodulationOptions, Demodulator, NoiseModel};

use super::Findings;
use crate::plan::DemodulateOptions;
use crate::progress::Progress;
use crate::view::ViewData;
use crate::work::Work;
use crate::{Error, Result};

/// Raw samples to complex images, with the conventions that the survey states.
pub(super) fn run(work: &mut Work, options: &DemodulateOptions, progress: &dyn Progress) -> Result<Findings> {
    let options = demodulation_options(work, options);
    let demodulator = Demodulator::new(&options).map_err(Error::stage("Demodulate", "options"))?;
    let total = work.outcome.views.len();
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        if let ViewData::Samples(raw) = &view.data {
            let mut frame = ComplexFrame::empty();
            let demodulated = demodulator.demodulate_into(raw, &mut frame);
            demodulated.map_err(Error::stage("Demodulate", &view.name()))?;
            view.data = ViewData::Phase(frame);
            view.before = view.snapshot();
        }
        progress.advance(index + 1);
    }
    Ok(Findings::from([("frames".to_owned(), total as f64)]))
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
