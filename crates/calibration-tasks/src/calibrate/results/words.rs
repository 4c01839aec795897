//! Numbers as people read them.

/// Metres as millimetres; other units as they are.
pub(crate) fn readable(value: f64, unit: &str) -> (f64, &str) {
    if unit == "m" { (1e3 * value, "mm") } else { (value, unit) }
}

/// A value down to a tenth of its standard deviation.
pub(crate) fn value_words(value: f64, sigma: f64) -> String {
    number(value, decimals(sigma))
}

/// Decimals that show a value down to a tenth of its standard deviation; `None` where that is too many to read.
fn decimals(sigma: f64) -> Option<usize> {
    let places = 1.0 - sigma.log10().floor();
    (sigma > 0.0 && (0.0..=7.0).contains(&places)).then_some(places as usize)
}

/// A value with so many decimals, or in powers of ten.
fn number(value: f64, decimals: Option<usize>) -> String {
    match decimals {
        Some(decimals) => format!("{value:.decimals$}"),
        None if value == 0.0 => "0".to_owned(),
        None if (1e-3..1e4).contains(&value.abs()) => format!("{value:.5}"),
        None => format!("{value:.4e}"),
    }
}
