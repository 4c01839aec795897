use scattering_deconvolution::{RestorationOptions, Restorer};

use super::Findings;
use crate::plan::DeconvolveOptions;
use crate::progress::Progress;
use crate::view::ViewData;
use crate::work::Work;
use crate::{Error, Result};

/// The calibrated point spread function is taken off the complex images.
pub(super) fn run(work: &mut Work, options: &DeconvolveOptions, progress: &dyn Progress) -> Result<Findings> {
    let psf = work.calibration.as_ref().and_then(|calibration| calibration.scattering.clone());
    let Some(psf) = psf else {
        return Err(Error::Camera(
            "stage Deconvolve needs a point spread function, but the calibration has no `scattering`".to_owned(),
        ));
    };
    let options = RestorationOptions { regularisation: options.regularisation, ..RestorationOptions::default() };
    let mut restorer: Option<(usize, usize, Restorer)> = None;
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let name = view.name();
        let (width, height) = view.size();
        let ViewData::Phase(frame) = &mut view.data else {
            return Err(Error::Needs { stage: "Deconvolve", needs: "Demodulate" });
        };
        if restorer.as_ref().is_none_or(|(w, h, _)| (*w, *h) != (width, height)) {
            let made = Restorer::new(&psf, width, height, &options).map_err(Error::stage("Deconvolve", &name))?;
            restorer = Some((width, height, made));
        }
        if let Some((_, _, restorer)) = &mut restorer {
            for channel in &mut frame.channels {
                restorer.restore_flagged(channel, &frame.flags).map_err(Error::stage("Deconvolve", &name))?;
            }
        }
        progress.advance(index + 1);
    }
    Ok(Findings::from([("scattered_share".to_owned(), psf.total_weight())]))
}
