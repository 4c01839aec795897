//! Light of another camera in the same band: a beat that all lit pixels share, in repeated frames of a scene at rest.

use rayon::prelude::*;
use statistics::chi_squared_limit;

use crate::averaging::average::require_alike;
use crate::sample_checks::beat::{Beat, Deviation};

use crate::{ComplexChannel, ComplexFrame, Error, Flags, Raster, Result};

/// Fewer frames leave nothing beside the beat that could tell it from motion.
const FEWEST_FRAMES: usize = 3;

/// A beat whose successive frames differ by less than this share of its variance changes steadily: white noise has 2, an
/// edge that passes half-way 4 / n, a ramp 12 / n^2.
const STEADY: f64 = 0.75;

/// When light of another camera counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct InterferenceOptions {
    /// Probability with which noise alone makes a pixel count as disturbed. Default: 1e-4.
    pub false_alarm_probability: f64,
    /// Smallest disturbed share of the brighter half of the pixels. Less is taken for motion. Default: 0.3.
    pub least_share: f64,
}

impl Default for InterferenceOptions {
    /// One pixel in ten thousand; three tenths.
    fn default() -> Self {
        Self { false_alarm_probability: 1e-4, least_share: 0.3 }
    }
}

impl InterferenceOptions {
    /// Refuses a probability and a share beyond 0 to 1.
    pub fn validate(&self) -> Result<()> {
        for (name, value) in
            [("false_alarm_probability", self.false_alarm_probability), ("least_share", self.least_share)]
        {
            if !(value > 0.0 && value < 1.0) {
                return Err(Error::OutOfDomain { name, value, expected: "a number between 0 and 1" });
            }
        }
        Ok(())
    }
}

/// What the test says of a set of frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InterferenceVerdict {
    /// Fewer than three frames, or no pixel has a value and a known standard deviation in all of them.
    NotTested,
    /// No beat that enough of the lit pixels share.
    NotFound {
        /// Disturbed share of the brighter half.
        share: f64,
    },
    /// Enough pixels share what changes, but it changes steadily: a beat slower than the frames, or something that moves.
    Steady {
        /// Disturbed share of the brighter half.
        share: f64,
    },
    /// Light of another camera, or light that flickers.
    Found {
        /// Disturbed share of the brighter half.
        share: f64,
    },
}

/// Result of [`check_interference`].
#[derive(Debug, Clone, PartialEq)]
pub struct Interference {
    /// Pixels that share the beat and do nothing else; none unless it was found.
    pub disturbed: Raster<bool>,
    /// Their number.
    pub disturbed_pixels: usize,
    /// Pixels that could be tested.
    pub tested_pixels: usize,
    /// What that means.
    pub verdict: InterferenceVerdict,
}

impl Interference {
    /// Gives the disturbed pixels [`Flags::INTERFERENCE`] instead of [`Flags::MOTION`].
    pub fn flag(&self, flags: &mut Raster<Flags>) {
        for (flags, disturbed) in flags.as_mut_slice().iter_mut().zip(self.disturbed.as_slice()) {
            if *disturbed {
                flags.remove(Flags::MOTION);
                flags.insert(Flags::INTERFERENCE);
            }
        }
    }
}

/// Looks for light of another camera in repeated frames of a scene and a camera at rest, frequency by frequency.
///
/// Another camera, whose clock is never quite the same, adds to each sample `a cos(chi + psi_n)`, where `a` and `chi` are
/// the pixel's and the beat `psi_n` is the frame's. So the deviations of a pixel from its mean over the frames, which are
/// `2 (n - 1)` numbers, lie in a plane that is the same for all pixels. It is taken from all pixels (those that deviate
/// most are held back), after the phase and the amplitude that a frame has in common are taken off. Once a beat is found,
/// what frames have in common counts with it where it lies in the plane. What a pixel has in
/// the plane is χ² of 2 degrees of freedom in units of its variance; what it has beside the plane, of `2 (n - 2)`. A pixel
/// is disturbed if the first exceeds its quantile and the second does not. Pixels are flagged only where the brighter half
/// has `least_share` of disturbed ones and the beat is no steady change; so noise flags none.
///
/// What this cannot tell: a camera beside this one, whose light goes the same ways, shifts phase and amplitude of all
/// pixels alike, and is a drift of [`check_rest`](crate::check_rest); lamps that flicker do as another camera does; a beat
/// slower than the set of frames is a steady change; with three frames half of what moves lies in the plane by chance.
pub fn check_interference(frames: &[ComplexFrame], options: &InterferenceOptions) -> Result<Interference> {
    options.validate()?;
    require_alike(frames)?;
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "test of interference" }) };
    let mut found = Interference {
        disturbed: Raster::filled(first.width(), first.height(), false),
        disturbed_pixels: 0,
        tested_pixels: 0,
        verdict: InterferenceVerdict::NotTested,
    };
    if frames.len() < FEWEST_FRAMES {
        return Ok(found);
    }
    for index in 0..first.channels.len() {
        let channels: Vec<&ComplexChannel> = frames.iter().map(|frame| &frame.channels[index]).collect();
        found.add(&channels, options);
    }
    found.disturbed_pixels = found.disturbed.as_slice().iter().filter(|disturbed| **disturbed).count();
    Ok(found)
}

impl Interference {
    /// Adds what one frequency shows.
    fn add(&mut self, channels: &[&ComplexChannel], options: &InterferenceOptions) {
        let Some(beat) = Beat::of(channels) else { return };
        let beside = 2.0 * (channels.len() as f64 - 2.0);
        let limits = [2.0, beside].map(|freedom| chi_squared_limit(freedom, options.false_alarm_probability));
        let pixels: Vec<Option<Tested>> = (0..self.disturbed.as_slice().len())
            .into_par_iter()
            .map_init(Deviation::default, |deviation, pixel| {
                if !deviation.set(channels, pixel) {
                    return None;
                }
                let parts = beat.parts(deviation);
                let disturbed = |within: f64| within > limits[0] && parts.beside <= limits[1];
                let [by_own, by_all] = [parts.own, parts.with_common].map(disturbed);
                Some(Tested { brightness: deviation.snr() as f32, by_own, by_all })
            })
            .collect();
        let share = share_of_brighter_half(pixels.iter().flatten().map(|pixel| (pixel.brightness, pixel.by_own)));
        self.tested_pixels = self.tested_pixels.max(pixels.iter().flatten().count());
        let verdict = if share < options.least_share {
            InterferenceVerdict::NotFound { share }
        } else if beat.successive_difference() < STEADY {
            InterferenceVerdict::Steady { share }
        } else {
            for (disturbed, pixel) in self.disturbed.as_mut_slice().iter_mut().zip(&pixels) {
                *disturbed |= pixel.as_ref().is_some_and(|pixel| pixel.by_all);
            }
            InterferenceVerdict::Found { share }
        };
        // The frequency that shows most speaks for all.
        if verdict.rank() > self.verdict.rank() {
            self.verdict = verdict;
        }
    }
}

impl InterferenceVerdict {
    fn rank(self) -> (u8, f64) {
        match self {
            Self::NotTested => (0, 0.0),
            Self::NotFound { share } => (1, share),
            Self::Steady { share } => (2, share),
            Self::Found { share } => (3, share),
        }
    }
}

/// One pixel's tests.
struct Tested {
    brightness: f32,
    /// Disturbed beside what frames have in common.
    by_own: bool,
    /// Disturbed, if there is a beat at all.
    by_all: bool,
}

/// Share of the pixels that are `true`, among those whose brightness is at or above the median.
fn share_of_brighter_half(pixels: impl Iterator<Item = (f32, bool)>) -> f64 {
    let mut pixels: Vec<(f32, bool)> = pixels.collect();
    if pixels.is_empty() {
        return 0.0;
    }
    let middle = pixels.len() / 2;
    let (_, median, _) = pixels.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0));
    let median = median.0;
    let bright = pixels.iter().filter(|(brightness, _)| *brightness >= median);
    let [count, disturbed] =
        bright.fold([0_usize; 2], |[count, sum], (_, disturbed)| [count + 1, sum + usize::from(*disturbed)]);
    disturbed as f64 / count.max(1) as f64
}

/// Tells contradictory samples of one frame apart: motion shows at edges, light of another camera, or light that flickers,
/// wherever there is light. Where [`Flags::MOTION`] stands at `least_share` or more of the brighter half of the pixels, it
/// becomes [`Flags::INTERFERENCE`]; gives that share.
///
/// To be called after [`check_samples`](crate::check_samples), on a frame without other reasons for that flag. A noise
/// model that is too small, and taps that are unequal beyond the tolerance, break the rules in all bright pixels as well: a
/// single frame does not tell these from another camera.
pub fn tell_interference(frame: &mut ComplexFrame, options: &InterferenceOptions) -> Result<f64> {
    options.validate()?;
    frame.validate()?;
    let Some(channel) = frame.channels.first() else { return Ok(0.0) };
    let amplitudes = channel.real.as_slice().iter().zip(channel.imaginary.as_slice()).map(|(re, im)| re.hypot(*im));
    let contradictory = frame.flags.as_slice().iter().map(|flags| flags.contains(Flags::MOTION));
    let share = share_of_brighter_half(amplitudes.zip(contradictory).filter(|(amplitude, _)| amplitude.is_finite()));
    if share >= options.least_share {
        for flags in frame.flags.as_mut_slice().iter_mut().filter(|flags| flags.contains(Flags::MOTION)) {
            flags.remove(Flags::MOTION);
            flags.insert(Flags::INTERFERENCE);
        }
    }
    Ok(share)
}
