//! Alignment of two clouds without a guess: descriptors, correspondences, consistent sets, verification.

mod align;
#[cfg(feature = "multiview")]
mod among;
mod cells;
mod correspondences;
mod descriptors;
mod distinct;
mod feature_cloud;
mod features;
mod fpfh;
mod graph;
mod judge;
mod labels;
mod matching;
mod options;
mod ransac;
mod reduced;
mod refine;
mod rsd;
mod sift;
mod sparse;
mod surface;
mod surroundings;
mod view;

#[cfg(feature = "multiview")]
pub(crate) use align::hypotheses;
pub use align::{CoarseAlignment, align_without_guess};
#[cfg(feature = "multiview")]
pub(crate) use among::{Placed, agreement, evidence, refined_among, with_one_voxel};
pub use feature_cloud::FeatureCloud;
pub use features::Features;
pub use options::{CoarseOptions, Estimator, Matching, SurfaceDescriptors, Viewpoint};
pub use rsd::SurfaceRadii;
pub use sift::{AmplitudeFeatureOptions, amplitude_features};
pub use sparse::{SparseAlignment, SparseIcpOptions, align_features};
