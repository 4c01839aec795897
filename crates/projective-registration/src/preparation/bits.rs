//! Medians of single precision by their bits.

/// The bits of a number, zero where it is not positive: integers in the order of the numbers, which are selected in half of
/// their time.
#[inline]
pub(crate) fn positive_bits(value: f32) -> u32 {
    if value > 0.0 { value.to_bits() } else { 0 }
}

/// The middle one of numbers given by [`positive_bits`], which are left in another order; `None` without any. It stands beside
/// [`statistics::upper_median`] for the frames of a stream, where selection is in the loop of each pair: half of its time.
pub(crate) fn median_of_bits(bits: &mut [u32]) -> Option<f32> {
    let middle = bits.len() / 2;
    (!bits.is_empty()).then(|| f32::from_bits(*bits.select_nth_unstable(middle).1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_bits_is_that_of_the_numbers() {
        assert_eq!(median_of_bits(&mut []), None);
        for numbers in
            [vec![0.5], vec![3.0, 1.0e-9, 2.0], vec![7.0, -0.0, 1.0e20, 0.25], vec![-1.0, 0.0, 4.0, 5.0, 6.0]]
        {
            let mut bits: Vec<u32> = numbers.iter().copied().map(positive_bits).collect();
            let mut all: Vec<f64> = numbers.iter().map(|n| f64::from(*n)).collect();
            let found = median_of_bits(&mut bits).map(f64::from);
            assert_eq!(found, Some(statistics::upper_median(&mut all)), "{numbers:?}");
        }
    }
}
