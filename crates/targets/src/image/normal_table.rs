//! The normal distribution by a table: an edge's profile is asked for at every pixel.

use std::sync::LazyLock;

use statistics::Distribution;

/// Entries of a unit: cubic interpolation between them is exact to 1e-9.
const ENTRIES: usize = 64;

/// Beyond, the profile is 1 to 2e-9 and its slope 1e-8.
const END: f64 = 6.0;

/// Profile `2Φ(z) − 1` and density `φ(z)` at multiples of 1/64.
static TABLE: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let entry = |k: usize| {
        let z = k as f64 / ENTRIES as f64;
        [1.0 - 2.0 * Distribution::Normal.survival(z), density(z)]
    };
    (0..=END as usize * ENTRIES + 1).map(entry).collect()
});

/// The table, to be asked for once a fit.
#[derive(Clone, Copy)]
pub(crate) struct NormalTable(&'static [[f64; 2]]);

impl NormalTable {
    pub(crate) fn new() -> Self {
        Self(&TABLE)
    }

    /// The profile of an edge blurred by a Gaussian, `2Φ(z) − 1`, and the density `φ(z)`, which is half its slope.
    pub(crate) fn profile(&self, z: f64) -> (f64, f64) {
        let size = z.abs();
        if size.is_nan() || size >= END {
            return (z.signum(), 0.0);
        }
        let place = size * ENTRIES as f64;
        let index = place as usize;
        let t = place - index as f64;
        let ([low, low_density], [high, high_density]) = (self.0[index], self.0[index + 1]);
        // Cubic between both values and slopes; those of the density are −zφ.
        let step = 1.0 / ENTRIES as f64;
        let z_low = index as f64 * step;
        let profile = hermite(t, [low, high], [2.0 * low_density * step, 2.0 * high_density * step]);
        let slopes = [-z_low * low_density * step, -(z_low + step) * high_density * step];
        (profile.copysign(z), hermite(t, [low_density, high_density], slopes))
    }
}

fn hermite(t: f64, [low, high]: [f64; 2], [low_slope, high_slope]: [f64; 2]) -> f64 {
    let rise = high - low;
    let (a, b) = (low_slope - rise, rise - high_slope);
    low + t * rise + t * (1.0 - t) * (a * (1.0 - t) + b * t)
}

fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_distribution() {
        let table = NormalTable::new();
        for k in -4000..4000 {
            let z = f64::from(k) * 0.001_7;
            let (profile, slope) = table.profile(z);
            assert!((profile - (1.0 - 2.0 * Distribution::Normal.survival(z))).abs() < 3e-9, "{z}: {profile}");
            assert!((slope - density(z)).abs() < 1e-8, "{z}: {slope}");
        }
        assert!(table.profile(f64::INFINITY).0 > 0.5 && table.profile(f64::NEG_INFINITY).0 < -0.5);
    }
}
