//! What is remembered of a cloud: thinned points, their surfaces, and histograms that describe them.

pub(crate) mod descriptors;
pub(crate) mod feature_cloud;
pub(crate) mod features;
pub(crate) mod fpfh;
pub(crate) mod labels;
pub(crate) mod reduced;
pub(crate) mod rsd;
pub(crate) mod sift;
pub(crate) mod surface;
pub(crate) mod surroundings;
pub(crate) mod view;
