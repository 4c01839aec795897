//! What one pixel of repeated frames says of rest.

/// One pixel's part in the tests, used for one pixel after the other.
pub(crate) struct PixelTest {
    /// Sum over the frames of the squared deviations from the mean, in variances.
    pub(crate) square: f64,
    pub(crate) degrees: usize,
    /// Values that were tested; of several frequencies, those of the frequency that has most.
    pub(crate) values: usize,
    /// Weighted deviation of each frame along the value (amplitude) and across it (phase).
    pub(crate) common: Vec<[f64; 2]>,
    pub(crate) weight: f64,
    /// Square of each frame's deviation, in the variances that such a deviation has.
    squares: Vec<f64>,
}

impl PixelTest {
    pub(crate) fn new(frames: usize) -> Self {
        let (common, squares) = (vec![[0.0; 2]; frames], vec![0.0; frames]);
        Self { square: 0.0, degrees: 0, values: 0, common, weight: 0.0, squares }
    }

    pub(crate) fn clear(&mut self) {
        (self.square, self.degrees, self.values, self.weight) = (0.0, 0, 0, 0.0);
        self.common.fill([0.0; 2]);
        self.squares.fill(0.0);
    }

    /// The square of the frame that deviates most.
    pub(crate) fn largest(&self) -> f64 {
        self.squares.iter().copied().fold(0.0, f64::max)
    }

    /// Adds a value of `parts` parts that count, with its sigma, from each of the frames that count; `along` gives the
    /// direction of the amplitude from the mean.
    pub(crate) fn add(
        &mut self,
        values: impl Iterator<Item = ([f64; 2], f64)> + Clone,
        counts: impl Fn(usize) -> bool,
        parts: usize,
        along: impl Fn([f64; 2]) -> [f64; 2],
    ) {
        let known = |frame: usize, ([x, y], sigma): ([f64; 2], f64)| {
            x.is_finite() && y.is_finite() && sigma > 0.0 && counts(frame)
        };
        let (mut count, mut mean, mut variance) = (0_usize, [0.0; 2], 0.0);
        for (frame, (value, sigma)) in values.clone().enumerate() {
            if known(frame, (value, sigma)) {
                count += 1;
                mean = [mean[0] + value[0], mean[1] + value[1]];
                variance += sigma * sigma;
            }
        }
        if count < 2 {
            return;
        }
        let number = count as f64;
        (mean, variance) = (mean.map(|sum| sum / number), variance / number);
        let [re, im] = along(mean);
        let all = count == self.common.len();
        let frames = values.enumerate().zip(self.common.iter_mut().zip(&mut self.squares));
        for ((frame, value), (common, largest)) in frames {
            if !known(frame, value) {
                continue;
            }
            let [x, y] = [value.0[0] - mean[0], value.0[1] - mean[1]];
            let square = (x * x + y * y) / variance;
            self.square += square;
            *largest += square * number / (number - 1.0);
            if all {
                common[0] += (x * re + y * im) / variance;
                common[1] += (y * re - x * im) / variance;
            }
        }
        self.degrees += parts * (count - 1);
        self.values = self.values.max(count);
        if all {
            self.weight += (re * re + im * im) / variance;
        }
    }
}
