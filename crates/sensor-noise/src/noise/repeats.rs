//! What repeated values of one quantity say of their variance.

use super::Steadiness;

/// Repeated values of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Repeats {
    /// Number of the pixel among those of all stations: what moves, moves in all its values.
    pub(super) pixel: usize,
    /// What the variance depends on linearly.
    pub(super) regressor: f64,
    /// Variance of the regressor by its own noise.
    pub(super) regressor_variance: f64,
    /// `Σ (x − mean)² / (n − 1)`.
    pub(super) variance: f64,
    /// `Σ (x_i+1 − x_i)² / 2 (n − 1)`: blind to a slow drift (`[vonNeumann1941]`).
    pub(super) successive: f64,
    /// Number n of values.
    pub(super) count: usize,
}

/// The sums behind [`Repeats`], value by value (`[Welford1962]`: no large numbers cancel).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Running {
    count: usize,
    pub(super) mean: f64,
    squares: f64,
    steps: f64,
    last: f64,
}

impl Running {
    pub(super) fn add(&mut self, value: f64) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
        if self.count > 1 {
            self.steps += (value - self.last).powi(2);
        }
        self.last = value;
    }

    /// `None` below two values. Pixel and the regressor's own noise are said later.
    pub(super) fn repeats(&self, regressor: f64) -> Option<Repeats> {
        let (count, degrees) = (self.count, self.count as f64 - 1.0);
        let (variance, successive) = (self.squares / degrees, 0.5 * self.steps / degrees);
        (count > 1).then_some(Repeats { pixel: 0, regressor, regressor_variance: 0.0, variance, successive, count })
    }
}

/// The repeats of all stations, one after the other.
#[derive(Default)]
pub(super) struct AllRepeats {
    pub(super) values: Vec<Repeats>,
    pub(super) steadiness: Vec<Steadiness>,
    /// Pixels of the stations so far.
    pixels: usize,
}

impl AllRepeats {
    /// Adds those of a station of so many frames; its pixels are numbered behind those of the others.
    pub(super) fn add(&mut self, station: &str, frames: usize, own: impl Iterator<Item = Repeats>) {
        let (first, earlier) = (self.values.len(), self.pixels);
        self.values.extend(own);
        let own = &mut self.values[first..];
        self.steadiness.push(Steadiness::new(station, frames, own));
        for one in own {
            one.pixel += earlier;
            self.pixels = self.pixels.max(one.pixel + 1);
        }
    }
}

/// Values of all stations together that are taken, about. Each takes 100 to 170 bytes; a class of noise holds 60,000 of so many, which tell its variance to half a percent from two frames already. A survey of fewer values, 40 stations
/// of 176 x 144 pixels with four samples each, is taken whole.
const MOST_VALUES: usize = 1 << 22;

/// The pixels whose values are taken: every so-many-th, each station beginning with another one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Thinning {
    /// Of so many pixels one is taken.
    pub(super) stride: usize,
    station: usize,
}

impl Thinning {
    /// Of the station of this number, of so many with as many values each.
    pub(super) fn new(station: usize, stations: usize, values: usize) -> Self {
        // Widths of images are even: an odd stride takes pixels of all columns.
        let stride = match (stations * values).div_ceil(MOST_VALUES) {
            0 | 1 => 1,
            several => several | 1,
        };
        Self { stride, station }
    }

    /// Of so many pixels.
    pub(super) fn pixels(self, count: usize) -> impl Iterator<Item = usize> + Clone {
        (self.station % self.stride..count).step_by(self.stride)
    }
}
