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
