//! Fused points: which observations they are made of, their planes, what does not fit.

mod assign;
mod curvature;
mod estimate;
mod gather;

pub(crate) use assign::{FARTHEST, Owner};
pub(crate) use curvature::{Bend, bends};
pub(crate) use estimate::{Alone, Estimate, FrameSums, Spread, estimate, runs};
pub(crate) use gather::{Gathered, gather, give_up, is_even, nonempty};
