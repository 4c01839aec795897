//! Which flags are false.
//!
//! A pixel is **wrong** where
//! - its range errs by more than four of its stated standard deviations and 5 mm (what curved surfaces, edges of paint and
//!   the calibration leave; the same floor as that of the tests for mixed pixels), which every wrong wrap does, or has no
//!   value;
//! - or its footprint covers several surfaces (a ray leaves that of its centre by 20 mm, which is four times the
//!   floor of the test for mixed pixels), whatever its range;
//! - or its light is less than the plan asks for: the amplitude without noise is below the plan's threshold, which is
//!   √n times lower for a mean of n frames;
//! - or its own light is outside the amplitudes that the calibration holds for;
//! - or its expected highest sample reaches the camera's last value but for three standard deviations.
//!
//! A false flag is on a **narrow** pixel where even the true ranges leave open whether it is mixed: no block of 3 by 3 pixels
//! with the pixel at a corner is a plane within 5 mm and free of mixed pixels. These stand out of the noise the more, the
//! more frames there are, as mixed pixels do.
//!
//! The first of these is measured at the end of all stages; the others are what flags have to say even where chance
//! brought the range near the truth. A flag on any other pixel is **false**.

use pipeline::{Processed, Silent, ViewData, process};
use range_image::Flags;

use super::Failure;
use super::rooms::{Capture, LOW_AMPLITUDE, SIZE, Truth};

const SIGMAS: f64 = 4.0;
const FLOOR_M: f64 = 0.005;

/// Mixed pixels that err by more than this are counted by themselves, metre.
const FAR_M: f64 = 0.05;

/// Share of right pixels that the tests for motion and for samples that do not fit each other flag, together.
const LEVEL: f64 = 2e-4;

/// Numbers of pixels.
#[derive(Default)]
pub struct Counts {
    pub pixels: usize,
    pub wrong: usize,
    pub flagged: usize,
    /// With any flag, and right.
    pub false_flags: usize,
    /// False ones of each of [`Flags::NAMED`].
    pub of_flag: [usize; Flags::NAMED.len()],
    /// With any flag, right, and narrow.
    pub false_of_narrow: usize,
    /// Ranges wrong, by the first reason, and not flagged.
    pub missed: usize,
    /// Mixed pixels whose range errs by more than 50 mm, and those of them flagged as mixed.
    pub far_mixed: usize,
    pub far_mixed_found: usize,
    pub error_median_m: f64,
}

impl Counts {
    pub fn share(&self, count: usize) -> f64 {
        count as f64 / self.pixels.max(1) as f64
    }

    /// Whether these false flags are more than the others, of as many pixels, by more than chance: four standard deviations of
    /// what the tests of a level flag.
    pub fn is_above(&self, other: &Self) -> bool {
        let by_chance = LEVEL * self.pixels as f64;
        self.false_flags as f64 > other.false_flags as f64 + by_chance + 4.0 * by_chance.sqrt()
    }

    /// The largest share of false flags that is allowed: twice that of wrong pixels and 2 % of all.
    pub fn bar(&self) -> f64 {
        2.0 * self.share(self.wrong) + 0.02
    }
}

/// Whether no plane of nine true ranges has the pixel at a corner.
fn is_narrow(truth: &Truth, pixel: usize) -> bool {
    let at = [pixel % SIZE[0], pixel / SIZE[0]];
    !(0..4).any(|corner| is_plane(truth, [at[0].wrapping_sub(corner % 2 * 2), at[1].wrapping_sub(corner / 2 * 2)]))
}

/// Whether the block of 3 by 3 true ranges from this column and row on is a plane: straight in inverse range.
fn is_plane(truth: &Truth, [col, row]: [usize; 2]) -> bool {
    if col.saturating_add(2) >= SIZE[0] || row.saturating_add(2) >= SIZE[1] {
        return false;
    }
    let pixels: [usize; 9] = std::array::from_fn(|index| (row + index / 3) * SIZE[0] + col + index % 3);
    let inverse = pixels.map(|pixel| 1.0 / f64::from(truth.range[pixel]));
    let offset = |index: usize| [index % 3, index / 3].map(|step| step as f64 - 1.0);
    let mean = inverse.iter().sum::<f64>() / 9.0;
    let slope = [0, 1].map(|axis| (0..9).map(|index| offset(index)[axis] * inverse[index]).sum::<f64>() / 6.0);
    (0..9).all(|index| {
        let left = inverse[index] - mean - slope[0] * offset(index)[0] - slope[1] * offset(index)[1];
        !truth.mixed[pixels[index]] && left.abs() / inverse[index].powi(2) < FLOOR_M
    })
}

/// Processes the first `frames` frames of each station and counts.
pub fn count(capture: &Capture, frames: usize) -> Result<Counts, Failure> {
    let outcome = process(&capture.plan(1)?, &capture.survey(frames)?, None, &Silent)?;
    Ok(judge(capture, &outcome, frames))
}

/// The same with the samples of these frames summed before anything is made of them: a single frame of the same noise.
pub fn count_of_sum(capture: &Capture, frames: usize) -> Result<Counts, Failure> {
    let outcome = process(&capture.plan(frames)?, &capture.survey_of_sums(frames)?, None, &Silent)?;
    Ok(judge(capture, &outcome, frames))
}

fn judge(capture: &Capture, outcome: &Processed, frames: usize) -> Counts {
    let mut counts = Counts::default();
    let mut errors = Vec::new();
    let low = LOW_AMPLITUDE / (frames as f64).sqrt();
    for (view, truth) in outcome.views.iter().zip(&capture.truth) {
        let ViewData::Range(frame) = &view.data else { continue };
        for (pixel, flags) in frame.flags.as_slice().iter().enumerate() {
            let error = f64::from(frame.range.as_slice()[pixel] - truth.range[pixel]).abs();
            let allowed = SIGMAS * f64::from(frame.sigma.as_slice()[pixel]) + FLOOR_M;
            let right = error <= allowed;
            let dark = truth.amplitude[pixel] < low || truth.outside_span[pixel];
            let wrong = !right || truth.mixed[pixel] || dark || truth.cut_off[pixel];
            let flagged = !flags.is_empty();
            counts.pixels += 1;
            counts.wrong += usize::from(wrong);
            counts.flagged += usize::from(flagged);
            counts.false_flags += usize::from(flagged && !wrong);
            counts.false_of_narrow += usize::from(flagged && !wrong && is_narrow(truth, pixel));
            counts.missed += usize::from(!right && !flagged);
            let far = truth.mixed[pixel] && error > FAR_M;
            counts.far_mixed += usize::from(far);
            counts.far_mixed_found += usize::from(far && flags.contains(Flags::MIXED_PIXEL));
            for (count, (flag, _)) in counts.of_flag.iter_mut().zip(Flags::NAMED) {
                *count += usize::from(flags.contains(flag) && !wrong);
            }
            errors.push(error);
        }
    }
    errors.retain(|error| error.is_finite());
    errors.sort_by(f64::total_cmp);
    counts.error_median_m = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    counts
}
