//! The check of each pixel against the frame before.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::TAU;

use phase_unwrap::wrapped;

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
    pub open: u32,
}

/// Pixels taken at a time, so that the compiler can vectorise.
const LANES: usize = 32;

/// Predicts each pixel's count as the one that brings its phase nearest to what was known last, and checks it: the phase may
/// not step far, and amplitude times range squared not change.
#[inline(always)]
pub(crate) fn carry_row(row: &mut Row<'_>, limits: Limits) -> Tally {
    let mut tally = Tally::default();
    let (phase, last_phase) = row.phase.as_chunks::<LANES>();
    let (amplitude, last_amplitude) = row.amplitude.as_chunks::<LANES>();
    let (unwrapped, last_unwrapped) = row.unwrapped.as_chunks_mut::<LANES>();
    let (before, last_before) = row.before.as_chunks_mut::<LANES>();
    let (wraps, last_wraps) = row.wraps.as_chunks_mut::<LANES>();
    let (state, last_state) = row.state.as_chunks_mut::<LANES>();
    let given = phase.iter().zip(amplitude);
    let kept = unwrapped.iter_mut().zip(before).zip(wraps.iter_mut().zip(state));
    for ((phase, amplitude), ((unwrapped, before), (wraps, state))) in given.zip(kept) {
        carry_pixels(phase, amplitude, unwrapped, before, wraps, state, limits, &mut tally);
    }
    for i in 0..last_phase.len() {
        let one = std::array::from_ref::<f32>;
        carry_pixels::<1>(
            one(&last_phase[i]),
            one(&last_amplitude[i]),
            std::array::from_mut(&mut last_unwrapped[i]),
            std::array::from_mut(&mut last_before[i]),
            std::array::from_mut(&mut last_wraps[i]),
            std::array::from_mut(&mut last_state[i]),
            limits,
            &mut tally,
        );
    }
    tally
}

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
    tally: &mut Tally,
) {
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
    tally.used = tally.used.wrapping_add(used.iter().fold(0, |sum: u32, one| sum.wrapping_add(*one)));
    tally.open = tally.open.wrapping_add(open.iter().fold(0, |sum: u32, one| sum.wrapping_add(*one)));
}

/// Standard deviations of a step between pixels of two amplitudes that count as noise, rad.
#[inline(always)]
fn noise_margin(a: f32, b: f32, noise2: f32) -> f32 {
    let (a2, b2) = (a * a, b * b);
    SIGMAS * (noise2 * (a2 + b2) / (a2 * b2)).sqrt()
}

/// The sizes of the steps from neighbours to a pixel (phase and amplitude) where they can lie on one surface; infinite where they
/// cannot.
#[inline(always)]
pub(crate) fn gentle_steps(
    phases: [f32; 4],
    amplitudes: [f32; 4],
    [phase, amplitude]: [f32; 2],
    noise2: f32,
) -> [f32; 4] {
    let mut steps = [f32::INFINITY; 4];
    for k in 0..4 {
        let (a, b) = (amplitudes[k], amplitude);
        let step = wrapped(phase - phases[k]).abs();
        let margin = noise_margin(a, b, noise2);
        let ratio = STEADY_RATIO * (1.0 + margin);
        // Neighbours lie on a slope, which the step in time does not see.
        let limit = if margin > SLOPE_RAD { margin } else { SLOPE_RAD };
        // Whatever the noise is, or where it is not known.
        let alike = (step <= SLOPE_RAD) & (a <= STEADY_RATIO * b) & (b <= STEADY_RATIO * a);
        let gentle = alike | ((step <= limit) & (a <= ratio * b) & (b <= ratio * a));
        steps[k] = if gentle { step } else { f32::INFINITY };
    }
    steps
}

/// Whether two neighbours with these unwrapped phases lie on two surfaces.
pub(crate) fn apart(unwrapped: [f32; 2], [a, b]: [f32; 2], noise2: f32) -> bool {
    let step = (unwrapped[1] - unwrapped[0]).abs();
    step > SLOPE_RAD && step > noise_margin(a, b, noise2)
}
