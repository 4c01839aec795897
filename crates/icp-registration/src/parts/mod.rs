//! The parts of the ICP family after `[RusinkiewiczLevoy2001]`, each behind a trait, for [`crate::Registration`].
//!
//! | question | trait | answers here |
//! |---|---|---|
//! | which points? | [`PointSelection`] | [`AllPoints`], [`EveryNth`], [`RandomPoints`], [`NormalSpace`], [`Stability`] |
//! | which partner? | [`PointMatching`] | [`NearestPoint`], [`CompatibleNearest`], [`Projective`], `ClosestOnMesh` (feature `mesh`) |
//! | how much weight? | [`PairWeighting`] | [`ConstantWeight`], [`DistanceWeight`], [`NormalWeight`], [`SigmaWeight`], [`IntensityWeight`] |
//! | which pairs not? | [`PairRejection`] | [`MaxDistance`], [`MaxNormalAngle`], [`Trimmed`], [`MedianDistance`], [`SourceRim`], [`TargetRim`], [`MutualNearest`] |
//! | what is minimised? | [`ErrorMetric`] | [`PointToPoint`], [`PointToPlane`], [`SymmetricPlanes`], [`PlaneToPlane`], [`Coloured`] |
//! | how? | [`Minimiser`] | [`GaussNewton`], [`LevenbergMarquardt`], [`ClosedForm`] |
//! | what of outliers? | [`KernelSchedule`] | [`crate::RobustKernel`], [`Graduated`] |
//! | until when? | [`StoppingRule`] | [`Settled`] |

mod kernel;
mod matching;
#[cfg(feature = "mesh")]
mod mesh;
mod metric;
mod minimisation;
mod rejection;
mod scene;
mod selection;
mod stopping;
mod weighting;

pub use kernel::{Graduated, KernelSchedule};
pub use matching::{CompatibleNearest, NearestPoint, Partner, PointMatching, Projective, Query};
#[cfg(feature = "mesh")]
pub use mesh::{ClosestOnMesh, TriangleMesh};
pub use metric::{Coloured, ErrorMetric, PlaneToPlane, PointToPlane, PointToPoint, Row, Rows, SymmetricPlanes};
pub use minimisation::{ClosedForm, GaussNewton, LevenbergMarquardt, Minimiser};
pub use rejection::{
    MaxDistance, MaxNormalAngle, MedianDistance, MutualNearest, PairRejection, SourceRim, TargetRim, Trimmed,
};
pub use scene::{Moment, Pair, Scene, TargetSurface};
pub(crate) use selection::thinned;
pub use selection::{AllPoints, EveryNth, NormalSpace, PointSelection, RandomPoints, Stability};
pub use stopping::{Progress, Settled, StoppingRule};
pub use weighting::{ConstantWeight, DistanceWeight, IntensityWeight, NormalWeight, PairWeighting, SigmaWeight};
