//! Wrapped steps from one row of phases to another.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::{PI, TAU};

/// Writes `to - from`, brought into `[-pi, pi]`, for as many as both have; NaN where either is.
#[inline(always)]
pub(crate) fn wrapped_steps(from: &[f32], to: &[f32], out: &mut Vec<f32>) {
    let count = from.len().min(to.len());
    out.resize(count, 0.0);
    for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
        let step = to - from;
        // A step of exactly pi stays, whichever way it goes: ties have no side.
        let cycle = if step.abs() > PI { TAU } else { 0.0 };
        *out = step - cycle.copysign(step);
    }
}
