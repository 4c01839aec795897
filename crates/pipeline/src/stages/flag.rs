use camera_model::RayTable;
use error_models::{GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
use multipath::{
    ComplexImage, MixedPixelTreatment, MixedPixels, SplitOptions, SurfacePoint, estimate_response, treat_mixed_pixels,
};
use range_image::Flags;

use crate::command::progress::Progress;
use crate::plan::FlagOptions;
use crate::stages::Findings;
use crate::stages::multipath::RESPONSE_SNR;
use crate::survey::outcome::FurtherPoint;
use crate::survey::view::{View, ViewData};
use crate::survey::work::Work;
use crate::{Error, Result};

/// Gross errors get a flag with their reason; no value is changed, but of mixed pixels that are to be dropped.
pub(super) fn run(work: &mut Work, options: &FlagOptions, progress: &dyn Progress) -> Result<Findings> {
    let maximum_sigma_m = options.maximum_sigma_m.unwrap_or(f64::INFINITY);
    let mixed_pixels = MixedPixelOptions {
        sigmas: options.mixed_pixels.sigmas,
        floor_m: options.mixed_pixels.floor_m,
        ..MixedPixelOptions::default()
    };
    let gross = GrossErrorOptions { mixed_pixels: Some(mixed_pixels), low_amplitude: options.low_amplitude };
    let (mut mixed, mut split) = (0_usize, 0_usize);
    work.outcome.further_points.clear();
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let name = view.name();
        let ViewData::Range(frame) = &mut view.data else {
            return Err(Error::Needs { stage: "Flag", needs: "Unwrap" });
        };
        let counts = flag_gross_errors(frame, &gross).map_err(Error::stage("Flag", &name))?;
        mixed += counts.mixed_pixel;
        for (sigma, flags) in frame.sigma.as_slice().iter().zip(frame.flags.as_mut_slice()) {
            if f64::from(*sigma) > maximum_sigma_m {
                flags.insert(Flags::LOW_AMPLITUDE);
            }
        }
        let treated = treat(view, options.mixed_pixels.treatment)?;
        split += treated.split.len();
        work.outcome.further_points.extend(further_points(index, &treated, &work.rays));
        let ViewData::Range(frame) = &view.data else { continue };
        if let Some(cloud) = work.outcome.clouds.get_mut(index) {
            cloud.flags.copy_from_slice(frame.flags.as_slice());
            let dropped = frame.range.as_slice().iter().map(|range| range.is_nan());
            for (point, _) in cloud.points.iter_mut().zip(dropped).filter(|(_, dropped)| *dropped) {
                *point = [f64::NAN; 3];
            }
        }
        progress.advance(index + 1);
    }
    let mut findings = Findings::from([("mixed_pixels".to_owned(), mixed as f64)]);
    if options.mixed_pixels.treatment == MixedPixelTreatment::Split {
        findings.insert("split_pixels".to_owned(), split as f64);
    }
    Ok(findings)
}

/// Mixed pixels stay flagged, lose their value, or give a point on each of their two surfaces besides.
fn treat(view: &mut View, treatment: MixedPixelTreatment) -> Result<MixedPixels> {
    let name = view.name();
    let complex = view.complex_channels();
    let response = complex.as_ref().and_then(|frame| estimate_response(frame, RESPONSE_SNR).ok());
    // Too few bright pixels to estimate it: then the ranges alone tell.
    let response = response.map(|estimate| estimate.response);
    let image = complex.as_ref().zip(response.as_ref()).map(|(frame, response)| ComplexImage { frame, response });
    let modulation_hz = view.modulation.map(|modulation| modulation.frequency_hz());
    let ViewData::Range(frame) = &mut view.data else { return Ok(MixedPixels::default()) };
    let mixed = frame.flags.map(|flags| flags.contains(Flags::MIXED_PIXEL));
    let options = SplitOptions { modulation_hz, ..SplitOptions::default() };
    treat_mixed_pixels(frame, &mixed, image.as_ref(), treatment, &options).map_err(Error::stage("Flag", &name))
}

/// The surfaces of split pixels in the camera's frame.
fn further_points<'a>(
    view: usize,
    mixed: &'a MixedPixels,
    rays: &'a RayTable,
) -> impl Iterator<Item = FurtherPoint> + 'a {
    mixed.split.iter().flat_map(move |pixel| {
        let direction = rays.direction(pixel.col, pixel.row);
        [pixel.foreground, pixel.background].map(|surface: SurfacePoint| FurtherPoint {
            view,
            point: (surface.range_m * direction).into(),
            sigma_m: surface.sigma_m as f32,
            amplitude: surface.amplitude as f32,
        })
    })
}
