//! Figures of views and calibrations.

pub(crate) mod correction_maps;
pub(crate) mod pattern;

pub use pattern::pattern_figures;
