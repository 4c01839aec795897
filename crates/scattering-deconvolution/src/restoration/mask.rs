//! Pixels that have no value, or one that must not be touched.

use range_image::{Flags, with_wide_registers};
use rayon::prelude::*;

use crate::SaturatedLight;
use crate::kernels::grid::ROWS_PER_TASK;
use crate::kernels::lanes::largest_part;

/// Pixels put aside while the image is restored, with their values.
#[derive(Default)]
pub(crate) struct Mask {
    kept: Vec<Kept>,
    filled: usize,
    dependent: Vec<usize>,
    /// Pixels of a row that are filled.
    unknown: Vec<bool>,
    /// Largest absolute value of each row; `None` where there is something to put aside.
    rows: Vec<Option<f32>>,
}

/// A pixel put aside: its own value, and the one that counts as light meanwhile.
#[derive(Clone, Copy)]
struct Kept {
    pixel: usize,
    own: [f32; 2],
    light: [f32; 2],
}

impl Mask {
    /// Puts aside pixels that are not finite and those flagged as saturated or without data; gives the largest absolute
    /// value of those that stay. Pixels that are not finite, and saturated ones if so wished, are filled with the mean of
    /// the nearest values to the left and to the right in their row (zero if the row has none).
    pub(crate) fn put_aside(
        &mut self,
        width: usize,
        re: &mut [f32],
        im: &mut [f32],
        flags: Option<&[Flags]>,
        saturated: SaturatedLight,
    ) -> f32 {
        self.kept.clear();
        self.dependent.clear();
        self.filled = 0;
        self.look_at_rows(width, re, im, flags);
        let mut largest = 0.0_f32;
        for (row, (re, im)) in re.chunks_exact_mut(width).zip(im.chunks_exact_mut(width)).enumerate() {
            if let Some(of_row) = self.rows[row] {
                largest = largest.max(of_row);
                continue;
            }
            let flags = flags.map(|flags| &flags[row * width..][..width]);
            match flags {
                Some(flags) if saturated == SaturatedLight::Clipped && largest_of(re, im).is_finite() => {
                    self.put_aside_flagged(row * width, re, im, flags);
                }
                flags => self.put_aside_row(row * width, re, im, flags, saturated),
            }
            largest = largest.max(largest_of(re, im));
        }
        largest
    }

    /// Of most rows nothing is put aside, which is found out side by side.
    fn look_at_rows(&mut self, width: usize, re: &[f32], im: &[f32], flags: Option<&[Flags]>) {
        self.rows.clear();
        self.rows.resize(re.len() / width, None);
        self.rows.par_iter_mut().with_min_len(ROWS_PER_TASK).enumerate().for_each(|(row, largest)| {
            let at = row * width..(row + 1) * width;
            let parts = largest_of(&re[at.clone()], &im[at.clone()]);
            let flagged = flags.is_some_and(|flags| union(&flags[at]).intersects(UNTOUCHED));
            *largest = Some(parts).filter(|parts| parts.is_finite() && !flagged);
        });
    }

    /// Puts aside the flagged pixels of a row in which nothing is filled.
    fn put_aside_flagged(&mut self, start: usize, re: &[f32], im: &[f32], flags: &[Flags]) {
        for (index, chunk) in flags.chunks(FLAGS).enumerate().filter(|(_, chunk)| union(chunk).intersects(UNTOUCHED)) {
            for (col, _) in (index * FLAGS..).zip(chunk).filter(|(_, flags)| flags.intersects(UNTOUCHED)) {
                let own = [re[col], im[col]];
                self.kept.push(Kept { pixel: start + col, own, light: own });
            }
        }
    }

    fn put_aside_row(
        &mut self,
        start: usize,
        re: &mut [f32],
        im: &mut [f32],
        flags: Option<&[Flags]>,
        saturated: SaturatedLight,
    ) {
        self.unknown.clear();
        let first = self.kept.len();
        for (col, (&re, &im)) in re.iter().zip(&*im).enumerate() {
            let flags = flags.map_or(Flags::empty(), |flags| flags[col]);
            let missing = !(re.is_finite() && im.is_finite());
            let unknown = missing || saturated == SaturatedLight::Filled && flags.intersects(Flags::SATURATED);
            if missing || flags.intersects(UNTOUCHED) {
                self.kept.push(Kept { pixel: start + col, own: [re, im], light: [re, im] });
            }
            self.filled += usize::from(unknown);
            self.unknown.push(unknown);
        }
        fill_row(re, im, &self.unknown);
        for kept in &mut self.kept[first..] {
            kept.light = [re[kept.pixel - start], im[kept.pixel - start]];
        }
    }

    /// Gives the pixels their values back.
    pub(crate) fn put_back(&self, re: &mut [f32], im: &mut [f32]) {
        for kept in &self.kept {
            [re[kept.pixel], im[kept.pixel]] = kept.own;
        }
    }

    /// The pixels put aside.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = usize> {
        self.kept.iter().map(|kept| kept.pixel)
    }

    /// The pixels put aside with the amplitude that counted as light.
    pub(crate) fn lights(&self) -> impl Iterator<Item = (usize, f32)> {
        self.kept.iter().map(|kept| (kept.pixel, kept.light[0].hypot(kept.light[1])))
    }

    pub(crate) fn kept(&self) -> usize {
        self.kept.len()
    }

    pub(crate) fn filled(&self) -> usize {
        self.filled
    }

    /// Pixels whose correction depends on those put aside.
    pub(crate) fn dependent(&self) -> &[usize] {
        &self.dependent
    }

    /// Notes those of a row of pixels, in order, for which `depends` says so; pixels put aside are none of them.
    pub(crate) fn note_dependent(&mut self, row: std::ops::Range<usize>, depends: impl Fn(usize) -> bool) {
        let first = self.kept.partition_point(|kept| kept.pixel < row.start);
        let mut kept = self.kept[first..].iter().map(|kept| kept.pixel).peekable();
        self.dependent.extend(row.filter(|&pixel| kept.next_if_eq(&pixel).is_none() && depends(pixel)));
    }
}

/// Largest absolute value of either part; not finite as soon as one value is not.
fn largest_of(re: &[f32], im: &[f32]) -> f32 {
    let [re, im] = with_wide_registers(
        #[inline(always)]
        || [largest_part(re), largest_part(im)],
    );
    // As `largest_part` compares them.
    f32::from_bits(re.to_bits().max(im.to_bits()))
}

/// Flags that are looked at together.
const FLAGS: usize = 16;
/// Flags of pixels that keep their value.
const UNTOUCHED: Flags = Flags::SATURATED.union(Flags::NO_DATA);

fn union(flags: &[Flags]) -> Flags {
    Flags::from_bits_retain(flags.iter().fold(0, |all, flags| all | flags.bits()))
}

fn fill_row(re: &mut [f32], im: &mut [f32], unknown: &[bool]) {
    let mut col = 0;
    while col < re.len() {
        if !unknown[col] {
            col += 1;
            continue;
        }
        let gap = unknown[col..].iter().take_while(|&&unknown| unknown).count();
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
        let mut flags = vec![Flags::MOTION; 12];
        flags[1] |= Flags::SATURATED;
        let mut mask = Mask::default();
        let largest = mask.put_aside(6, &mut re, &mut im, Some(&flags), SaturatedLight::Clipped);
        assert_eq!(re, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(im[2..6], [4.0, 4.0, 8.0, 8.0]);
        assert_eq!((mask.kept(), mask.filled(), largest.to_bits()), (11, 10, 8.0_f32.to_bits()));
        re[1] = 99.0;
        mask.put_back(&mut re, &mut im);
        assert!(re[0].is_nan() && re[5].is_infinite() && re[11].is_nan());
        assert_eq!(re[1].to_bits(), 1.0_f32.to_bits());
        mask.put_aside(6, &mut re, &mut im, Some(&flags), SaturatedLight::Filled);
        // Nothing but gaps to the left of the only value.
        assert_eq!(re[..6], [3.0; 6]);
        assert_eq!((mask.kept(), mask.filled()), (11, 11));
    }
}
