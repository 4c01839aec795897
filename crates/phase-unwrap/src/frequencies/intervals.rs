//! What several ambiguity intervals can tell apart together.

use range_image::Modulation;

use crate::{Error, Result};

/// Relative remainder below which an interval is taken as a multiple: frequencies are set to better than that.
const TOLERANCE: f64 = 1e-6;

/// Largest ratio of two frequencies: the tolerance of the higher one is then a thousandth of the lower one, beyond which
/// remainders can no longer be told from it.
const LARGEST_RATIO: f64 = 1e3;

/// Range in metres at which all phases repeat at once: the least common multiple of the ambiguity intervals.
///
/// 60 and 80 MHz repeat after that of 20 MHz, 7.5 m. Frequencies without a common divisor (to one part in a million)
/// repeat at very long ranges or never. Frequencies more than a factor of a thousand apart are an [`Error::OutOfDomain`].
pub fn combined_interval_m(modulations: &[Modulation]) -> Result<f64> {
    check(modulations)?;
    let rates = modulations.iter().map(|m| 1.0 / m.ambiguity_interval_m());
    Ok(1.0 / rates.fold(0.0, common_divisor))
}

fn check(modulations: &[Modulation]) -> Result<()> {
    if modulations.len() < 2 {
        return Err(Error::TooFewFrequencies { found: modulations.len() });
    }
    for (second, b) in modulations.iter().enumerate() {
        for (first, a) in modulations[..second].iter().enumerate() {
            let (a, interval_m) = (a.ambiguity_interval_m(), b.ambiguity_interval_m());
            if (a - interval_m).abs() <= TOLERANCE * a {
                return Err(Error::EqualFrequencies { first, second, interval_m });
            }
            let value = (a / interval_m).max(interval_m / a);
            if value > LARGEST_RATIO {
                let expected = "modulation frequencies lie within a factor of 1000";
                return Err(Error::OutOfDomain { name: "ratio of two modulation frequencies", value, expected });
            }
        }
    }
    Ok(())
}

/// Euclid's algorithm; stops where the remainder drowns in the tolerance.
fn common_divisor(a: f64, b: f64) -> f64 {
    let (mut a, mut b) = (a.max(b), a.min(b));
    let floor = TOLERANCE * a;
    while b > floor {
        // Rounding may leave a remainder just below the divisor, which is none.
        let rest = a - (a / b).round() * b;
        (a, b) = (b, rest.abs());
    }
    a
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn intervals_combine_as_least_common_multiples() {
        let interval = |hz: &[f64]| {
            let modulations: Vec<_> = hz.iter().map(|&hz| Modulation::new(hz).unwrap()).collect();
            combined_interval_m(&modulations).unwrap()
        };
        let single = |hz: f64| Modulation::new(hz).unwrap().ambiguity_interval_m();
        for (hz, common) in [
            (vec![80e6, 60e6], 20e6),
            (vec![100e6, 80e6], 20e6),
            (vec![16e6, 80e6, 120e6], 8e6),
            (vec![80.32e6, 60.24e6], 20.08e6),
        ] {
            // Euclid's steps multiply rounding errors of 1e-16 by the quotients, which are below a hundred here.
            assert!((interval(&hz) / single(common) - 1.0).abs() < 1e-9, "{hz:?}");
        }
        // Without a common divisor above the tolerance the interval is at least 1e4 single ones.
        assert!(interval(&[80e6, 80e6 / std::f64::consts::SQRT_2]) > 1e4 * single(80e6));
    }

    #[test]
    fn frequencies_too_far_apart_have_no_combined_interval() {
        let modulations = [1e3, 1e9].map(|hz| Modulation::new(hz).unwrap());
        let found = combined_interval_m(&modulations);
        assert!(matches!(found, Err(Error::OutOfDomain { value, .. }) if (value - 1e6).abs() < 1.0), "{found:?}");
    }
}
