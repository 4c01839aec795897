//! Values that repeat in places where no surface has them.

use range_image::Raster;
use statistics::Distribution;

/// Part of the pixels that a value must have before it is looked at.
const SHARE: f64 = 5e-4;
/// Values that are looked at, the most frequent first.
const LOOKED_AT: usize = 64;
/// Two values this close, as a part of them, may lie on one surface.
const NEAR: f64 = 0.05;
/// Part of the neighbours of a surface's value that lie near it, at least: the others lie across an edge.
const OF_A_SURFACE: f64 = 0.5;
/// Probability by which a surface's value is taken for none.
const LEVEL: f64 = 1e-6;
/// Bits of a single-precision value that are not looked at: a value that went through a product comes back to a part of
/// 1e-6.
const ROUNDED_BITS: u32 = 3;

/// A value that many pixels have, and their neighbours are not near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepeatedValue {
    /// The value.
    pub value: f32,
    /// Pixels that have it.
    pub pixels: usize,
    /// Neighbours with other values.
    pub neighbours: usize,
    /// Those of them that lie within 5 % of it.
    pub near: usize,
    /// Probability that so few lie near, were it the value of a surface.
    pub p_value: f64,
}

/// The values of a frame that mean something else than a distance: a constant that many pixels have and that no surface
/// leads to, as 65535, the end of the scale, or a code for saturation. What is not finite or is 0 is known as such and not
/// told. The most frequent first; at a level of one in a million for each value.
pub fn repeated_values(values: &Raster<f32>) -> Vec<RepeatedValue> {
    let key = |value: f32| (value.to_bits().saturating_add(1 << (ROUNDED_BITS - 1))) >> ROUNDED_BITS;
    let is_value = |value: f32| value.is_finite() && value != 0.0;
    let mut keys: Vec<u32> =
        values.as_slice().iter().filter(|value| is_value(**value)).map(|value| key(*value)).collect();
    keys.sort_unstable();
    let least = ((SHARE * values.len() as f64) as usize).max(20);
    let mut frequent: Vec<(usize, u32)> = keys
        .chunk_by(|a, b| a == b)
        .filter(|same| same.len() >= least)
        .filter_map(|same| Some((same.len(), *same.first()?)))
        .collect();
    frequent.sort_unstable_by(|a, b| b.cmp(a));
    frequent.truncate(LOOKED_AT);
    frequent.into_iter().filter_map(|(pixels, code)| repeated(values, pixels, &|value| key(value) == code)).collect()
}

fn repeated(values: &Raster<f32>, pixels: usize, is_it: &dyn Fn(f32) -> bool) -> Option<RepeatedValue> {
    let value = *values.as_slice().iter().find(|value| is_it(**value))?;
    let (mut neighbours, mut near) = (0_usize, 0_usize);
    for (row, line) in values.rows().enumerate() {
        for (col, here) in line.iter().enumerate() {
            let others = [values.get(col + 1, row), values.get(col, row + 1)];
            for other in others.into_iter().flatten().filter(|other| is_it(*here) != is_it(**other)) {
                let other = if is_it(*here) { *other } else { *here };
                if other.is_finite() && other != 0.0 {
                    neighbours += 1;
                    near += usize::from((other - value).abs() <= NEAR as f32 * value.abs());
                }
            }
        }
    }
    // Normal approximation to the binomial distribution, with its correction for whole numbers.
    let (count, expected) = (neighbours as f64, OF_A_SURFACE * neighbours as f64);
    let deviation = (count * OF_A_SURFACE * (1.0 - OF_A_SURFACE)).sqrt();
    let p_value = Distribution::Normal.survival((expected - near as f64 - 0.5) / deviation.max(0.5));
    (p_value < LEVEL).then_some(RepeatedValue { value, pixels, neighbours, near, p_value })
}
