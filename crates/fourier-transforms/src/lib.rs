#![doc = include_str!("../README.md")]

use std::sync::Arc;

pub use rustfft::{Fft, FftDirection, num_complex};
use rustfft::{FftPlanner, FftPlannerScalar};

/// Plans transforms in single precision for the widest registers that the machine has.
pub struct SinglePlanner(FftPlanner<f32>);

impl SinglePlanner {
    /// Without plans.
    // Here and below: what is inlined would be compiled again, with all transforms, in the crate that calls it.
    #[inline(never)]
    pub fn new() -> Self {
        Self(FftPlanner::new())
    }

    /// The transform of lines of `length` numbers; neither direction is scaled.
    #[inline(never)]
    pub fn plan(&mut self, length: usize, direction: FftDirection) -> Arc<dyn Fft<f32>> {
        self.0.plan_fft(length, direction)
    }
}

impl Default for SinglePlanner {
    fn default() -> Self {
        Self::new()
    }
}

/// Plans transforms in double precision, with the same bits on every machine: for what is made once.
pub struct DoublePlanner(FftPlannerScalar<f64>);

impl DoublePlanner {
    /// Without plans.
    #[inline(never)]
    pub fn new() -> Self {
        Self(FftPlannerScalar::new())
    }

    /// The transform of lines of `length` numbers; neither direction is scaled.
    #[inline(never)]
    pub fn plan(&mut self, length: usize, direction: FftDirection) -> Arc<dyn Fft<f64>> {
        self.0.plan_fft(length, direction)
    }
}

impl Default for DoublePlanner {
    fn default() -> Self {
        Self::new()
    }
}
