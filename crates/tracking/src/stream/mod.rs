//! Frames one by one: registered, lost and found again, loops closed.

pub(crate) mod beside;
pub(crate) mod claim;
pub(crate) mod keyframes;
pub(crate) mod locate;
pub(crate) mod reference;
pub(crate) mod register;
pub(crate) mod returns;
pub(crate) mod spread;
pub(crate) mod tracker;
pub(crate) mod wide;
