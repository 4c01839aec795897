//! Whole ambiguity intervals: of one frequency carried from frame to frame, of several by each pixel's own phases.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use phase_unwrap::{MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, combined_interval_m};
use range_image::{ComplexChannel, Flags, Modulation, Raster, with_wide_registers};
use rayon::prelude::*;
use statistics::quantile;

use crate::calibration::{FURTHEST_M, PreparedCalibration};
use crate::camera::LiveCamera;
use crate::carried::{CarriedUnwrapper, CarrySummary};
use crate::error::Result;
use crate::frame::ProcessedFrame;
use crate::stages::UnwrapStage;
use crate::work::planes::Planes;

/// Standard deviation, metre, of what the ranges of one frequency carry besides noise when they are unwrapped, as in a
/// pipeline: range errors are taken off later and come to one or two centimetres.
const SYSTEMATIC_M: f64 = 0.02;
/// Pixels that one task takes.
const CHUNK: usize = 1 << 14;

/// What finds the counts.
#[derive(Debug)]
pub(crate) enum Counts {
    /// Of one frequency, with the noise of each pixel while its median is sought.
    One(Box<CarriedUnwrapper>, Vec<f64>),
    Several(Box<Several>),
}

/// Several frequencies.
#[derive(Debug)]
pub(crate) struct Several {
    unwrapper: MultiUnwrapper,
    found: MultiUnwrapped,
    /// Standard deviations of the phases by noise and by errors that are not taken off yet.
    sigmas: Vec<Raster<f32>>,
    mask: Raster<bool>,
}

impl Counts {
    pub(crate) fn new(camera: &LiveCamera, calibration: &PreparedCalibration, stage: &UnwrapStage) -> Result<Self> {
        if camera.modulations.len() == 1 {
            let spatial = calibration.spatial_options(stage.maximum_range_m);
            let noise = Vec::with_capacity(camera.width * camera.height);
            return Ok(Self::One(Box::new(CarriedUnwrapper::new(spatial, stage.carry)?), noise));
        }
        let maximum_range_m = match stage.maximum_range_m {
            Some(maximum_m) => maximum_m,
            None => combined_interval_m(&camera.modulations)?.min(FURTHEST_M),
        };
        let options = MultiFrequencyOptions { maximum_range_m: Some(maximum_range_m), ..Default::default() };
        let plane = Raster::filled(camera.width, camera.height, f32::NAN);
        Ok(Self::Several(Box::new(Several {
            unwrapper: MultiUnwrapper::new(&camera.modulations, options)?,
            found: MultiUnwrapped::default(),
            sigmas: vec![plane; camera.modulations.len()],
            mask: Raster::filled(camera.width, camera.height, false),
        })))
    }

    /// Takes over what a new calibration says of the camera.
    pub(crate) fn set_calibration(&mut self, calibration: &PreparedCalibration, stage: &UnwrapStage) -> Result<()> {
        match self {
            Self::One(unwrapper, _) => Ok(unwrapper.set_options(calibration.spatial_options(stage.maximum_range_m))?),
            Self::Several(_) => Ok(()),
        }
    }

    /// Nothing is carried into the next frame.
    pub(crate) fn restart(&mut self) {
        if let Self::One(unwrapper, _) = self {
            unwrapper.restart();
        }
    }

    pub(crate) fn find(&mut self, planes: &Planes, frame: &ProcessedFrame) -> Result<CarrySummary> {
        match self {
            Self::One(unwrapper, values) => {
                let (Some(phase), Some(channel)) = (planes.phases.first(), planes.complex.channels.first()) else {
                    return Ok(CarrySummary::default());
                };
                Ok(unwrapper.unwrap_next(channel, phase, &frame.amplitude, || median(&channel.sigma, values))?)
            }
            Self::Several(several) => {
                several.find(planes)?;
                Ok(CarrySummary::default())
            }
        }
    }

    /// Counts of each frequency, and the confidence in them.
    pub(crate) fn found(&self) -> (&[Raster<i32>], &Raster<f32>) {
        match self {
            Self::One(unwrapper, _) => (std::slice::from_ref(unwrapper.wraps()), unwrapper.confidence()),
            Self::Several(several) => (&several.found.wraps, &several.found.confidence),
        }
    }
}

impl Several {
    fn find(&mut self, planes: &Planes) -> Result<()> {
        let flags = planes.complex.flags.as_slice();
        for (mask, flags) in self.mask.as_mut_slice().iter_mut().zip(flags) {
            *mask = !flags.contains(Flags::NO_DATA);
        }
        for (channel, (sigma, out)) in planes.complex.channels.iter().zip(planes.sigmas.iter().zip(&mut self.sigmas)) {
            add_systematics(channel, sigma.as_slice(), out.as_mut_slice());
        }
        let Self { unwrapper, found, sigmas, mask } = self;
        Ok(unwrapper.unwrap_into(&planes.phases, Some(sigmas), Some(mask), found)?)
    }
}

/// Noise of each part of the complex image: the median over the pixels; `None` where it is not known.
fn median(sigma: &Raster<f32>, values: &mut Vec<f64>) -> Option<f32> {
    values.clear();
    values.extend(sigma.as_slice().iter().map(|sigma| f64::from(*sigma)));
    Some(quantile(values, 0.5) as f32).filter(|noise| noise.is_finite())
}

/// The hypotenuse of the noise and of range errors; not known where the noise is not.
fn add_systematics(channel: &ComplexChannel, sigma: &[f32], out: &mut [f32]) {
    let systematic = f64::from(channel.modulation.phase_from_range(SYSTEMATIC_M) as f32);
    out.par_chunks_mut(CHUNK).zip(sigma.par_chunks(CHUNK)).for_each(|(out, sigma)| {
        with_wide_registers(
            #[inline(always)]
            || {
                for (out, sigma) in out.iter_mut().zip(sigma) {
                    // Squares of single precision are exact in double: the bits of `f32::hypot`, many at once.
                    let sigma = f64::from(*sigma);
                    *out = (sigma * sigma + systematic * systematic).sqrt() as f32;
                }
            },
        );
    });
}

/// Metres of a radian, and of a cycle, as `Modulation::range_from_phase` has them.
pub(crate) fn metres(modulation: &Modulation) -> [f64; 2] {
    [modulation.range_from_phase(1.0), modulation.ambiguity_interval_m()]
}
