//! The check of each pixel against the frame before, and of neighbours against each other.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::{PI, TAU};

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
/// another surface passes, and the slower surfaces may move; what passes wrongly shows at its border ([`contradicts`]).
const STEADY_RAD: f32 = 0.5;
/// Factor by which amplitude times range squared may change beyond its noise: that of `image::cuts`, `exp(0.35)`.
const STEADY_RATIO: f32 = 1.419;
/// Largest step between two neighbours on one surface, rad, or four standard deviations: that of `image::cuts`.
const GENTLE_RAD: f32 = 0.1;
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

/// Predicts each pixel's count as the one that brings its phase nearest to what was known last, and checks it: the phase may
/// not step far, and amplitude times range squared not change.
#[inline(always)]
pub(crate) fn carry_row(row: Row<'_>, limits: Limits) -> Tally {
    let n = row.phase.len();
    let (phase, amplitude) = (&row.phase[..n], &row.amplitude[..n]);
    let (unwrapped, before) = (&mut row.unwrapped[..n], &mut row.before[..n]);
    let (wraps, state) = (&mut row.wraps[..n], &mut row.state[..n]);
    let (mut used, mut open) = (0.0_f32, 0.0_f32);
    for i in 0..n {
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
        let dark = (own_variance > DARK_VARIANCE) & in_span;
        let held = there & steady & !dark;
        let told = if dark { DARK } else { OPEN };
        state[i] = if !there {
            MASKED
        } else if held {
            HELD
        } else {
            told
        };
        unwrapped[i] = if held { now } else { known };
        before[i] = if held { a } else { earlier };
        let sound = if there & in_span { count } else { 0.0 };
        wraps[i] = sound as i32;
        used += if there { 1.0 } else { 0.0 };
        open += if there & !held & !dark { 1.0 } else { 0.0 };
    }
    Tally { used: used as u32, open: open as u32 }
}

/// Ends of the links of a row: phases, what they unwrap to, amplitudes, states.
#[derive(Clone, Copy)]
pub(crate) struct Ends<'a> {
    pub phase: &'a [f32],
    pub unwrapped: &'a [f32],
    pub amplitude: &'a [f32],
    pub state: &'a [u8],
}

impl<'a> Ends<'a> {
    #[inline(always)]
    pub(crate) fn part(&self, start: usize, count: usize) -> Self {
        Self {
            phase: &self.phase[start..][..count],
            unwrapped: &self.unwrapped[start..][..count],
            amplitude: &self.amplitude[start..][..count],
            state: &self.state[start..][..count],
        }
    }
}

/// Number of links between pixels that hold which look like one surface and have counts of two: where another surface passed
/// for the one before, such links run along its border.
#[inline(always)]
pub(crate) fn contradictions(from: Ends<'_>, to: Ends<'_>, noise2: f32) -> u32 {
    let n = from.phase.len();
    let mut sum = 0_u32;
    let (from, to) = (from.part(0, n), to.part(0, n));
    for i in 0..n {
        let step = to.phase[i] - from.phase[i];
        let cycle = if step.abs() > PI { TAU } else { 0.0 };
        let step = step - cycle.copysign(step);
        let found = to.unwrapped[i] - from.unwrapped[i];
        let (a, b) = (from.amplitude[i], to.amplitude[i]);
        let (own, other) = (1.0 / a, 1.0 / b);
        let margin = SIGMAS * (noise2 * (own * own + other * other)).sqrt();
        let ratio = STEADY_RATIO * (1.0 + margin);
        let limit = if margin > GENTLE_RAD { margin } else { GENTLE_RAD };
        let alike = (step.abs() <= limit) & (a <= ratio * b) & (b <= ratio * a);
        let apart = (found - step).abs() > PI;
        let both = (from.state[i] == HELD) & (to.state[i] == HELD);
        // One at a time: never more than the pixels of a row.
        sum = sum.wrapping_add(u32::from(alike & apart & both));
    }
    sum
}

/// How far the phases and amplitudes of two neighbours are from being those of one surface: at most 1 where they can be.
pub(crate) fn distance([phase, other_phase]: [f32; 2], [a, b]: [f32; 2], noise2: f32) -> f32 {
    let step = crate::tree::grid::wrapped(other_phase - phase).abs();
    let margin = SIGMAS * (noise2 * (1.0 / (a * a) + 1.0 / (b * b))).sqrt();
    // Neighbours lie on a slope, which the step in time does not see.
    let limit = margin.max(0.5 * STEADY_RAD);
    let ratio = if a > b { a / b } else { b / a };
    (step / limit).max(ratio / (STEADY_RATIO * (1.0 + margin)))
}
