//! The iterations: pairs, system, step, and what they result in.

pub(in crate::icp) mod descent;
pub(crate) mod matching;
pub(in crate::icp) mod options;
pub(in crate::icp) mod outcome;
pub(in crate::icp) mod quality;
pub(in crate::icp) mod registration;
pub(in crate::icp) mod sensitivity;
