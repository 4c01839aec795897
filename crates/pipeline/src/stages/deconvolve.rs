use range_image::ComplexFrame;
use scattering_deconvolution::{
    OutsideLightDetector, OutsideLightOptions, OutsideLightVerdict, Psf, RestorationOptions, Restorer,
};

use super::Findings;
use crate::plan::DeconvolveOptions;
use crate::progress::Progress;
use crate::view::ViewData;
use crate::work::Work;
use crate::{Error, Result};

/// The calibrated point spread function is taken off the complex images; pixels whose correction depends on light that
/// is not known, saturated or from outside the field of view, are flagged.
pub(super) fn run(work: &mut Work, options: &DeconvolveOptions, progress: &dyn Progress) -> Result<Findings> {
    let psf = work.calibration.as_ref().and_then(|calibration| calibration.scattering.clone());
    let Some(psf) = psf else {
        return Err(Error::Camera(
            "stage Deconvolve needs a point spread function, but the calibration has no `scattering`".to_owned(),
        ));
    };
    let options = RestorationOptions { regularisation: options.regularisation, ..RestorationOptions::default() };
    let mut tools: Option<Tools> = None;
    let (mut dependent, mut suspected) = (0, 0);
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let name = view.name();
        let size = view.size();
        let ViewData::Phase(frame) = &mut view.data else {
            return Err(Error::Needs { stage: "Deconvolve", needs: "Demodulate" });
        };
        if tools.as_ref().is_none_or(|tools| tools.size != size) {
            tools = Some(Tools::new(&psf, size, &options).map_err(Error::stage("Deconvolve", &name))?);
        }
        if let Some(tools) = &mut tools {
            let found = tools.apply(frame).map_err(Error::stage("Deconvolve", &name))?;
            dependent += found.dependent;
            suspected += usize::from(found.outside_light);
        }
        progress.advance(index + 1);
    }
    Ok(Findings::from([
        ("scattered_share".to_owned(), psf.total_weight()),
        ("dependent_px".to_owned(), dependent as f64),
        ("views_with_outside_light".to_owned(), suspected as f64),
    ]))
}

/// What restores images of one size.
struct Tools {
    size: (usize, usize),
    restorer: Restorer,
    /// `None` where nothing is scattered.
    detector: Option<OutsideLightDetector>,
}

struct Found {
    dependent: usize,
    outside_light: bool,
}

impl Tools {
    fn new(psf: &Psf, size: (usize, usize), options: &RestorationOptions) -> scattering_deconvolution::Result<Self> {
        let (width, height) = size;
        let restorer = Restorer::new(psf, width, height, options)?;
        let detector = if psf.is_empty() {
            None
        } else {
            Some(OutsideLightDetector::new(psf, width, height, &OutsideLightOptions::default())?)
        };
        Ok(Self { size, restorer, detector })
    }

    fn apply(&mut self, frame: &mut ComplexFrame) -> scattering_deconvolution::Result<Found> {
        let summaries = self.restorer.restore_frame(frame)?;
        let mut outside_light = false;
        if let Some(detector) = &self.detector {
            for channel in &frame.channels {
                let verdict = detector.detect(channel, &mut frame.flags)?;
                outside_light |= matches!(verdict, OutsideLightVerdict::Suspected(_));
            }
        }
        Ok(Found { dependent: summaries.iter().map(|summary| summary.dependent_pixels).sum(), outside_light })
    }
}
