//! What the flags of repeated frames say of their mean.
//!
//! A flag that chance gives a pixel in one frame of a thousand is no flag of the mean: where those of all frames are put
//! together, each frame adds its false alarms.

use rayon::prelude::*;

use crate::{Flags, Raster};

/// Pixels that are looked at in one plane after the other, so that each plane's part stays in the first-level cache.
const BLOCK: usize = 1024;

/// The flags of frames, put together for their mean.
pub(crate) struct MeanFlags<'a> {
    frames: Vec<&'a Raster<Flags>>,
    /// Of at least one frame.
    pub(crate) any: Raster<Flags>,
    /// Of more than half of the frames that count; [`Flags::SATURATED`] where nothing else is left, or what is left is
    /// biased.
    pub(crate) most: Raster<Flags>,
    /// Whether some frames of a pixel do not count, because they are saturated and others are not.
    left_out: Vec<bool>,
}

impl<'a> MeanFlags<'a> {
    /// Of planes that all have one size.
    pub(crate) fn of(frames: Vec<&'a Raster<Flags>>) -> Self {
        let mut any = frames.first().map(|&plane| plane.clone()).unwrap_or_default();
        let mut most = any.clone();
        let mut left_out = vec![false; any.as_slice().len()];
        let planes = any.as_mut_slice().par_chunks_mut(BLOCK).zip(most.as_mut_slice().par_chunks_mut(BLOCK));
        planes.zip(left_out.par_chunks_mut(BLOCK)).enumerate().for_each(|(block, ((any, all), left_out))| {
            for plane in &frames {
                let own = plane.as_slice()[block * BLOCK..].iter();
                for ((any, all), own) in any.iter_mut().zip(all.iter_mut()).zip(own) {
                    *any |= *own;
                    *all &= *own;
                }
            }
            for (index, ((any, all), left_out)) in any.iter().zip(all).zip(left_out).enumerate() {
                if any != all {
                    (*all, *left_out) = judge(&frames, block * BLOCK + index, *any);
                }
            }
        });
        Self { frames, any, most, left_out }
    }

    /// Whether a pixel's value in a frame counts for the mean.
    pub(crate) fn counts(&self, pixel: usize, frame: usize) -> bool {
        !(self.left_out[pixel] && self.frames[frame].as_slice()[pixel].contains(Flags::SATURATED))
    }

    /// Whether values of a pixel do not count.
    pub(crate) fn leaves_out(&self, pixel: usize) -> bool {
        self.left_out[pixel]
    }
}

/// The flags of a pixel whose frames differ in them, of which there are `any`; and whether saturated frames are left out.
fn judge(frames: &[&Raster<Flags>], pixel: usize, any: Flags) -> (Flags, bool) {
    let with_value = || frames.iter().map(|plane| plane.as_slice()[pixel]).filter(|own| !own.contains(Flags::NO_DATA));
    let (mut values, mut saturated) = (0_usize, 0_usize);
    for own in with_value() {
        values += 1;
        saturated += usize::from(own.contains(Flags::SATURATED));
    }
    if values == 0 {
        return (any, false);
    }
    let left_out = 0 < saturated && saturated < values;
    let count = if left_out { values - saturated } else { values };
    let counting = || with_value().filter(|own| !(left_out && own.contains(Flags::SATURATED)));
    let mut flags = Flags::empty();
    for flag in (any - Flags::SATURATED - Flags::NO_DATA).iter() {
        flags.set(flag, 2 * counting().filter(|own| own.contains(flag)).count() > count);
    }
    flags.set(Flags::SATURATED, saturated == values || is_biased(saturated, count));
    (flags, left_out)
}

/// Whether the mean of `left` values may be off by more than its standard deviation because `out` others were cut off.
///
/// Noise that carries a share f of the values over a limit leaves the mean of the others low by `φ(Φ⁻¹(f)) / (1 − f)`
/// standard deviations of a value, at most `f √(2 ln 1/f) / (1 − f)`.
fn is_biased(out: usize, left: usize) -> bool {
    if out == 0 {
        return false;
    }
    let share = out as f64 / (out + left) as f64;
    let shift = share * (-2.0 * share.ln()).sqrt() / (1.0 - share);
    shift * shift * left as f64 > 1.0
}
