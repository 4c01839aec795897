use range_image::ComplexFrame;
use scattering_deconvolution::{
    OutsideLight, OutsideLightDetector, OutsideLightOptions, OutsideLightVerdict, Psf, RestorationOptions, Restorer,
    Side,
};

use crate::command::progress::Progress;
use crate::command::verdict::{Doubt, DoubtKind};
use crate::plan::DeconvolveOptions;
use crate::stages::Findings;
use crate::survey::view::ViewData;
use crate::survey::work::Work;
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
    let (mut dependent, mut suspected, mut doubts) = (0, 0, Vec::new());
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
            suspected += usize::from(found.outside_light.is_some());
            doubts.extend(found.outside_light.and_then(|light| doubt(&view.station, &light, size)));
        }
        progress.advance(index + 1);
    }
    work.outcome.doubts.extend(doubts);
    Ok(Findings::from([
        ("scattered_share".to_owned(), psf.total_weight()),
        ("dependent_px".to_owned(), dependent as f64),
        ("views_with_outside_light".to_owned(), suspected as f64),
    ]))
}

/// What to say where light from outside spoils pixels.
fn doubt(station: &str, light: &OutsideLight, (width, height): (usize, usize)) -> Option<Doubt> {
    let side = match light.suspected_side {
        Side::Left => "left",
        Side::Right => "right",
        Side::Top => "upper",
        Side::Bottom => "lower",
    };
    let words = format!(
        "light from beyond the {side} border seems to be scattered into the image, {:.1} units of amplitude at the border \
         (by chance: one in {:.0}): {:.1} % of its pixels are flagged multipath; take what is bright out of sight, or leave \
         them out",
        light.strength,
        1.0 / light.p_value.max(1e-9),
        100.0 * light.flagged_pixels as f64 / (width * height) as f64
    );
    (light.flagged_pixels > 0).then(|| Doubt::about(DoubtKind::OutsideLight, station, words))
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
    /// Of the frequency in which it flags most.
    outside_light: Option<OutsideLight>,
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
        let mut outside_light: Option<OutsideLight> = None;
        if let Some(detector) = &self.detector {
            for channel in &frame.channels {
                if let OutsideLightVerdict::Suspected(light) = detector.detect(channel, &mut frame.flags)? {
                    let more = |other: &OutsideLight| light.flagged_pixels > other.flagged_pixels;
                    if outside_light.as_ref().is_none_or(more) {
                        outside_light = Some(light);
                    }
                }
            }
        }
        Ok(Found { dependent: summaries.iter().map(|summary| summary.dependent_pixels).sum(), outside_light })
    }
}
