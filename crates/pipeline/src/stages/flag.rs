use error_models::{GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
use range_image::Flags;

use super::Findings;
use crate::plan::FlagOptions;
use crate::progress::Progress;
use crate::view::ViewData;
use crate::work::Work;
use crate::{Error, Result};

/// Gross errors get a flag with their reason; no value is changed.
pub(super) fn run(work: &mut Work, options: &FlagOptions, progress: &dyn Progress) -> Result<Findings> {
    let maximum_sigma_m = options.maximum_sigma_m.unwrap_or(f64::INFINITY);
    let mixed_pixels = MixedPixelOptions {
        sigmas: options.mixed_pixels.sigmas,
        floor_m: options.mixed_pixels.floor_m,
        ..MixedPixelOptions::default()
    };
    let options = GrossErrorOptions { mixed_pixels: Some(mixed_pixels), low_amplitude: options.low_amplitude };
    let mut mixed = 0_usize;
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let name = view.name();
        let ViewData::Range(frame) = &mut view.data else {
            return Err(Error::Needs { stage: "Flag", needs: "Unwrap" });
        };
        let counts = flag_gross_errors(frame, &options).map_err(Error::stage("Flag", &name))?;
        mixed += counts.mixed_pixel;
        for (sigma, flags) in frame.sigma.as_slice().iter().zip(frame.flags.as_mut_slice()) {
            if f64::from(*sigma) > maximum_sigma_m {
                flags.insert(Flags::LOW_AMPLITUDE);
            }
        }
        if let Some(cloud) = work.outcome.clouds.get_mut(index) {
            cloud.flags.copy_from_slice(frame.flags.as_slice());
        }
        progress.advance(index + 1);
    }
    Ok(Findings::from([("mixed_pixels".to_owned(), mixed as f64)]))
}
