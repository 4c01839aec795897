//! What the stages work on: one view per frame, later per station.

use std::sync::Arc;

use camera_model::OrganisedCloud;
use nalgebra::Isometry3;
use phase_unwrap::combine_frequencies;
use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, RangeFrame, Raster, RawFrame};

use crate::survey::correction_record::CorrectionRecord;
use crate::survey::truth::ViewTruth;
use crate::{Error, Result};
use commands::Tape;

/// A frame on its way, or the mean of all frames of a station.
#[derive(Debug, Clone)]
pub struct View {
    /// Name of the station.
    pub station: String,
    /// Positions of the frames in the survey that went into this view.
    pub frames: Vec<usize>,
    /// Time of the first frame, second.
    pub timestamp_s: f64,
    /// Integration time, second, where the survey states it.
    pub integration_time_s: Option<f64>,
    /// The frame at the level it has reached.
    pub data: ViewData,
    /// Ranges and amplitudes as the camera alone gives them; what "before" means in the report.
    pub before: Option<Snapshot>,
    /// Approximate or known pose from the survey.
    pub approximate_world_from_camera: Option<Isometry3<f64>>,
    /// Truth, where the survey was simulated.
    pub truth: Option<ViewTruth>,
    /// A second opinion on the range, such as the camera's own, metre.
    pub reference_range: Option<Raster<f32>>,
    /// Modulation of the first frequency, where the survey states one.
    pub modulation: Option<Modulation>,
    /// Ranges of each frequency once they are unwrapped; empty where there is only one.
    pub channels: Vec<RangeFrame>,
    /// Modulations of all frequencies, where the survey states them.
    pub modulations: Vec<Modulation>,
    /// Error that light bounced once in the scene is expected to make, metre; once it was assessed.
    pub multipath_risk_m: Option<Raster<f32>>,
    /// What the correction of the ranges worked on; once it ran.
    pub correction: Option<CorrectionRecord>,
    /// Points in the camera's frame, a pixel each; once [`crate::Stage::PointCloud`] ran.
    pub cloud: Option<OrganisedCloud>,
    /// Points on the two surfaces of split mixed pixels.
    pub further_points: Vec<FurtherPoint>,
    /// Counts the view among those in memory.
    pub live: LiveFrames,
}

/// A point that belongs to no single pixel of an organised cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FurtherPoint {
    /// Position in the camera's frame, metre.
    pub point: [f64; 3],
    /// Standard deviation along the ray, metre.
    pub sigma_m: f32,
    /// Amplitude in the camera's unit.
    pub amplitude: f32,
}

/// How many frames that were read of a survey are still in memory: each view holds one of these.
#[derive(Debug, Clone, Default)]
pub struct LiveFrames(Arc<()>);

impl LiveFrames {
    /// Frames in memory, if the survey holds one of these and each view another.
    pub fn count(&self) -> usize {
        Arc::strong_count(&self.0) - 1
    }
}

/// The frame at its level.
#[derive(Debug, Clone)]
pub enum ViewData {
    /// Raw samples.
    Samples(RawFrame),
    /// Complex images.
    Phase(ComplexFrame),
    /// Ranges.
    Range(RangeFrame),
}

/// Range and amplitude at one moment.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// Range, metre; wrapped to the ambiguity interval at level phase.
    pub range: Raster<f32>,
    /// Amplitude in the camera's unit.
    pub amplitude: Raster<f32>,
}

impl Snapshot {
    /// Writes it, or takes it over.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        for plane in [&mut self.range, &mut self.amplitude] {
            let (mut width, mut values) = (plane.width(), std::mem::take(plane).into_vec());
            tape.count(&mut width);
            tape.short_numbers(&mut values);
            let height = values.len() / width.max(1);
            *plane = Raster::from_vec(width, height, values).unwrap_or_default();
        }
    }
}

impl View {
    /// Name for messages: the station, and the frame where the station has several views.
    pub fn name(&self) -> String {
        view_name(&self.station, &self.frames)
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        match &self.data {
            ViewData::Samples(raw) => (raw.width(), raw.height()),
            ViewData::Phase(frame) => (frame.width(), frame.height()),
            ViewData::Range(frame) => (frame.width(), frame.height()),
        }
    }

    /// Range and amplitude as far as they are known now; `None` before demodulation.
    pub fn snapshot(&self) -> Option<Snapshot> {
        match &self.data {
            ViewData::Samples(_) => None,
            ViewData::Phase(frame) => frame.channels.first().map(|channel| Snapshot {
                range: channel.phase().map(|phase| channel.modulation.range_from_phase(f64::from(*phase)) as f32),
                amplitude: channel.amplitude(),
            }),
            ViewData::Range(frame) => Some(Snapshot { range: frame.range.clone(), amplitude: frame.amplitude.clone() }),
        }
    }

    /// Takes the unwrapped ranges of all frequencies and combines them.
    pub fn set_channels(&mut self, mut channels: Vec<RangeFrame>) -> Result<()> {
        if channels.len() == 1 {
            self.data = ViewData::Range(channels.remove(0));
            self.channels.clear();
            return Ok(());
        }
        self.channels = channels;
        self.combine_channels()
    }

    /// Combines the ranges of several frequencies, each weighted by its variance; nothing to do where there is one.
    pub fn combine_channels(&mut self) -> Result<()> {
        let Some(first) = self.channels.first() else { return Ok(()) };
        let ranges: Vec<_> = self.channels.iter().map(|channel| channel.range.clone()).collect();
        let sigmas: Vec<_> = self.channels.iter().map(|channel| channel.sigma.clone()).collect();
        let combined = combine_frequencies(&ranges, &sigmas).map_err(Error::stage("Unwrap", &self.name()))?;
        let mut flags = first.flags.clone();
        for channel in &self.channels[1..] {
            for (flags, more) in flags.as_mut_slice().iter_mut().zip(channel.flags.as_slice()) {
                flags.insert(*more);
            }
        }
        self.data = ViewData::Range(RangeFrame {
            range: combined.range,
            sigma: combined.sigma,
            amplitude: first.amplitude.clone(),
            flags,
        });
        Ok(())
    }

    /// The complex image that belongs to the corrected ranges of several frequencies; `None` where there is one.
    pub fn complex_channels(&self) -> Option<ComplexFrame> {
        let first = self.channels.first()?;
        let channels = self.channels.iter().zip(&self.modulations).map(|(channel, modulation)| {
            let radians_per_metre = modulation.phase_from_range(1.0) as f32;
            let plane = |value: fn(f32, f32) -> f32| {
                let mut out = channel.range.clone();
                for (out, amplitude) in out.as_mut_slice().iter_mut().zip(channel.amplitude.as_slice()) {
                    *out = value(*amplitude, radians_per_metre * *out);
                }
                out
            };
            let mut sigma = channel.sigma.clone();
            for (sigma, amplitude) in sigma.as_mut_slice().iter_mut().zip(channel.amplitude.as_slice()) {
                *sigma *= radians_per_metre * amplitude;
            }
            let (real, imaginary) = (plane(|a, phase| a * phase.cos()), plane(|a, phase| a * phase.sin()));
            ComplexChannel { modulation: *modulation, real, imaginary, offset: None, sigma }
        });
        Some(ComplexFrame { channels: channels.collect(), flags: first.flags.clone() })
    }

    /// The modulation to which ranges are still wrapped, `None` once they are not.
    pub fn wrapped_to(&self) -> Option<Modulation> {
        match &self.data {
            ViewData::Phase(frame) => frame.channels.first().map(|channel| channel.modulation),
            _ => None,
        }
    }

    /// The flag plane, `None` before demodulation.
    pub fn flags(&self) -> Option<&Raster<Flags>> {
        match &self.data {
            ViewData::Samples(_) => None,
            ViewData::Phase(frame) => Some(&frame.flags),
            ViewData::Range(frame) => Some(&frame.flags),
        }
    }
}

/// Name of a view for messages.
pub fn view_name(station: &str, frames: &[usize]) -> String {
    match frames {
        [frame] => format!("station {station}, frame {frame}"),
        frames => format!("station {station}, mean of {} frames", frames.len()),
    }
}
