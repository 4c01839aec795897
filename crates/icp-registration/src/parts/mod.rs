//! The parts of the ICP family after `[RusinkiewiczLevoy2001]`, each behind a trait, for [`crate::Registration`].
//!
//! | question | trait | answers here |
//! |---|---|---|
//! | which points? | [`PointSelection`] | [`Selection`] |
//! | which partner? | [`PointMatching`] | [`NearestPoint`], `ClosestOnMesh` (feature `mesh`) |
//! | how much weight? | [`PairWeighting`] | [`SigmaWeight`] |
//! | which pairs not? | [`PairRejection`] | [`MaxNormalAngle`], [`Trimmed`], [`TargetRim`] |
//! | what is minimised? | [`ErrorMetric`] | [`PointToPoint`], [`PointToPlane`], [`SymmetricPlanes`], [`PlaneToPlane`], [`Coloured`] |
//! | how? | [`Minimiser`] | [`GaussNewton`], [`ClosedForm`] |

mod matching;
#[cfg(feature = "mesh")]
mod mesh;
mod metric;
mod minimisation;
mod rejection;
mod scene;
mod selection;
mod weighting;

pub use matching::{NearestPoint, Partner, PointMatching, Query};
#[cfg(feature = "mesh")]
pub use mesh::{ClosestOnMesh, TriangleMesh};
pub use metric::{Coloured, ErrorMetric, PlaneToPlane, PointToPlane, PointToPoint, Row, Rows, SymmetricPlanes};
pub use minimisation::{ClosedForm, GaussNewton, Minimiser};
pub use rejection::{MaxNormalAngle, PairRejection, TargetRim, Trimmed};
pub use scene::{Moment, Pair, Scene, TargetSurface};
pub(crate) use selection::thinned;
pub use selection::{PointSelection, Selection};
pub use weighting::{PairWeighting, SigmaWeight};
