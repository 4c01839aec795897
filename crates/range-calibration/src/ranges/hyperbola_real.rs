//! The hyperbola of Eq. 15 in numbers for which it always has a value.
//!
//! With `x = a − a₀` from the smallest amplitude on, the radicand of Eq. 15 over h3² is `q²x² + 2qnτx + n²`: q is the
//! slope h2/h3, n the root of the radicand at a₀, and the hyperbola falls from `n − q a₀` to `nτ − q a₀`. It is real for
//! all `a ≥ a₀` where `q, n > 0` and `τ ≥ −1`. So their logarithms, `ln q`, `ln n` and `ln(1 + τ)`, may take any value.

use error_models::AmplitudeHyperbola;

/// Largest logarithm, and its negative: e^100 stands for infinity, and its square still is a number.
const LARGEST: f64 = 100.0;

/// Least `1 + τ` and relative n of a start value, which may lie on the edge.
const LEAST: f64 = 1e-3;

/// The hyperbola with its value and derivatives by `ln q`, `ln n`, `ln(1 + τ)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RealHyperbola {
    slope: f64,
    root: f64,
    level: f64,
    lowest: f64,
}

impl RealHyperbola {
    /// From the three logarithms; `lowest` is a₀. `None` where one is no number or out of all proportion.
    pub(crate) fn from_logarithms(logarithms: &[f64], lowest: f64) -> Option<Self> {
        let [slope, root, level] = *logarithms else { return None };
        let usable = [slope, root, level].iter().all(|value| value.abs() < LARGEST);
        usable.then(|| Self { slope: slope.exp(), root: root.exp(), level: level.exp() - 1.0, lowest })
    }

    /// The nearest one to coefficients h1, h2, h3 with a positive slope h2/h3; `None` for others.
    pub(crate) fn near([h1, h2, h3]: [f64; 3], lowest: f64) -> Option<Self> {
        let (slope, linear, constant) = (h2 / h3, h1 / h3, 1.0 / h3);
        let radicand = (slope * slope * lowest - 2.0 * linear) * lowest + constant;
        let root = radicand.max(LEAST * LEAST * constant.abs()).sqrt();
        let level = (slope * slope * lowest - linear) / (slope * root);
        let usable = slope > 0.0 && root > 0.0 && slope.is_finite() && root.is_finite() && level.is_finite();
        usable.then(|| Self { slope, root, level: level.max(LEAST - 1.0), lowest })
    }

    pub(crate) fn logarithms(&self) -> [f64; 3] {
        [self.slope.ln(), self.root.ln(), self.level.ln_1p()]
    }

    /// h1, h2, h3.
    pub(crate) fn coefficients(&self) -> [f64; 3] {
        let Self { slope, root, level, lowest } = *self;
        let linear = slope * (slope * lowest - root * level);
        let constant = slope * lowest * (slope * lowest - 2.0 * root * level) + root * root;
        [linear / constant, slope / constant, 1.0 / constant]
    }

    /// Square root of the radicand at an amplitude of a₀ or more.
    fn root_at(&self, amplitude: f64) -> f64 {
        let x = self.slope * (amplitude - self.lowest);
        ((x + 2.0 * self.root * self.level) * x + self.root * self.root).max(0.0).sqrt()
    }

    /// `Δρ` in metre.
    pub(crate) fn value(&self, amplitude: f64) -> f64 {
        let x = self.slope * (amplitude - self.lowest);
        let at_lowest = self.root - self.slope * self.lowest;
        // The fall from the lowest amplitude on, without the difference of two large numbers.
        let fall = 2.0 * self.root * (1.0 - self.level) * x / (self.root_at(amplitude) + self.root + x);
        at_lowest - fall
    }

    /// Derivatives by the three logarithms; `None` where the root vanishes.
    pub(crate) fn derivatives(&self, amplitude: f64) -> Option<[f64; 3]> {
        let x = self.slope * (amplitude - self.lowest);
        let root = self.root_at(amplitude);
        let by_slope = (x * x + self.root * self.level * x) / root - self.slope * amplitude;
        let by_root = self.root * (self.level * x + self.root) / root;
        let by_level = (1.0 + self.level) * self.root * x / root;
        let all = [by_slope, by_root, by_level];
        all.iter().all(|derivative| derivative.is_finite()).then_some(all)
    }
}

/// Whether a hyperbola has a value at every amplitude of its span: its radicand is a parabola that opens upwards.
pub(crate) fn is_real_over_span(hyperbola: &AmplitudeHyperbola) -> bool {
    let [low, high] = hyperbola.amplitude_span;
    let lowest_point = (hyperbola.h1 * hyperbola.h3 / hyperbola.h2.powi(2)).clamp(low, high);
    let places = [low, lowest_point, high];
    places.into_iter().all(|amplitude| amplitude.is_nan() || hyperbola.correction(amplitude).is_some())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_has_a_value_everywhere_and_its_coefficients_give_the_same(
            logarithms in prop::array::uniform3(-6.0..3.0_f64), lowest in 0.0..50.0_f64, above in 0.0..5.0_f64,
        ) {
            let real = RealHyperbola::from_logarithms(&logarithms, lowest).unwrap();
            let amplitude = lowest + 10.0_f64.powf(above) - 1.0;
            let value = real.value(amplitude);
            prop_assert!(value.is_finite());
            let [h1, h2, h3] = real.coefficients();
            let hyperbola = AmplitudeHyperbola { h1, h2, h3, amplitude_span: [lowest, 2e5] };
            // By the coefficients the radicand is a difference of large numbers: it has digits left where it is not
            // small against them.
            let size = (real.slope * amplitude).powi(2) + real.root.powi(2) * (1.0 + real.level.abs());
            prop_assume!(real.root_at(amplitude).powi(2) > 1e-6 * size);
            let by_coefficients = hyperbola.correction(amplitude).unwrap();
            prop_assert!((by_coefficients - value).abs() <= 1e-8 * size.sqrt(), "{} {}", by_coefficients, value);
        }

        #[test]
        fn derivatives_are_those_of_the_value(
            logarithms in prop::array::uniform3(-3.0..2.0_f64), lowest in 0.0..50.0_f64, above in 0.0..4.0_f64,
        ) {
            let amplitude = lowest + 10.0_f64.powf(above) - 1.0;
            let at = |index: usize, step: f64| {
                let mut moved = logarithms;
                moved[index] += step;
                RealHyperbola::from_logarithms(&moved, lowest).unwrap()
            };
            let real = at(0, 0.0);
            let analytic = real.derivatives(amplitude).unwrap();
            // Terms of this size are added up, and keep twelve digits of the value.
            let size = real.slope * amplitude + real.root * (1.0 + real.level.abs());
            for (index, analytic) in analytic.into_iter().enumerate() {
                let step = 1e-5;
                let numeric = (at(index, step).value(amplitude) - at(index, -step).value(amplitude)) / (2.0 * step);
                // Third derivatives grow where the root is small.
                let small = (size / real.root_at(amplitude)).powi(4);
                prop_assert!((numeric - analytic).abs() < 1e-9 * size * (1.0 + small), "{} {} {}", index, numeric, analytic);
            }
        }

        #[test]
        fn there_and_back(logarithms in prop::array::uniform3(-3.0..2.0_f64), lowest in 0.0..50.0_f64) {
            let real = RealHyperbola::from_logarithms(&logarithms, lowest).unwrap();
            let constant = 1.0 / real.coefficients()[2];
            // h3 infinite or negative: no start value.
            let largest = (real.slope * lowest).powi(2) + real.root.powi(2) * (1.0 + real.level.abs());
            // Start values keep away from where the root vanishes.
            prop_assume!(constant > 1e-4 * largest && real.level > LEAST - 1.0 && real.root.powi(2) > 1e-5 * constant);
            let back = RealHyperbola::near(real.coefficients(), lowest).unwrap();
            for (there, back) in logarithms.iter().zip(back.logarithms()) {
                prop_assert!((there - back).abs() < 1e-5, "{} {}", there, back);
            }
        }
    }
}
