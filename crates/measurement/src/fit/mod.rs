//! Planes, spheres and cylinders fitted to the points of a region, with the derivatives of their parameters by every point.

mod adjusted;
mod expected;
mod observation;
mod options;
mod robust;
mod shapes;
mod start;
mod support;
mod surface;

pub use options::FitOptions;
pub use shapes::{FittedCylinder, FittedPlane, FittedSphere, fit_cylinder, fit_plane, fit_sphere};
pub use support::{Scatter, Support};
pub use surface::Shape;

pub(crate) use expected::Term;
pub(crate) use surface::combined;
