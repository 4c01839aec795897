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
        for (pixel, (re, im)) in re.iter().zip(im.iter()).enumerate() {
            let missing = !(re.is_finite() && im.is_finite());
            if missing || keep(pixel) {
                self.kept.push((pixel, *re, *im));
                self.filled += usize::from(missing);
            }
        }
        if self.filled > 0 {
            for (re, im) in re.chunks_exact_mut(width).zip(im.chunks_exact_mut(width)) {
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
