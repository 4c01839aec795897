//! One frequency: counts carried from frame to frame, then corrected points row by row.

use range_image::{ComplexChannel, ComplexFrame, ComplexPixels, PolarPixels, Raster};
use scattering_deconvolution::ChannelRow;
use statistics::quantile;

use crate::calibration::PreparedCalibration;
use crate::carried::{CarriedUnwrapper, CarrySummary};
use crate::error::Result;
use crate::frame::ProcessedFrame;
use crate::stages::UnwrapStage;
use crate::work::ranges::{Channel, Rules, flag_unsure};
use crate::work::rows::{Chunk, MOST_CHUNKS, for_each_chunk};

/// Pixels that go through one step after the other together, in whole rows: they stay near in between, and memory comes in faster by
/// long stretches of few planes than by single rows of many.
const TOGETHER: usize = 8192;

/// What is kept from frame to frame.
#[derive(Debug)]
pub(crate) struct One {
    phase: Raster<f32>,
    pub(crate) unwrapper: CarriedUnwrapper,
    /// Noise of each pixel while its median is sought.
    noise: Vec<f64>,
}

impl One {
    pub(crate) fn new(calibration: &PreparedCalibration, stage: &UnwrapStage) -> Result<Self> {
        let camera = calibration.live_camera();
        let spatial = calibration.spatial_options(stage.maximum_range_m);
        Ok(Self {
            phase: Raster::filled(camera.width, camera.height, f32::NAN),
            unwrapper: CarriedUnwrapper::new(spatial, stage.carry)?,
            noise: Vec::with_capacity(camera.width * camera.height),
        })
    }

    pub(crate) fn finish(
        &mut self,
        complex: &mut ComplexFrame,
        rules: &Rules<'_>,
        frame: &mut ProcessedFrame,
    ) -> Result<CarrySummary> {
        let Self { phase, unwrapper, noise } = self;
        let Some(channel) = complex.channels.first_mut() else { return Ok(CarrySummary::default()) };
        to_polar(channel, rules, phase, frame)?;
        let summary = unwrapper.unwrap_next(channel, phase, &frame.amplitude, || median(&channel.sigma, noise))?;
        let (wraps, confidence) = (unwrapper.wraps().as_slice(), unwrapper.confidence().as_slice());
        let (width, rows) = (rules.width, frame.height().div_ceil(MOST_CHUNKS));
        for_each_chunk(frame, rows, std::iter::repeat(()), |chunk, ()| {
            let Chunk { first_row, range, sigma, amplitude, flags, points } = chunk;
            let together = (TOGETHER / width).max(1) * width;
            for start in (0..range.len()).step_by(together) {
                let own = start..(start + together).min(range.len());
                let (row, first) = (*first_row + start / width, *first_row * width);
                let here = first + own.start..first + own.end;
                let flags = &mut flags[own.clone()];
                let given = &complex.flags.as_slice()[here.clone()];
                flag_unsure(given, &confidence[here.clone()], rules.minimum_confidence, flags);
                let channel = Channel {
                    modulation: channel.modulation,
                    phase: &phase.as_slice()[here.clone()],
                    wraps: &wraps[here.clone()],
                    amplitude: &amplitude[own.clone()],
                    sigma_phase: None,
                    range: &mut range[own.clone()],
                    sigma: &mut sigma[own.clone()],
                };
                channel.correct([row, 0], rules, flags)?;
                rules.rays.back_project_pixels(here.start, &range[own.clone()], &mut points[own], flags)?;
            }
            Ok(())
        })?;
        Ok(summary)
    }
}

/// Takes scattered light off, and derives what unwrapping and correction work on.
fn to_polar(
    channel: &mut ComplexChannel,
    rules: &Rules<'_>,
    phase: &mut Raster<f32>,
    frame: &mut ProcessedFrame,
) -> Result<()> {
    let (width, rows) = (rules.width, frame.height().div_ceil(MOST_CHUNKS));
    let unit = channel.modulation.range_from_phase(1.0) as f32;
    let ComplexChannel { real, imaginary, sigma: noise, .. } = channel;
    let [real, imaginary, noise, phase] =
        [real, imaginary, noise, phase].map(|plane| plane.as_mut_slice().chunks_mut(rows * width));
    let planes = real.zip(imaginary).zip(noise.zip(phase));
    for_each_chunk(frame, rows, planes, |chunk, ((real, imaginary), (noise, phase))| {
        for (row, start) in (chunk.first_row..).zip((0..phase.len()).step_by(width)) {
            let own = start..start + width;
            let (real, imaginary) = (&mut real[own.clone()], &mut imaginary[own.clone()]);
            let sigma = &mut noise[own.clone()];
            let pixels = ChannelRow { real: &mut *real, imaginary: &mut *imaginary, sigma: &mut *sigma };
            rules.take_off_row([row, 0], pixels);
            let out = PolarPixels {
                phase: &mut phase[own.clone()],
                amplitude: &mut chunk.amplitude[own.clone()],
                sigma: &mut chunk.sigma[own],
            };
            ComplexPixels { real, imaginary, sigma }.phase_amplitude_and_sigma_into(out, unit)?;
        }
        Ok(())
    })
}

/// Noise of each part of the complex image: the median over the pixels; `None` where it is not known.
fn median(sigma: &Raster<f32>, values: &mut Vec<f64>) -> Option<f32> {
    values.clear();
    values.extend(sigma.as_slice().iter().map(|sigma| f64::from(*sigma)));
    Some(quantile(values, 0.5) as f32).filter(|noise| noise.is_finite())
}
