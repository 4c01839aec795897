//! A primitive adjusted to the ranges of a region.

use camera_model::Camera;
use nalgebra::Vector3;
use range_image::RangeFrame;
use statistics::{Distribution, mad_scale};

use crate::adjustment::{Adjusted, RegionPixel, adjust};
use crate::judge::{require_determined, systematic_sigmas};
use crate::linear_start::start;
use crate::surface::{Hit, Surface};
use crate::{Error, Result};
use crate::{FittedPixel, PrimitiveFit, PrimitiveKind, PrimitiveOptions};

/// Most rounds of choosing pixels; a choice that still changes then is taken as it is.
const MAX_ROUNDS: usize = 20;
/// Pixels further from the primitive than so many standard deviations, or robust scales where these are larger, belong to
/// something else: under normal noise one good pixel in sixteen thousand. More of them keeps mixed pixels in the fit.
const REJECTION_SIGMAS: f64 = 4.0;
/// Largest share of such pixels: a median, by which the start is chosen, bears less than half. Beyond it the region is
/// another primitive's.
const LARGEST_OUTLIER_SHARE: f64 = 0.4;
/// Largest standard deviation of a radius in parts of itself, and of a direction in radian: first-order covariances are worth
/// little beyond. A larger one lets through cylinders of which a narrow strip is seen.
const LARGEST_UNCERTAINTY: f64 = 0.1;

/// Fits a primitive to the ranges of a region of a frame, robustly: averaging in space (Sect. 4).
///
/// What is random in a pixel is its range, so points move along their rays: `ρ + v = ρ(primitive, ray)`, weighted by the
/// frame's sigmas. Start values come from robust linear fits; pixels of other things are left out by their residuals.
/// The answer has the covariance of the primitive and of the range that it gives each pixel.
///
/// `camera` gives the rays with its lens taken off.
///
/// # Errors
/// [`Error::TooFewPixels`]; [`Error::NotThatPrimitive`] where too many pixels belong to something else, or where
/// neighbouring residuals show another shape; [`Error::PrimitiveNotDetermined`] where the region is too small a part of
/// it.
///
/// ```
/// use primitives::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
/// use primitives::range_image::{RangeFrame, Raster};
/// use primitives::{PrimitiveKind, PrimitiveOptions, fit_primitive};
///
/// let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
/// let camera = Camera::new(ImageFormat::new(60, 48, [0.1, 0.1])?, interior, LensDistortion::default())?;
/// // A wall 3 m in front of the camera.
/// let range = Raster::from_fn(60, 48, |col, row| {
///     let noise = 0.005 * (1.7 * col as f64 + 23.1 * (row as f64).sin()).sin();
///     (-3.0 / camera.ray([col as f64, row as f64]).z + noise) as f32
/// });
/// let frame = RangeFrame { sigma: Raster::filled(60, 48, 0.004), ..RangeFrame::from_range(range) };
/// let fit = fit_primitive(&frame, &camera, PrimitiveKind::Plane, &PrimitiveOptions::default())?;
/// assert!(fit.sigma0 < 1.2 && fit.outlier_share() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit_primitive(
    frame: &RangeFrame,
    camera: &Camera,
    kind: PrimitiveKind,
    options: &PrimitiveOptions,
) -> Result<PrimitiveFit> {
    let fit = fit_whatever_shape(frame, camera, kind, options)?;
    let (found, limit) = (fit.systematic_sigmas, options.largest_systematic_sigmas);
    if found > limit {
        return Err(Error::NotThatPrimitive { kind, what: "sigmas that neighbouring residuals share", found, limit });
    }
    Ok(fit)
}

/// [`fit_primitive`] without the test for another shape: what the residuals share is then what is looked for.
pub fn fit_whatever_shape(
    frame: &RangeFrame,
    camera: &Camera,
    kind: PrimitiveKind,
    options: &PrimitiveOptions,
) -> Result<PrimitiveFit> {
    options.validate()?;
    let pixels = region(frame, camera, options)?;
    require_pixels(pixels.len(), kind)?;
    let points: Vec<Vector3<f64>> = pixels.iter().map(|pixel| pixel.ray * pixel.observed_m).collect();
    let (surface, mut parameters) = start(kind, &points, options.seed).ok_or_else(|| nothing(kind))?;
    let mut used = chosen(&pixels, &surface, &parameters, options);
    let mut adjusted = None;
    for _ in 0..MAX_ROUNDS {
        require_pixels(used.iter().filter(|used| **used).count(), kind)?;
        let found = adjust(&pixels, &used, &surface, &parameters)?;
        parameters.clone_from(&found.parameters);
        adjusted = Some(found);
        let next = chosen(&pixels, &surface, &parameters, options);
        if next == used {
            break;
        }
        used = next;
    }
    let adjusted = adjusted.ok_or_else(|| nothing(kind))?;
    let outcome = outcome(kind, &pixels, &used, &surface, adjusted)?;
    let (found, limit) = (outcome.outlier_share(), LARGEST_OUTLIER_SHARE);
    if found > limit {
        return Err(Error::NotThatPrimitive { kind, what: "share of pixels that lie elsewhere", found, limit });
    }
    require_determined(&outcome, LARGEST_UNCERTAINTY)?;
    Ok(PrimitiveFit { systematic_sigmas: systematic_sigmas(&outcome, options.pixels.step), ..outcome })
}

/// No primitive goes through the points: they do not span one.
fn nothing(kind: PrimitiveKind) -> Error {
    Error::PrimitiveNotDetermined { kind, what: "whole of it", sigma: f64::INFINITY, limit: 0.0 }
}

/// Five pixels for each parameter leave something to judge by.
fn require_pixels(pixels: usize, kind: PrimitiveKind) -> Result<()> {
    let needed = 5 * kind.parameters();
    if pixels < needed { Err(Error::TooFewPixels { kind, pixels, needed }) } else { Ok(()) }
}

/// The usable pixels of the region.
fn region(frame: &RangeFrame, camera: &Camera, options: &PrimitiveOptions) -> Result<Vec<RegionPixel>> {
    frame.validate()?;
    camera.validate()?;
    let (width, height) = (camera.format.width, camera.format.height);
    if (frame.width(), frame.height()) != (width, height) {
        let (found_width, found_height) = (frame.width(), frame.height());
        let mismatch = range_image::Error::SizeMismatch { what: "frame", width, height, found_width, found_height };
        return Err(Error::Image(mismatch));
    }
    let pixel = |position: [usize; 2]| {
        let place = (position[0], position[1]);
        let (observed_m, sigma_m) = (f64::from(frame.range[place]), f64::from(frame.sigma[place]));
        let usable =
            observed_m > 0.0 && observed_m.is_finite() && !frame.flags[place].intersects(options.pixels.exclude);
        let known = sigma_m > 0.0 && sigma_m.is_finite();
        let sigma_m = if known { sigma_m } else { options.pixels.unknown_sigma_m };
        let ray = camera.ray(position.map(|index| index as f64));
        usable.then_some(RegionPixel { position, ray, observed_m, sigma_m })
    };
    Ok(options.pixels.positions(width, height).filter_map(pixel).collect())
}

/// Pixels that the surface explains: within so many sigmas, or robust scales where these are larger.
fn chosen(pixels: &[RegionPixel], surface: &Surface, parameters: &[f64], options: &PrimitiveOptions) -> Vec<bool> {
    let smallest_cosine = options.pixels.largest_incidence_rad.cos();
    let standardised: Vec<f64> = pixels
        .iter()
        .map(|pixel| {
            let hit = surface.hit(parameters, &pixel.ray).filter(|hit| hit.cosine >= smallest_cosine);
            hit.map_or(f64::INFINITY, |hit| ((pixel.observed_m - hit.range_m) / pixel.sigma_m).abs())
        })
        .collect();
    let scale = mad_scale(&mut standardised.clone());
    let limit = REJECTION_SIGMAS * if scale.is_finite() { scale.max(1.0) } else { 1.0 };
    standardised.iter().map(|value| *value <= limit).collect()
}

fn outcome(
    kind: PrimitiveKind,
    pixels: &[RegionPixel],
    used: &[bool],
    surface: &Surface,
    adjusted: Adjusted,
) -> Result<PrimitiveFit> {
    let primitive = surface.primitive(&adjusted.parameters).ok_or_else(|| nothing(kind))?;
    let count = kind.parameters();
    let deviation = |hit: &Hit| {
        let row = &hit.derivatives[..count];
        let product = |(column, own): (usize, &f64)| {
            let with = |(row, other): (usize, &f64)| other * adjusted.covariance[(row, column)];
            own * row.iter().enumerate().map(with).sum::<f64>()
        };
        row.iter().enumerate().map(product).sum::<f64>().max(0.0).sqrt()
    };
    let fitted = |(pixel, used): (&RegionPixel, &bool)| {
        let hit = surface.hit(&adjusted.parameters, &pixel.ray);
        FittedPixel {
            position: pixel.position,
            observed_m: pixel.observed_m,
            sigma_m: pixel.sigma_m,
            modelled_m: hit.map_or(f64::NAN, |hit| hit.range_m),
            modelled_sigma_m: hit.map_or(f64::NAN, |hit| deviation(&hit)),
            used: *used,
        }
    };
    let pixels: Vec<FittedPixel> = pixels.iter().zip(used).map(fitted).collect();
    let squares = |of: fn(&FittedPixel) -> f64| pixels.iter().filter(|p| p.used).map(|p| of(p).powi(2)).sum::<f64>();
    let gain = (squares(|pixel| pixel.sigma_m) / squares(|pixel| pixel.modelled_sigma_m)).sqrt();
    let redundancy = adjusted.redundancy as f64;
    Ok(PrimitiveFit {
        kind,
        primitive,
        sigma0_probability: Distribution::ChiSquared { dof: redundancy }
            .survival(redundancy * adjusted.sigma0 * adjusted.sigma0),
        parameters: adjusted.parameters,
        covariance: adjusted.covariance,
        sigma0: adjusted.sigma0,
        redundancy: adjusted.redundancy,
        systematic_sigmas: 0.0,
        pixels,
        gain,
    })
}
