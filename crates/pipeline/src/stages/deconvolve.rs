use std::sync::{Mutex, PoisonError};

use range_image::ComplexFrame;
use scattering_deconvolution::{
    OutsideLight, OutsideLightDetector, OutsideLightOptions, OutsideLightVerdict, Psf, RestorationOptions, Restorer,
    Side,
};

use crate::stages::line::Making;
use crate::stages::{Findings, Found, ViewStage};
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::DeconvolveOptions;
use commands::{Doubt, DoubtKind};

/// The calibrated point spread function is taken off the complex images; pixels whose correction depends on light that
/// is not known, saturated or from outside the field of view, are flagged.
pub(super) struct Deconvolve {
    psf: Psf,
    options: RestorationOptions,
    /// Of the last images: as many as there were at the same time.
    tools: Mutex<Vec<Tools>>,
}

impl Deconvolve {
    pub(super) fn new(options: &DeconvolveOptions, making: &Making<'_>) -> Result<Self> {
        let psf = making.survey.calibration.as_ref().and_then(|calibration| calibration.scattering.clone());
        let Some(psf) = psf else {
            return Err(Error::Camera(
                "stage Deconvolve needs a point spread function, but the calibration has no `scattering`".to_owned(),
            ));
        };
        let options = RestorationOptions { regularisation: options.regularisation, ..RestorationOptions::default() };
        Ok(Self { psf, options, tools: Mutex::default() })
    }
}

impl ViewStage for Deconvolve {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let (name, size) = (view.name(), view.size());
        let fail = |error| Error::stage("Deconvolve", &name)(error);
        let ViewData::Phase(frame) = &mut view.data else {
            return Err(Error::Needs { stage: "Deconvolve", needs: "Demodulate" });
        };
        let tools = || self.tools.lock().unwrap_or_else(PoisonError::into_inner);
        // Not locked while they work: that is shared among threads, which may then take up another view.
        let kept = tools().pop().filter(|kept| kept.size == size);
        let mut own = kept.map_or_else(|| Tools::new(&self.psf, size, &self.options), Ok).map_err(fail)?;
        let light = own.apply(frame).map_err(fail)?;
        tools().push(own);
        found.add("dependent_px", light.dependent);
        found.add("views_with_outside_light", usize::from(light.outside_light.is_some()));
        found.doubts.extend(light.outside_light.and_then(|light| doubt(&view.station, &light, size)));
        Ok(())
    }

    fn findings(&self, found: &Found) -> Findings {
        let mut findings = found.sums.clone();
        findings.insert("scattered_share".to_owned(), self.psf.total_weight());
        findings
    }
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

struct Light {
    dependent: usize,
    /// Of the frequency in which it flags most.
    outside_light: Option<OutsideLight>,
}

impl Tools {
    fn new(
        psf: &Psf,
        size: (usize, usize),
        options: &RestorationOptions,
    ) -> std::result::Result<Self, scattering_deconvolution::Error> {
        let (width, height) = size;
        let restorer = Restorer::new(psf, width, height, options)?;
        let detector = if psf.is_empty() {
            None
        } else {
            Some(OutsideLightDetector::new(psf, width, height, &OutsideLightOptions::default())?)
        };
        Ok(Self { size, restorer, detector })
    }

    fn apply(&mut self, frame: &mut ComplexFrame) -> std::result::Result<Light, scattering_deconvolution::Error> {
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
        Ok(Light { dependent: summaries.iter().map(|summary| summary.dependent_pixels).sum(), outside_light })
    }
}
