//! What the ranges of a wall leave beside its plane, frame by frame and station by station.

use camera_model::Camera;
use range_image::RangeFrame;
use rayon::prelude::*;

use super::WallQuality;
use primitives::{PrimitiveKind, PrimitiveOptions, fit_whatever_shape};

use crate::{Error, Result};

/// One frame of a flat wall, all other range errors taken off.
#[derive(Debug, Clone)]
pub struct WallCapture<'a> {
    /// Name of the station; frames of one station count as one wall.
    pub station: String,
    /// The frame.
    pub frame: &'a RangeFrame,
}

/// A residual for each pixel and its variance; NaN where there is none.
#[derive(Debug, Clone)]
pub(super) struct Residuals {
    pub(super) values_m: Vec<f64>,
    pub(super) variances: Vec<f64>,
}

/// Residuals of single frames, and of what counts as one wall: of a station, or of a frame where there is one station.
pub(super) struct Walls {
    pub(super) frames: Vec<Residuals>,
    /// Position in `averaged` of each frame.
    pub(super) wall_of: Vec<usize>,
    pub(super) averaged: Vec<Residuals>,
    pub(super) quality: Vec<WallQuality>,
    /// Whether walls are stations.
    pub(super) of_stations: bool,
}

impl Walls {
    /// Fits a plane to each frame.
    pub(super) fn new(captures: &[WallCapture<'_>], camera: &Camera, options: &PrimitiveOptions) -> Result<Self> {
        if let [] | [_] = captures {
            let station = captures.first().map_or_else(String::new, |capture| capture.station.clone());
            return Err(Error::TooFewFrames { station, frames: captures.len(), needed: 2 });
        }
        let mut stations: Vec<&str> = Vec::new();
        for capture in captures {
            if !stations.contains(&capture.station.as_str()) {
                stations.push(&capture.station);
            }
        }
        let of_stations = stations.len() > 1;
        let place = |index: usize, capture: &WallCapture<'_>| {
            let station = stations.iter().position(|name| *name == capture.station).unwrap_or(0);
            if of_stations { station } else { index }
        };
        let wall_of: Vec<usize> = captures.iter().enumerate().map(|(index, one)| place(index, one)).collect();
        let fitted = |capture: &WallCapture<'_>| Residuals::of(capture, camera, options);
        let fitted: Vec<(Residuals, WallQuality)> = captures.par_iter().map(fitted).collect::<Result<_>>()?;
        let (frames, quality): (Vec<_>, Vec<_>) = fitted.into_iter().unzip();
        let count = if of_stations { stations.len() } else { captures.len() };
        let own = |wall: usize| frames.iter().zip(&wall_of).filter(move |(_, of)| **of == wall).map(|(frame, _)| frame);
        let averaged = (0..count).map(|wall| Residuals::mean(&own(wall).collect::<Vec<_>>())).collect();
        Ok(Self { frames, wall_of, averaged, quality, of_stations })
    }
}

impl Residuals {
    fn of(capture: &WallCapture<'_>, camera: &Camera, options: &PrimitiveOptions) -> Result<(Self, WallQuality)> {
        let fit = fit_whatever_shape(capture.frame, camera, PrimitiveKind::Plane, options)?;
        let (width, pixels) = (camera.format.width, camera.format.width * camera.format.height);
        let mut out = Self { values_m: vec![f64::NAN; pixels], variances: vec![f64::NAN; pixels] };
        let (mut squares, mut used) = (0.0, 0_usize);
        for pixel in fit.pixels.iter().filter(|pixel| pixel.used) {
            let index = pixel.position[1] * width + pixel.position[0];
            out.values_m[index] = pixel.observed_m - pixel.modelled_m;
            out.variances[index] = pixel.sigma_m * pixel.sigma_m;
            squares += out.values_m[index].powi(2);
            used += 1;
        }
        let quality = WallQuality {
            station: capture.station.clone(),
            pixels: used,
            outlier_share: fit.outlier_share(),
            residual_rms_m: (squares / used as f64).sqrt(),
            sigma0: fit.sigma0,
            systematic_sigmas: fit.systematic_sigmas,
        };
        Ok((out, quality))
    }

    /// Mean over frames, pixel by pixel, of those that have a residual.
    fn mean(frames: &[&Self]) -> Self {
        let pixels = frames.first().map_or(0, |frame| frame.values_m.len());
        let mut out = Self { values_m: vec![f64::NAN; pixels], variances: vec![f64::NAN; pixels] };
        for index in 0..pixels {
            let known = || frames.iter().filter(|frame| frame.values_m[index].is_finite());
            let count = known().count() as f64;
            out.values_m[index] = known().map(|frame| frame.values_m[index]).sum::<f64>() / count;
            out.variances[index] = known().map(|frame| frame.variances[index]).sum::<f64>() / (count * count);
        }
        out
    }
}
