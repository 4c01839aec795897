//! The iterations: pairs, system, step, and what they result in.

pub(in crate::icp) mod descent;
pub(in crate::icp) mod matching;
pub(in crate::icp) mod options;
pub(in crate::icp) mod quality;
pub(in crate::icp) mod registration;
pub(in crate::icp) mod result;
pub(in crate::icp) mod sensitivity;
pub(in crate::icp) mod system;
pub(in crate::icp) mod target;
