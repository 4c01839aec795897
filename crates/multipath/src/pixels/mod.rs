//! One pixel with several paths of light.

pub(crate) mod model;
pub(crate) mod pixel;
pub(crate) mod profile;
pub(crate) mod refine;
pub(crate) mod response;
pub(crate) mod search;
pub(crate) mod single;
pub(crate) mod solver;
pub(crate) mod two_path;
