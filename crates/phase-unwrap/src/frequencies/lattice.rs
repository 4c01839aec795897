//! The wrap counts of several frequencies that can belong together, and the search among them for a block of pixels.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use range_image::Modulation;

use crate::frequencies::frame::{Block, Planes};
use crate::frequencies::intervals::combined_interval_m;
use crate::frequencies::lanes::{LANES, Lanes, exp_negative, nearest, select};
use crate::{Error, MultiFrequencyOptions, Result};

/// Largest number of frequencies.
pub(crate) const MAXIMUM_FREQUENCIES: usize = 8;
/// Most hypotheses a pixel: a search of a frame takes time in proportion, and real cameras need tens. Frequencies whose
/// combined interval asks for more are refused until a largest range is given.
const MAXIMUM_HYPOTHESES: usize = 4096;
/// Misfit per degree of freedom, as a ratio of variances, from which the confidence is lowered in proportion: three standard
/// deviations, squared. Phases that no range explains come from mixed pixels, multipath or motion; a larger value calls more
/// of them sure, a smaller one doubts ranges whose sigma is stated too small.
const ACCEPTABLE_MISFIT: f32 = 9.0;

/// Misfit beyond the best one's from which a hypothesis is not told any more: its likelihood is e^-30, a millionth of the last bit of
/// the best one's.
const UNLIKELY_MISFIT: f32 = 60.0;

/// What does not depend on the pixel: frequencies sorted from the highest, and the hypotheses of each as reference.
#[derive(Debug, Clone)]
pub(crate) struct Lattice {
    /// Position of each frequency in the caller's order.
    pub(crate) order: Vec<usize>,
    pub(crate) intervals_m: Vec<f64>,
    pub(crate) maximum_range_m: f64,
    pub(crate) assumed_sigma: f32,
    references: Vec<Reference>,
}

/// The hypotheses where a frequency is the highest one known: one for each of its counts from -1. The count -1 serves
/// phases just below a full cycle at ranges near zero.
#[derive(Debug, Clone)]
struct Reference {
    /// Ratio of intervals, this one over each; 0 where there is no frequency.
    ratio: [f32; MAXIMUM_FREQUENCIES],
    /// The same as a number of twelve bits and a rest: its products with the number of a hypothesis are exact.
    coarse_ratio: [f32; MAXIMUM_FREQUENCIES],
    rest_ratio: [f32; MAXIMUM_FREQUENCIES],
    /// Metres of one cycle, of this frequency and of each.
    interval_m: f32,
    intervals_m: [f32; MAXIMUM_FREQUENCIES],
    /// For each hypothesis the range in metres that the count stands for.
    start_m: Vec<f32>,
    /// For each hypothesis the cycles of each frequency that the count stands for, less whole ones.
    cycles: Vec<[f32; MAXIMUM_FREQUENCIES]>,
}

/// The best hypotheses of a block of pixels, best first.
pub(crate) struct Found<const K: usize> {
    pub(crate) range_m: [Lanes; K],
    /// Infinite where there are fewer hypotheses.
    pub(crate) misfit: [Lanes; K],
    /// Among these hypotheses; 0 where there is none.
    pub(crate) probability: [Lanes; K],
    /// Standard deviation of the range, with assumed sigmas of phases where none are given.
    pub(crate) sigma_m: Lanes,
    /// The same; NaN where it rests on an assumption.
    pub(crate) known_sigma_m: Lanes,
    /// 1, or less where not even the best hypothesis explains the phases.
    pub(crate) acceptable: Lanes,
    /// Whether the best hypothesis of each pixel is the only likely one: the others are not told then.
    pub(crate) alone: bool,
}

impl Lattice {
    pub(crate) fn new(modulations: &[Modulation], options: &MultiFrequencyOptions) -> Result<Self> {
        let combined = combined_interval_m(modulations)?;
        if modulations.len() > MAXIMUM_FREQUENCIES {
            return Err(Error::TooManyFrequencies { found: modulations.len(), limit: MAXIMUM_FREQUENCIES });
        }
        let maximum_range_m = options.maximum_range_m.unwrap_or(combined);
        options.validate(maximum_range_m)?;
        // A millionth of slack lets the caller state the combined interval itself, rounded.
        if maximum_range_m > combined * (1.0 + 1e-6) {
            return Err(Error::BeyondCombinedInterval { maximum_range_m, combined_interval_m: combined });
        }
        let intervals = modulations.iter().map(Modulation::ambiguity_interval_m);
        let mut sorted: Vec<(usize, f64)> = intervals.enumerate().collect();
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
        let hypotheses = (maximum_range_m / sorted[0].1).ceil();
        if hypotheses > MAXIMUM_HYPOTHESES as f64 {
            return Err(Error::SearchTooLarge { hypotheses, maximum_range_m, limit: MAXIMUM_HYPOTHESES });
        }
        let (order, intervals_m): (Vec<usize>, Vec<f64>) = sorted.into_iter().unzip();
        let references = intervals_m.iter().map(|own| Reference::new(*own, &intervals_m, maximum_range_m)).collect();
        Ok(Self { order, intervals_m, maximum_range_m, assumed_sigma: options.assumed_sigma_phase_rad, references })
    }

    /// Finds the `K` best hypotheses of the pixels from `start`, `LANES` or as many as `count` says; of pixels for which one alone
    /// is likely only that one, unless `all` are asked for.
    #[inline(always)]
    pub(crate) fn search<const K: usize>(
        &self,
        planes: &Planes<'_>,
        start: usize,
        count: usize,
        all: bool,
    ) -> Found<K> {
        // Missing frequencies weigh nothing, so a few sizes serve all.
        match self.order.len() {
            2 => self.search_sized::<2, K>(planes, start, count, all),
            3 => self.search_sized::<3, K>(planes, start, count, all),
            4 => self.search_sized::<4, K>(planes, start, count, all),
            _ => self.search_sized::<MAXIMUM_FREQUENCIES, K>(planes, start, count, all),
        }
    }

    #[inline(always)]
    fn search_sized<const F: usize, const K: usize>(
        &self,
        planes: &Planes<'_>,
        start: usize,
        count: usize,
        all: bool,
    ) -> Found<K> {
        let block = Block::<F>::load(self, planes, start, count);
        let mut found = Found::<K>::none();
        let first = &self.references[0];
        if !all && block.led_by(0) == [true; LANES] {
            let best = first.best::<F, K>(&block, 0, self.maximum_range_m as f32);
            found.alone = first.is_clear(&best);
            let ranks = if found.alone { 1 } else { K };
            first.unpack(&block, 0, &best[..ranks], &[true; LANES], &mut found);
            Self::finish(&block, &mut found);
            return found;
        }
        for (position, reference) in self.references.iter().enumerate().take(F - 1) {
            let lanes = block.led_by(position);
            if lanes.iter().any(|&led| led) {
                let best = reference.best::<F, K>(&block, position, self.maximum_range_m as f32);
                reference.unpack(&block, position, &best, &lanes, &mut found);
            }
        }
        Self::finish(&block, &mut found);
        found
    }

    /// Probabilities, sigma and fit from the misfits.
    #[inline(always)]
    fn finish<const F: usize, const K: usize>(block: &Block<F>, found: &mut Found<K>) {
        let best = found.misfit[0];
        let mut sum = [1.0; LANES];
        if found.alone {
            found.probability[0] = sum;
        } else {
            sum = Self::weigh(found);
        }
        for lane in 0..LANES {
            found.sigma_m[lane] = 1.0 / block.total_weight[lane].max(f32::MIN_POSITIVE).sqrt();
            let known = block.sigma_known[lane] * sum[lane] > 0.0;
            found.known_sigma_m[lane] = select(known, found.sigma_m[lane], f32::NAN);
            let limit = ACCEPTABLE_MISFIT * (block.members[lane] - 1.0);
            found.acceptable[lane] = (limit / best[lane].max(f32::MIN_POSITIVE)).min(1.0);
        }
    }

    /// Probabilities, and the sums of the likelihoods.
    #[inline(always)]
    fn weigh<const K: usize>(found: &mut Found<K>) -> Lanes {
        let best = found.misfit[0];
        let mut sum = [0.0; LANES];
        for (misfit, probability) in found.misfit.iter().zip(&mut found.probability) {
            for lane in 0..LANES {
                let likelihood = exp_negative(-0.5 * (misfit[lane] - best[lane]).max(0.0));
                probability[lane] = select(misfit[lane] <= f32::MAX, likelihood, 0.0);
                sum[lane] += probability[lane];
            }
        }
        for probability in &mut found.probability {
            for lane in 0..LANES {
                probability[lane] /= sum[lane].max(f32::MIN_POSITIVE);
            }
        }
        sum
    }
}

impl Reference {
    fn new(own_m: f64, all_m: &[f64], maximum_range_m: f64) -> Self {
        // Less than nothing is left of a last count that only rounding makes.
        let counts = -1..((maximum_range_m / own_m - 1e-9).ceil() as i32).max(1);
        let each = |value: &dyn Fn(f64) -> f64| {
            let mut values = [0.0; MAXIMUM_FREQUENCIES];
            for (value_of, interval_m) in values.iter_mut().zip(all_m) {
                *value_of = value(*interval_m) as f32;
            }
            values
        };
        let coarse = |interval_m: f64| {
            let ratio = own_m / interval_m;
            let unit = (ratio.log2().floor() - 11.0).exp2();
            (ratio / unit).round() * unit
        };
        let cycles = counts.clone().map(|count| {
            each(&|interval_m| {
                let exact = f64::from(count) * (own_m / interval_m);
                exact - exact.round()
            })
        });
        Self {
            ratio: each(&|interval_m| own_m / interval_m),
            coarse_ratio: each(&coarse),
            rest_ratio: each(&|interval_m| own_m / interval_m - coarse(interval_m)),
            interval_m: own_m as f32,
            intervals_m: each(&|interval_m| interval_m),
            cycles: cycles.collect(),
            start_m: counts.map(|count| (f64::from(count) * own_m) as f32).collect(),
        }
    }

    /// Bits that number the hypotheses.
    #[inline(always)]
    fn number_mask(&self) -> u32 {
        self.start_m.len().next_power_of_two() as u32 - 1
    }

    /// Cycles by which the other phases differ from what this one says.
    #[inline(always)]
    fn offsets<const F: usize>(&self, block: &Block<F>, position: usize) -> [Lanes; F] {
        let mut offsets = [[0.0; LANES]; F];
        for other in 1..F {
            for lane in 0..LANES {
                let expected = block.cycles[position][lane] * self.ratio[other];
                offsets[other][lane] = expected - block.cycles[other][lane];
            }
        }
        offsets
    }

    /// Misfit and number of the best hypotheses, packed into one integer each: the bits of a positive number sort as
    /// the number does, and its last ones give way to the number of the hypothesis.
    #[inline(always)]
    fn best<const F: usize, const K: usize>(
        &self,
        block: &Block<F>,
        position: usize,
        maximum_range_m: f32,
    ) -> [[u32; LANES]; K] {
        let offsets = self.offsets(block, position);
        let interval_m = self.interval_m;
        let mask = self.number_mask();
        let tolerance = 1e-5 * interval_m;
        let mut weight = [[0.0; LANES]; F];
        let mut inverse = [0.0; LANES];
        let mut first_m = [0.0; LANES];
        for lane in 0..LANES {
            inverse[lane] = 1.0 / block.total_weight[lane].max(f32::MIN_POSITIVE);
            first_m[lane] = interval_m * block.cycles[position][lane];
            for other in 1..F {
                weight[other][lane] = block.weight[other][lane] * self.intervals_m[other];
            }
        }
        let mut best = [[u32::MAX; LANES]; K];
        for (number, (start_m, cycles)) in self.start_m.iter().zip(&self.cycles).enumerate() {
            for lane in 0..LANES {
                let (mut sum, mut squares) = (0.0, 0.0);
                for other in 1..F {
                    let difference = offsets[other][lane] + cycles[other];
                    let residual = nearest(difference) - difference;
                    let weighted = weight[other][lane] * residual;
                    sum += weighted;
                    squares += weighted * (residual * self.intervals_m[other]);
                }
                let shift = sum * inverse[lane];
                let range_m = start_m + first_m[lane] + shift;
                let misfit = (squares - sum * shift).max(0.0);
                let valid = (range_m >= -tolerance) & (range_m < maximum_range_m - tolerance);
                let mut key = if valid { misfit.to_bits() & !mask } else { f32::INFINITY.to_bits() } | number as u32;
                for best in &mut best {
                    let low = best[lane].min(key);
                    key = best[lane].max(key);
                    best[lane] = low;
                }
            }
        }
        best
    }

    /// Whether each pixel has a hypothesis, and no other that is likely beside it.
    #[inline(always)]
    fn is_clear<const K: usize>(&self, best: &[[u32; LANES]; K]) -> bool {
        let mask = self.number_mask();
        let mut clear = true;
        for lane in 0..LANES {
            let misfit = f32::from_bits(best[0][lane] & !mask);
            let next = if K > 1 { f32::from_bits(best[1][lane] & !mask) } else { f32::INFINITY };
            clear &= (misfit <= f32::MAX) & (next - misfit > UNLIKELY_MISFIT);
        }
        clear
    }

    /// Ranges and misfits of the hypotheses found, for the lanes that this reference leads.
    #[inline(always)]
    fn unpack<const F: usize, const K: usize>(
        &self,
        block: &Block<F>,
        position: usize,
        best: &[[u32; LANES]],
        lanes: &[bool; LANES],
        found: &mut Found<K>,
    ) {
        let offsets = self.offsets(block, position);
        let interval_m = self.interval_m;
        let mask = self.number_mask();
        for (k, best) in best.iter().enumerate() {
            for lane in 0..LANES {
                // Numbers stay far below 2^24, which is all that a wider one could mean.
                let number = ((best[lane] & mask) as i32) as f32 - 1.0;
                let (mut sum, mut squares) = (0.0, 0.0);
                for other in 1..F {
                    let coarse = number * self.coarse_ratio[other];
                    let cycles = (coarse - nearest(coarse)) + number * self.rest_ratio[other];
                    let difference = offsets[other][lane] + cycles;
                    let residual = (nearest(difference) - difference) * self.intervals_m[other];
                    let weighted = block.weight[other][lane] * residual;
                    sum += weighted;
                    squares += weighted * residual;
                }
                let shift = sum / block.total_weight[lane].max(f32::MIN_POSITIVE);
                let range_m = interval_m * (number + block.cycles[position][lane]) + shift;
                let valid = lanes[lane] & (best[lane] < f32::INFINITY.to_bits());
                let misfit = (squares - sum * shift).max(0.0);
                found.range_m[k][lane] = select(valid, range_m.max(0.0), found.range_m[k][lane]);
                found.misfit[k][lane] = select(valid, misfit, found.misfit[k][lane]);
            }
        }
    }
}

impl<const K: usize> Found<K> {
    fn none() -> Self {
        let zero = [0.0; LANES];
        Self {
            range_m: [[f32::NAN; LANES]; K],
            misfit: [[f32::INFINITY; LANES]; K],
            probability: [zero; K],
            sigma_m: zero,
            known_sigma_m: zero,
            acceptable: zero,
            alone: false,
        }
    }
}
