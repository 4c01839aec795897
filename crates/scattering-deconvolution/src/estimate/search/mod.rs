//! The search for the point spread function that explains them.

pub(in crate::estimate) mod blur;
pub(in crate::estimate) mod fit;
pub(in crate::estimate) mod observation;
pub(in crate::estimate) mod response;
pub(in crate::estimate) mod scene;
pub(in crate::estimate) mod score;
pub(in crate::estimate) mod selection;
pub(in crate::estimate) mod start;
