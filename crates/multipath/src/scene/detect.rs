//! Multipath by the contradiction between frequencies.

use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, Raster};
use rayon::prelude::*;
use statistics::chi_squared_limit;

use crate::error::require_probability;
use crate::pixels::pixel::{MAXIMUM_FREQUENCIES, System, USELESS};
use crate::scene::contradiction::{BLOCK, Contradiction, Frequency, Samples};
use crate::{FrequencyResponse, Result, Systematics};

/// A frequency whose amplitude is smaller, in standard deviations of the complex value, does not take part: the errors of
/// phase and amplitude are normal only well above the noise. At ten the amplitude is biased by half a per cent, half of the
/// floor of the contrast; a smaller one raises the false alarms of dark pixels.
const LEAST_SNR: f32 = 10.0;

/// What of the frequencies is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Evidence {
    /// Ranges and ratios of amplitudes.
    #[default]
    RangesAndAmplitudes,
    /// Ranges alone, where the frequency response is not known.
    Ranges,
}

/// When frequencies contradict each other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct DetectionOptions {
    /// Probability that a pixel with one path is flagged. Default: 1e-3.
    pub false_alarm: f64,
    /// What is compared. Default: [`Evidence::RangesAndAmplitudes`].
    pub evidence: Evidence,
    /// What calibration leaves over. Default: that of [`Systematics`].
    pub systematics: Systematics,
}

impl Default for DetectionOptions {
    /// One false alarm in a thousand, ranges and amplitudes.
    fn default() -> Self {
        Self { false_alarm: 1e-3, evidence: Evidence::default(), systematics: Systematics::default() }
    }
}

/// The test of each pixel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Detection {
    /// Sum of the squared, weighted differences between the frequencies: chi-squared with [`Self::freedom`] if there is
    /// one path; NaN where there was no test.
    pub statistic: Raster<f32>,
    /// Degrees of freedom of the test; 0 where there was none.
    pub freedom: Raster<u8>,
    /// Pixels tested.
    pub tested: usize,
    /// Pixels found to have more than one path.
    pub flagged: usize,
}

/// The test for given frequencies, made once for many frames.
#[derive(Debug, Clone)]
pub struct Detector {
    system: System,
    frequencies: Vec<Frequency>,
    evidence: Evidence,
    /// Largest statistic of one path for each number of degrees of freedom.
    thresholds: [f64; 2 * MAXIMUM_FREQUENCIES],
    /// Phase and amplitude of each frequency, kept from frame to frame.
    polar: Vec<[Raster<f32>; 2]>,
}

impl Detector {
    /// Needs two to [`MAXIMUM_FREQUENCIES`] different frequencies; see [`detect`].
    pub fn new(modulations: &[Modulation], response: &FrequencyResponse, options: &DetectionOptions) -> Result<Self> {
        require_probability("false_alarm", options.false_alarm)?;
        let system = System::new(modulations, response, &options.systematics, 2)?;
        let frequency = |(modulation, contrast): (&Modulation, &f64)| Frequency {
            interval_m: modulation.ambiguity_interval_m() as f32,
            inverse_contrast: (1.0 / contrast) as f32,
            floor_m: options.systematics.floor_m as f32,
            floor_contrast: options.systematics.floor_contrast as f32,
            least_snr: LEAST_SNR,
        };
        let frequencies: Vec<Frequency> = modulations.iter().zip(&response.contrast).map(frequency).collect();
        Ok(Self {
            system,
            evidence: options.evidence,
            thresholds: std::array::from_fn(|freedom| chi_squared_limit(freedom as f64, options.false_alarm)),
            polar: vec![Default::default(); frequencies.len()],
            frequencies,
        })
    }

    /// The largest statistic, for a number of degrees of freedom, that one path explains; infinite where there is none.
    pub fn threshold(&self, freedom: usize) -> f64 {
        self.thresholds.get(freedom).copied().unwrap_or(f64::INFINITY)
    }

    /// Tests a frame and sets [`Flags::MULTIPATH`]; see [`detect`]. Planes of the right size are used again.
    pub fn detect_into(&mut self, frame: &mut ComplexFrame, range_m: &Raster<f32>, out: &mut Detection) -> Result<()> {
        self.system.require_frame(frame)?;
        System::require_sigma(frame)?;
        frame.flags.require_same_size(range_m, "range")?;
        self.prepare(frame, out)?;
        let ComplexFrame { channels, flags } = frame;
        // Whole blocks in each task; what a task does not fill is the frame's end alone.
        let task = BLOCK * 64;
        let statistics = out.statistic.as_mut_slice().par_chunks_mut(task);
        let freedoms = out.freedom.as_mut_slice().par_chunks_mut(task);
        let tasks = flags.as_mut_slice().par_chunks_mut(task).zip(statistics).zip(freedoms).enumerate();
        let counts = tasks.map(|(index, ((flags, statistics), freedoms))| {
            let mut counts = [0, 0];
            let blocks = flags.chunks_mut(BLOCK).zip(statistics.chunks_mut(BLOCK)).zip(freedoms.chunks_mut(BLOCK));
            for (block, ((flags, statistics), freedoms)) in blocks.enumerate() {
                let start = index * task + block * BLOCK;
                let contradiction = self.contradiction(channels, range_m, start..start + flags.len());
                let found = self.judge(&contradiction, flags, statistics, freedoms);
                counts = [counts[0] + found[0], counts[1] + found[1]];
            }
            counts
        });
        [out.tested, out.flagged] = counts.reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]);
        Ok(())
    }

    /// Phases, amplitudes, and planes of the right size for the result.
    fn prepare(&mut self, frame: &ComplexFrame, out: &mut Detection) -> Result<()> {
        let (width, height) = (frame.width(), frame.height());
        if frame.flags.require_same_size(&out.statistic, "").is_err() || out.freedom.len() != out.statistic.len() {
            out.statistic = Raster::filled(width, height, f32::NAN);
            out.freedom = Raster::filled(width, height, 0);
        }
        for ([phase, amplitude], channel) in self.polar.iter_mut().zip(&frame.channels) {
            for plane in [&mut *phase, &mut *amplitude] {
                if frame.flags.require_same_size(plane, "").is_err() {
                    *plane = Raster::filled(width, height, f32::NAN);
                }
            }
            channel.phase_and_amplitude_into(phase, amplitude)?;
        }
        Ok(())
    }

    fn contradiction(
        &self,
        channels: &[ComplexChannel],
        range_m: &Raster<f32>,
        pixels: std::ops::Range<usize>,
    ) -> Contradiction {
        let mut contradiction = Contradiction::new();
        for ((frequency, [phase, amplitude]), channel) in self.frequencies.iter().zip(&self.polar).zip(channels) {
            let samples = Samples {
                phase: &phase.as_slice()[pixels.clone()],
                amplitude: &amplitude.as_slice()[pixels.clone()],
                sigma: &channel.sigma.as_slice()[pixels.clone()],
            };
            contradiction.add(frequency, samples, &range_m.as_slice()[pixels.clone()]);
        }
        contradiction
    }

    /// Writes the results of a block; gives the numbers of pixels tested and flagged.
    fn judge(
        &self,
        found: &Contradiction,
        flags: &mut [Flags],
        statistics: &mut [f32],
        freedoms: &mut [u8],
    ) -> [usize; 2] {
        let mut counts = [0, 0];
        for (pixel, ((flags, statistic), freedom)) in flags.iter_mut().zip(statistics).zip(freedoms).enumerate() {
            let differences = (found.count[pixel] as usize).saturating_sub(1);
            let (value, degrees) = match self.evidence {
                Evidence::Ranges => (found.ranges.squares[pixel], differences),
                Evidence::RangesAndAmplitudes => {
                    (found.ranges.squares[pixel] + found.amplitudes.squares[pixel], 2 * differences)
                }
            };
            // Without noise and floor there is no scale to judge differences by.
            let tested = degrees > 0 && value.is_finite() && !flags.intersects(USELESS | Flags::MIXED_PIXEL);
            (*statistic, *freedom) = if tested { (value, degrees as u8) } else { (f32::NAN, 0) };
            counts[0] += usize::from(tested);
            if tested && f64::from(value) > self.threshold(degrees) {
                *flags |= Flags::MULTIPATH;
                counts[1] += 1;
            }
        }
        counts
    }
}

/// Tests for each pixel whether one path explains all frequencies, and sets [`Flags::MULTIPATH`] where it does not.
///
/// One path at range `r` gives every frequency that range and amplitudes in the ratio of the `response`; with a second
/// path both differ from frequency to frequency. The statistic is the weighted sum of squared deviations of the ranges,
/// and of the amplitudes over the response, from their weighted means. With one path, it is chi-squared with `F - 1` degrees of
/// freedom for either, `F` being the number of usable frequencies.
///
/// - `range_m`: unwrapped range; each frequency's range is the one nearest to it.
/// - The phases must be free of each frequency's own range errors; what is left over is part of the options.
/// - Not tested: pixels flagged as saturated, moved, without data or mixed (two surfaces in one pixel are two paths as
///   well), without a range, without a known sigma, or with fewer than two frequencies of enough amplitude.
///
/// What cannot be seen: light whose detour is much smaller than `U` of the highest frequency changes all ranges alike,
/// and a path of a tenth of a percent drowns in the noise.
///
/// # Errors
/// [`Error::SigmaUnknown`](crate::Error::SigmaUnknown) where a channel has no sigma, [`Error::FrequencyCount`](crate::Error::FrequencyCount)
/// below two frequencies, and what does not fit: sizes, modulations, response, options.
///
/// ```
/// use multipath::range_image::{ComplexFrame, Flags, Modulation, PhaseConvention, Raster};
/// use multipath::{DetectionOptions, FrequencyResponse, detect};
///
/// // The second frequency sees the wall 5 cm farther than the first: its light came by more than one way.
/// let modulations = [20e6, 80e6].map(|hz| Modulation::new(hz).unwrap());
/// let phase = |range_m: f64, modulation: Modulation| Raster::filled(4, 3, modulation.phase_from_range(range_m) as f32);
/// let frame = ComplexFrame::from_phase(
///     modulations.to_vec(),
///     vec![phase(1.5, modulations[0]), phase(1.55, modulations[1])],
///     vec![Raster::filled(4, 3, 400.0); 2],
///     &PhaseConvention::default(),
/// )?;
/// let mut frame = frame.with_sigma(vec![Raster::filled(4, 3, 1.0); 2])?;
/// let range_m = Raster::filled(4, 3, 1.52);
/// let found = detect(&mut frame, &range_m, &FrequencyResponse::flat(2), &DetectionOptions::default())?;
/// assert_eq!((found.tested, found.flagged), (12, 12));
/// assert!(frame.flags[(0, 0)].contains(Flags::MULTIPATH));
/// # Ok::<(), multipath::Error>(())
/// ```
pub fn detect(
    frame: &mut ComplexFrame,
    range_m: &Raster<f32>,
    response: &FrequencyResponse,
    options: &DetectionOptions,
) -> Result<Detection> {
    let modulations: Vec<Modulation> = frame.channels.iter().map(|channel| channel.modulation).collect();
    let mut out = Detection::default();
    Detector::new(&modulations, response, options)?.detect_into(frame, range_m, &mut out)?;
    Ok(out)
}
