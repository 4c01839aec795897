//! Weighted squares of the differences between frequencies, a block of pixels at a time: loops that the compiler can
//! vectorise, without branches and library calls.

/// Pixels that are worked on together.
pub(crate) const BLOCK: usize = 64;
const INVERSE_TAU: f32 = 0.159_154_94;
/// Adding and subtracting 3 * 2^22 rounds a single-precision number below 2^22 to a whole one.
const ROUNDER: f32 = 12_582_912.0;

/// Running weighted mean and squared deviations from it, for each pixel of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scatter {
    weight: [f32; BLOCK],
    mean: [f32; BLOCK],
    pub squares: [f32; BLOCK],
}

impl Scatter {
    fn new() -> Self {
        Self { weight: [0.0; BLOCK], mean: [0.0; BLOCK], squares: [0.0; BLOCK] }
    }

    /// Takes a value in; one of weight 0 changes nothing. The mean moves value by value: no difference of large sums.
    #[inline]
    fn add(&mut self, pixel: usize, value: f32, weight: f32) {
        let total = self.weight[pixel] + weight;
        let share = if weight > 0.0 { weight / total } else { 0.0 };
        let deviation = value - self.mean[pixel];
        self.squares[pixel] += self.weight[pixel] * share * deviation * deviation;
        self.mean[pixel] += share * deviation;
        self.weight[pixel] = total;
    }
}

/// One frequency: what is the same in all pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frequency {
    pub interval_m: f32,
    pub inverse_contrast: f32,
    pub floor_m: f32,
    pub floor_contrast: f32,
    pub least_snr: f32,
}

/// One frequency of the pixels of a block.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'a> {
    pub phase: &'a [f32],
    pub amplitude: &'a [f32],
    pub sigma: &'a [f32],
}

/// What the frequencies of a block's pixels say of each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contradiction {
    pub ranges: Scatter,
    pub amplitudes: Scatter,
    /// Usable frequencies.
    pub count: [f32; BLOCK],
}

impl Contradiction {
    pub fn new() -> Self {
        Self { ranges: Scatter::new(), amplitudes: Scatter::new(), count: [0.0; BLOCK] }
    }

    /// Takes in a frequency; each range is the one nearest to `range_m`.
    pub fn add(&mut self, frequency: &Frequency, samples: Samples, range_m: &[f32]) {
        let metres_per_radian = frequency.interval_m * INVERSE_TAU;
        let rate = 1.0 / frequency.interval_m;
        let values = samples.phase.iter().zip(samples.amplitude).zip(samples.sigma).zip(range_m);
        for (pixel, (((phase, amplitude), sigma), range)) in values.enumerate().take(BLOCK) {
            let cycles = phase * INVERSE_TAU - range * rate;
            let distance = (cycles - ((cycles + ROUNDER) - ROUNDER)) * frequency.interval_m;
            let relative = sigma / amplitude;
            let sigma_m = relative * metres_per_radian;
            let variance_m = sigma_m * sigma_m + frequency.floor_m * frequency.floor_m;
            let light = amplitude * frequency.inverse_contrast;
            let variance = relative * relative + frequency.floor_contrast * frequency.floor_contrast;
            // Comparisons with NaN are false.
            let usable = *sigma >= 0.0
                && *amplitude > frequency.least_snr * sigma
                && *amplitude < f32::MAX
                && distance.abs() <= frequency.interval_m;
            let one = if usable { 1.0 } else { 0.0 };
            let (distance, light) = if usable { (distance, light) } else { (0.0, 0.0) };
            self.count[pixel] += one;
            self.ranges.add(pixel, distance, if usable { 1.0 / variance_m } else { 0.0 });
            self.amplitudes.add(pixel, light, if usable { 1.0 / (variance * light * light) } else { 0.0 });
        }
    }
}
