//! Where the camera should be by now.

pub(crate) mod motion;
pub(crate) mod prediction;
pub(crate) mod velocity;
