//! Frames of one scene with different integration times become one (Sect. 4.6).

use rayon::prelude::*;
use statistics::{chi_squared_limit, upper_median};

use crate::averaging::fusion_bias::Bias;

use crate::{Error, Flags, RangeFrame, Raster, Result};

/// Pixels that two exposures must share for the ratio of their amplitudes to be taken from them. A choice: the median
/// of so many ratios is known to a third of their spread; with fewer the integration times tell the ratio.
const FEWEST_SHARED: usize = 16;

/// A range with one of these is used only where no exposure of the pixel is without: it may be wrong, and not by noise.
pub(crate) const DOUBTFUL: Flags = Flags::LOW_AMPLITUDE
    .union(Flags::OUTSIDE_SPAN)
    .union(Flags::UNWRAP_UNSURE)
    .union(Flags::MOTION)
    .union(Flags::INTERFERENCE);

/// A frame with its integration time.
#[derive(Debug, Clone, Copy)]
pub struct Exposure<'a> {
    /// Corrected ranges, with sigma.
    pub frame: &'a RangeFrame,
    /// Integration time, second.
    pub integration_time_s: f64,
}

/// How exposures are fused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct FusionOptions {
    /// Probability with which exposures of a scene at rest count as contradictory in a pixel. Default: 1e-4.
    pub false_alarm_probability: f64,
    /// Standard deviation of what calibration leaves in one exposure and not in the others, metre. It counts where
    /// exposures are compared, not in the weights: there is no noise in it that a mean could reduce. Default: 0.005 m.
    pub floor_m: f64,
    /// Ranges with a larger sigma, metre, are left to the longest exposure: the noise of phases is not normal below a
    /// ratio of signal to noise of about five, which is `U / 2π / 5`, and such ranges neither improve a mean nor prove
    /// anything. Default: 0.08 m.
    pub normal_sigma_m: f64,
}

impl Default for FusionOptions {
    /// One pixel in ten thousand; 5 mm; 8 cm, which is for 60 MHz and below.
    fn default() -> Self {
        Self { false_alarm_probability: 1e-4, floor_m: 0.005, normal_sigma_m: 0.08 }
    }
}

impl FusionOptions {
    /// Refuses a probability beyond 0 to 1 and lengths that are negative or not finite.
    pub fn validate(&self) -> Result<()> {
        let (name, value) = ("false_alarm_probability", self.false_alarm_probability);
        if !(value > 0.0 && value < 1.0) {
            return Err(Error::OutOfDomain { name, value, expected: "a number between 0 and 1" });
        }
        for (name, value) in [("floor_m", self.floor_m), ("normal_sigma_m", self.normal_sigma_m)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::OutOfDomain { name, value, expected: "finite and not negative" });
            }
        }
        Ok(())
    }
}

/// Result of [`fuse_exposures`].
#[derive(Debug, Clone, PartialEq)]
pub struct Fusion {
    /// Ranges, sigmas and flags; amplitudes in the unit of the longest exposure.
    pub frame: RangeFrame,
    /// Pixels that each exposure took part in, in the order of the arguments.
    pub used_pixels: Vec<usize>,
    /// Pixels whose exposures contradict each other; they were given [`Flags::MOTION`].
    pub contradictory_pixels: usize,
    /// Pixels that are saturated in each exposure that has a value.
    pub saturated_pixels: usize,
}

/// Fuses exposures of a scene and a camera at rest, pixel by pixel: the mean of the ranges that are not saturated,
/// weighted by their inverse variances, with its sigma `1 / sqrt(Σ 1 / σ²)`.
///
/// **Weights.** A range's own sigma goes with one over its amplitude, which in the dark is as uncertain as the range: the
/// exposure that noise makes bright would get too much weight and too small a sigma. So the amplitude of a pixel is taken
/// from all its exposures together, and no sigma is smaller than that which this amplitude gives. How much brighter one
/// exposure is than another is taken from the brighter half of the pixels that both have (their median ratio), from the
/// times where there are too few.
///
/// **Bias.** A short exposure has low amplitudes, and what calibration leaves there (Eq. 15) is in no sigma; a mean with it
/// is worse than the long exposure alone as soon as the bias exceeds the sigma of their difference. So for each exposure
/// the median difference to the longest one beside it is taken by octaves of amplitude, and its square, less what noise
/// makes of it, is added to the variance: the weights are then those of the smallest mean square error.
///
/// **Agreement.** Exposures agree if `Σ (ρ − mean)² / (σ² + floor²)` stays below the quantile of χ² with `n − 1` degrees of
/// freedom. If they do not, the one goes that fits worst, and of two the longer one, in which motion and saturation leave
/// more. The pixel is flagged [`Flags::MOTION`] then.
///
/// **Doubt.** Ranges of low amplitude, outside the calibrated span, of unsure interval or disturbed are used only where
/// there is no other; so are those beyond `normal_sigma_m` and those without sigma, and then the longest exposure alone. A
/// pixel that is saturated in all exposures gets no value, and keeps [`Flags::SATURATED`]; one without any value keeps all
/// flags.
///
/// What this cannot tell: an error that all exposures share; of two exposures that differ, which one is wrong.
pub fn fuse_exposures(exposures: &[Exposure<'_>], options: &FusionOptions) -> Result<Fusion> {
    options.validate()?;
    let first = validated(exposures)?;
    let gains = gains(exposures);
    let biases = exposures.iter().map(|own| Bias::of(own, exposures, options.normal_sigma_m)).collect();
    let fuser = Fuser { exposures, gains, biases, options, limits: limits(exposures.len(), options) };
    let (width, height) = (first.width(), first.height());
    let pixels: Vec<Fused> = (0..width * height)
        .into_par_iter()
        .with_min_len(1024)
        .map_init(Vec::new, |candidates, pixel| fuser.pixel(pixel, candidates))
        .collect();
    let plane = |of: fn(&Fused) -> f32| Raster::from_vec(width, height, pixels.iter().map(of).collect());
    let used = |index: usize| pixels.iter().filter(|pixel| pixel.used >> index & 1 == 1).count();
    Ok(Fusion {
        frame: RangeFrame {
            range: plane(|pixel| pixel.range)?,
            sigma: plane(|pixel| pixel.sigma)?,
            amplitude: plane(|pixel| pixel.amplitude)?,
            flags: Raster::from_vec(width, height, pixels.iter().map(|pixel| pixel.flags).collect())?,
        },
        used_pixels: (0..exposures.len()).map(used).collect(),
        contradictory_pixels: pixels.iter().filter(|pixel| pixel.contradictory).count(),
        saturated_pixels: pixels.iter().filter(|pixel| pixel.saturated).count(),
    })
}

/// The first frame, if all go together.
fn validated<'a>(exposures: &[Exposure<'a>]) -> Result<&'a RangeFrame> {
    let Some(first) = exposures.first() else { return Err(Error::NoFrames { what: "fusion of exposures" }) };
    if exposures.len() > 64 {
        let value = exposures.len() as f64;
        return Err(Error::OutOfDomain { name: "exposures", value, expected: "at most 64 exposures" });
    }
    for (index, exposure) in exposures.iter().enumerate() {
        exposure.frame.validate()?;
        let (name, value) = ("integration_time_s", exposure.integration_time_s);
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::OutOfDomain { name, value, expected: "a positive time" });
        }
        if (exposure.frame.width(), exposure.frame.height()) != (first.frame.width(), first.frame.height()) {
            return Err(Error::Inconsistent { index, what: "the size" });
        }
    }
    Ok(first.frame)
}

/// Quantiles of χ² for one degree of freedom less than there are ranges.
fn limits(most: usize, options: &FusionOptions) -> Vec<f64> {
    let limit = |count| chi_squared_limit(count as f64 - 1.0, options.false_alarm_probability);
    (0..=most).map(limit).collect()
}

/// Amplitude of each exposure where the longest has 1.
fn gains(exposures: &[Exposure<'_>]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..exposures.len()).collect();
    order.sort_by(|a, b| exposures[*b].integration_time_s.total_cmp(&exposures[*a].integration_time_s));
    let mut gains = vec![1.0; exposures.len()];
    for pair in order.windows(2) {
        let [longer, shorter] = [&exposures[pair[0]], &exposures[pair[1]]];
        let by_time = shorter.integration_time_s / longer.integration_time_s;
        gains[pair[1]] = gains[pair[0]] * ratio_of_amplitudes(shorter.frame, longer.frame).unwrap_or(by_time);
    }
    gains
}

/// Median ratio over the brighter half of the pixels that both have unsaturated.
fn ratio_of_amplitudes(shorter: &RangeFrame, longer: &RangeFrame) -> Option<f64> {
    let of = |frame: &RangeFrame, pixel: usize| {
        let amplitude = frame.amplitude.as_slice()[pixel];
        let saturated = frame.flags.as_slice()[pixel].contains(Flags::SATURATED);
        (amplitude > 0.0 && amplitude.is_finite() && !saturated).then_some(amplitude)
    };
    let pairs = (0..shorter.flags.as_slice().len()).filter_map(|pixel| Some((of(shorter, pixel)?, of(longer, pixel)?)));
    let mut pairs: Vec<(f32, f32)> = pairs.collect();
    if pairs.len() < FEWEST_SHARED {
        return None;
    }
    let middle = pairs.len() / 2;
    pairs.select_nth_unstable_by(middle, |a, b| a.1.total_cmp(&b.1));
    let mut ratios: Vec<f64> =
        pairs[middle..].iter().map(|(short, long)| f64::from(*short) / f64::from(*long)).collect();
    Some(upper_median(&mut ratios))
}

/// What one pixel becomes.
struct Fused {
    range: f32,
    sigma: f32,
    amplitude: f32,
    flags: Flags,
    /// Bit by exposure.
    used: u64,
    contradictory: bool,
    saturated: bool,
}

/// A range that may take part.
#[derive(Clone, Copy)]
struct Candidate {
    exposure: usize,
    time_s: f64,
    range: f64,
    sigma: f64,
    amplitude: f64,
    flags: Flags,
}

struct Fuser<'a> {
    exposures: &'a [Exposure<'a>],
    gains: Vec<f64>,
    biases: Vec<Bias>,
    options: &'a FusionOptions,
    limits: Vec<f64>,
}

impl Fuser<'_> {
    fn pixel(&self, pixel: usize, candidates: &mut Vec<Candidate>) -> Fused {
        candidates.clear();
        candidates.extend(self.exposures.iter().enumerate().map(|(exposure, own)| Candidate {
            exposure,
            time_s: own.integration_time_s,
            range: f64::from(own.frame.range.as_slice()[pixel]),
            sigma: f64::from(own.frame.sigma.as_slice()[pixel]),
            amplitude: f64::from(own.frame.amplitude.as_slice()[pixel]),
            flags: own.frame.flags.as_slice()[pixel],
        }));
        let all_flags = candidates.iter().fold(Flags::empty(), |all, candidate| all | candidate.flags);
        candidates.retain(|candidate| candidate.range.is_finite());
        let some = !candidates.is_empty();
        candidates.retain(|candidate| !candidate.flags.contains(Flags::SATURATED));
        keep_if_any(candidates, |candidate| !candidate.flags.intersects(DOUBTFUL));
        let saturated = some && candidates.is_empty();
        if !keep_if_any(candidates, |candidate| candidate.sigma <= self.options.normal_sigma_m) {
            candidates.sort_by(|a, b| b.time_s.total_cmp(&a.time_s));
            candidates.truncate(1);
        }
        let amplitude = self.share_amplitude(candidates);
        for candidate in candidates.iter_mut() {
            let bias = self.biases[candidate.exposure].square(candidate.amplitude);
            candidate.sigma = (candidate.sigma.powi(2) + bias).sqrt();
        }
        let contradictory = self.settle(candidates);
        let (range, sigma) = match candidates.as_slice() {
            [only] => (only.range, only.sigma),
            several => {
                let (range, weight) = mean(several, |candidate| candidate.sigma.powi(2));
                (range, weight.sqrt().recip())
            }
        };
        let kept = candidates.iter().fold(Flags::empty(), |all, candidate| all | candidate.flags);
        let mut flags = if candidates.is_empty() { all_flags | Flags::NO_DATA } else { kept - Flags::NO_DATA };
        flags.set(Flags::MOTION, contradictory || flags.contains(Flags::MOTION));
        Fused {
            range: range as f32,
            sigma: if range.is_nan() { f32::NAN } else { sigma as f32 },
            amplitude: amplitude as f32,
            flags,
            used: candidates.iter().fold(0, |used, candidate| used | 1 << candidate.exposure),
            contradictory,
            saturated,
        }
    }

    /// Gives each candidate the sigma that the amplitude of all together says; gives that amplitude, NaN where one is not
    /// known.
    fn share_amplitude(&self, candidates: &mut [Candidate]) -> f64 {
        let sums = candidates.iter().fold([0.0; 2], |[amplitude, gain], candidate| {
            [amplitude + candidate.amplitude, gain + self.gains[candidate.exposure]]
        });
        let shared = sums[0] / sums[1];
        if shared > 0.0 {
            for candidate in candidates {
                // Never smaller than its own: near darkness that is bounded, and no longer one over the amplitude.
                let ratio = candidate.amplitude / (shared * self.gains[candidate.exposure]);
                candidate.sigma *= ratio.max(1.0);
            }
        }
        shared
    }

    /// Takes candidates away until the rest agree; whether one had to go.
    fn settle(&self, candidates: &mut Vec<Candidate>) -> bool {
        let count = candidates.len();
        while candidates.len() > 1 && self.disagreement(candidates, None) > self.limits[candidates.len()] {
            let worst = if let [a, b] = candidates.as_slice() {
                usize::from(a.time_s < b.time_s)
            } else {
                let without = |index: &usize| self.disagreement(candidates, Some(*index));
                (0..candidates.len()).min_by(|a, b| without(a).total_cmp(&without(b))).unwrap_or(0)
            };
            candidates.remove(worst);
        }
        candidates.len() < count
    }

    /// `Σ (ρ − mean)² / (σ² + floor²)`, one candidate left out.
    fn disagreement(&self, candidates: &[Candidate], without: Option<usize>) -> f64 {
        let left = || candidates.iter().enumerate().filter(move |(index, _)| Some(*index) != without).map(|(_, c)| c);
        let variance = |candidate: &Candidate| candidate.sigma.powi(2) + self.options.floor_m.powi(2);
        let (mean, _) = mean(left(), variance);
        left().map(|candidate| (candidate.range - mean).powi(2) / variance(candidate)).sum()
    }
}

/// Weighted mean and sum of weights.
fn mean<'a>(candidates: impl IntoIterator<Item = &'a Candidate>, variance: impl Fn(&Candidate) -> f64) -> (f64, f64) {
    let (sum, weights) = candidates.into_iter().fold((0.0, 0.0), |(sum, weights), candidate| {
        let weight = variance(candidate).recip();
        (sum + weight * candidate.range, weights + weight)
    });
    (sum / weights, weights)
}

/// Keeps those for which something holds, or all if it holds for none; whether it holds for one.
fn keep_if_any(candidates: &mut Vec<Candidate>, holds: impl Fn(&Candidate) -> bool) -> bool {
    let any = candidates.iter().any(&holds);
    if any {
        candidates.retain(holds);
    }
    any
}
