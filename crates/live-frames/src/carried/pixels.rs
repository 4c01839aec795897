//! The check of each pixel against the frame before.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::TAU;

use crate::carried::attach::Block;

/// No phase.
pub(crate) const MASKED: u8 = 0;
/// The check failed: the count is not known yet.
pub(crate) const OPEN: u8 = 1;
/// Too noisy to be checked: the count nearest to what was known last.
pub(crate) const DARK: u8 = 2;
/// The count holds.
pub(crate) const HELD: u8 = 3;
/// At an edge, with a neighbour's count for this frame: the next one does not rest on it.
pub(crate) const RIM: u8 = 4;

/// Largest change of the unwrapped phase from frame to frame that passes for the same surface, rad, or four standard
/// deviations where those are more: 8 % of an ambiguity interval (0.4 m at 30 MHz). The smaller it is, the less often
/// another surface passes, and the slower surfaces may move; what passes wrongly contradicts the small image.
const STEADY_RAD: f32 = 0.5;
/// Factor by which amplitude times range squared may change beyond its noise: that of `image::cuts`, `exp(0.35)`.
const STEADY_RATIO: f32 = 1.419;
/// Largest step between two neighbours on one surface whose slope is not known, rad, or four standard deviations. A choice:
/// steeper surfaces are left to the small image, and edges below it pass for slopes.
const SLOPE_RAD: f32 = 0.25;
/// Standard deviations that count as noise.
const SIGMAS: f32 = 4.0;
/// Variance of a phase, rad^2, from which a pixel is dark: that of `image::cuts`, at which a step of pi is within reach of noise.
const DARK_VARIANCE: f32 = 0.5;
/// Adding and taking off 1.5 * 2^23 rounds to an integer.
const ROUND: f32 = 12_582_912.0;
/// Unwrapped phase below which the relative noise of a range is not followed further, rad: a twelfth of an interval.
const NEAREST_RAD: f32 = 0.5;

/// What pixels are judged by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Variance of each part of the complex image.
    pub noise2: f32,
    pub maximum_wraps: f32,
}

/// A row of the frame, and what is known of it.
pub(crate) struct Row<'a> {
    pub phase: &'a [f32],
    pub amplitude: &'a [f32],
    /// Unwrapped phase as it was known last; NaN where it never was. Of pixels that hold, that of this frame afterwards.
    pub unwrapped: &'a mut [f32],
    /// Amplitude that belongs to it.
    pub before: &'a mut [f32],
    pub wraps: &'a mut [i32],
    pub state: &'a mut [u8],
}

/// Counts of pixels that are used, and that failed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tally {
    pub used: u32,
    pub failed: u32,
}

/// Pixels taken at a time, so that the compiler can vectorise; few, since one that fails takes the others the long way.
pub(crate) const LANES: usize = 16;

/// Predicts each pixel's count as the one that brings its phase nearest to what was known last, and checks it: the phase may
/// not step far, and amplitude times range squared not change. Lists the blocks in which pixels fail; `first` is the row's first
/// pixel.
#[inline(always)]
pub(crate) fn carry_row(row: &mut Row<'_>, first: u32, limits: Limits, blocks: &mut Vec<Block>) -> Tally {
    let (mut tally, mut used) = (Tally::default(), 0);
    let mut list = |col: usize, open: u32| {
        if open != 0 {
            tally.failed += open.count_ones();
            blocks.push(Block { first: first + col as u32, col: col as u32, open, attached: 0 });
        }
    };
    let (phase, last_phase) = row.phase.as_chunks::<LANES>();
    let (amplitude, last_amplitude) = row.amplitude.as_chunks::<LANES>();
    let (unwrapped, last_unwrapped) = row.unwrapped.as_chunks_mut::<LANES>();
    let (before, last_before) = row.before.as_chunks_mut::<LANES>();
    let (wraps, last_wraps) = row.wraps.as_chunks_mut::<LANES>();
    let (state, last_state) = row.state.as_chunks_mut::<LANES>();
    let given = phase.iter().zip(amplitude);
    let kept = unwrapped.iter_mut().zip(before).zip(wraps.iter_mut().zip(state));
    let whole = row.phase.len() - last_phase.len();
    for (col, ((phase, amplitude), ((unwrapped, before), (wraps, state)))) in
        (0..whole).step_by(LANES).zip(given.zip(kept))
    {
        list(col, carry_pixels(phase, amplitude, unwrapped, before, wraps, state, limits, &mut used));
    }
    let mut last_open = 0;
    for i in 0..last_phase.len() {
        let one = std::array::from_ref::<f32>;
        let open = carry_pixels::<1>(
            one(&last_phase[i]),
            one(&last_amplitude[i]),
            std::array::from_mut(&mut last_unwrapped[i]),
            std::array::from_mut(&mut last_before[i]),
            std::array::from_mut(&mut last_wraps[i]),
            std::array::from_mut(&mut last_state[i]),
            limits,
            &mut used,
        );
        last_open |= open << i;
    }
    list(whole, last_open);
    tally.used = used;
    tally
}

/// Carries `L` pixels, counts those that are used, and gives those that fail, a bit each.
#[inline(always)]
#[allow(clippy::too_many_arguments)] // planes of one row, in the order of `Row`
fn carry_pixels<const L: usize>(
    phase: &[f32; L],
    amplitude: &[f32; L],
    unwrapped: &mut [f32; L],
    before: &mut [f32; L],
    wraps: &mut [i32; L],
    state: &mut [u8; L],
    limits: Limits,
    all_used: &mut u32,
) -> u32 {
    if hold_steady(phase, amplitude, unwrapped, before, wraps, limits) {
        *before = *amplitude;
        *state = [HELD; L];
        *all_used = all_used.wrapping_add(L as u32);
        return 0;
    }
    let [mut told, mut used, mut open] = [[0_u32; L]; 3];
    let mut counts = [0.0_f32; L];
    for i in 0..L {
        let (p, a, known, earlier) = (phase[i], amplitude[i], unwrapped[i], before[i]);
        let count = ((known - p) * (1.0 / TAU) + ROUND) - ROUND;
        let now = p + TAU * count;
        let step = now - known;
        let (own, other) = (1.0 / a, 1.0 / earlier);
        let own_variance = limits.noise2 * (own * own);
        let variance = own_variance + limits.noise2 * (other * other);
        let margin = SIGMAS * variance.sqrt();
        let near = if now > NEAREST_RAD { now } else { NEAREST_RAD };
        let ratio = STEADY_RATIO * (1.0 + margin * (1.0 + 2.0 / near));
        let (brightness, brightness_before) = (a * now * now, earlier * known * known);
        let limit = if margin > STEADY_RAD { margin } else { STEADY_RAD };
        let in_span = (count >= 0.0) & (count <= limits.maximum_wraps);
        let steady = (step.abs() <= limit)
            & (brightness <= ratio * brightness_before)
            & (brightness_before <= ratio * brightness)
            & in_span;
        let there = p.abs() <= f32::MAX;
        let dark = there & (own_variance > DARK_VARIANCE) & in_span;
        let held = there & steady & !dark;
        let failed = there & !held & !dark;
        told[i] = if held { u32::from(HELD) } else { 0 }
            | if dark { u32::from(DARK) } else { 0 }
            | if failed { u32::from(OPEN) } else { 0 };
        unwrapped[i] = if held { now } else { known };
        before[i] = if held { a } else { earlier };
        counts[i] = if there & in_span { count } else { 0.0 };
        used[i] = u32::from(there);
        open[i] = u32::from(failed);
    }
    for i in 0..L {
        // Added to 1.5 * 2^23, a small integer stands in the last bits.
        wraps[i] = ((counts[i] + ROUND).to_bits() & 0xff) as i32;
        state[i] = told[i] as u8;
    }
    *all_used = all_used.wrapping_add(used.iter().fold(0, |sum: u32, one| sum.wrapping_add(*one)));
    open.iter().enumerate().fold(0, |bits, (i, open)| bits | open << i)
}

/// Takes over counts and unwrapped phases of this frame where all pixels hold by the limits that apply whatever the noise is, as
/// they do in most blocks, and says whether they do. It spares the roots and quotients that tell the noise.
#[inline(always)]
fn hold_steady<const L: usize>(
    phase: &[f32; L],
    amplitude: &[f32; L],
    unwrapped: &mut [f32; L],
    before: &[f32; L],
    wraps: &mut [i32; L],
    limits: Limits,
) -> bool {
    let (mut missed, mut now, mut counts) = ([0_u32; L], [0.0_f32; L], [0.0_f32; L]);
    for i in 0..L {
        let (p, a, known, earlier) = (phase[i], amplitude[i], unwrapped[i], before[i]);
        counts[i] = ((known - p) * (1.0 / TAU) + ROUND) - ROUND;
        now[i] = p + TAU * counts[i];
        let (brightness, brightness_before) = (a * now[i] * now[i], earlier * known * known);
        let steady = ((now[i] - known).abs() <= STEADY_RAD)
            & (brightness <= STEADY_RATIO * brightness_before)
            & (brightness_before <= STEADY_RATIO * brightness)
            & (counts[i] >= 0.0)
            & (counts[i] <= limits.maximum_wraps)
            & (limits.noise2 <= DARK_VARIANCE * (a * a));
        missed[i] = u32::from(!steady);
    }
    if missed.iter().fold(0, |any, one| any | one) != 0 {
        return false;
    }
    *unwrapped = now;
    for i in 0..L {
        wraps[i] = ((counts[i] + ROUND).to_bits() & 0xff) as i32;
    }
    true
}

/// Whether a step between two neighbours of these amplitudes can lie on one surface. Squares are compared, which needs no root and
/// no quotient; amplitudes from 1e-9 to 1e9 keep within single precision.
#[inline(always)]
pub(crate) fn is_gentle(step: f32, [a, b]: [f32; 2], noise2: f32) -> bool {
    // Neighbours lie on a slope, which the step in time does not see.
    let near = (step <= SLOPE_RAD) | (scaled(step, [a, b]) <= noise_of_step([a, b], noise2));
    // Not beyond the steady ratio by more than noise makes of it.
    let alike = |a: f32, b: f32| {
        let over = a - STEADY_RATIO * b;
        (over <= 0.0) | (over * over * a * a <= STEADY_RATIO * STEADY_RATIO * noise_of_step([a, b], noise2))
    };
    near & alike(a, b) & alike(b, a)
}

/// Whether two neighbours with these unwrapped phases lie on two surfaces.
#[inline(always)]
pub(crate) fn apart(unwrapped: [f32; 2], amplitudes: [f32; 2], noise2: f32) -> bool {
    let step = (unwrapped[1] - unwrapped[0]).abs();
    (step > SLOPE_RAD) & (scaled(step, amplitudes) > noise_of_step(amplitudes, noise2))
}

/// Square of a step times both squared amplitudes.
#[inline(always)]
fn scaled(step: f32, [a, b]: [f32; 2]) -> f32 {
    let scaled = step * a * b;
    scaled * scaled
}

/// Square of the standard deviations of a step that count as noise, in the same scale.
#[inline(always)]
fn noise_of_step([a, b]: [f32; 2], noise2: f32) -> f32 {
    SIGMAS * SIGMAS * noise2 * (a * a + b * b)
}
