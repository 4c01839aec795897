//! Unwrapping with several frequencies: a search over all wrap counts in the combined ambiguity interval.

use std::f32::consts::TAU as TAU_F32;
use std::f64::consts::TAU;

use range_image::{Modulation, Raster};

use crate::intervals::combined_interval_m;
use crate::{Error, Result};

/// How several frequencies are unwrapped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultiFrequencyOptions {
    /// Largest range searched, metres. `None`: the combined ambiguity interval.
    pub maximum_range_m: Option<f64>,
    /// Standard deviation of the phase, radians, where none is given.
    pub assumed_sigma_phase_rad: f32,
    /// Largest number of hypotheses a pixel: a search beyond it is refused.
    pub maximum_hypotheses: usize,
    /// Misfit per degree of freedom, as a ratio of variances, above which the confidence is lowered: phases that no
    /// range explains come from mixed pixels, multipath or motion.
    pub acceptable_misfit: f32,
}

impl Default for MultiFrequencyOptions {
    fn default() -> Self {
        Self { maximum_range_m: None, assumed_sigma_phase_rad: 0.1, maximum_hypotheses: 4096, acceptable_misfit: 9.0 }
    }
}

/// Wrap counts and combined ranges of several frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct MultiUnwrapped {
    /// Whole cycles of each frequency; 0 where there is no answer.
    pub wraps: Vec<Raster<i32>>,
    /// Inverse-variance mean of the ranges, metres; NaN where fewer than two phases are usable.
    pub range: Raster<f32>,
    /// Standard deviation of `range` in metres as the phases' sigmas propagate; NaN where these are not given.
    pub sigma: Raster<f32>,
    /// 0 (a guess, or no answer) to 1: from the gap to the second-best hypothesis and the misfit of the best.
    pub confidence: Raster<f32>,
}

/// Finds the wrap counts of each pixel that make the ranges of all frequencies agree best.
///
/// `phases` are in radians in `[0, 2 pi]`, one raster a frequency, `sigma_phase` their standard deviations; where that
/// is NaN or not positive the assumed one stands in. For each count of the highest frequency the others take the
/// counts nearest to its range; the hypothesis with the smallest sum of squared, normalised residuals wins. A phase
/// that is not finite is left out; two at least are needed.
pub fn unwrap_multi_frequency(
    phases: &[Raster<f32>],
    modulations: &[Modulation],
    sigma_phase: Option<&[Raster<f32>]>,
    mask: Option<&Raster<bool>>,
    options: &MultiFrequencyOptions,
) -> Result<MultiUnwrapped> {
    let search = Search::new(modulations, options)?;
    let first = check_planes(phases, modulations.len(), sigma_phase, mask)?;
    let (width, height) = (first.width(), first.height());
    let plane = |value| Raster::filled(width, height, value);
    let mut out = MultiUnwrapped {
        wraps: vec![Raster::filled(width, height, 0); phases.len()],
        range: plane(f32::NAN),
        sigma: plane(f32::NAN),
        confidence: plane(0.0),
    };
    let mut pixel = PixelSearch::default();
    for index in 0..first.len() {
        if mask.is_some_and(|mask| !mask.as_slice()[index]) {
            continue;
        }
        pixel.load(&search, phases, sigma_phase, index);
        let Some(best) = pixel.search(&search) else {
            continue;
        };
        for (member, &wraps) in pixel.members.iter().zip(&pixel.best) {
            out.wraps[member.frequency].as_mut_slice()[index] = wraps;
        }
        out.range.as_mut_slice()[index] = best.range_m as f32;
        out.confidence.as_mut_slice()[index] = best.confidence;
        if pixel.sigma_known {
            out.sigma.as_mut_slice()[index] = best.sigma_m as f32;
        }
    }
    Ok(out)
}

fn check_planes<'a>(
    phases: &'a [Raster<f32>],
    frequencies: usize,
    sigma_phase: Option<&[Raster<f32>]>,
    mask: Option<&Raster<bool>>,
) -> Result<&'a Raster<f32>> {
    let count = |what, planes: &[Raster<f32>]| {
        let found = planes.len();
        if found == frequencies { Ok(()) } else { Err(Error::PlaneCount { what, expected: frequencies, found }) }
    };
    count("phase", phases)?;
    let Some(first) = phases.first().filter(|first| !first.is_empty()) else {
        return Err(Error::Empty { width: 0, height: 0 });
    };
    for plane in phases {
        first.require_same_size(plane, "phase")?;
        let outside = |&value: &f32| value.is_finite() && !(0.0..=TAU_F32).contains(&value);
        if let Some(index) = plane.as_slice().iter().position(outside) {
            let (col, row) = (index % first.width(), index / first.width());
            return Err(Error::PhaseOutsideCycle { col, row, value: plane.as_slice()[index] });
        }
    }
    if let Some(sigmas) = sigma_phase {
        count("sigma of the phase", sigmas)?;
        for plane in sigmas {
            first.require_same_size(plane, "sigma of the phase")?;
        }
    }
    if let Some(mask) = mask {
        first.require_same_size(mask, "mask")?;
    }
    Ok(first)
}

/// What does not depend on the pixel.
struct Search {
    /// Intervals in metres.
    intervals: Vec<f64>,
    maximum_range_m: f64,
    assumed_sigma: f64,
    acceptable_misfit: f64,
}

impl Search {
    fn new(modulations: &[Modulation], options: &MultiFrequencyOptions) -> Result<Self> {
        let combined = combined_interval_m(modulations)?;
        let maximum_range_m = options.maximum_range_m.unwrap_or(combined);
        let positive = [
            ("maximum_range_m", maximum_range_m),
            ("assumed_sigma_phase_rad", options.assumed_sigma_phase_rad.into()),
            ("acceptable_misfit", options.acceptable_misfit.into()),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfDomain { name, value, expected: "positive and finite" });
            }
        }
        // A millionth of slack lets the caller state the combined interval itself, rounded.
        if maximum_range_m > combined * (1.0 + 1e-6) {
            return Err(Error::BeyondCombinedInterval { maximum_range_m, combined_interval_m: combined });
        }
        let intervals: Vec<f64> = modulations.iter().map(Modulation::ambiguity_interval_m).collect();
        let shortest = intervals.iter().copied().fold(f64::INFINITY, f64::min);
        let hypotheses = (maximum_range_m / shortest).ceil();
        if hypotheses > options.maximum_hypotheses as f64 {
            let limit = options.maximum_hypotheses;
            return Err(Error::SearchTooLarge { hypotheses, maximum_range_m, limit });
        }
        Ok(Self {
            intervals,
            maximum_range_m,
            assumed_sigma: options.assumed_sigma_phase_rad.into(),
            acceptable_misfit: options.acceptable_misfit.into(),
        })
    }
}

/// One usable phase of a pixel.
#[derive(Debug, Clone, Copy)]
struct Member {
    frequency: usize,
    interval_m: f64,
    /// Phase in cycles.
    cycles: f64,
    /// Inverse variance of the range, 1/m^2.
    weight: f64,
}

struct Best {
    range_m: f64,
    sigma_m: f64,
    confidence: f32,
}

/// The search of one pixel; members are sorted by frequency, highest first.
#[derive(Debug, Default)]
struct PixelSearch {
    members: Vec<Member>,
    sigma_known: bool,
    counts: Vec<i32>,
    best: Vec<i32>,
}

impl PixelSearch {
    fn load(&mut self, search: &Search, phases: &[Raster<f32>], sigmas: Option<&[Raster<f32>]>, index: usize) {
        self.members.clear();
        self.sigma_known = true;
        for (frequency, (phase, &interval_m)) in phases.iter().zip(&search.intervals).enumerate() {
            let phase = f64::from(phase.as_slice()[index]);
            if !phase.is_finite() {
                continue;
            }
            let given = sigmas.map(|planes| f64::from(planes[frequency].as_slice()[index]));
            let known = given.filter(|sigma| sigma.is_finite() && *sigma > 0.0);
            self.sigma_known &= known.is_some();
            let sigma_m = known.unwrap_or(search.assumed_sigma) * interval_m / TAU;
            let member = Member { frequency, interval_m, cycles: phase / TAU, weight: 1.0 / (sigma_m * sigma_m) };
            self.members.push(member);
        }
        self.members.sort_by(|a, b| a.interval_m.total_cmp(&b.interval_m));
    }

    fn search(&mut self, search: &Search) -> Option<Best> {
        let (first, others) = self.members.split_first()?;
        if others.is_empty() {
            return None;
        }
        let weight: f64 = self.members.iter().map(|m| m.weight).sum();
        let (mut best, mut second, mut range_m) = (f64::INFINITY, f64::INFINITY, f64::NAN);
        let hypotheses = (search.maximum_range_m / first.interval_m).ceil() as i32;
        for count in 0..hypotheses {
            let reference = first.interval_m * (first.cycles + f64::from(count));
            self.counts.clear();
            self.counts.push(count);
            let (mut sum, mut squares) = (0.0, 0.0);
            for other in others {
                let wraps = (reference / other.interval_m - other.cycles).round().max(0.0);
                let residual = other.interval_m * (other.cycles + wraps) - reference;
                sum += other.weight * residual;
                squares += other.weight * residual * residual;
                self.counts.push(wraps as i32);
            }
            let range = reference + sum / weight;
            let misfit = squares - sum * sum / weight;
            if range >= search.maximum_range_m {
                continue;
            }
            if misfit < best {
                (best, second, range_m) = (misfit, best, range);
                std::mem::swap(&mut self.best, &mut self.counts);
            } else if misfit < second {
                second = misfit;
            }
        }
        range_m.is_finite().then(|| {
            let freedom = others.len() as f64;
            let acceptable = (search.acceptable_misfit * freedom / best.max(f64::MIN_POSITIVE)).min(1.0);
            // Half the difference of chi-squared is a log likelihood ratio, and tanh of its half is 2 p - 1.
            let confidence = ((second - best) / 4.0).tanh() * acceptable;
            Best { range_m, sigma_m: 1.0 / weight.sqrt(), confidence: confidence as f32 }
        })
    }
}
