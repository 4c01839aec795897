use std::sync::Arc;

use camera_model::RayTable;
use error_models::{GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
use multipath::{
    ComplexImage, MixedPixelTreatment, MixedPixels, SplitOptions, SurfacePoint, estimate_response, treat_mixed_pixels,
};
use range_image::Flags;

use crate::stages::line::Making;
use crate::stages::multipath::RESPONSE_SNR;
use crate::stages::{Found, ViewStage};
use crate::survey::view::{FurtherPoint, View, ViewData};
use crate::{Error, Result};
use commands::plan::FlagOptions;

/// Gross errors get a flag with their reason; no value is changed, but of mixed pixels that are to be dropped.
pub(super) struct Flag {
    options: FlagOptions,
    rays: Arc<RayTable>,
}

impl Flag {
    pub(super) fn new(options: &FlagOptions, making: &Making<'_>) -> Self {
        Self { options: *options, rays: Arc::clone(&making.rays) }
    }
}

impl ViewStage for Flag {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let name = view.name();
        let ViewData::Range(frame) = &mut view.data else {
            return Err(Error::Needs { stage: "Flag", needs: "Unwrap" });
        };
        let FlagOptions { low_amplitude, maximum_sigma_m, mixed_pixels } = self.options;
        let gross = MixedPixelOptions {
            sigmas: mixed_pixels.sigmas,
            floor_m: mixed_pixels.floor_m,
            ambiguity_interval_m: view.modulation.map(|modulation| modulation.ambiguity_interval_m()),
            ..MixedPixelOptions::default()
        };
        let gross = GrossErrorOptions { mixed_pixels: Some(gross), low_amplitude };
        let counts = flag_gross_errors(frame, &gross).map_err(Error::stage("Flag", &name))?;
        found.add("mixed_pixels", counts.mixed_pixel);
        for (sigma, flags) in frame.sigma.as_slice().iter().zip(frame.flags.as_mut_slice()) {
            if maximum_sigma_m.is_some_and(|maximum_m| f64::from(*sigma) > maximum_m) {
                flags.insert(Flags::LOW_AMPLITUDE);
            }
        }
        let treated = treat(view, mixed_pixels.treatment)?;
        if mixed_pixels.treatment == MixedPixelTreatment::Split {
            found.add("split_pixels", treated.split.len());
        }
        view.further_points = further_points(&treated, &self.rays);
        let (ViewData::Range(frame), Some(cloud)) = (&view.data, &mut view.cloud) else { return Ok(()) };
        cloud.flags.copy_from_slice(frame.flags.as_slice());
        let dropped = frame.range.as_slice().iter().map(|range| range.is_nan());
        for (point, _) in cloud.points.iter_mut().zip(dropped).filter(|(_, dropped)| *dropped) {
            *point = [f64::NAN; 3];
        }
        Ok(())
    }
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
fn further_points(mixed: &MixedPixels, rays: &RayTable) -> Vec<FurtherPoint> {
    let surfaces = mixed.split.iter().flat_map(|pixel| {
        let direction = rays.direction(pixel.col, pixel.row);
        [pixel.foreground, pixel.background].map(|surface: SurfacePoint| FurtherPoint {
            point: (surface.range_m * direction).into(),
            sigma_m: surface.sigma_m as f32,
            amplitude: surface.amplitude as f32,
        })
    });
    surfaces.collect()
}
