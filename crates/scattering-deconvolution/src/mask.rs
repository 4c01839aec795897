//! Pixels that have no value, or one that must not be touched.

/// Pixels put aside while the image is restored, with their values.
#[derive(Default)]
pub(crate) struct Mask {
    kept: Vec<(usize, f32, f32)>,
    filled: usize,
}

impl Mask {
    /// Puts aside pixels that are not finite and those for which `keep` says so. Pixels that are not finite are filled
    /// with the mean of the nearest values to the left and to the right in their row (zero if the row has none).
    pub(crate) fn put_aside(&mut self, width: usize, re: &mut [f32], im: &mut [f32], keep: impl Fn(usize) -> bool) {
        self.kept.clear();
        self.filled = 0;
        for (row, (re, im)) in re.chunks_exact_mut(width).zip(im.chunks_exact_mut(width)).enumerate() {
            let complete = largest_part(re).is_finite() && largest_part(im).is_finite();
            for col in 0..width {
                let missing = !(complete || re[col].is_finite() && im[col].is_finite());
                if missing || keep(row * width + col) {
                    self.kept.push((row * width + col, re[col], im[col]));
                    self.filled += usize::from(missing);
                }
            }
            if !complete {
                fill_row(re, im);
            }
        }
    }

    /// Gives the pixels their values back.
    pub(crate) fn put_back(&self, re: &mut [f32], im: &mut [f32]) {
        for &(pixel, real, imaginary) in &self.kept {
            (re[pixel], im[pixel]) = (real, imaginary);
        }
    }

    /// The pixels put aside.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = usize> {
        self.kept.iter().map(|&(pixel, ..)| pixel)
    }

    pub(crate) fn kept(&self) -> usize {
        self.kept.len()
    }

    pub(crate) fn filled(&self) -> usize {
        self.filled
    }
}

/// Largest absolute value; not finite as soon as one value is not.
///
/// Without its sign the pattern of bits of a float grows with its value, infinity and NaN being largest of all, and the
/// largest of many integers is found in wide registers, which IEEE comparisons do not allow.
pub(crate) fn largest_part(values: &[f32]) -> f32 {
    let magnitude = |value: &f32| (value.to_bits() & 0x7fff_ffff) as i32;
    f32::from_bits(values.iter().map(magnitude).max().unwrap_or(0) as u32)
}

fn fill_row(re: &mut [f32], im: &mut [f32]) {
    let mut col = 0;
    while col < re.len() {
        if re[col].is_finite() && im[col].is_finite() {
            col += 1;
            continue;
        }
        let gap = (col..re.len()).take_while(|&i| !(re[i].is_finite() && im[i].is_finite())).count();
        let value = |i: usize| re.get(i).copied().zip(im.get(i).copied());
        let estimate = match (col.checked_sub(1).and_then(value), value(col + gap)) {
            (Some(left), Some(right)) => (f32::midpoint(left.0, right.0), f32::midpoint(left.1, right.1)),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => (0.0, 0.0),
        };
        re[col..col + gap].fill(estimate.0);
        im[col..col + gap].fill(estimate.1);
        col += gap;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_part_is_found() {
        assert_eq!(largest_part(&[-3.0, 2.0, -0.0]).to_bits(), 3.0_f32.to_bits());
        assert_eq!(largest_part(&[]).to_bits(), 0);
        assert!(largest_part(&[1.0, f32::NEG_INFINITY]).is_infinite());
        assert!(!largest_part(&[1.0, -f32::NAN, 3e38]).is_finite());
    }

    #[test]
    fn gaps_are_filled_from_both_sides_and_given_back() {
        let nan = f32::NAN;
        let mut re = vec![nan, 1.0, nan, nan, 3.0, f32::INFINITY, nan, nan, nan, nan, nan, nan];
        let mut im = vec![0.0; 12];
        im[4] = 8.0;
        let mut mask = Mask::default();
        mask.put_aside(6, &mut re, &mut im, |pixel| pixel == 1);
        assert_eq!(re, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(im[2..6], [4.0, 4.0, 8.0, 8.0]);
        assert_eq!((mask.kept(), mask.filled()), (11, 10));
        re[1] = 99.0;
        mask.put_back(&mut re, &mut im);
        assert!(re[0].is_nan() && re[5].is_infinite() && re[11].is_nan());
        assert_eq!(re[1].to_bits(), 1.0_f32.to_bits());
    }
}
