//! Networks whose truth is known.
#![allow(dead_code)]

pub mod cases;
pub mod networks;

/// Ambiguity interval at 30 MHz, metre.
pub const INTERVAL: f64 = 4.996_540_966_666_667;
