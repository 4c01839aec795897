//! Order statistics: quantiles with and without interpolation.

use std::cmp::Ordering;

/// `f32` or `f64`: values in their total order.
pub trait Number: Copy + sealed::Sealed {
    /// What stands for no value.
    const NAN: Self;

    /// The total order, in which NaN comes last (with a sign first).
    fn order(&self, other: &Self) -> Ordering;
}

impl Number for f32 {
    const NAN: Self = Self::NAN;

    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Number for f64 {
    const NAN: Self = Self::NAN;

    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The `share` quantile (0 to 1) of the finite values, interpolated between the two next to it (R's type 7); NaN where
/// there are none. For numbers that are shown or that few values make; reorders them.
///
/// ```
/// assert_eq!(statistics::quantile(&mut [4.0, f64::NAN, 1.0, 3.0, 2.0], 0.5), 2.5);
/// ```
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    let finite = partition_finite(values);
    if finite.is_empty() {
        return f64::NAN;
    }
    let position = share.clamp(0.0, 1.0) * (finite.len() - 1) as f64;
    let below = position as usize;
    let (_, &mut low, above) = finite.select_nth_unstable_by(below, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    low + (position - below as f64) * (high - low)
}

/// The value nearest to the `share` (0 to 1) of the order, one of those given: of two that are equally near the larger one.
/// NaN where there are none. For thresholds over many values; reorders them.
///
/// ```
/// assert_eq!(statistics::ranked(&mut [4.0, 1.0, 3.0, 2.0], 1.0), 4.0);
/// ```
pub fn ranked<T: Number>(values: &mut [T], share: f64) -> T {
    if values.is_empty() {
        return T::NAN;
    }
    let index = ((values.len() - 1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
    *values.select_nth_unstable_by(index, T::order).1
}

/// The value in the middle of the order, of an even number the upper one of the two; NaN where there are none.
///
/// ```
/// assert_eq!(statistics::upper_median(&mut [4.0_f32, 1.0, 3.0, 2.0]), 3.0);
/// ```
pub fn upper_median<T: Number>(values: &mut [T]) -> T {
    ranked(values, 0.5)
}

fn partition_finite(values: &mut [f64]) -> &mut [f64] {
    let mut count = 0;
    for index in 0..values.len() {
        if values[index].is_finite() {
            values.swap(index, count);
            count += 1;
        }
    }
    &mut values[..count]
}
