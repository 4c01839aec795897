//! Noisy phases: filtering along fringes.

pub(crate) mod congruent;
pub(crate) mod fringes;
pub(crate) mod noise;
pub(crate) mod phasor;
pub(crate) mod prefilter;
pub(crate) mod window;
