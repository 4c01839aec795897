//! Look-up tables of offsets, pixel by pixel.

use range_io::calibration::Calibration;
use serde::Serialize;
use statistics::Distribution;

/// The tables of offsets in both files.
#[derive(Debug, Clone, Serialize)]
pub struct PatternLine {
    /// Pixels whose offset both files know.
    pub pixels: usize,
    /// Largest difference, second minus first, metre.
    pub largest_m: f64,
    /// Its standard deviation, metre.
    pub largest_sigma_m: f64,
    /// Where it is, column and row.
    pub pixel: [usize; 2],
    /// Root mean square of the differences, metre.
    pub rms_m: f64,
    /// What chance makes of it, metre.
    pub expected_rms_m: f64,
    /// χ² of all differences: probability of so much by chance.
    pub p_value: f64,
    /// Whether it is below the level.
    pub significant: bool,
}

/// The comparison; `None` where not both files have a table, or no pixel has a standard deviation in both.
///
/// Pixels of a block share an offset and say the same: differences that are alike in all numbers count once.
pub(crate) fn line(first: &Calibration, second: &Calibration, level: f64) -> Option<PatternLine> {
    let (one, other) = (first.fixed_pattern.as_ref()?, second.fixed_pattern.as_ref()?);
    let place = |index: usize| [index % one.width, index / one.width];
    let sigmas = one.sigma_m.iter().zip(&other.sigma_m);
    let values = one.offset_m.iter().zip(&other.offset_m).zip(sigmas).enumerate();
    let known: Vec<(usize, [f32; 4])> = values
        .map(|(index, ((a, b), (sa, sb)))| (index, [*a, *b, *sa, *sb]))
        .filter(|(_, [_, _, a, b])| a.hypot(*b) > 0.0 && a.hypot(*b).is_finite())
        .collect();
    let difference = |[a, b, ..]: [f32; 4]| f64::from(b) - f64::from(a);
    let variance = |[_, _, a, b]: [f32; 4]| f64::from(a).powi(2) + f64::from(b).powi(2);
    let (index, largest) = *known.iter().max_by(|a, b| difference(a.1).abs().total_cmp(&difference(b.1).abs()))?;
    let mean = |of: &dyn Fn([f32; 4]) -> f64| known.iter().map(|one| of(one.1)).sum::<f64>() / known.len() as f64;
    let mut distinct: Vec<[u32; 4]> = known.iter().map(|one| one.1.map(f32::to_bits)).collect();
    distinct.sort_unstable();
    distinct.dedup();
    let squares = distinct.iter().map(|bits| bits.map(f32::from_bits));
    let chi_squared: f64 = squares.map(|one| difference(one).powi(2) / variance(one)).sum();
    // The mean of each table is zero.
    let dof = (distinct.len().max(2) - 1) as f64;
    let p_value = Distribution::ChiSquared { dof }.survival(chi_squared);
    Some(PatternLine {
        pixels: known.len(),
        largest_m: difference(largest),
        largest_sigma_m: variance(largest).sqrt(),
        pixel: place(index),
        rms_m: mean(&|one| difference(one).powi(2)).sqrt(),
        expected_rms_m: mean(&variance).sqrt(),
        p_value,
        significant: p_value < level,
    })
}

/// The table of a file where the other has none.
pub(crate) fn alone(here: &Calibration, there: &Calibration) -> Option<String> {
    let alone = here.fixed_pattern.is_some() && there.fixed_pattern.is_none();
    alone.then(|| "table of offsets (fixed pattern)".to_owned())
}
